"""A discrete-event simulation of a sweep with any number of workers, by the measured costs of its steps.

A *sweep* computes many cases in parallel and stores their results (docs/sweeps.md). A *case* is a surface in one
setting. The *driver* hands out batches of cases through a scheduler. Workers compute in parallel, one in each thread of
the cluster. A worker requests a batch from the driver and computes its cases one by one. It writes each result to the
shared file system before it begins the next case. The driver with its scheduler and the file system are two *servers*,
each of which handles one request at a time.

Times are in seconds. Real batches also shrink towards the end of a sweep, which the simulation leaves out. A test
compares the driver's constants, in `sunbeam_mitsuba.sweep.drive`, with the copies below.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

# Smallest target duration of a batch, equal to that of `drive`.
BATCH_SECONDS = 1.0
# Target duration of a batch for each thread of the cluster, where the sum over threads exceeds BATCH_SECONDS; equal to
# that of `drive`.
BATCH_SECONDS_PER_THREAD = 0.01
# Largest number of cases in a batch, equal to that of `drive`.
BATCH_CASES_MAX = 500
# Fraction of the time in use above which a server counts as the limit of the sweep: most requests then wait for it.
BUSY = 0.8


@dataclass(frozen=True)
class Costs:
    """Costs of a sweep's steps."""

    # Time of driver and scheduler for a batch.
    batch_seconds: float
    # Time of a worker for a case with its tables.
    case_seconds: float
    # Time of writing a result to a local disk.
    write_seconds: float
    # Size of a result.
    result_bytes: float
    # Size of a surface's tables.
    table_bytes: float


@dataclass(frozen=True)
class Storage:
    """A shared file system: the files per second that it writes, and the bytes per second of the cache of tables.

    `None` bytes per second stand for a file system without the cache.
    """

    name: str
    files_per_second: float
    cache_bytes_per_second: float | None = None


class Server:
    """Handles one request at a time, in the order of arrival."""

    def __init__(self) -> None:
        # Time at which the server has handled all requests so far.
        self.free_at = 0.0
        # Total time in use.
        self.busy = 0.0

    def handle(self, now: float, seconds: float) -> float:
        """Takes a request that arrives at the time `now` and needs `seconds`; returns the time at which it is done."""
        self.free_at = max(self.free_at, now) + seconds
        self.busy += seconds
        return self.free_at


def simulate(costs: Costs, cases: int, workers: int, storage: Storage) -> dict:
    """Simulates a sweep of `cases` cases, each with its own surface, by `workers` workers; at least one of both.

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
    # Cases that no worker has yet, and by worker the unfinished cases of its batch.
    left, unfinished = cases, [0] * workers
    # Heap of the workers' next events: time and worker. The event is the end of a case while the worker's batch is
    # unfinished, or else the request for a batch.
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
