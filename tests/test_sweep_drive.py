"""The sweep's driver against a fake Dask client, whose workers die at chosen moments."""

import pytest

# The builtin TimeoutError from Python 3.11 on.
from distributed import TimeoutError as DaskTimeoutError
from distributed.comm.core import CommClosedError
from distributed.scheduler import KilledWorker

CASES = 3


class Result:
    """A fake future of a batch that ended with `error`, or with the result `done` if that is None.

    `result` and `exception` raise the failures first, one a call.
    """

    def __init__(self, done, failures, error):
        self.done, self.failures, self.error = done, failures, error
        self.status = "finished" if error is None else "error"

    def add_done_callback(self, tell):
        tell(self)

    def result(self, timeout):
        if self.failures:
            raise self.failures.pop()
        return self.done

    def exception(self, timeout):
        if self.failures:
            raise self.failures.pop()
        return self.error

    def release(self):
        pass


@pytest.fixture
def drive(sweep_package):
    """A function that drives three cases with one worker and returns the numbers of finished and failed cases."""
    from sunbeam_mitsuba.sweep.drive import drive
    from sunbeam_mitsuba.sweep.spec import Case
    from sunbeam_mitsuba.sweep.work import Done, Job

    class Client:
        def __init__(self, status, failures, error, reset):
            self.status, self.failures, self.error, self.reset = status, failures, error, reset

        def nthreads(self):
            if self.reset:
                raise CommClosedError("connection reset by peer")
            return {"worker": 1}

        def submit(self, run, job, batch, **how):
            return Result(Done({case.identity: False for case in batch}, 1.0), self.failures, self.error)

    def driven(*failures, status="running", error=None, reset=False):
        told = []
        cases = [Case(row, str(row), "surface", {}) for row in range(CASES)]
        client = Client(status, list(failures), error, reset)
        drive(client, Job(None, None, (), ""), cases, lambda *counts: told.append(counts))
        return tuple(map(sum, zip(*told, strict=True)))

    return driven


def test_lost_results_are_awaited_again(drive):
    """Dask repeats the batch, which may take longer than the wait for a result."""
    assert drive(DaskTimeoutError(), DaskTimeoutError()) == (CASES, 0)


def test_lost_errors_are_awaited_again(drive, sweep_package):
    with pytest.raises(sweep_package.SweepError, match="a worker cannot do its work: RuntimeError: broken"):
        drive(DaskTimeoutError(), error=RuntimeError("broken"))


def test_cases_of_a_deadly_batch_are_tried_alone(drive):
    assert drive(KilledWorker("batch", "worker", 3)) == (CASES, 0)


@pytest.mark.parametrize("error", [None, RuntimeError("broken")], ids=repr)
@pytest.mark.parametrize("failure", [DaskTimeoutError(), ConnectionError()], ids=repr)
def test_a_lost_scheduler_is_one_line(drive, sweep_package, failure, error):
    with pytest.raises(sweep_package.SweepError, match="the connection to the scheduler is lost"):
        drive(failure, status="closed", error=error)


def test_a_scheduler_lost_while_counting_threads_is_one_line(drive, sweep_package):
    with pytest.raises(sweep_package.SweepError, match="the connection to the scheduler is lost"):
        drive(reset=True)


def test_the_simulation_has_the_constants_of_the_driver(sweep_package):
    from sunbeam_mitsuba.sweep.drive import BATCH_CASES_MAX, BATCH_SECONDS, BATCH_SECONDS_PER_THREAD

    from docs.figures import sweeps_simulation

    assert sweeps_simulation.BATCH_SECONDS == BATCH_SECONDS
    assert sweeps_simulation.BATCH_SECONDS_PER_THREAD == BATCH_SECONDS_PER_THREAD
    assert sweeps_simulation.BATCH_CASES_MAX == BATCH_CASES_MAX
