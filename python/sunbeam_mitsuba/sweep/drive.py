"""Submits cases to the workers in batches, a few at a time, and collects the results.

A worker can die, most often for lack of memory, and Dask then repeats its batch on another worker. Dask gives up after
KILLS deaths. The cases of such a batch are submitted again one by one. A single case whose workers died may be
innocent, because Dask counts a death against all tasks at that worker. Such *suspects* are tried at the end, each alone
in the cluster (*on trial*), and fail if KILLS workers die again.
"""

from __future__ import annotations

import queue
import time
import uuid
from collections import deque
from collections.abc import Callable
from concurrent.futures import CancelledError
from typing import Any

from distributed import Client, Future
from distributed.scheduler import KilledWorker

from .cluster import KILLS, thread_count
from .errors import SweepError
from .reflector import with_full_path
from .spec import Case
from .store import StoreError, input_of, write_result
from .work import Done, Job, record_of, run_batch

#: Target duration of a batch in seconds. Chosen: long against the scheduler's milliseconds, short enough to lose.
BATCH_SECONDS = 1.0
# : Target duration of a batch in seconds, per thread of the cluster, if their product exceeds BATCH_SECONDS. Chosen:
# this : process and the scheduler spend some milliseconds on each batch.
BATCH_SECONDS_PER_THREAD = 0.01
#: Largest number of cases in a batch. Chosen.
BATCH_CASES_MAX = 500
#: Batches at the workers for each of their threads: one being computed and one waiting.
_BATCHES_PER_THREAD = 2
# Weight of the newest batch in the exponential mean of a case's duration. Chosen.
_NEWEST = 0.5
# Seconds between checks of the connection while no batch ends. Chosen.
_LOOK_SECONDS = 0.25
# Seconds between counts of the workers' threads.
_RECOUNT_SECONDS = 2.0
# Seconds to wait for a finished batch's result; it is small, so a longer wait means that its worker died.
_RESULT_SECONDS = 10.0


def drive(client: Client, job: Job, cases: list[Case], finished: Callable[[int, int], None]) -> None:
    """Computes all cases. After every batch calls ``finished`` with its number of cases and of failed ones.

    The scheduler has few batches at a time, so its memory does not grow with the number of cases.
    Raises :class:`SweepError` where the sweep cannot continue.
    """
    _Driver(client, job, cases, finished).run()


class _Driver:
    """State of a sweep under way: waiting, submitted and suspect cases."""

    def __init__(self, client: Client, job: Job, cases: list[Case], finished: Callable[[int, int], None]):
        self._client, self._job, self._finished = client, job, finished
        self._waiting: deque[Case] = deque(cases)
        # Cases of a batch that killed its workers, each to be submitted alone.
        self._alone: deque[list[Case]] = deque()
        # Cases whose workers were killed while other batches were submitted. Dask counts a worker's death against all
        # of its tasks, so suspects are tried again at the end, one at a time.
        self._suspects: deque[Case] = deque()
        self._on_trial: Case | None = None
        self._submitted: dict[Future[Done], list[Case]] = {}
        self._arrived: queue.Queue[Future[Done]] = queue.Queue()
        # Exponential mean of a case's duration; 0 before the first batch ends.
        self._case_seconds = 0.0
        self._count_threads()
        self._key, self._number = uuid.uuid4().hex[:8], 0

    def run(self) -> None:
        """Submits and collects batches until no case is left."""
        self._submit_batches()
        while self._submitted:
            try:
                future = self._arrived.get(timeout=_LOOK_SECONDS)
            except queue.Empty:
                # The timeout also lets Python handle signals.
                if self._client.status != "running":
                    raise self._lost() from None
                continue
            self._take(future, self._submitted.pop(future))
            self._submit_batches()

    def _submit_batches(self) -> None:
        """Submits batches until each thread has its number; a suspect only if nothing else is submitted."""
        if time.monotonic() - self._counted_at > _RECOUNT_SECONDS:
            self._count_threads()
        while len(self._submitted) < _BATCHES_PER_THREAD * self._threads and (self._waiting or self._alone):
            if self._alone:
                self._submit(self._alone.popleft())
            else:
                size = min(self._batch_size(), len(self._waiting))
                self._submit([self._waiting.popleft() for _ in range(size)])
        if self._suspects and not self._submitted:
            self._on_trial = self._suspects.popleft()
            self._submit([self._on_trial])

    def _count_threads(self) -> None:
        """Updates the number of the workers' threads, which changes as workers join and leave."""
        try:
            self._threads = max(1, thread_count(self._client))
        except OSError as error:
            raise self._lost() from error
        self._counted_at = time.monotonic()

    def _submit(self, batch: list[Case]) -> None:
        self._number += 1
        key = f"sweep-{self._key}-{self._number}"
        future = self._client.submit(run_batch, self._job, batch, key=key, pure=False)
        self._await(future, batch)

    def _await(self, future: Future[Done], batch: list[Case]) -> None:
        """Registers a submitted batch; its future enters the queue of arrivals when it ends."""
        self._submitted[future] = batch
        future.add_done_callback(self._arrived.put)

    def _batch_size(self) -> int:
        """Number of cases of the next batch, from the measured duration of a case; 1 before the first measurement."""
        if self._case_seconds <= 0:
            return 1
        target = max(BATCH_SECONDS, BATCH_SECONDS_PER_THREAD * self._threads)
        # Batches shrink towards the end, so that all workers finish together.
        equal_parts = max(1, len(self._waiting) // (_BATCHES_PER_THREAD * self._threads))
        return max(1, min(int(target / self._case_seconds), BATCH_CASES_MAX, equal_parts))

    def _take(self, future: Future[Done], batch: list[Case]) -> None:
        """Collects the result of a batch that ended, whatever its end."""
        if future.status == "cancelled":
            raise self._lost()
        if future.status == "error":
            self._take_error(future.exception(timeout=_RESULT_SECONDS), batch)
            return
        try:
            done: Done = future.result(timeout=_RESULT_SECONDS)
        except TimeoutError as error:
            if self._client.status != "running":
                raise self._lost() from error
            # The worker died before its result was fetched, and Dask repeats the batch.
            self._await(future, batch)
            return
        except KilledWorker as error:
            # The workers that repeated the batch died, too.
            self._take_error(error, batch)
            return
        except (OSError, CancelledError) as error:
            # The connection can also be lost after the status was checked.
            raise self._lost() from error
        future.release()
        if done.failed:
            seconds = done.seconds / len(done.failed)
            before = self._case_seconds or seconds
            self._case_seconds = _NEWEST * seconds + (1 - _NEWEST) * before
        self._finished(len(done.failed), sum(done.failed.values()))
        if done.fatal:
            raise SweepError(done.fatal)

    def _take_error(self, error: Any, batch: list[Case]) -> None:
        """Resubmits or fails the cases of a batch that killed its workers. Raises SweepError for another error."""
        if not isinstance(error, KilledWorker):
            raise SweepError(f"a worker cannot do its work: {type(error).__name__}: {' '.join(str(error).split())}")
        if len(batch) > 1:
            # One of the cases killed the workers. Results of the cases before it are stored.
            self._alone.extend([case] for case in batch)
            return
        (case,) = batch
        if case is not self._on_trial:
            self._suspects.append(case)
            return
        message = f"killed {KILLS} workers that tried it; most often the memory is too small for it"
        record = record_of(self._job, case, message)
        parameters = with_full_path(case.parameters, self._job.folder)
        try:
            if "filename" in parameters:
                record["input"] = input_of(self._job.folder / str(parameters["filename"]))
            write_result(self._job.output, record, {})
        except (OSError, StoreError) as error_of_disk:
            raise SweepError(str(error_of_disk)) from error_of_disk
        self._finished(1, 1)

    def _lost(self) -> SweepError:
        return SweepError("the connection to the scheduler is lost")
