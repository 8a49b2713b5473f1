"""Runs a sweep from its specification to its table."""

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
    """Result of a sweep: folder, number of cases and of failed ones, and duration in seconds."""

    folder: Path
    cases: int
    failed: int
    seconds: float


@dataclass(frozen=True)
class Plan:
    """Demand of a sweep: cases, different surfaces, peak memory of the largest build in GB, and this machine's workers
    with the memory of each in GB."""

    cases: int
    surfaces: int
    largest_gb: float
    workers: int
    worker_gb: float


def plan(spec: Spec, workers: int | None = None, memory_gb: float | None = None) -> Plan:
    """Estimates the sweep's demand on this machine, without computing it. Raises :class:`SweepError`."""
    cases = list(spec.cases(version()))
    surfaces = _surfaces(spec, cases)
    largest = largest_estimate(surfaces)
    count, memory = plan_workers(workers, memory_gb and memory_gb * 1e9, largest, len(cases))
    return Plan(len(cases), len(surfaces), largest / 1e9, count, memory / 1e9)


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

    The cases run in ``workers`` processes of this machine, each with at most ``memory_gb``: by default one process a
    core, fewer where memory is short. With ``scheduler``, an address, they run on the workers of that Dask scheduler.
    Earlier results in the folder are kept unless ``fresh``. ``retry_failed`` computes failed cases again. ``progress``
    reports from the third second on.

    A script that calls this function needs ``if __name__ == "__main__":``, since worker processes import the script.

    Raises :class:`SweepError` where the sweep cannot begin or continue; finished cases are kept.
    """
    start = time.perf_counter()
    cases = list(spec.cases(version()))
    job = Job(spec.output, spec.folder, spec.wants, version())
    if scheduler is None:
        for want in spec.wants:
            want.check_here()
        check_library(case.parameters for case in cases)
    store = Store(spec.output)
    store.open(fresh)
    begun = {"version": version(), "cases": len(cases), "started": _now()}
    try:
        write_summary(spec, "unfinished", begun)
        pending, failed = _pending(spec, cases, retry_failed)
        with Progress(len(cases), len(cases) - len(pending), failed, progress) as count:
            try:
                if pending:
                    with _client(spec, job, pending, scheduler, workers, memory_gb, progress) as client:
                        drive(client, job, pending, count.advance)
                facts = {**begun, "failed": count.failed, "finished": _now()}
                write_tables(spec, cases)
                write_sheet(spec, read_rows(spec.output, cases), facts)
                write_summary(spec, "finished", {**facts, "seconds": round(time.perf_counter() - start, 3)})
            except (SweepError, StoreError) as error:
                if count.done == 0:
                    raise SweepError(str(error)) from error
                raise SweepError(
                    f"{error} ({count.done} of {count.total} cases are done; the same command goes on with the rest)"
                ) from error
    except StoreError as error:
        raise SweepError(str(error)) from error
    finally:
        store.close()
    return Outcome(spec.output, len(cases), count.failed, time.perf_counter() - start)


def _pending(spec: Spec, cases: list[Case], retry_failed: bool) -> tuple[list[Case], int]:
    """The cases without a valid result, and the number of failed ones among the others."""
    pending, failed = [], 0
    for case in cases:
        record = read_result(spec.output, case.identity)
        name = case.parameters.get("filename")
        if record is None or not is_current(record, None if name is None else spec.folder / str(name)):
            # Workers skip a case with a result, so an outdated result is removed.
            _forget(spec.output, case)
            pending.append(case)
        elif record["status"] == "failed" and retry_failed:
            _forget(spec.output, case)
            pending.append(case)
        else:
            failed += record["status"] == "failed"
    return pending, failed


def _forget(folder: Path, case: Case) -> None:
    """Removes a case's result. Raises :class:`StoreError`."""
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
    """A client of the given scheduler, or of new workers on this machine."""
    if scheduler is not None:
        with remote_client(scheduler, job) as client:
            _tell(progress, f"{len(pending)} cases to do, {thread_count(client)} threads at {scheduler}", client)
            yield client
        return
    largest = largest_estimate(_surfaces(spec, pending))
    count, memory = plan_workers(workers, memory_gb and memory_gb * 1e9, largest, len(pending))
    with local_client(count, memory) as client:
        _tell(progress, f"{len(pending)} cases to do, {count} workers with {memory / 1e9:.1f} GB each", client)
        yield client


def _tell(progress: bool, line: str, client: Client) -> None:
    """Prints a line on stderr, with the address of Dask's dashboard if its library is installed."""
    if not progress:
        return
    where = f"; {client.dashboard_link}" if importlib.util.find_spec("bokeh") else ""
    print(line + where, file=sys.stderr, flush=True)


def _surfaces(spec: Spec, cases: list[Case]) -> list[dict[str, Any]]:
    """The different surfaces of the cases, with absolute paths."""
    found: dict[str, dict[str, Any]] = {}
    for case in cases:
        surface = {name: value for name, value in case.parameters.items() if name not in LIGHT}
        found.setdefault(repr(sorted(surface.items())), dict(with_full_path(surface, spec.folder)))
    return list(found.values())


def _now() -> str:
    return datetime.now(timezone.utc).isoformat(timespec="seconds")
