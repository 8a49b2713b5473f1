"""Runs each part in its own process with a time limit, and collects the results in one file."""

from __future__ import annotations

import json
import os
import shutil
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
# Smallest remaining time in seconds at which a part starts. Chosen: a process alone takes seconds to start.
LEAST_S = 5.0


@dataclass(frozen=True)
class Run:
    """A run: command-line `flags` for every part, the folder for pictures, and the `deadline` by `time.monotonic`."""

    flags: tuple[str, ...]
    pictures: Path
    deadline: float


def run_all(names: list[str], run: Run) -> dict[str, dict]:
    """Runs the parts. A result has the `status` `passed`, `failed` or `not run`, and the `rows` of its checks."""
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
    """Runs one part and returns its result."""
    left = run.deadline - time.monotonic()
    if left < LEAST_S:
        return {"status": "not run", "error": "the time of the run was up", "seconds": 0.0, "rows": []}
    limit = min(PARTS[name].limit_s, left)
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        rows, log = folder / "rows", folder / "log"
        rows.touch()
        start = time.monotonic()
        code = run_with_limit(child(name, run, rows), environment(name, folder), log, limit)
        seconds = round(time.monotonic() - start, 2)
        lines = [json.loads(line) for line in rows.read_text(encoding="utf-8").splitlines()]
        stderr = log.read_text(encoding="utf-8", errors="replace").strip()
    if stderr:
        print(stderr, file=sys.stderr, flush=True)
    error = None if code in (0, FAILED) else failure(code, limit, stderr)
    passed = code == 0 and bool(lines)
    return {"status": "passed" if passed else "failed", "error": error, "seconds": seconds, "rows": lines}


def child(name: str, run: Run, rows: Path) -> list[str]:
    """The command line of a part's process."""
    flags = [*run.flags, "--pictures", str(run.pictures), "--rows", str(rows)]
    return [sys.executable, "-X", "faulthandler", "-m", __package__, name, *flags]


def environment(name: str, folder: Path) -> dict[str, str]:
    """The environment of a part's process; parts in UNCACHED get empty kernel caches."""
    caches = {
        "DRJIT_CACHE_DIR": str(folder / "kernels"),
        "OPTIX_CACHE_PATH": str(folder / "optix"),
        "CUDA_CACHE_DISABLE": "1",
    }
    if name not in UNCACHED:
        return dict(os.environ)
    for cache in ("kernels", "optix"):
        (folder / cache).mkdir()
    return {**os.environ, **caches}


def run_with_limit(words: list[str], environment: dict[str, str], log: Path, limit: float) -> int | None:
    """Runs a process with a time limit and returns its exit status, negative for a signal, `None` at the limit."""
    with log.open("wb") as stderr:
        process = subprocess.Popen(words, env=environment, cwd=REPOSITORY, stderr=stderr, start_new_session=True)
        try:
            return process.wait(timeout=limit)
        except subprocess.TimeoutExpired:
            return None
        finally:
            end_group(process)


def end_group(process: subprocess.Popen) -> None:
    """Kills a session leader and its children."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        return
    process.wait()


def failure(code: int | None, limit: float, stderr: str) -> str:
    """A message for a process that ended without a result."""
    if code is None:
        return f"ended at its limit of {limit:.0f} s"
    if code < 0:
        return f"ended by {signal.Signals(-code).name}"
    return stderr.splitlines()[-1] if stderr else f"exit status {code}"


def gathered(results: dict[str, dict], machine: dict, file: Path) -> dict:
    """The results, merged with those in `file` if these are from the same card or this machine has no card.

    A machine without a card only adds comparisons of the card's pictures, so the description of the card's machine
    stays.
    """
    before = json.loads(file.read_text(encoding="utf-8")) if file.exists() else None
    if before is None or not (machine["card"] is None or before["machine"]["card"] == machine["card"]):
        return {"machine": machine, "parts": results}
    kept = before["machine"] if machine["card"] is None else machine
    return {"machine": kept, "parts": {**before["parts"], **results}}


def write(results: dict, file: Path) -> None:
    """Replaces the file in one step, so that an interrupted run leaves the old file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    new = file.with_suffix(".new")
    new.write_text(json.dumps(results, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    shutil.move(new, file)
