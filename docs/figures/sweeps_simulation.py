"""A discrete-event simulation of a sweep with any number of workers, by the measured costs of its parts.

Two servers handle one request at a time: the driver with its scheduler, and the shared file system. Workers compute in
parallel. A worker requests a batch, computes its cases, and writes each result before it begins the next case.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

# The next three constants are copies of those of `sunbeam_mitsuba.sweep.drive`.
# Target duration of a batch.
BATCH_SECONDS = 1.0
# Target duration of a batch per thread of the cluster.
BATCH_SECONDS_PER_THREAD = 0.01
# Largest number of cases in a batch.
BATCH_CASES_MAX = 500
# Fraction of busy time above which a server counts as the limit.
BUSY = 0.8


@dataclass(frozen=True)
class Costs:
    """Measured costs.

    Seconds of driver and scheduler for a batch, of a worker for a case with its tables, and of writing a result to a
    local disk; bytes of a result and of a surface's tables.
    """

    batch_seconds: float
    case_seconds: float
    write_seconds: float
    result_bytes: float
    table_bytes: float


@dataclass(frozen=True)
class Storage:
    """A shared file system: files a second for all workers, and bytes a second if it has the cache of tables too."""

    name: str
    files_per_second: float
    cache_bytes_per_second: float | None = None


def simulate(costs: Costs, cases: int, workers: int, storage: Storage) -> dict:
    """Hours for `cases` cases, each with its own surface, and the busy fraction of both servers."""
    target = max(BATCH_SECONDS, BATCH_SECONDS_PER_THREAD * workers)
    batch = max(1, min(int(target / costs.case_seconds), BATCH_CASES_MAX))
    file_seconds = 1 / storage.files_per_second
    if storage.cache_bytes_per_second is not None:
        file_seconds += costs.table_bytes / storage.cache_bytes_per_second
    left, driver_free, files_free, driver_busy, files_busy, end = cases, 0.0, 0.0, 0.0, 0.0, 0.0
    # For each worker the time of its next event, and the remaining cases of its batch.
    events = [(0.0, worker, 0) for worker in range(workers)]
    heapq.heapify(events)
    while events:
        now, worker, remaining = heapq.heappop(events)
        if remaining == 0:
            if left == 0:
                end = max(end, now)
                continue
            remaining = min(batch, left)
            left -= remaining
            driver_free = max(driver_free, now) + costs.batch_seconds
            driver_busy += costs.batch_seconds
            heapq.heappush(events, (driver_free + costs.case_seconds, worker, -remaining))
            continue
        # A case is complete, and its result is written.
        remaining = -remaining - 1
        files_free = max(files_free, now) + file_seconds
        files_busy += file_seconds
        written = max(files_free, now + costs.write_seconds)
        if remaining:
            heapq.heappush(events, (written + costs.case_seconds, worker, -remaining))
        else:
            heapq.heappush(events, (written, worker, 0))
    shares = {"scheduler": driver_busy / end, "file system": files_busy / end}
    limit = max(shares, key=lambda one: shares[one])
    return {
        "workers": workers,
        "storage": storage.name,
        "hours": end / 3600,
        "efficiency": cases * costs.case_seconds / (workers * end),
        "batch": batch,
        "scheduler_busy": shares["scheduler"],
        "files_busy": shares["file system"],
        "limit": limit if shares[limit] > BUSY else "none",
        "results_gb": cases * costs.result_bytes / 1e9,
        "tables_gb": cases * costs.table_bytes / 1e9,
    }
