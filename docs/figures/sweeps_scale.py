"""Part `sweeps-scale` of the documentation (page.py): overhead of sweeps, and a simulation of many workers.

A *sweep* computes many cases in parallel and stores their results (docs/sweeps.md). A *case* is a surface in one
setting, here an angle of incidence. The *driver* sends cases to workers in batches, through the scheduler of Dask.

Sweeps run as users run them, in processes of their own. They are compared with a plain loop over the same cases in one
process. Scripts in other processes measure what the steps of a case cost: computing, writing and reading its result.
These costs are the input of the simulation (sweeps_simulation.py).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mitsuba_scenes.environment import REPOSITORY, SetupError

from .page import insist
from .speed_error import processor
from .sweeps_simulation import Costs, Storage, simulate

PART = "sweeps-scale"
# Folder that holds the Python package.
PACKAGE = REPOSITORY / "python"
# Number of cases of the sweeps that are compared with plain loops. Each case takes about a second.
CASES = 60
# Number of cases of the sweep that measures the scheduler's memory. Its cases compute nothing.
TRIVIAL = 100_000
# Number of cases of the finished sweep that runs again. Its cases compute nothing.
FINISHED = 10_000
# Number of cases of the sweep whose batches have one case each, from which the cost of a batch follows. They compute
# nothing.
BATCHES = 1000
# Number of cases in the loop that measures the costs of results without pictures.
SMALL_CASES = 500
# Numbers of workers in the simulation.
WORKERS = (10, 100, 1000)
# Number of cases in the simulation, each with its own surface.
SURFACES = 100_000
# Assumed time of a worker for a case of the simulation, with its tables.
CASE_SECONDS = 5.0
# Assumed shared file systems: a fast one, a slow one, and a fast one that also has the cache of tables (in bytes/s).
STORAGES = (
    Storage("2000 files/s", 2000.0),
    Storage("200 files/s", 200.0),
    Storage("2000 files/s, with the cache at 100 MB/s", 2000.0, 1e8),
)
# The following four bounds are those that sentences of the page state (`check`).
#
# Largest accepted overhead relative to a plain loop.
OVERHEAD_MAX = 0.05
# Smallest accepted speed-up of two workers.
SPEED_UP_MIN = 1.8
# Largest accepted memory of the process with driver and scheduler.
MEMORY_MAX_GB = 2.0
# Largest accepted time of the second run of a finished sweep.
RESUME_MAX_SECONDS = 10.0
# Specification of the sweeps, for `str.format`. Its table [want.…] names the quantity to compute.
SPEC = """
output = "out"
[[surface]]
preset = "blazed"
[settings]
coherence_length = 10
conserve_energy = false
tolerance = 0.01
obliquity = "stam"
theta_i_deg = {theta_i_deg}
[want.{want}]
{options}
"""
# Fields of SPEC for a map, which takes about a second on one core.
MAP = {"want": "map", "options": "size = 256\nlambda_step_nm = 2.5"}
# Fields of SPEC for a colour, which takes almost no time.
COLOUR = {"want": "colour", "options": "samples = 16\ngamut = false\nlambda_step_nm = 20"}
# Main program of a measured sweep, for `str.format`. After the sweep it prints its process's largest memory in KiB.
# Spawned workers import the main program, so it is a file and does nothing when imported. `batch_cases` replaces the
# driver's limit of the cases in a batch; None keeps the driver's.
PROGRAM = """
if __name__ == "__main__":
    import resource
    import sys

    import sunbeam_mitsuba.sweep.drive as drive
    from sunbeam_mitsuba.sweep.command_line import main

    drive.BATCH_CASES_MAX = {batch_cases} or drive.BATCH_CASES_MAX
    sys.argv[0] = "sweep"
    code = main()
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    sys.exit(code)
"""
# Script that runs a specification's cases in a plain loop; prints the costs of a case's steps in seconds and bytes.
# Messages between driver and worker have the sizes of their pickled contents. HeldSurfaces keeps surfaces by their
# parameters; its argument 0 means no limit of memory. Done is a worker's answer to a batch: whether each case failed,
# and the seconds that the batch took.
CASE_COSTS = """
import json, pickle, sys, time
from sunbeam_mitsuba.sweep.spec import read_spec
from sunbeam_mitsuba.sweep.store import read_result, write_result
from sunbeam_mitsuba.sweep.tables import HeldSurfaces
from sunbeam_mitsuba.sweep.work import Done, Job, compute, version

spec = read_spec(sys.argv[1])
job, cases, held = Job(spec.output, spec.folder, spec.wants, version()), list(spec.cases(version())), HeldSurfaces(0.0)
# The first case builds the tables.
compute(job, cases[0], held)
start = time.perf_counter()
results = [compute(job, case, held) for case in cases]
computed = time.perf_counter()
for record, pictures in results:
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
# Script that gets the tables of reliefs twice, each time into an empty HeldSurfaces. Prints the seconds to build them
# and to read them from the disk cache.
TABLE_COSTS = """
import json, sys, time
from sunbeam_mitsuba.sweep.tables import HeldSurfaces
rows = []
for name, parameters in json.loads(sys.argv[1]):
    seconds = []
    for _ in range(2):
        held = HeldSurfaces(0.0)
        start = time.perf_counter()
        surface = held.get(parameters)
        seconds.append(time.perf_counter() - start)
    rows.append({"name": name, "build_seconds": seconds[0], "cache_seconds": seconds[1], "bytes": surface.table_bytes})
print(json.dumps(rows))
"""
# Names and parameters of the reliefs of TABLE_COSTS.
RELIEFS = [
    ["blazed, conserving energy", {"preset": "blazed", "eta": 1.56}],
    ["xenopeltis (procedural), 20 µm", {"preset": "xenopeltis", "eta": 1.56, "coherence_length": 20.0}],
]


def figures() -> dict:
    """All measured costs, and the simulation. Raises SetupError if a bound is exceeded.

    - `waiting`, `maps`: sweeps by 1 and 2 workers against plain loops, over cases that wait and over maps.
    - `parts`, `small`: the costs of cases with and without pictures, by CASE_COSTS.
    - `tables`: the costs of tables, by TABLE_COSTS.
    - `finished`, `trivial`: large sweeps that run twice.
    - `start_seconds`, `batch_seconds`: the fixed cost of a sweep, and that of a batch.
    - `load_before`, `load_after`: the machine's load average of one minute before and after the measurements.
    """
    load_before = os.getloadavg()[0]
    with TemporaryDirectory() as temporary:
        runs = sweeps(Path(temporary))
        parts, small, tables = case_and_table_costs(Path(temporary))
    waiting, maps, finished, trivial = (runs[name] for name in ("waiting", "maps", "finished", "trivial"))
    start_seconds = runs["single"]["seconds"]
    # The sweep of a single case, which computes nothing, takes the fixed time of any sweep.
    batch_seconds = (runs["batches"]["seconds"] - start_seconds) / BATCHES
    costs = Costs(
        batch_seconds=batch_seconds,
        case_seconds=CASE_SECONDS,
        write_seconds=small["write_seconds"],
        result_bytes=small["case_bytes"],
        # The last of RELIEFS, a skin, has the larger tables.
        table_bytes=tables[-1]["bytes"],
    )
    made = {
        "processor": processor(),
        "load_before": load_before,
        "load_after": os.getloadavg()[0],
        "cases": CASES,
        # A waiting case takes 1 s, so a loop over them takes CASES seconds. Keys of `waiting` and `maps` are numbers of
        # workers.
        "waiting": [row(workers, run, float(CASES), waiting[1]) for workers, run in waiting.items()],
        "maps": [row(workers, run, parts["loop_seconds"], maps[1]) for workers, run in maps.items()],
        "start_seconds": start_seconds,
        "parts": parts,
        "small": small,
        "batch_seconds": batch_seconds,
        "tables": tables,
        "finished": {"cases": FINISHED, "first": finished[0], "again": finished[1]},
        "trivial": {"cases": TRIVIAL, "first": trivial[0], "again": trivial[1]},
        "surfaces": SURFACES,
        "simulated": [simulate(costs, SURFACES, workers, storage) for workers in WORKERS for storage in STORAGES],
        "case_seconds": costs.case_seconds,
    }
    check(made)
    return made


def sweeps(folder: Path) -> dict:
    """The results of `sweep` for all measured sweeps, which run in subfolders of `folder`.

    `waiting` and `maps` are by number of workers. `finished` and `trivial` have the first and the second run. `single`
    has one case, and `batches` has batches of one.
    """
    return {
        "waiting": {
            workers: sweep(folder / f"wait{workers}", CASES, COLOUR, workers, wait_seconds=1.0) for workers in (1, 2)
        },
        "single": sweep(folder / "one", 1, COLOUR, 1, wait_seconds=0.0),
        **{
            # The second run of a sweep in the same folder finds all results.
            name: [sweep(folder / name, count, COLOUR, 2, wait_seconds=0.0) for _ in range(2)]
            for name, count in (("finished", FINISHED), ("trivial", TRIVIAL))
        },
        "batches": sweep(folder / "empty", BATCHES, COLOUR, 1, wait_seconds=0.0, batch_cases=1),
        "maps": {workers: sweep(folder / f"map{workers}", CASES, MAP, workers) for workers in (1, 2)},
    }


def case_and_table_costs(folder: Path) -> tuple[dict, dict, list[dict]]:
    """The results of CASE_COSTS for maps and for colours, and those of TABLE_COSTS."""
    parts = run_script(CASE_COSTS, write_spec(folder / "parts", CASES, MAP), env=environment())
    small = run_script(CASE_COSTS, write_spec(folder / "small", SMALL_CASES, COLOUR), env=environment())
    cache = environment(SUNBEAM_CACHE_DIR=str(folder / "cache"))
    return parts, small, run_script(TABLE_COSTS, json.dumps(RELIEFS), env=cache)


def row(workers: int, run: dict, loop_seconds: float, by_one: dict) -> dict:
    """A sweep's `run` with these `workers` against the plain loop over its cases, and against `by_one`.

    `by_one` is the run with one worker. `overhead` is the total time of the workers over the loop's, minus 1.
    `speed_up` is the time with one worker over that of this run.
    """
    return {
        "workers": workers,
        **run,
        "loop_seconds": loop_seconds,
        "overhead": run["seconds"] * workers / loop_seconds - 1,
        "speed_up": by_one["seconds"] / run["seconds"],
    }


def check(made: dict) -> None:
    """Raises SetupError if a bound is exceeded. Bounds on times need an idle machine."""
    one, two = made["waiting"]
    insist(PART, one["overhead"] <= OVERHEAD_MAX, "a sweep takes at most 5 % more than a plain loop")
    insist(PART, two["speed_up"] >= SPEED_UP_MIN, "two workers are 1.8 times as fast")
    for run in (made["trivial"]["first"], made["trivial"]["again"]):
        insist(PART, run["memory_gb"] < MEMORY_MAX_GB, "the scheduler keeps to 2 GB")
    # The second run finds all results.
    again = made["finished"]["again"]["seconds"]
    insist(PART, again <= RESUME_MAX_SECONDS, "a finished sweep of ten thousand ends within 10 s")


def environment(**more: str) -> dict[str, str]:
    """Environment variables of a process that computes with one thread, like a worker, and the variables `more`.

    The process finds the checkout's Python packages.
    """
    return {**os.environ, "PYTHONPATH": f"{PACKAGE}{os.pathsep}{REPOSITORY}", "RAYON_NUM_THREADS": "1", **more}


def write_spec(folder: Path, count: int, want: dict) -> Path:
    """Writes the specification of a sweep with `count` cases of MAP or COLOUR into `folder`, which may exist."""
    folder.mkdir(exist_ok=True)
    path = folder / "spec.toml"
    theta_i_deg = "0" if count == 1 else f"{{ from = 0, to = 80, count = {count} }}"
    path.write_text(SPEC.format(theta_i_deg=theta_i_deg, **want))
    return path


def run_script(script: str, *arguments: object, env: dict[str, str]) -> Any:
    """The JSON output of a Python script with these `arguments`."""
    done = subprocess.run([sys.executable, "-c", script, *map(str, arguments)], env=env, capture_output=True, text=True)
    if done.returncode != 0:
        raise SetupError(f"a measurement of sweeps failed: {last_line(done.stderr)}")
    return json.loads(done.stdout)


def last_line(stderr: str) -> str:
    """The last line of a process's error output, or "?" without output."""
    return (stderr.strip().splitlines() or ["?"])[-1]


def sweep(
    folder: Path,
    count: int,
    want: dict,
    workers: int,
    wait_seconds: float | None = None,
    batch_cases: int | None = None,
) -> dict:
    """Runs a sweep in `folder`; returns its seconds and the largest memory of the process with driver and scheduler.

    With `wait_seconds` cases wait instead of computing (sweeps_waiting.py): at 0 they do nothing, and `None` computes
    them. `batch_cases` limits the cases of a batch; `None` keeps the driver's limit.
    """
    spec = write_spec(folder, count, want)
    variables = {}
    if wait_seconds is not None:
        preload = Path(__file__).with_name("sweeps_waiting.py")
        variables = {
            "DASK_DISTRIBUTED__WORKER__PRELOAD": json.dumps([str(preload)]),
            "SUNBEAM_SWEEP_WAIT_SECONDS": str(wait_seconds),
        }
    program = folder / "program.py"
    program.write_text(PROGRAM.format(batch_cases=batch_cases))
    start = time.perf_counter()
    arguments = [sys.executable, str(program), str(spec), "--workers", str(workers)]
    done = subprocess.run(arguments, env=environment(**variables), capture_output=True, text=True)
    seconds = time.perf_counter() - start
    if done.returncode != 0:
        raise SetupError(f"a measured sweep failed: {last_line(done.stderr)}")
    print(f"{folder.name}: {count} cases, {workers} workers, {seconds:.1f} s", flush=True)
    memory_kib = int(done.stdout.splitlines()[-1])
    return {"seconds": seconds, "memory_gb": memory_kib * 1024 / 1e9}
