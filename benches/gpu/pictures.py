"""Maps and pictures of the realtime renderer on the card, compared with the CPU and with the software adapter.

BRDF maps are compared with those of the methods in Rust, pictures of the snake with those of the software adapter.
The card's pictures are kept: if its machine has no software adapter, `--compare` compares them on another machine.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from mitsuba_scenes.crosscheck.realtime import surface_words
from mitsuba_scenes.environment import SetupError
from mitsuba_scenes.tool import sunbeam

from .parts import Check
from .plan import Plan

# Largest accepted median of CIEDE2000 over the surface's pixels: a tenth of a just noticeable difference, which is
# about 1. Rounding in single precision stays below it.
MEDIAN_MAX = 0.1
# Largest accepted 99th percentile of CIEDE2000, a just noticeable difference. It is larger than MEDIAN_MAX, because at
# silhouettes a pixel's centre may fall on another triangle.
P99_MAX = 1.0
# Rotation of the relief for the negative control, a comparison that must fail.
WRONG_TURN_DEG = 1.0
# Direction to the light of the maps: polar angle and azimuth, in degrees.
INCIDENCE = ("--theta-i", "30", "--phi-i", "20")


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """Yields a comparison of pictures per method; before them, if `plan.draws`, maps and a negative control."""
    if plan.draws:
        for method in plan.methods:
            yield f"{method}, map beside the CPU", partial(map_beside_cpu, plan, folder, method)
        yield "a turned picture is told apart", partial(turned, plan, folder)
    for method in plan.methods:
        yield f"{method}, picture beside software", partial(picture_beside_software, plan, folder, method)


def map_beside_cpu(plan: Plan, folder: Path, method: str) -> dict:
    """Compares the BRDF maps of a method's shader and of its Rust code."""
    arguments = ["brdf-map", "--size", plan.compared_side, *INCIDENCE, *surface_words(plan.skin)]
    card, cpu = folder / f"map-{method}.exr", folder / f"map-{method}-cpu.exr"
    sunbeam(*arguments, "-o", card, "--method", method, "--backend", "gpu", "--adapter", plan.adapter)
    # The GPU's `table` is the colour table. On the CPU, `table` is the spectral table.
    sunbeam(*arguments, "-o", cpu, "--method", "colour-table" if method == "table" else method)
    return judged(cpu, card)


def picture_beside_software(plan: Plan, folder: Path, method: str) -> dict:
    """Compares the card's picture, drawn now or kept in the folder, with the software adapter's."""
    card, software = folder / f"{method}-card.exr", folder / f"{method}-software.exr"
    if plan.draws:
        draw(plan, card, method, plan.adapter)
    try:
        draw(plan, software, method, "software")
    except SetupError as error:
        # Only a missing software adapter is excused (`NoAdapter` of crates/realtime/src/error.rs), and only where the
        # card's picture was drawn now and is kept. Other errors of the software adapter are failures.
        if not plan.draws or "no software GPU adapter" not in str(error):
            raise
        return {"note": f"not compared, there is no software adapter; {card.name} is kept for --compare elsewhere"}
    return judged(software, card)


def draw(plan: Plan, path: Path, method: str, adapter: str, rotation: float = 0.0) -> None:
    """Draws the snake in the sun, without pigment and ground. Its relief, `plan.skin`, is turned by `rotation`°."""
    arguments = ["render", "-o", path, "--adapter", adapter, "--method", method, "--blend", "none"]
    arguments += [*surface_words(plan.skin), "--resolution", plan.mesh_resolution]
    arguments += ["--ground", "false", "--rotation", rotation, "--size", f"{plan.compared_side}x{plan.compared_side}"]
    sunbeam(*arguments)


def judged(reference: Path, path: Path) -> dict:
    """Compares the EXR `path` with `reference` over the pixels that are above 0 in a channel of the reference.

    Returns the statistics `delta_e` of CIEDE2000 and the number of these `pixels`. `passed` applies MEDIAN_MAX and
    P99_MAX. A black reference raises SetupError, so a comparison of nothing never passes.
    """
    found = json.loads(sunbeam("compare", reference, path, "--mask", reference))
    delta_e = found["delta_e_2000"]
    passed = delta_e["median"] <= MEDIAN_MAX and delta_e["p99"] <= P99_MAX
    return {"passed": passed, "delta_e": delta_e, "pixels": found["pixels"]}


def turned(plan: Plan, folder: Path) -> dict:
    """The negative control: a rotated relief must fail the comparison."""
    # One method suffices, since the comparison is the same for all.
    method = plan.methods[-1]
    straight, other = folder / f"{method}-straight.exr", folder / f"{method}-turned.exr"
    draw(plan, straight, method, plan.adapter)
    draw(plan, other, method, plan.adapter, rotation=WRONG_TURN_DEG)
    found = judged(straight, other)
    return {**found, "passed": not found["passed"]}
