"""Sweeps that are killed, interrupted or run out of disk resume with the same command, to equal bytes."""

import contextlib
import os
import re
import signal
import subprocess
import sys
import time

import needs
import psutil
import pyarrow.parquet as pq
import pytest
from sweeps import begin, environment, results, sweep, wait_for, write_spec

CASES = 12
# Seconds added to each of twelve cases, so that a kill meets a running sweep.
SLOW = 0.8


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The table of a sweep without interruption."""
    folder = tmp_path_factory.mktemp("undisturbed")
    done = sweep(write_spec(folder), "--workers", 2)
    assert done.returncode == 0, done.stderr
    return (folder / "out" / "sweep.parquet").read_bytes()


def kill(process):
    with contextlib.suppress(ProcessLookupError):
        os.kill(process.pid, signal.SIGKILL)


def workers_of(driver):
    """The driver's worker processes, spawned by Dask's nannies."""
    with contextlib.suppress(psutil.NoSuchProcess):
        children = psutil.Process(driver.pid).children(recursive=True)
        return [child for child in children if "spawn_main" in " ".join(child.cmdline())]
    return []


def in_the_middle(folder):
    wait_for(lambda: 3 <= len(results(folder / "out")) < CASES)


def test_a_killed_driver_resumes(tmp_path, undisturbed):
    """Killing the driver also kills the scheduler, which is in its process on one machine."""
    spec = write_spec(tmp_path)
    driver = begin(spec, "--workers", 2, slow=SLOW)
    in_the_middle(tmp_path)
    workers = workers_of(driver)
    kill(driver)
    driver.wait()
    assert workers
    # Workers end by themselves.
    wait_for(lambda: not any(worker.is_running() and worker.status() != "zombie" for worker in workers), 20)
    done_before = results(tmp_path / "out")
    assert 3 <= len(done_before) < CASES
    assert not (tmp_path / "out" / "sweep.parquet").exists()
    times = {path: path.stat().st_mtime_ns for path in done_before}
    again = sweep(spec, "--workers", 2)
    assert again.returncode == 0, again.stderr
    assert f"{CASES - len(done_before)} cases to do" in again.stderr
    assert {path: path.stat().st_mtime_ns for path in done_before} == times
    assert (tmp_path / "out" / "sweep.parquet").read_bytes() == undisturbed


def test_a_killed_worker_does_not_change_the_table(tmp_path, undisturbed):
    driver = begin(write_spec(tmp_path), "--workers", 2, slow=SLOW)
    in_the_middle(tmp_path)
    kill(workers_of(driver)[0])
    out, err = driver.communicate(timeout=60)
    assert driver.returncode == 0, err
    assert f"{CASES} cases, 0 failed" in out
    assert "Traceback" not in err
    assert (tmp_path / "out" / "sweep.parquet").read_bytes() == undisturbed


def test_a_case_that_kills_three_workers_becomes_a_row(tmp_path, undisturbed):
    spec = write_spec(tmp_path)
    done = sweep(spec, "--workers", 2, slow=0, DEADLY_ROW="5")
    assert done.returncode == 1, done.stderr
    assert f"{CASES} cases, 1 failed" in done.stdout
    rows = pq.read_table(tmp_path / "out" / "sweep.parquet").to_pylist()
    assert [row["row"] for row in rows if row["status"] == "failed"] == [5]
    assert rows[5]["error"].startswith("killed 3 workers that tried it")
    again = sweep(spec, "--workers", 2, "--retry-failed")
    assert again.returncode == 0, again.stderr
    assert (tmp_path / "out" / "sweep.parquet").read_bytes() == undisturbed


def start(folder, *words, slow=None):
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler" if words[0] == "scheduler" else
               "distributed.cli.dask_worker", *words[1:]]  # fmt: skip
    log = open(folder / f"{words[0]}.log", "a")  # noqa: SIM115  # The process keeps it.
    return subprocess.Popen(command, env=environment(folder, slow), stdout=log, stderr=log, cwd=folder)


def cluster(folder, slow):
    """A scheduler and two workers over TCP, as on several machines."""
    file = folder / "scheduler.json"
    file.unlink(missing_ok=True)
    words = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", file]
    scheduler = start(folder, "scheduler", *map(str, words))
    wait_for(lambda: file.exists() and file.read_text().strip().endswith("}"))
    address = re.search(r'"address": "([^"]+)"', file.read_text())[1]
    words = [address, "--nthreads", "1", "--nworkers", "1", "--no-dashboard", "--death-timeout", "10", "--no-nanny"]
    return address, scheduler, [start(folder, "worker", *words, slow=slow) for _ in range(2)]


def test_a_killed_scheduler_is_one_line_and_resumes(tmp_path, undisturbed):
    spec = write_spec(tmp_path)
    processes = []
    try:
        address, scheduler, workers = cluster(tmp_path, SLOW)
        processes += [scheduler, *workers]
        driver = begin(spec, "--scheduler", address)
        in_the_middle(tmp_path)
        kill(scheduler)
        begun = time.monotonic()
        _, err = driver.communicate(timeout=60)
        assert time.monotonic() - begun < 20
        assert driver.returncode == 2, err
        assert re.search(
            r"^sweep: the connection to the scheduler is lost \(\d+ of 12 cases are done; the same", err, re.M
        )
        assert "Traceback" not in err
        for worker in workers:
            kill(worker)
        address, scheduler, workers = cluster(tmp_path, 0)
        processes += [scheduler, *workers]
        again = sweep(spec, "--scheduler", address)
        assert again.returncode == 0, again.stderr
        assert (tmp_path / "out" / "sweep.parquet").read_bytes() == undisturbed
        # The cluster stays for the next sweep.
        assert all(process.poll() is None for process in (scheduler, *workers))
    finally:
        for process in processes:
            kill(process)
            process.wait()


def test_ctrl_c_ends_soon_and_resumes(tmp_path, undisturbed):
    spec = write_spec(tmp_path)
    driver = begin(spec, "--workers", 2, slow=SLOW, group=True)
    in_the_middle(tmp_path)
    workers = workers_of(driver)
    begun = time.monotonic()
    # A terminal interrupts the whole process group.
    os.killpg(driver.pid, signal.SIGINT)
    _, err = driver.communicate(timeout=30)
    assert time.monotonic() - begun < 5
    assert driver.returncode == 130
    assert err.strip().splitlines()[-1] == "sweep: stopped; the same command goes on with the rest"
    assert "Traceback" not in err
    assert not any(worker.is_running() for worker in workers)
    assert sweep(spec, "--workers", 2).returncode == 0
    assert (tmp_path / "out" / "sweep.parquet").read_bytes() == undisturbed


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 40 kB, with room for a part of the results."""
    place = tmp_path / "out"
    place.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=40k", "tmpfs", str(place)]
    mounted = subprocess.run(words, capture_output=True, text=True)
    if mounted.returncode != 0:
        needs.skip("mount", mounted.stderr.strip())
    yield place
    subprocess.run(["umount", str(place)], check=True)


def test_a_full_disk_is_one_line_and_resumes(tmp_path, small_disk, undisturbed):
    spec = write_spec(tmp_path)
    done = sweep(spec, "--workers", 2)
    assert done.returncode == 2, done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("sweep: ")]
    assert "cannot be written: No space left on device" in line
    assert "the same command goes on with the rest" in line
    assert "Traceback" not in done.stderr
    kept = results(small_disk)
    assert 0 < len(kept) < CASES
    assert not list(small_disk.glob("**/.*.part"))
    times = {path: path.stat().st_mtime_ns for path in kept}
    subprocess.run(["mount", "-o", "remount,size=8m", str(small_disk)], check=True)
    again = sweep(spec, "--workers", 2)
    assert again.returncode == 0, again.stderr
    assert {path: path.stat().st_mtime_ns for path in kept} == times
    assert (small_disk / "sweep.parquet").read_bytes() == undisturbed
