"""Hands cases to the workers in batches, a few at a time, and takes what becomes of them."""

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

#: Seconds that a batch is meant to take: the scheduler's milliseconds are little beside it, and what a dying worker
#: takes along is little, too.
BATCH_SECONDS = 1.0
#: With very many workers batches take longer, so that this process and the scheduler, with some milliseconds for each,
#: keep up.
BATCH_SECONDS_PER_THREAD = 0.01
#: Most cases of a batch.
BATCH_CASES_MAX = 500
#: Batches given out for each thread of the workers: one in work, and one to go on with.
_GIVEN_OUT = 2
# How much of the newest measurement goes into the mean time of a case.
_NEWEST = 0.5
_LOOK_SECONDS = 0.25
_RECOUNT_SECONDS = 2.0
# What a batch returns is small, and is brought at once where it still is.
_RESULT_SECONDS = 10.0


def drive(client: Client, job: Job, cases: list[Case], finished: Callable[[int, int], None]) -> None:
    """Computes all cases; ``finished`` is told after every batch how many are done and how many of these failed.

    Only some batches are with the scheduler at a time, so its memory does not depend on how many cases there are.
    Raises :class:`SweepError` where the sweep cannot go on.
    """
    _Driver(client, job, cases, finished).run()


class _Driver:
    def __init__(self, client: Client, job: Job, cases: list[Case], finished: Callable[[int, int], None]):
        self._client, self._job, self._finished = client, job, finished
        self._waiting: deque[Case] = deque(cases)
        # Batches that must not be joined with others: what was in one that killed its workers.
        self._alone: deque[list[Case]] = deque()
        # Cases whose workers were killed while others were given out. Dask counts a worker's death against all that it
        # was given, so these are tried again in the end, one by one with nothing beside them.
        self._suspects: deque[Case] = deque()
        self._on_trial: Case | None = None
        self._given_out: dict[Future[Done], list[Case]] = {}
        self._arrived: queue.Queue[Future[Done]] = queue.Queue()
        self._case_seconds = 0.0
        self._count_threads()
        self._key, self._number = uuid.uuid4().hex[:8], 0

    def run(self) -> None:
        self._give_out()
        while self._given_out:
            try:
                future = self._arrived.get(timeout=_LOOK_SECONDS)
            except queue.Empty:
                # Also where signals are answered.
                if self._client.status != "running":
                    raise self._lost() from None
                continue
            self._take(future, self._given_out.pop(future))
            self._give_out()

    def _give_out(self) -> None:
        if time.monotonic() - self._counted_at > _RECOUNT_SECONDS:
            # Workers come and go.
            self._count_threads()
        while len(self._given_out) < _GIVEN_OUT * self._threads and (self._waiting or self._alone):
            if self._alone:
                self._submit(self._alone.popleft())
            else:
                size = min(self._batch_size(), len(self._waiting))
                self._submit([self._waiting.popleft() for _ in range(size)])
        if self._suspects and not self._given_out:
            self._on_trial = self._suspects.popleft()
            self._submit([self._on_trial])

    def _count_threads(self) -> None:
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
        self._given_out[future] = batch
        future.add_done_callback(self._arrived.put)

    def _batch_size(self) -> int:
        if self._case_seconds <= 0:
            return 1
        target = max(BATCH_SECONDS, BATCH_SECONDS_PER_THREAD * self._threads)
        # Towards the end batches become smaller, so that all workers end together.
        share = max(1, len(self._waiting) // (_GIVEN_OUT * self._threads))
        return max(1, min(int(target / self._case_seconds), BATCH_CASES_MAX, share))

    def _take(self, future: Future[Done], batch: list[Case]) -> None:
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
            # It was done, but its worker died before this was asked for, and another does it again.
            self._await(future, batch)
            return
        except KilledWorker as error:
            # As above, and those that did it again died, too.
            self._take_error(error, batch)
            return
        except (OSError, CancelledError) as error:
            # Also where it is lost between the look at the status and this.
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
        if not isinstance(error, KilledWorker):
            raise SweepError(f"a worker cannot do its work: {type(error).__name__}: {' '.join(str(error).split())}")
        if len(batch) > 1:
            # One of them did it. Those that were done before it are on the disk.
            self._alone.extend([case] for case in batch)
            return
        (case,) = batch
        if case is not self._on_trial:
            self._suspects.append(case)
            return
        told = f"killed {KILLS} workers that tried it; most often the memory is too small for it"
        record = record_of(self._job, case, told)
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
