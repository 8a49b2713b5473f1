"""The Dask cluster that computes a sweep: new workers on this machine, or those of a given scheduler.

A Dask *worker* is a process that runs tasks, the *scheduler* hands tasks to the workers, and a *client* is the driver's
connection to the scheduler. The driver is this process. A *case* is a surface under a setting, and a task is a batch of
cases (drive.py).
"""

from __future__ import annotations

import asyncio
import logging
import os
import shutil
import sys
import tempfile
import uuid
from collections.abc import Iterator, Set
from contextlib import contextmanager, suppress
from typing import Any

import dask
import psutil
from distributed import Client, LocalCluster

# Dask raises asyncio's TimeoutError, which is the builtin one from Python 3.11 on.
from distributed import TimeoutError as DaskTimeoutError
from distributed.comm.core import connect

from .errors import SweepError
from .tables import WORKER_BYTES
from .work import Job, probe

#: Number of workers that must die at a task before it is given up. Smaller values blame tasks for deaths that they did
#: not cause; larger ones lose more work of the other tasks at these workers.
KILLS = 3
# Fraction of the machine's free memory for all workers together. The rest is for this process and the system, so larger
# values risk that the system kills a process; smaller ones refuse more surfaces.
_MEMORY_FRACTION = 0.9
# Seconds to wait for the scheduler's first answer. A scheduler that is up answers at once.
_CONNECT_SECONDS = 5
# Seconds to wait for the scheduler's first worker, which may still be starting.
_WAIT_SECONDS = 60


def plan_workers(
    wanted_workers: int | None, wanted_bytes: float | None, largest_bytes: float, cases: int
) -> tuple[int, float]:
    """Number of workers of this machine, and the memory limit of each in bytes.

    By default there is one worker for each core that this process may use, but at most one per case. There are fewer
    where memory is short: each worker needs WORKER_BYTES and ``largest_bytes``, the peak memory of the largest surface.
    The default limit is an equal part of _MEMORY_FRACTION of the free memory. ``wanted_workers`` and ``wanted_bytes``
    replace the number and the limit; ``None`` keeps the default. Raises :class:`SweepError` unless they are above zero.
    """
    for name, wanted in (("number of workers", wanted_workers), ("memory of a worker", wanted_bytes)):
        # The negated comparison also refuses NaN.
        if wanted is not None and not 0 < wanted < float("inf"):
            raise SweepError(f"the {name} is {wanted:g}, but must be a finite number above zero")
    usable_bytes = psutil.virtual_memory().available * _MEMORY_FRACTION
    cores = len(os.sched_getaffinity(0))
    fitting = int(usable_bytes / (largest_bytes + WORKER_BYTES))
    workers = max(1, min(cores, cases, fitting)) if wanted_workers is None else wanted_workers
    return workers, usable_bytes / workers if wanted_bytes is None else wanted_bytes


@contextmanager
def local_client(workers: int, memory_bytes: float) -> Iterator[Client]:
    """A client of a new cluster of ``workers`` worker processes on this machine, each limited to ``memory_bytes``.

    The workers are killed when the context ends.
    """
    # PIDs of the children of a script that calls the sweep, which must survive it.
    before = {child.pid for child in psutil.Process().children(recursive=True)}
    _quiet()
    scratch = tempfile.mkdtemp(prefix="sunbeam-sweep-")
    settings: dict[str, Any] = {
        # Dask gives a task up once more than this number of workers died while they had it.
        "distributed.scheduler.allowed-failures": KILLS - 1,
        "temporary-directory": scratch,
    }
    # Python's tracker of shared resources inherits these options. After an interruption it cleans up after the workers,
    # and would warn about it.
    sys.warnoptions.append("ignore:resource_tracker")
    try:
        with dask.config.set(settings):
            cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                memory_limit=int(memory_bytes),
                # Any free port, since several sweeps may run on a machine.
                dashboard_address=":0",
                silence_logs=logging.CRITICAL,
                local_directory=scratch,
            )
            client = Client(cluster, set_as_default=False)
            yield client
            # Reached without an error. Timeouts in seconds; workers that do not end within them are killed below.
            client.close(timeout=2)
            cluster.close(timeout=5)
    finally:
        # After an interruption a worker may still compute for a minute. Killing it loses only an unfinished case.
        psutil.wait_procs(kill_workers(before), timeout=1)
        sys.warnoptions.remove("ignore:resource_tracker")
        shutil.rmtree(scratch, ignore_errors=True)


def kill_workers(before: Set[int] = frozenset()) -> list[psutil.Process]:
    """Kills the worker processes below this one, except those with a PID in ``before``. Returns the killed ones."""
    workers = [child for child in psutil.Process().children(recursive=True) if _is_worker(child, before)]
    for child in workers:
        with suppress(psutil.NoSuchProcess):
            child.kill()
    return workers


def _is_worker(child: psutil.Process, before: Set[int]) -> bool:
    """Whether the child process is a worker and its PID is not in ``before``.

    Python starts workers with ``spawn_main``. Its tracker of shared resources, another child, ends by itself.
    """
    try:
        return child.pid not in before and "spawn_main" in " ".join(child.cmdline())
    except psutil.NoSuchProcess:
        return False


@contextmanager
def remote_client(address: str, job: Job) -> Iterator[Client]:
    """A client of the scheduler at ``address``, such as ``tcp://host:8786``, with every worker probed.

    The workers stay when the context ends. Raises :class:`SweepError` where the scheduler does not answer within
    _CONNECT_SECONDS or has no worker within _WAIT_SECONDS, and where a worker lacks a requirement of the sweep.
    """
    _quiet()
    try:
        # Dask prints errors when it closes a client that never connected, so a bare connection is tried first.
        asyncio.run(_reach(address))
        client = Client(address, timeout=_CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError, DaskTimeoutError, RuntimeError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise SweepError(f"the scheduler {address} does not answer: {reason}") from error
    try:
        _wait_for_worker(client, address)
        _probe_all(client, job)
        yield client
    finally:
        # The scheduler may be gone. The error that ended the context reports that.
        with suppress(Exception):
            client.close(timeout=1)


async def _reach(address: str) -> None:
    """Opens and drops a connection to the scheduler. Raises OSError or ValueError where none answers."""
    comm = await connect(address, timeout=_CONNECT_SECONDS)
    comm.abort()


def _wait_for_worker(client: Client, address: str) -> None:
    """Waits for the scheduler's first worker. Raises :class:`SweepError` without one after _WAIT_SECONDS."""
    try:
        client.wait_for_workers(1, timeout=_WAIT_SECONDS)
    except DaskTimeoutError as error:
        raise SweepError(f"the scheduler {address} has had no worker for {_WAIT_SECONDS} s") from error


def _probe_all(client: Client, job: Job) -> None:
    """Runs :func:`work.probe` on every worker.

    Each must find a new random token in the output folder, which shows that it has the same disk. Raises
    :class:`SweepError` for the first worker that cannot take part.
    """
    token, token_file = uuid.uuid4().hex, job.output / ".token"
    token_file.write_text(token)
    try:
        answers = client.run(probe, job, token, on_error="return")
    except Exception as error:
        raise SweepError(f"the workers cannot be asked: {type(error).__name__}: {error}") from error
    finally:
        token_file.unlink(missing_ok=True)
    for worker, answer in answers.items():
        if isinstance(answer, BaseException):
            raise SweepError(f"the worker {worker} cannot take part: {type(answer).__name__}: {answer}")
        if answer:
            raise SweepError(answer)


def thread_count(client: Client) -> int:
    """Current number of threads of all workers."""
    return sum(client.nthreads().values())


def _quiet() -> None:
    """Silences Dask's reports of lost workers and connections; the sweep reports them in one line."""
    for name in ["distributed", "tornado", "asyncio", *logging.root.manager.loggerDict]:
        # Some of Dask's loggers have a level of their own, so each is set.
        if name.split(".")[0] in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
