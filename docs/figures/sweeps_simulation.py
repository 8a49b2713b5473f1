"""A discrete-event simulation of a sweep with any number of workers, by the measured costs of its steps.

Two servers handle one request at a time: the driver with its scheduler, and the shared file system. Workers compute in
parallel, one in each thread of the cluster. A *case* is a surface in one setting (docs/sweeps.md). A worker requests a
batch of cases from the driver and computes them one by one. It writes each result to the file system before it begins
the next case. Times are in seconds. Batches of the driver also shrink towards the end of a sweep, which the simulation
leaves out. A test compares the constants of the driver with the copies below.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

# Target duration of a batch, equal to that of `sunbeam_mitsuba.sweep.drive`.
BATCH_SECONDS = 1.0
# Target duration of a batch for each thread of the cluster, where this exceeds BATCH_SECONDS; equal to that of `drive`.
BATCH_SECONDS_PER_THREAD = 0.01
# Largest number of cases in a batch, equal to that of `drive`.
BATCH_CASES_MAX = 500
# Fraction of the time in use above which a server counts as the limit of the sweep. Chosen: requests then mostly wait.
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


class Server:
    """Handles one request at a time, in the order of arrival."""

    def __init__(self) -> None:
        # Time from which on the server is free.
        self.free_at = 0.0
        # Total time in use.
        self.busy = 0.0

    def handle(self, now: float, seconds: float) -> float:
        """Takes a request that arrives at the time `now` and needs `seconds`; returns the time at which it is done."""
        self.free_at = max(self.free_at, now) + seconds
        self.busy += seconds
        return self.free_at


def simulate(costs: Costs, cases: int, workers: int, storage: Storage) -> dict:
    """Simulates at least one worker and `cases` cases, at least one, each with its own surface.

    - `hours`: the duration of the sweep.
    - `efficiency`: the fraction of the workers' time spent on cases.
    - `batch`: the number of cases in a batch.
    - `scheduler_busy`, `files_busy`: the fractions of the duration in which the servers are in use.
    - `limit`: the busier server if it is in use for more than BUSY, or else "none".
    - `results_gb`, `tables_gb`: the sizes of all results and of all tables.
    """
    target = max(BATCH_SECONDS, BATCH_SECONDS_PER_THREAD * workers)
    batch = max(1, min(int(target / costs.case_seconds), BATCH_CASES_MAX))
    # Time of the shared file system for a case: one file for the result, and the tables' bytes if it has their cache.
    file_seconds = 1 / storage.files_per_second
    if storage.cache_bytes_per_second is not None:
        file_seconds += costs.table_bytes / storage.cache_bytes_per_second
    driver, files, end = Server(), Server(), 0.0
    # Cases that no worker has yet, and the cases of each worker's batch that are not finished.
    left, unfinished = cases, [0] * workers
    # Heap of the times of each worker's next event: the end of a case, or the request for a batch if its batch is
    # finished.
    events = [(0.0, worker) for worker in range(workers)]
    while events:
        now, worker = heapq.heappop(events)
        if unfinished[worker]:
            unfinished[worker] -= 1
            # The local disk may take longer than the shared file system.
            written = max(files.handle(now, file_seconds), now + costs.write_seconds)
            # The worker computes the next case of its batch, or requests a batch at once.
            computing = costs.case_seconds if unfinished[worker] else 0.0
            heapq.heappush(events, (written + computing, worker))
        elif left:
            unfinished[worker] = min(batch, left)
            left -= unfinished[worker]
            received = driver.handle(now, costs.batch_seconds)
            heapq.heappush(events, (received + costs.case_seconds, worker))
        else:
            # No case is left for this worker.
            end = max(end, now)
    busy = {"scheduler": driver.busy / end, "file system": files.busy / end}
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
