"""Helpers of the tests of sweeps: quick specifications, and the command line in its own process."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
# Settings whose tables take some milliseconds.
QUICK = 'coherence_length = 10\nconserve_energy = false\ntolerance = 0.01\nobliquity = "stam"\n'
# Twelve cases of six surfaces.
SPEC = f"""
output = "out"

[[surface]]
preset = "blazed"
period = {{ from = 1.0, to = 2.0, count = 6 }}

[settings]
theta_i_deg = [0, 30]
{QUICK}
[want.colour]
samples = 64
gamut = false
"""
# Module that workers of Dask load first. By environment variables it makes each case slower by CASE_SECONDS, and kills
# the worker at the case of the row DEADLY_ROW.
SLOW = """
import os, signal, time
from sunbeam_mitsuba.sweep import work
def compute(job, case, held, computed=work.compute):
    if os.environ.get("DEADLY_ROW") == str(case.row):
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(float(os.environ.get("CASE_SECONDS", "0")))
    return computed(job, case, held)
# A worker may run this more than once; only the first run replaces the function.
if work.compute.__module__ == work.__name__:
    work.compute = compute
"""


def environment(folder, slow=None, **more):
    """Environment of a process that uses the checkout's package; each case takes `slow` seconds longer.

    `more` are further variables. Unless `slow` is None, SLOW is written to `folder` and loaded; only then DEADLY_ROW
    among `more` has an effect.
    """
    found = {
        **os.environ,
        "PYTHONPATH": str(REPOSITORY / "python"),
        "SUNBEAM_COMMAND": str(REPOSITORY / "target" / "release" / "sunbeam"),
        **more,
    }
    if slow is not None:
        preload = folder / "slow.py"
        preload.write_text(SLOW)
        found["DASK_DISTRIBUTED__WORKER__PRELOAD"] = json.dumps([str(preload)])
        found["CASE_SECONDS"] = str(slow)
    return found


def write_spec(folder, text=SPEC):
    """Writes a specification to `folder`; returns the file's path."""
    path = folder / "spec.toml"
    path.write_text(text)
    return path


def words(spec, *more):
    """The command line of a sweep with the further arguments `more`."""
    return [sys.executable, "-m", "sunbeam_mitsuba.sweep", str(spec), *map(str, more)]


def sweep(spec, *more, slow=None, **variables):
    """Runs a sweep to its end, with further arguments `more` and environment `variables`."""
    env = environment(spec.parent, slow, **variables)
    return subprocess.run(words(spec, *more), env=env, capture_output=True, text=True, timeout=300)


def begin(spec, *more, slow=None, group=False, **variables):
    """Begins a sweep in the background; with `group` in its own process group, for an interrupt as by a terminal."""
    env = environment(spec.parent, slow, **variables)
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(
        words(spec, *more), env=env, start_new_session=group, preexec_fn=heeding_interrupts, **pipes
    )


def heeding_interrupts():
    """Lets SIGINT end the process. Tests started in the background may ignore it, which children inherit."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def results(folder):
    """Files of the results that a sweep has stored in its output `folder`."""
    return sorted(folder.glob("results/*/*.json"))


def wait_for(condition, seconds=60):
    """Waits until the condition is true and returns its value."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(0.02)
    raise AssertionError(f"not within {seconds} s")


def one_line(done, code=2):
    """Checks that a sweep failed with a single line, and returns it."""
    assert done.returncode == code, done.stderr
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("sweep: ")
    return line
