"""The part `sweeps-scale`: overhead of sweeps, and a simulation of many workers by the measured costs."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from mitsuba_scenes.environment import REPOSITORY, SetupError

from .page import insist
from .speed_error import processor
from .sweeps_simulation import Costs, Storage, simulate

PART = "sweeps-scale"
# Folder of the Python package.
PACKAGE = REPOSITORY / "python"
# Number of cases that take a second each.
CASES = 60
# Number of cases that compute almost nothing.
TRIVIAL = 100_000
# Number of cases of a finished sweep that runs again.
FINISHED = 10_000
# Number of cases in batches of one each, from which the cost of a batch follows.
BATCHES = 1000
# Numbers of workers in the simulation.
WORKERS = (10, 100, 1000)
# Number of surfaces in the simulation.
SURFACES = 100_000
# Assumed shared file systems, with round numbers for fast and slow ones.
STORAGES = (
    Storage("2000 files/s", 2000.0),
    Storage("200 files/s", 200.0),
    Storage("2000 files/s, with the cache at 100 MB/s", 2000.0, 1e8),
)
# Largest accepted overhead relative to a plain loop.
OVERHEAD_MAX = 0.05
# Smallest accepted speed-up of two workers.
SPEED_UP_MIN = 1.8
# Largest accepted memory of the process with driver and scheduler.
MEMORY_MAX_GB = 2.0
# Largest accepted time of the second run of a finished sweep.
RESUME_MAX_SECONDS = 10.0
# Specification of the sweeps.
SPEC = """
output = "out"
[[surface]]
preset = "blazed"
[settings]
coherence_length = 10
conserve_energy = false
tolerance = 0.01
obliquity = "stam"
theta_i_deg = {{ from = 0, to = 80, count = {count} }}
[want.{want}]
{options}
"""
# A map that takes about a second on one core.
MAP = {"want": "map", "options": "size = 256\nlambda_step_nm = 2.5"}
# A figure that takes almost no time.
NOTHING = {"want": "colour", "options": "samples = 16\ngamut = false\nlambda_step_nm = 20"}
# Script for a separate process: the costs of the parts of a case, in seconds and bytes.
PARTS = """
import json, pickle, sys, time
from pathlib import Path
from sunbeam_mitsuba.sweep.spec import read_spec
from sunbeam_mitsuba.sweep.store import read_result, write_result
from sunbeam_mitsuba.sweep.tables import HeldSurfaces
from sunbeam_mitsuba.sweep.work import Done, Job, compute, version

spec = read_spec(sys.argv[1])
job, cases, held = Job(spec.output, spec.folder, spec.wants, version()), list(spec.cases(version())), HeldSurfaces(0.0)
compute(job, cases[0], held)
start = time.perf_counter()
made = [compute(job, case, held) for case in cases]
computed = time.perf_counter()
for record, pictures in made:
    write_result(spec.output, record, pictures)
written = time.perf_counter()
for case in cases:
    assert read_result(spec.output, case.identity)
read = time.perf_counter()
size = sum(path.stat().st_size for path in spec.output.rglob("*") if path.is_file())
print(json.dumps({
    "loop_seconds": computed - start,
    "compute_seconds": (computed - start) / len(cases),
    "write_seconds": (written - computed) / len(cases),
    "read_seconds": (read - written) / len(cases),
    "case_bytes": size / len(cases),
    "batch_bytes": len(pickle.dumps((job, []))),
    "request_bytes": len(pickle.dumps(cases)) / len(cases),
    "answer_bytes": len(pickle.dumps(Done({case.identity: False for case in cases}, 1.0))) / len(cases),
}))
"""
TABLES = """
import json, sys, time
from sunbeam_mitsuba.sweep.tables import HeldSurfaces
rows = []
for name, parameters in json.loads(sys.argv[1]):
    seconds = []
    for _ in range(2):
        held = HeldSurfaces(0.0)
        start = time.perf_counter()
        made = held.get(parameters)
        seconds.append(time.perf_counter() - start)
    rows.append({"name": name, "build_seconds": seconds[0], "cache_seconds": seconds[1], "bytes": made.table_bytes})
print(json.dumps(rows))
"""
RELIEFS = [
    ["blazed, conserving energy", {"preset": "blazed", "eta": 1.56}],
    ["xenopeltis (procedural), 20 µm", {"preset": "xenopeltis", "eta": 1.56, "coherence_length": 20.0}],
]


def figures() -> dict:
    """All measured costs, and the simulation."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        load_before = os.getloadavg()[0]
        waited = {workers: sweep(folder / f"wait{workers}", CASES, NOTHING, workers, 1.0) for workers in (1, 2)}
        nearly = sweep(folder / "one", 1, NOTHING, 1, 0.0)
        finished = sweep(folder / "finished", FINISHED, NOTHING, 2, 0.0)
        resumed = sweep(folder / "finished", FINISHED, NOTHING, 2, 0.0)
        trivial = sweep(folder / "trivial", TRIVIAL, NOTHING, 2, 0.0)
        trivial_again = sweep(folder / "trivial", TRIVIAL, NOTHING, 2, 0.0)
        empty = sweep(folder / "empty", BATCHES, NOTHING, 1, 0.0, batch=1)
        parts = asked(PARTS, write_spec(folder / "parts", CASES, MAP), env=environment())
        mapped = {workers: sweep(folder / f"map{workers}", CASES, MAP, workers) for workers in (1, 2)}
        small = asked(PARTS, write_spec(folder / "small", 500, NOTHING), env=environment())
        cache = environment(SUNBEAM_CACHE_DIR=str(folder / "cache"))
        tables = asked(TABLES, json.dumps(RELIEFS), env=cache)
    batch_seconds = (empty["seconds"] - nearly["seconds"]) / BATCHES
    costs = Costs(
        batch_seconds=batch_seconds,
        case_seconds=5.0,
        write_seconds=small["write_seconds"],
        result_bytes=small["case_bytes"],
        table_bytes=tables[1]["bytes"],
    )
    made = {
        "processor": processor(),
        "load_before": load_before,
        "load_after": os.getloadavg()[0],
        "cases": CASES,
        "waiting": [row(workers, run, float(CASES), waited[1]) for workers, run in waited.items()],
        "maps": [row(workers, run, parts["loop_seconds"], mapped[1]) for workers, run in mapped.items()],
        "start_seconds": nearly["seconds"],
        "parts": parts,
        "small": small,
        "batch_seconds": batch_seconds,
        "tables": tables,
        "finished": {"cases": FINISHED, "first": finished, "again": resumed},
        "trivial": {"cases": TRIVIAL, "first": trivial, "again": trivial_again},
        "surfaces": SURFACES,
        "simulated": [simulate(costs, SURFACES, workers, storage) for workers in WORKERS for storage in STORAGES],
        "case_seconds": costs.case_seconds,
    }
    check(made)
    return made


def row(workers: int, run: dict, loop_seconds: float, one: dict) -> dict:
    """A row: a sweep against the plain loop over its cases."""
    return {
        "workers": workers,
        **run,
        "loop_seconds": loop_seconds,
        "overhead": run["seconds"] * workers / loop_seconds - 1,
        "speed_up": one["seconds"] / run["seconds"],
    }


def check(made: dict) -> None:
    """Raises an error where a bound is exceeded; bounds of computing need an idle machine."""
    one, two = made["waiting"]
    insist(PART, one["overhead"] <= OVERHEAD_MAX, "a sweep takes at most 5 % more than a plain loop")
    insist(PART, two["speed_up"] >= SPEED_UP_MIN, "two workers are 1.8 times as fast")
    for run in (made["trivial"]["first"], made["trivial"]["again"]):
        insist(PART, run["memory_gb"] < MEMORY_MAX_GB, "the scheduler keeps to 2 GB")
    again = made["finished"]["again"]["seconds"]
    insist(PART, again <= RESUME_MAX_SECONDS, "a finished sweep of ten thousand ends within 10 s")


def environment(**more: str) -> dict[str, str]:
    """The environment of a process with one thread, like a worker."""
    return {**os.environ, "PYTHONPATH": f"{PACKAGE}{os.pathsep}{REPOSITORY}", "RAYON_NUM_THREADS": "1", **more}


def write_spec(folder: Path, count: int, want: dict) -> Path:
    """Writes the specification of a sweep with `count` cases."""
    folder.mkdir(exist_ok=True)
    path = folder / "spec.toml"
    path.write_text(SPEC.format(count=max(count, 2), **want))
    if count == 1:
        path.write_text(re.sub(r"theta_i_deg = .*", "theta_i_deg = 0", path.read_text()))
    return path


def asked(script: str, *words: object, env: dict[str, str]) -> dict:
    """The JSON output of a script."""
    done = subprocess.run([sys.executable, "-c", script, *map(str, words)], env=env, capture_output=True, text=True)
    if done.returncode != 0:
        raise SetupError(f"a measurement of sweeps failed: {(done.stderr.strip().splitlines() or ['?'])[-1]}")
    return json.loads(done.stdout)


def sweep(
    folder: Path, count: int, want: dict, workers: int, wait_seconds: float | None = None, batch: int | None = None
) -> dict:
    """Runs a sweep; returns its seconds and the largest memory of the process with driver and scheduler."""
    spec = write_spec(folder, count, want)
    variables = {}
    if wait_seconds is not None:
        preload = Path(__file__).with_name("sweeps_waiting.py")
        variables = {
            "DASK_DISTRIBUTED__WORKER__PRELOAD": json.dumps([str(preload)]),
            "SUNBEAM_SWEEP_WAIT_SECONDS": str(wait_seconds),
        }
    limit = f"import sunbeam_mitsuba.sweep.drive as d; d.BATCH_CASES_MAX = {batch or 'd.BATCH_CASES_MAX'}; "
    code = (
        limit
        + "import sys; from sunbeam_mitsuba.sweep.command_line import main; sys.argv[0] = 'sweep'; code = main(); "
        + "import resource; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss); sys.exit(code)"
    )
    # Spawned workers import the main module, so it must be a file.
    program = folder / "program.py"
    program.write_text(f'if __name__ == "__main__":\n    exec({code!r})\n')
    start = time.perf_counter()
    words = [sys.executable, str(program), str(spec), "--workers", str(workers)]
    done = subprocess.run(words, env=environment(**variables), capture_output=True, text=True)
    seconds = time.perf_counter() - start
    if done.returncode != 0:
        raise SetupError(f"a measured sweep failed: {(done.stderr.strip().splitlines() or ['?'])[-1]}")
    print(f"{folder.name}: {count} cases, {workers} workers, {seconds:.1f} s", flush=True)
    return {"seconds": seconds, "memory_gb": int(done.stdout.splitlines()[-1]) * 1024 / 1e9}
