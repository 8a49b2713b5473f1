"""Calls of a BSDF without OptiX, the library by which Mitsuba's CUDA variants trace rays.

The calls must work. A render without OptiX is tried, too, and its result or error message is reported.
`python -m benches.gpu.without_optix VARIANT` is the process without OptiX; it prints a line of JSON for each step.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from mitsuba_scenes.environment import REPOSITORY

from .parts import Check
from .plan import Plan

# Environment variable with the path of the OptiX library for Dr.Jit.
OPTIX_VARIABLE = "DRJIT_LIBOPTIX_PATH"
# A path at which there is no library.
MISSING_LIBRARY = "/nonexistent/libnvoptix.so.1"


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """The only check."""
    yield plan.variant("rgb"), partial(run_without_optix, plan.variant("rgb"))


def run_without_optix(variant: str) -> dict:
    """Runs the process without OptiX; `passed` is whether the calls work, however the render ends.

    Returns `value`, the sum of the BSDF's values if the calls work, and `render`, the result of the render or the
    error message with which the process ended.
    """
    child = [sys.executable, "-m", __name__, variant]
    # Without a timeout: at the time limit of the part, supervisor.py ends this process and its child.
    environment = {**os.environ, OPTIX_VARIABLE: MISSING_LIBRARY}
    done = subprocess.run(child, env=environment, cwd=REPOSITORY, capture_output=True, text=True)
    steps = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    found = {key: value for step in steps for key, value in step.items()}
    if "render" not in found:
        lines = done.stderr.strip().splitlines()
        found["render"] = f"{exit_text(done.returncode)}: {lines[-1] if lines else 'no message'}"
    return {"passed": found.get("value", 0) > 0, **found}


def exit_text(code: int) -> str:
    """A message for an exit status."""
    return f"ended by {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"


def main(variant: str) -> None:
    """The process without OptiX: calls a BSDF, then renders a scene, which needs OptiX."""
    import drjit as dr
    import mitsuba as mi
    import numpy as np

    from .questions import ask, drawn
    from .scenes import ball, picture
    from .variants import use

    use(variant)
    bsdf = mi.load_dict({"type": "diffraction", "preset": "blazed"})
    answered = ask(bsdf, drawn(np.random.default_rng(1), 64))
    dr.sync_thread()
    print(json.dumps({"value": float(answered.value.sum())}), flush=True)
    try:
        brightness = float(picture(ball(bsdf)).mean())
        print(json.dumps({"render": f"works, mean {brightness:.3g}"}))
    except Exception as error:
        print(json.dumps({"render": f"{type(error).__name__}: {' '.join(str(error).split())}"}))


if __name__ == "__main__":
    main(sys.argv[1])
