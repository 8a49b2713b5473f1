"""Runs a sweep from its specification to its table of results.

A *case* is a surface under one of the specification's ``settings``, a row of the table. Results of earlier runs stay in
the folder, so a run computes only the cases without a valid result. The workers write results. This process, the
driver, reads them back for the table, the contact sheet of pictures and the summary (store.py).
"""

from __future__ import annotations

import importlib.util
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from distributed import Client

from .cluster import local_client, plan_workers, remote_client, thread_count
from .drive import drive
from .errors import SweepError
from .instruments import check_library
from .limits import LIGHT
from .progress import Progress
from .reflector import with_full_path
from .report import read_rows, write_summary, write_tables
from .sheet import write_sheet
from .spec import Case, Spec
from .store import Store, StoreError, is_current, read_result, result_path
from .tables import largest_estimate
from .work import Job, version


@dataclass(frozen=True)
class Outcome:
    """Result of a sweep."""

    #: Folder of the results.
    folder: Path
    #: Number of cases.
    cases: int
    #: Number of cases in which some figure failed.
    failed: int
    #: Duration of the run in seconds, without the reading of the specification.
    seconds: float


@dataclass(frozen=True)
class Plan:
    """Demand of a sweep on this machine."""

    #: Number of cases.
    cases: int
    #: Number of different surfaces.
    surfaces: int
    #: Estimated peak memory of the largest build of tables in GB (10⁹ bytes); 0 where it is small or unknown.
    largest_gb: float
    #: Number of worker processes.
    workers: int
    #: Memory limit of each worker in GB.
    worker_gb: float


def plan(spec: Spec, workers: int | None = None, memory_gb: float | None = None) -> Plan:
    """Estimates the sweep's demand on this machine without computing it.

    All cases count, including those that have results and that :func:`run` would skip.

    ``workers`` and ``memory_gb`` are those of :func:`run`. Raises :class:`SweepError` where either is not above zero,
    and where the command of ``SUNBEAM_COMMAND``, which estimates memory, cannot be run.
    """
    cases = list(spec.cases(version()))
    surfaces = _surfaces(spec, cases)
    largest_bytes = largest_estimate(surfaces)
    count, memory_bytes = plan_workers(workers, _in_bytes(memory_gb), largest_bytes, len(cases))
    return Plan(len(cases), len(surfaces), largest_bytes / 1e9, count, memory_bytes / 1e9)


def run(
    spec: Spec,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    memory_gb: float | None = None,
    fresh: bool = False,
    retry_failed: bool = False,
    progress: bool = True,
) -> Outcome:
    """Computes the missing cases of a sweep and writes its table, sheet and summary.

    - ``workers`` and ``memory_gb``: number of processes on this machine, and memory limit of each. The default is one
      process per core, or fewer where memory is short or cases are few, with equal parts of the free memory.
    - ``scheduler``: address of a Dask scheduler, whose workers compute the cases instead. ``workers`` and ``memory_gb``
      then have no effect.
    - ``fresh``: removes earlier results in the folder, which are kept otherwise.
    - ``retry_failed``: computes failed cases again.
    - ``progress``: reports on stderr.

    A script that calls this function needs ``if __name__ == "__main__":``, since worker processes import the script.

    Raises :class:`SweepError` where the sweep cannot begin or continue; finished cases are kept.
    """
    start = time.perf_counter()
    # The versions of the package, its library and Mitsuba are part of a case's identity, so updates compute all again.
    cases = list(spec.cases(version()))
    job = Job(spec.output, spec.folder, spec.wants, version())
    if scheduler is None:
        # The wants (groups of figures) and files may need a command, a variant of Mitsuba or a library. Missing ones
        # raise SweepError. Remote workers are probed instead.
        for want in spec.wants:
            want.check_here()
        check_library(case.parameters for case in cases)
    store = Store(spec.output)
    # `open` is outside of `try`: where it raises SweepError, it leaves the folder unlocked.
    store.open(fresh)
    # Entries of the summary that are known at the start.
    begun = {"version": version(), "cases": len(cases), "started": _now()}
    try:
        write_summary(spec, "unfinished", begun)
        pending, failed = _pending_cases(spec, cases, retry_failed)
        with Progress(len(cases), len(cases) - len(pending), failed, progress) as counter:
            # The inner block adds the number of finished cases to errors. The outer one converts errors from before it.
            try:
                if pending:
                    with _client(spec, job, pending, scheduler, workers, memory_gb, progress) as client:
                        drive(client, job, pending, counter.advance)
                facts = {**begun, "failed": counter.failed, "finished": _now()}
                write_tables(spec, cases)
                write_sheet(spec, read_rows(spec.output, cases), facts)
                write_summary(spec, "finished", {**facts, "seconds": round(time.perf_counter() - start, 3)})
            except (SweepError, StoreError) as error:
                raise SweepError(_with_progress(str(error), counter, fresh)) from error
    except StoreError as error:
        raise SweepError(str(error)) from error
    finally:
        store.close()
    return Outcome(spec.output, len(cases), counter.failed, time.perf_counter() - start)


def _with_progress(message: str, counter: Progress, fresh: bool) -> str:
    """The message of an error, with the number of finished cases, which a run without ``fresh`` keeps."""
    if counter.done == 0:
        return message
    same_command = "the same command without --fresh" if fresh else "the same command"
    return f"{message} ({counter.done} of {counter.total} cases are done; {same_command} goes on with the rest)"


def _pending_cases(spec: Spec, cases: list[Case], retry_failed: bool) -> tuple[list[Case], int]:
    """The cases to compute, and the number of failed cases among those that are kept.

    Cases to compute have no result or an outdated one, or have failed where ``retry_failed`` is set. Their results are
    removed, since workers skip a case with a result. Raises :class:`StoreError` where a result cannot be removed.
    """
    pending, failed = [], 0
    for case in cases:
        record = read_result(spec.output, case.identity)
        name = case.parameters.get("filename")
        # None for a preset, whose results are always current.
        input_path = None if name is None else spec.folder / str(name)
        is_valid = record is not None and is_current(record, input_path)
        has_failed = record is not None and record["status"] == "failed"
        if not is_valid or (has_failed and retry_failed):
            _forget(spec.output, case)
            pending.append(case)
        else:
            failed += has_failed
    return pending, failed


def _forget(folder: Path, case: Case) -> None:
    """Removes a case's result, if any. Raises :class:`StoreError` where it cannot be removed."""
    try:
        result_path(folder, case.identity).unlink(missing_ok=True)
    except OSError as error:
        raise StoreError(f"{folder} cannot be written: {error.strerror or error}") from error


@contextmanager
def _client(
    spec: Spec,
    job: Job,
    pending: list[Case],
    scheduler: str | None,
    workers: int | None,
    memory_gb: float | None,
    progress: bool,
) -> Iterator[Client]:
    """A client of the scheduler at the address ``scheduler``, or of new workers on this machine for ``None``.

    ``pending`` are the cases to compute. Their largest surface limits the number of new workers. ``workers``,
    ``memory_gb`` and ``progress`` are those of :func:`run`. Raises :class:`SweepError` where the scheduler
    or one of its workers cannot take part.
    """
    if scheduler is not None:
        with remote_client(scheduler, job) as client:
            _tell(progress, f"{len(pending)} cases to do, {thread_count(client)} threads at {scheduler}", client)
            yield client
        return
    largest_bytes = largest_estimate(_surfaces(spec, pending))
    count, memory_bytes = plan_workers(workers, _in_bytes(memory_gb), largest_bytes, len(pending))
    with local_client(count, memory_bytes) as client:
        _tell(progress, f"{len(pending)} cases to do, {count} workers with {memory_bytes / 1e9:.1f} GB each", client)
        yield client


def _in_bytes(memory_gb: float | None) -> float | None:
    """The memory in bytes; ``None`` stays ``None``."""
    return None if memory_gb is None else memory_gb * 1e9


def _tell(progress: bool, line: str, client: Client) -> None:
    """Prints a line on stderr if ``progress``, with the address of Dask's dashboard if its library is installed."""
    if not progress:
        return
    where = f"; {client.dashboard_link}" if importlib.util.find_spec("bokeh") else ""
    print(line + where, file=sys.stderr, flush=True)


def _surfaces(spec: Spec, cases: list[Case]) -> list[dict[str, Any]]:
    """Parameters of the different surfaces of the cases, without the light, with files in the spec's folder."""
    found: dict[str, dict[str, Any]] = {}
    for case in cases:
        surface = {name: value for name, value in case.parameters.items() if name not in LIGHT}
        found.setdefault(repr(sorted(surface.items())), dict(with_full_path(surface, spec.folder)))
    return list(found.values())


def _now() -> str:
    """UTC time in ISO 8601, to the second."""
    return datetime.now(timezone.utc).isoformat(timespec="seconds")
