"""The Dask cluster: workers of this machine, or those of a given scheduler."""

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
from distributed.comm.core import connect

from .errors import SweepError
from .tables import WORKER_BYTES
from .work import Job, probe

#: Number of killed workers after which their task is given up. Chosen: two may have died for another reason.
KILLS = 3
#: Fraction of the machine's free memory for all workers together. Chosen.
_MEMORY_FRACTION = 0.9
# Seconds to wait for the scheduler's first answer. Chosen.
_CONNECT_SECONDS = 5
# Seconds to wait for the scheduler's first worker. Chosen.
_WAIT_SECONDS = 60


def plan_workers(asked: int | None, memory_bytes: float | None, largest_bytes: float, cases: int) -> tuple[int, float]:
    """Number of workers of this machine, and the memory limit of each in bytes.

    The default is one worker a core, at most one a case, and few enough that ``largest_bytes`` fits into each worker's
    memory. ``asked`` and ``memory_bytes`` replace the number and the limit.
    """
    free = psutil.virtual_memory().available * _MEMORY_FRACTION
    cores = len(os.sched_getaffinity(0))
    workers = asked or max(1, min(cores, cases, int(free / (largest_bytes + WORKER_BYTES))))
    return workers, memory_bytes or free / workers


@contextmanager
def local_client(workers: int, memory_bytes: float) -> Iterator[Client]:
    """A client of a cluster of worker processes on this machine, which are killed when the context ends."""
    before = {child.pid for child in psutil.Process().children(recursive=True)}
    _quiet()
    scratch = tempfile.mkdtemp(prefix="sunbeam-sweep-")
    settings: dict[str, Any] = {
        # Dask gives a task up once more than this number of workers died while they had it.
        "distributed.scheduler.allowed-failures": KILLS - 1,
        "temporary-directory": scratch,
    }
    # After an interruption Python's tracker of shared resources cleans up after the workers and would warn.
    sys.warnoptions.append("ignore:resource_tracker")
    try:
        with dask.config.set(settings):
            cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                memory_limit=int(memory_bytes),
                dashboard_address=":0",
                silence_logs=logging.CRITICAL,
                local_directory=scratch,
            )
            client = Client(cluster, set_as_default=False)
            yield client
            client.close(timeout=2)
            cluster.close(timeout=5)
    finally:
        # After an interruption a worker may still compute for a minute. Killing it loses only an unfinished case.
        psutil.wait_procs(kill_workers(before), timeout=1)
        sys.warnoptions.remove("ignore:resource_tracker")
        shutil.rmtree(scratch, ignore_errors=True)


def kill_workers(before: Set[int] = frozenset()) -> list[psutil.Process]:
    """Kills this process's workers except those with a PID in ``before``. Returns the killed ones."""
    workers = [child for child in psutil.Process().children(recursive=True) if _is_worker(child, before)]
    for child in workers:
        with suppress(psutil.NoSuchProcess):
            child.kill()
    return workers


def _is_worker(child: psutil.Process, before: Set[int]) -> bool:
    """Whether the child is a new worker, not Python's tracker of shared resources, which ends by itself."""
    try:
        return child.pid not in before and "spawn_main" in " ".join(child.cmdline())
    except psutil.NoSuchProcess:
        return False


@contextmanager
def remote_client(address: str, job: Job) -> Iterator[Client]:
    """A client of the scheduler at ``address``, such as ``tcp://host:8786``, with every worker probed.

    Raises :class:`SweepError` where the scheduler does not answer within 5 s or has no worker within a minute, and
    where a worker lacks a requirement of the sweep.
    """
    _quiet()
    try:
        # Dask prints errors when it closes a client that never connected, so the address is tried first.
        asyncio.run(_reach(address))
        client = Client(address, timeout=_CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError, TimeoutError, RuntimeError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise SweepError(f"the scheduler {address} does not answer: {reason}") from error
    try:
        try:
            client.wait_for_workers(1, timeout=_WAIT_SECONDS)
        except TimeoutError as error:
            raise SweepError(f"the scheduler {address} has had no worker for {_WAIT_SECONDS} s") from error
        _probe_all(client, job)
        yield client
    finally:
        # The scheduler may be gone, which another error reports.
        with suppress(Exception):
            client.close(timeout=1)


async def _reach(address: str) -> None:
    """Opens and drops a connection; raises an error where nothing answers."""
    comm = await connect(address, timeout=_CONNECT_SECONDS)
    comm.abort()


def _probe_all(client: Client, job: Job) -> None:
    """Runs :func:`work.probe` on every worker, with a token that it must find in the output folder.

    Raises :class:`SweepError` for the first worker that cannot take part.
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
        # Some of Dask's loggers do not inherit their level.
        if name.split(".")[0] in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


__all__ = ["KILLS", "local_client", "plan_workers", "remote_client", "thread_count"]
