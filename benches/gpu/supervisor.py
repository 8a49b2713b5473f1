"""Runs each part in its own process with a time limit, and collects the results in one file."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from mitsuba_scenes.environment import REPOSITORY

from .checks import FAILED
from .parts import PARTS

# Parts that run without the kernel caches of Dr.Jit, OptiX and the CUDA driver: they measure or read compilations.
UNCACHED = ("renders", "inspection")
# Smallest remaining time in seconds at which a part starts. The start of a process alone takes a few seconds.
LEAST_S = 5.0


@dataclass(frozen=True)
class Run:
    """A run: command-line `flags` for every part, the folder for pictures, and the `deadline` by `time.monotonic`.

    `data` is the folder of data for the parts, in place of that in SUNBEAM_DATA.
    """

    flags: tuple[str, ...]
    pictures: Path
    deadline: float
    data: Path | None = None


def run_all(names: list[str], run: Run) -> dict[str, dict]:
    """Runs the parts; returns the result of each (`run_part`)."""
    run.pictures.mkdir(parents=True, exist_ok=True)
    results = {}
    for name in names:
        print(f"{name}: {PARTS[name].title}", flush=True)
        results[name] = run_part(name, run)
        result = results[name]
        error = f": {result['error']}" if result["error"] else ""
        print(f"{name} {result['status']} after {result['seconds']:.1f} s{error}\n", flush=True)
    return results


def run_part(name: str, run: Run) -> dict:
    """Runs one part and returns its result.

    `status` is `passed`, `failed` or `not run`. `error` is the reason why checks did not run or end, or `None`.
    `seconds` is the wall-clock time, and `rows` are the figures of the checks that ended.
    """
    left = run.deadline - time.monotonic()
    if left < LEAST_S:
        return {"status": "not run", "error": "the time of the run was up", "seconds": 0.0, "rows": []}
    limit_s = min(PARTS[name].limit_s, left)
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        # The process appends a line of JSON for each check to `rows`.
        rows, log = folder / "rows", folder / "log"
        rows.touch()
        start = time.monotonic()
        code = run_with_limit(child(name, run, rows), environment(name, folder, run.data), log, limit_s)
        seconds = round(time.monotonic() - start, 2)
        # A process that was killed may have left an unfinished line.
        lines = [json.loads(line) for line in rows.read_text(encoding="utf-8").split("\n")[:-1]]
        stderr = log.read_text(encoding="utf-8", errors="replace").strip()
    if stderr:
        print(stderr, file=sys.stderr, flush=True)
    # The process ends with FAILED if a check failed.
    error = None if code in (0, FAILED) else failure(code, limit_s, stderr)
    if code == 0 and not lines:
        error = "no check ran"
    passed = code == 0 and bool(lines)
    return {"status": "passed" if passed else "failed", "error": error, "seconds": seconds, "rows": lines}


def child(name: str, run: Run, rows: Path) -> list[str]:
    """The command line of a part's process, in which a crash prints the Python stack."""
    flags = [*run.flags, "--pictures", str(run.pictures), "--rows", str(rows)]
    return [sys.executable, "-X", "faulthandler", "-m", __package__, name, *flags]


def environment(name: str, folder: Path, data: Path | None) -> dict[str, str]:
    """The environment of a part's process, with the folder of data; parts in UNCACHED get empty kernel caches."""
    given = {} if data is None else {"SUNBEAM_DATA": str(data)}
    if name not in UNCACHED:
        return {**os.environ, **given}
    kernels, optix = folder / "kernels", folder / "optix"
    kernels.mkdir()
    optix.mkdir()
    empty = {"DRJIT_CACHE_DIR": str(kernels), "OPTIX_CACHE_PATH": str(optix), "CUDA_CACHE_DISABLE": "1"}
    return {**os.environ, **given, **empty}


def run_with_limit(command: list[str], variables: dict[str, str], log: Path, limit_s: float) -> int | None:
    """Runs a process with these environment variables, a time limit, and its standard error in the file `log`.

    Returns the exit status: negative after a signal, `None` at the limit. Ends the process's children in every case.
    """
    with log.open("wb") as stderr:
        process = subprocess.Popen(command, env=variables, cwd=REPOSITORY, stderr=stderr, start_new_session=True)
        try:
            return process.wait(timeout=limit_s)
        except subprocess.TimeoutExpired:
            return None
        finally:
            end_group(process)


def end_group(process: subprocess.Popen) -> None:
    """Kills the process, which leads a session, and its children."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        return
    process.wait()


def failure(code: int | None, limit_s: float, stderr: str) -> str:
    """The message for a process that crashed, exceeded its limit, or failed outside the checks."""
    if code is None:
        return f"ended at its limit of {limit_s:.0f} s"
    if code < 0:
        return f"ended by {signal.Signals(-code).name}"
    return stderr.splitlines()[-1] if stderr else f"exit status {code}"


def gathered(results: dict[str, dict], machine: dict, file: Path) -> dict:
    """The description of the machine and the results by part, as `{"machine": …, "parts": …}`.

    They are merged with those in `file` if these are from the same card or this machine has no card. A machine without
    a card only adds comparisons of the card's pictures, so the description of the card's machine stays.
    """
    if not file.exists():
        return {"machine": machine, "parts": results}
    before = json.loads(file.read_text(encoding="utf-8"))
    if machine["card"] not in (None, before["machine"]["card"]):
        return {"machine": machine, "parts": results}
    kept = before["machine"] if machine["card"] is None else machine
    return {"machine": kept, "parts": {**before["parts"], **results}}


def write(results: dict, file: Path) -> None:
    """Writes the results as JSON. The file is replaced in one step, so an interrupted run leaves the old file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    new = file.with_suffix(".new")
    new.write_text(json.dumps(results, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    new.replace(file)
