"""A discrete-event simulation of a sweep with any number of workers, by the measured costs of its steps.

Two servers handle one request at a time: the driver with its scheduler, and the shared file system. Workers compute in
parallel. A worker requests a batch of cases from the driver, computes them one by one, and writes each result to the
file system before it begins the next case. Times are in seconds.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

# Target duration of a batch, equal to that of `sunbeam_mitsuba.sweep.drive`.
BATCH_SECONDS = 1.0
# Target duration of a batch per thread of the cluster, if their product is larger; equal to that of `drive`.
BATCH_SECONDS_PER_THREAD = 0.01
# Largest number of cases in a batch, equal to that of `drive`.
BATCH_CASES_MAX = 500
# Fraction of the time in use above which a server counts as the limit, since requests then wait.
BUSY = 0.8


@dataclass(frozen=True)
class Costs:
    """Costs of a sweep's steps."""

    # Driver and scheduler for a batch.
    batch_seconds: float
    # A worker for a case with its tables.
    case_seconds: float
    # Writing a result to a local disk.
    write_seconds: float
    # Size of a result.
    result_bytes: float
    # Size of a surface's tables.
    table_bytes: float


@dataclass(frozen=True)
class Storage:
    """A shared file system: files per second of all workers, and bytes per second if it also has the tables' cache."""

    name: str
    files_per_second: float
    cache_bytes_per_second: float | None = None


def simulate(costs: Costs, cases: int, workers: int, storage: Storage) -> dict:
    """Simulates `cases` cases, each with its own surface.

    Returns the duration in hours, the fraction of the workers' time spent on cases, `efficiency`, the number of cases
    in a batch, and the fractions of time in which the servers are busy. `limit` is the busier server, or "none".
    """
    target = max(BATCH_SECONDS, BATCH_SECONDS_PER_THREAD * workers)
    batch = max(1, min(int(target / costs.case_seconds), BATCH_CASES_MAX))
    # Time of the file system for a case.
    file_seconds = 1 / storage.files_per_second
    if storage.cache_bytes_per_second is not None:
        file_seconds += costs.table_bytes / storage.cache_bytes_per_second
    # Times at which the servers are free, and for which they have been busy.
    driver_free, files_free, driver_busy, files_busy, end = 0.0, 0.0, 0.0, 0.0, 0.0
    # Cases that no worker has yet, and the cases of each worker's batch that are not finished.
    left, unfinished = cases, [0] * workers
    # The time of each worker's next event: the end of a case, or the request for a batch if nothing is unfinished.
    events = [(0.0, worker) for worker in range(workers)]
    while events:
        now, worker = heapq.heappop(events)
        if unfinished[worker]:
            unfinished[worker] -= 1
            files_free = max(files_free, now) + file_seconds
            files_busy += file_seconds
            written = max(files_free, now + costs.write_seconds)
            next_event = written + costs.case_seconds if unfinished[worker] else written
            heapq.heappush(events, (next_event, worker))
        elif left:
            unfinished[worker] = min(batch, left)
            left -= unfinished[worker]
            driver_free = max(driver_free, now) + costs.batch_seconds
            driver_busy += costs.batch_seconds
            heapq.heappush(events, (driver_free + costs.case_seconds, worker))
        else:
            # No case is left for this worker.
            end = max(end, now)
    busy = {"scheduler": driver_busy / end, "file system": files_busy / end}
    busier = max(busy, key=lambda server: busy[server])
    return {
        "workers": workers,
        "storage": storage.name,
        "hours": end / 3600,
        "efficiency": cases * costs.case_seconds / (workers * end),
        "batch": batch,
        "scheduler_busy": busy["scheduler"],
        "files_busy": busy["file system"],
        "limit": busier if busy[busier] > BUSY else "none",
        "results_gb": cases * costs.result_bytes / 1e9,
        "tables_gb": cases * costs.table_bytes / 1e9,
    }
