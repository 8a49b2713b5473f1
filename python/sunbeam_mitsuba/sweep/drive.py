"""Submits cases to the workers in batches, a few at a time, and collects the results.

A *case* is a surface under a setting, a row of the results. A *batch* is a Dask task: a call of work.run_batch with
some cases. The number of cases follows from their measured duration, so that a batch takes about BATCH_SECONDS and the
overhead of a task is small.

A worker can die, most often for lack of memory, and Dask then repeats its batch on another worker. After KILLS deaths
Dask gives the batch up with a KilledWorker error. Then:

- The cases of a batch with several cases are submitted again, each alone in its batch.
- A single case becomes a *suspect*. It may be innocent, because Dask counts a death against all tasks at that worker.
- Suspects are tried at the end, one at a time, with nothing else at the workers (*on trial*). If the trial kills KILLS
  workers, too, the case counts as failed.
"""

from __future__ import annotations

import queue
import time
import uuid
from collections import deque
from collections.abc import Callable
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

from distributed import Client, Future
from distributed import TimeoutError as DaskTimeoutError
from distributed.scheduler import KilledWorker

from .cluster import KILLS, thread_count
from .errors import SweepError
from .reflector import with_full_path
from .spec import Case
from .store import StoreError, input_of, write_result
from .work import Done, Job, record_of, run_batch

#: Shortest target duration of a batch in seconds. Longer batches spend less of the time on overhead, some
#: milliseconds each; shorter ones balance the load better.
BATCH_SECONDS = 1.0
#: Target duration of a batch in seconds for each thread of all workers, where the product exceeds BATCH_SECONDS. This
#: process and the scheduler spend some milliseconds on each batch, and must keep up with all threads.
BATCH_SECONDS_PER_THREAD = 0.01
#: Largest number of cases in a batch. It limits the size of a message to a worker.
BATCH_CASES_MAX = 500
# Batches at the workers for each of their threads: one being computed and one waiting.
_BATCHES_PER_THREAD = 2
# Weight of the newest batch in the exponential mean of a case's duration. Larger values follow changes faster; smaller
# ones average more batches.
_NEWEST_WEIGHT = 0.5
# Longest wait in seconds for the end of a batch, after which the connection is checked.
_POLL_SECONDS = 0.25
# Seconds between counts of the workers' threads.
_RECOUNT_SECONDS = 2.0
# Longest wait in seconds for a finished batch's result or error. Both are small, so a longer wait means that the worker
# died after the batch.
_RESULT_SECONDS = 10.0


def drive(client: Client, job: Job, cases: list[Case], on_finished: Callable[[int, int], None]) -> None:
    """Computes all cases on the client's workers, which write the results.

    After every batch it calls ``on_finished`` with the batch's numbers of cases and of failed cases. The scheduler has
    few batches at a time, so its memory does not grow with the number of cases.

    Raises :class:`SweepError` where the sweep cannot continue.
    """
    _Driver(client, job, cases, on_finished).run()


class _Driver:
    """State of a sweep under way: waiting, submitted and suspect cases."""

    def __init__(self, client: Client, job: Job, cases: list[Case], on_finished: Callable[[int, int], None]):
        self._client, self._job, self._on_finished = client, job, on_finished
        # Cases that were not submitted yet.
        self._waiting: deque[Case] = deque(cases)
        # Cases of batches that killed their workers, each to be submitted in a batch of its own.
        self._single: deque[Case] = deque()
        # Single cases whose workers were killed while other batches were submitted.
        self._suspects: deque[Case] = deque()
        # The suspect that was submitted last.
        self._on_trial: Case | None = None
        # Batches at the workers, by their futures.
        self._submitted: dict[Future[Done], list[Case]] = {}
        # Futures of batches that ended. Dask fills the queue in a thread of its own.
        self._ended: queue.Queue[Future[Done]] = queue.Queue()
        # Exponential mean of a case's duration in seconds; 0 before the first batch ends.
        self._case_seconds = 0.0
        # Number of the workers' threads, and the time when they were counted.
        self._threads, self._counted_at = 1, 0.0
        self._count_threads()
        # Dask's keys of the batches are a random prefix, which differs between sweeps on one scheduler, and a number.
        self._key_prefix = uuid.uuid4().hex[:8]
        self._batches_made = 0

    def run(self) -> None:
        """Submits and collects batches until no case is left."""
        self._submit_batches()
        while self._submitted:
            try:
                future = self._ended.get(timeout=_POLL_SECONDS)
            except queue.Empty:
                # A wait without a timeout would also delay the handling of signals.
                if self._client.status != "running":
                    raise self._lost() from None
                continue
            self._collect(future, self._submitted.pop(future))
            self._submit_batches()

    def _submit_batches(self) -> None:
        """Submits batches until each thread has _BATCHES_PER_THREAD, and a suspect if nothing else is submitted."""
        if time.monotonic() - self._counted_at > _RECOUNT_SECONDS:
            self._count_threads()
        while len(self._submitted) < _BATCHES_PER_THREAD * self._threads and (self._waiting or self._single):
            if self._single:
                self._submit([self._single.popleft()])
            else:
                size = min(self._batch_size(), len(self._waiting))
                self._submit([self._waiting.popleft() for _ in range(size)])
        if self._suspects and not self._submitted:
            self._on_trial = self._suspects.popleft()
            self._submit([self._on_trial])

    def _count_threads(self) -> None:
        """Updates the number of the workers' threads, which changes as workers join and leave.

        Raises :class:`SweepError` where the connection is lost.
        """
        try:
            self._threads = max(1, thread_count(self._client))
        except OSError as error:
            raise self._lost() from error
        self._counted_at = time.monotonic()

    def _submit(self, batch: list[Case]) -> None:
        """Submits a batch to the workers."""
        self._batches_made += 1
        key = f"sweep-{self._key_prefix}-{self._batches_made}"
        future = self._client.submit(run_batch, self._job, batch, key=key, pure=False)
        self._await(future, batch)

    def _await(self, future: Future[Done], batch: list[Case]) -> None:
        """Registers a submitted batch, so that its future enters the queue ``_ended`` when it ends."""
        self._submitted[future] = batch
        future.add_done_callback(self._ended.put)

    def _batch_size(self) -> int:
        """Number of cases in the next batch, from the measured duration of a case; 1 before the first measurement."""
        if self._case_seconds <= 0:
            return 1
        target_seconds = max(BATCH_SECONDS, BATCH_SECONDS_PER_THREAD * self._threads)
        # Batches shrink towards the end, so that all workers finish together.
        equal_parts = max(1, len(self._waiting) // (_BATCHES_PER_THREAD * self._threads))
        return max(1, min(int(target_seconds / self._case_seconds), BATCH_CASES_MAX, equal_parts))

    def _collect(self, future: Future[Done], batch: list[Case]) -> None:
        """Collects the result or the error of a batch that ended.

        Raises :class:`SweepError` where the sweep cannot continue.
        """
        if future.status == "cancelled":
            raise self._lost()
        done: Done | None = None
        try:
            # `result` would raise the batch's own error, in which an OSError could not be told from a lost connection.
            error: Any = future.exception(timeout=_RESULT_SECONDS) if future.status == "error" else None
            if error is None:
                done = future.result(timeout=_RESULT_SECONDS)
        except KilledWorker as killed:
            # The worker died before its result was fetched, and so did the workers that repeated the batch.
            error = killed
        except DaskTimeoutError as late:
            if self._client.status != "running":
                raise self._lost() from late
            # The worker died before its result was fetched, and Dask repeats the batch.
            self._await(future, batch)
            return
        except (OSError, CancelledError) as lost:
            # The connection can also be lost after the status was read.
            raise self._lost() from lost
        if done is None:
            self._handle_error(error, batch)
            return
        # The scheduler may forget the result.
        future.release()
        self._count_result(done)

    def _count_result(self, done: Done) -> None:
        """Measures and counts the cases of a computed batch. Raises :class:`SweepError` for its fatal error."""
        # `has_failed` has an entry for each computed case. A batch with a fatal error may have computed none.
        finished = len(done.has_failed)
        if finished:
            newest = done.seconds / finished
            mean = self._case_seconds or newest
            self._case_seconds = _NEWEST_WEIGHT * newest + (1 - _NEWEST_WEIGHT) * mean
        self._on_finished(finished, sum(done.has_failed.values()))
        if done.fatal:
            raise SweepError(done.fatal)

    def _handle_error(self, error: Any, batch: list[Case]) -> None:
        """Handles the error of a batch: a KilledWorker error as the head of this file describes, others are fatal.

        Raises :class:`SweepError` for a fatal error, and where the record of a failed case cannot be written.
        """
        if not isinstance(error, KilledWorker):
            raise SweepError(f"a worker cannot do its work: {type(error).__name__}: {' '.join(str(error).split())}")
        if len(batch) > 1:
            # Cases before the deadly one have stored results, which `run_batch` finds.
            self._single.extend(batch)
            return
        (case,) = batch
        if case is not self._on_trial:
            self._suspects.append(case)
            return
        self._record_deadly(case)
        self._on_finished(1, 1)

    def _record_deadly(self, case: Case) -> None:
        """Records as failed a case that killed its workers. Raises :class:`SweepError` where that is impossible."""
        message = f"killed {KILLS} workers that tried it; most often the memory is too small for it"
        record = record_of(self._job, case, message)
        parameters = with_full_path(case.parameters, self._job.folder)
        try:
            if "filename" in parameters:
                record["input"] = input_of(Path(str(parameters["filename"])))
            write_result(self._job.output, record, {})
        except (OSError, StoreError) as disk_error:
            raise SweepError(str(disk_error)) from disk_error

    def _lost(self) -> SweepError:
        """The error of a lost connection, to be raised."""
        return SweepError("the connection to the scheduler is lost")
