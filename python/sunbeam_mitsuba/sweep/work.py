"""What a worker does: the cases of a batch, one by one, each written before the next is begun."""

from __future__ import annotations

import base64
import os
import socket
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timezone
from functools import lru_cache
from pathlib import Path
from typing import Any

from .._errors import SunbeamError
from .command import CommandError
from .errors import SweepError
from .instruments import converted
from .limits import Value
from .reflector import Reflector, ReflectorError, with_full_path
from .spec import Case
from .store import StoreError, input_of, read_result, write_result, write_whole
from .tables import HeldSurfaces, TooLarge
from .wants import Question, Want, WantError

# What says in one line why a figure cannot be had; anything else is a defect, and named as one.
_REFUSALS = (SunbeamError, CommandError, ReflectorError, WantError, TooLarge, SweepError)


@dataclass(frozen=True)
class Job:
    """What all cases of a sweep share: where results go and file names begin, what is wanted, and the version."""

    output: Path
    folder: Path
    wants: tuple[Want, ...]
    version: str


@dataclass
class Done:
    """What became of a batch: identities with whether they failed, the seconds it took, and what stops the sweep."""

    failed: dict[str, bool]
    seconds: float
    fatal: str = ""


@lru_cache(maxsize=1)
def version() -> str:
    """The versions of the package, its library and Mitsuba, by which results are told apart."""
    from .. import MITSUBA_VERSION, __version__
    from .._surface import library_version

    return f"sunbeam {__version__}, library {library_version()}, mitsuba {MITSUBA_VERSION}"


class _Asked(Question):
    def __init__(self, parameters: dict[str, Value], held: HeldSurfaces):
        self.parameters = parameters
        self.theta_i_deg = float(parameters["theta_i_deg"])
        self.phi_i_deg = float(parameters["phi_i_deg"])
        self._held = held

    def reflector(self) -> Reflector:
        return self._held.get(self.parameters)


# Mitsuba has one variant at a time in a process, so cases take turns where a worker has several threads.
_turn = threading.Lock()
_held = HeldSurfaces(0.0)


def run_batch(job: Job, cases: list[Case]) -> Done:
    """Computes the cases and writes their results; those that are there already, from a worker that died, are left.

    Nothing that is wrong with a case raises: it becomes a record with its error. What stops the whole sweep, a full
    disk or another version, is in the result's ``fatal``.
    """
    # The tables and the calls of the library keep to the worker's own core.
    os.environ.setdefault("RAYON_NUM_THREADS", "1")
    start = time.perf_counter()
    failed: dict[str, bool] = {}
    if version() != job.version:
        return Done({}, 0.0, f"a worker on {socket.gethostname()} has {version()}, but the sweep {job.version}")
    with _turn:
        _held.memory_bytes = _memory_bytes()
        for case in cases:
            record = read_result(job.output, case.identity)
            try:
                if record is None:
                    record, pictures = compute(job, case, _held)
                    write_result(job.output, record, pictures)
            except StoreError as error:
                return Done(failed, time.perf_counter() - start, str(error))
            failed[case.identity] = record["status"] == "failed"
    return Done(failed, time.perf_counter() - start)


def _memory_bytes() -> float:
    """The memory limit of this worker, or 0 outside of one, and where it has none."""
    from distributed import get_worker

    try:
        worker = get_worker()
    except ValueError:
        return 0.0
    return float(worker.memory_manager.memory_limit or 0)


def compute(job: Job, case: Case, held: HeldSurfaces) -> tuple[dict[str, Any], dict[str, bytes]]:
    """The record of a case and its pictures. A figure that is refused leaves the others standing."""
    start, tables_before = time.perf_counter(), held.seconds
    parameters = with_full_path(case.parameters, job.folder)
    errors: list[tuple[str, str]] = []
    figures: dict[str, Any] = {}
    pictures: dict[str, bytes] = {}
    thumbnails: dict[str, str] = {}
    source: dict[str, Any] | None = None
    if "filename" in parameters:
        try:
            source = input_of(Path(str(parameters["filename"])))
            parameters = converted(parameters)
        except OSError as error:
            errors.append(("", f"{case.parameters['filename']}: cannot be read: {error.strerror}"))
        except SunbeamError as error:
            errors.append(("", _told(str(error), case, parameters)))
    for want in job.wants if not errors else ():
        try:
            answer = want.compute(_Asked(parameters, held))
        except _REFUSALS as error:
            errors.append((want.name, _told(str(error), case, parameters)))
            continue
        except Exception as error:
            errors.append((want.name, _told(f"a defect: {type(error).__name__}: {error}", case, parameters)))
            continue
        figures.update({f"{want.name}_{name}": value for name, value in answer.figures.items()})
        for ending, content in answer.pictures.items():
            pictures[ending] = content
        for name, content in answer.thumbnails.items():
            thumbnails[name] = base64.b64encode(content).decode()
    record = record_of(job, case, _joined(errors))
    spent = time.perf_counter() - start
    record.update(figures=figures, thumbnails=thumbnails, input=source)
    record["time"].update(seconds=round(spent, 4), tables_seconds=round(held.seconds - tables_before, 4))
    return record, pictures


def record_of(job: Job, case: Case, error: str) -> dict[str, Any]:
    """A record without figures: of a case that failed with this one line, or, with none, of one to be filled."""
    return {
        "identity": case.identity,
        "surface": case.surface,
        "parameters": case.parameters,
        "version": job.version,
        "status": "failed" if error else "done",
        "error": error,
        "figures": {},
        "thumbnails": {},
        "input": None,
        "time": {
            "finished": datetime.now(timezone.utc).isoformat(timespec="seconds"),
            "seconds": 0.0,
            "tables_seconds": 0.0,
            "worker": f"{socket.gethostname()}:{os.getpid()}",
        },
    }


def _joined(errors: list[tuple[str, str]]) -> str:
    """The errors of all figures in one line: what all of them have in common once, else each with its figure's name."""
    messages = {message for _, message in errors}
    if len(messages) == 1:
        return messages.pop() if len(errors) != 1 else ": ".join(part for part in errors[0] if part)
    return "; ".join(f"{name}: {message}" for name, message in errors)


def _told(message: str, case: Case, parameters: Mapping[str, Value]) -> str:
    """The message in one line, with the file's name as the specification has it, so that it is the same everywhere."""
    if "filename" in parameters:
        message = message.replace(str(parameters["filename"]), str(case.parameters["filename"]))
    return " ".join(message.split())


def probe(job: Job, token: str) -> str:
    """Asked of every worker before a sweep begins: an empty text, or in one line why it cannot take part."""
    here = socket.gethostname()
    if version() != job.version:
        return f"a worker on {here} has {version()}, but the sweep {job.version}"
    try:
        if (job.output / ".token").read_text() != token:
            return f"a worker on {here} sees another folder as {job.output}; it must be on a disk that all share"
    except OSError:
        return f"a worker on {here} does not see {job.output}; it must be on a disk that all share"
    try:
        write_whole(job.output / f".probe-{here}-{os.getpid()}", b"")
        (job.output / f".probe-{here}-{os.getpid()}").unlink()
        for want in job.wants:
            want.check_here()
    except (StoreError, SweepError) as error:
        return f"a worker on {here}: {error}"
    return ""
