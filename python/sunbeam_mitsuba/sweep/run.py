"""A sweep from its specification to its table."""

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
    """What a sweep ended with: its folder, how many cases it has, how many of them failed, and the seconds it took."""

    folder: Path
    cases: int
    failed: int
    seconds: float


@dataclass(frozen=True)
class Plan:
    """What a sweep would take: cases, different surfaces, the largest estimate of a surface's tables while they are
    built, the workers of this machine and the memory of each, in GB."""

    cases: int
    surfaces: int
    largest_gb: float
    workers: int
    worker_gb: float


def plan(spec: Spec, workers: int | None = None, memory_gb: float | None = None) -> Plan:
    """What the sweep would take on this machine, without doing any of it. Raises :class:`SweepError`."""
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
    """Computes what is missing of a sweep and writes its table, sheet and summary.

    Work is done in ``workers`` processes of this machine (a worker a core, fewer where memory is short), each with at
    most ``memory_gb``, or by the workers of the Dask scheduler at the address ``scheduler``. Results that are in the
    folder already are kept unless ``fresh``; ``retry_failed`` tries the cases anew that failed. ``progress`` shows how
    far it has come from the third second on.

    A script that calls this needs ``if __name__ == "__main__":``, since workers are processes that import it.

    Raises :class:`SweepError` where the sweep cannot begin or go on. What was computed is kept then.
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
    """The cases without a result that still holds, and how many of the others failed."""
    pending, failed = [], 0
    for case in cases:
        record = read_result(spec.output, case.identity)
        name = case.parameters.get("filename")
        if record is None or not is_current(record, None if name is None else spec.folder / str(name)):
            # A worker leaves alone what has a result, so one that holds no longer has to go.
            _forget(spec.output, case)
            pending.append(case)
        elif record["status"] == "failed" and retry_failed:
            _forget(spec.output, case)
            pending.append(case)
        else:
            failed += record["status"] == "failed"
    return pending, failed


def _forget(folder: Path, case: Case) -> None:
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
    if not progress:
        return
    where = f"; {client.dashboard_link}" if importlib.util.find_spec("bokeh") else ""
    print(line + where, file=sys.stderr, flush=True)


def _surfaces(spec: Spec, cases: list[Case]) -> list[dict[str, Any]]:
    """The different surfaces among the cases, with full paths."""
    found: dict[str, dict[str, Any]] = {}
    for case in cases:
        own = {name: value for name, value in case.parameters.items() if name not in LIGHT}
        found.setdefault(repr(sorted(own.items())), dict(with_full_path(own, spec.folder)))
    return list(found.values())


def _now() -> str:
    return datetime.now(timezone.utc).isoformat(timespec="seconds")
