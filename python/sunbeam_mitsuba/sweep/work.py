"""Computation of cases in the Dask workers, which write each result before the next case begins.

A *case* is a surface under a setting; its *identity* is a hash of all that decides its result (spec.py). A *want*
(wants/want.py) is a group of figures with its options. It computes an *answer*, figures and pictures, to a *question*,
the case.

A *record* is the result of a case as a JSON object (:func:`record_of`). It holds the figures and the errors; pictures
are files beside it.
"""

from __future__ import annotations

import base64
import math
import os
import socket
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timezone
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

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

# Expected errors, whose messages are for the user; any other exception is reported as a defect.
_REFUSALS = (SunbeamError, CommandError, ReflectorError, WantError, TooLarge, SweepError)


@dataclass(frozen=True)
class Job:
    """Settings that all cases of a sweep share."""

    #: Folder of the results.
    output: Path
    #: Folder to which file names in the specification are relative.
    folder: Path
    #: Wanted figures of each case.
    wants: tuple[Want, ...]
    #: :func:`version` of the process that began the sweep, which every worker must have.
    version: str


@dataclass
class Done:
    """Result of a batch of cases."""

    #: Whether each finished case failed, by identity.
    has_failed: dict[str, bool]
    #: Wall time, including the wait for other threads of the worker.
    seconds: float
    #: One-line error that stops the whole sweep; empty without one.
    fatal: str = ""


@lru_cache(maxsize=1)
def version() -> str:
    """Versions of the package, its library and Mitsuba, which are part of a result's identity."""
    from .. import MITSUBA_VERSION, __version__
    from .._surface import library_version

    return f"sunbeam {__version__}, library {library_version()}, mitsuba {MITSUBA_VERSION}"


class _CaseQuestion(Question):
    """A case whose surface comes from ``held``, the surfaces that a worker keeps between cases (tables.py)."""

    def __init__(self, parameters: Mapping[str, Value], held: HeldSurfaces):
        self.parameters = parameters
        self.theta_i_deg = float(parameters["theta_i_deg"])
        self.phi_i_deg = float(parameters["phi_i_deg"])
        self._held = held

    def reflector(self) -> Reflector:
        return self._held.get(self.parameters)


# A process has one variant of Mitsuba at a time, so the threads of a worker take turns.
_mitsuba_lock = threading.Lock()
# Surfaces kept between cases, at first without a memory limit (0). `run_batch` sets the worker's.
_held = HeldSurfaces(0.0)


def run_batch(job: Job, cases: list[Case]) -> Done:
    """Computes the cases and writes their results. A case with a result, by a worker that died, is skipped.

    An error of a case is in its record. An error that stops the whole sweep, such as a full disk or another version, is
    in ``fatal`` of the returned object.
    """
    # Number of the library's threads, unless the user set it: a worker has one core.
    os.environ.setdefault("RAYON_NUM_THREADS", "1")
    if version() != job.version:
        return Done({}, 0.0, _other_version(job))
    start = time.perf_counter()
    has_failed: dict[str, bool] = {}
    with _mitsuba_lock:
        _held.memory_bytes = _memory_bytes()
        for case in cases:
            record = read_result(job.output, case.identity)
            try:
                if record is None:
                    record, pictures = compute(job, case, _held)
                    write_result(job.output, record, pictures)
            except StoreError as error:
                return Done(has_failed, time.perf_counter() - start, str(error))
            has_failed[case.identity] = record["status"] == "failed"
    return Done(has_failed, time.perf_counter() - start)


def _memory_bytes() -> float:
    """Memory limit of this worker in bytes; 0 without a limit, and outside of workers."""
    from distributed import get_worker

    try:
        worker = get_worker()
    except ValueError:
        return 0.0
    return float(worker.memory_manager.memory_limit or 0)


def compute(job: Job, case: Case, held: HeldSurfaces) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Computes a case. Returns its record (record_of), and the contents of its pictures by ending (Answer.pictures).

    ``held`` has the surfaces of earlier cases, and gets this case's. The record has the figures of all wants with an
    answer, even if other wants have none.
    """
    start, tables_before = time.perf_counter(), held.seconds
    prepared = _prepared(job, case)
    errors = [_Error("", prepared.error)] if prepared.error else []
    # Values by column of the results.
    figures: dict[str, Any] = {}
    pictures: dict[str, bytes] = {}
    # Small PNGs in base 64 by the title of their column on the contact sheet.
    thumbnails: dict[str, str] = {}
    question = _CaseQuestion(prepared.parameters, held)
    for want in () if errors else job.wants:
        try:
            answer = want.compute(question)
        except _REFUSALS as error:
            errors.append(_Error(want.name, _one_line(str(error), case, prepared.parameters)))
            continue
        except Exception as error:
            defect = f"a defect: {type(error).__name__}: {error}"
            errors.append(_Error(want.name, _one_line(defect, case, prepared.parameters)))
            continue
        if not_finite := [name for name, value in answer.figures.items() if not _is_finite(value)]:
            errors.append(_Error(want.name, f"{', '.join(not_finite)}: not a finite number"))
            continue
        figures.update({f"{want.name}_{name}": value for name, value in answer.figures.items()})
        # Endings of pictures differ between wants.
        pictures.update(answer.pictures)
        # A record is JSON, which has no bytes.
        thumbnails.update({name: base64.b64encode(content).decode() for name, content in answer.thumbnails.items()})
    record = record_of(job, case, _joined_errors(errors))
    record.update(figures=figures, thumbnails=thumbnails, input=prepared.input_file)
    seconds = time.perf_counter() - start
    record["time"].update(seconds=round(seconds, 4), tables_seconds=round(held.seconds - tables_before, 4))
    return record, pictures


class _Prepared(NamedTuple):
    """A case's parameters with a file that the library can read, or the error of its file."""

    parameters: dict[str, Value]
    #: The record's key ``input`` (store.input_of); ``None`` for a case without a file, and where it cannot be read.
    input_file: dict[str, Any] | None
    #: Message in one line; empty without an error.
    error: str


def _prepared(job: Job, case: Case) -> _Prepared:
    """Makes the file's path absolute, examines the file, and replaces an instrument's file by a temporary .gsf."""
    parameters = with_full_path(case.parameters, job.folder)
    if "filename" not in parameters:
        return _Prepared(parameters, None, "")
    try:
        input_file = input_of(Path(str(parameters["filename"])))
    except OSError as error:
        return _Prepared(parameters, None, f"{case.parameters['filename']}: cannot be read: {error.strerror or error}")
    try:
        return _Prepared(converted(parameters), input_file, "")
    except (OSError, SunbeamError) as error:
        return _Prepared(parameters, input_file, _one_line(str(error), case, parameters))


def record_of(job: Job, case: Case, error: str) -> dict[str, Any]:
    """The record of a case without figures, as a JSON object. The case has failed unless ``error`` is empty.

    ``parameters`` are those of the specification. The caller replaces ``input`` by the result of ``store.input_of`` if
    the surface has a file. ``time`` has the end in UTC, the wall time in seconds, the part of it spent on tables, and
    the worker's machine and process.
    """
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


def _is_finite(value: Any) -> bool:
    """Whether the value is a finite number, or no number at all. Lists are not examined."""
    return not isinstance(value, float) or math.isfinite(value)


class _Error(NamedTuple):
    """An error of a case."""

    #: Name of the want; empty for an error of the input file.
    want: str
    #: Message in one line.
    message: str


def _joined_errors(errors: list[_Error]) -> str:
    """Joins errors in one line; empty without errors. If all messages are equal, one is given, without names.

    An error of the input file is the only one, since no want is computed after it.
    """
    if len(errors) == 1:
        want, message = errors[0]
        return f"{want}: {message}" if want else message
    messages = {error.message for error in errors}
    if len(messages) == 1:
        return messages.pop()
    return "; ".join(f"{error.want}: {error.message}" for error in errors)


def _other_version(job: Job) -> str:
    """The error of a worker whose version is not the sweep's."""
    return f"a worker on {socket.gethostname()} has {version()}, but the sweep {job.version}"


def _one_line(message: str, case: Case, parameters: Mapping[str, Value]) -> str:
    """The message in one line, with the file's name in the specification in place of its path.

    Paths differ between machines, and those of converted files between runs.
    """
    if "filename" in parameters:
        message = message.replace(str(parameters["filename"]), str(case.parameters["filename"]))
    return " ".join(message.split())


def probe(job: Job, token: str) -> str:
    """Checks a worker before a sweep begins. Returns one line if it cannot take part, and else an empty text.

    ``token`` is what the process that runs the sweep wrote to ``.token`` in its output folder. A worker that reads
    another text sees another folder.
    """
    here = socket.gethostname()
    if version() != job.version:
        return _other_version(job)
    try:
        if (job.output / ".token").read_text() != token:
            return f"a worker on {here} sees another folder as {job.output}; it must be on a disk that all share"
    except OSError:
        return f"a worker on {here} does not see {job.output}; it must be on a disk that all share"
    try:
        # Finds whether the worker can write.
        trial = job.output / f".probe-{here}-{os.getpid()}"
        write_whole(trial, b"")
        trial.unlink()
        for want in job.wants:
            want.check_here()
    except (StoreError, SweepError, OSError) as error:
        return f"a worker on {here}: {error}"
    return ""
