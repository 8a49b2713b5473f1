"""Renders by a frozen function while the coherence length changes between calls: Dr.Jit must use the new tables.

`dr.freeze` records the kernels of a function's first call and replays them in later calls.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

from .kernels import CHANGED, LENGTHS_UM
from .parts import Check
from .plan import Plan
from .scenes import SPP, STRAY, ball, differing, picture
from .variants import use


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """One check per kind of variant, such as `rgb`.

    The part has a process of its own: a crash in Dr.Jit ends it, and the other parts still run.
    """
    for kind in plan.kinds:
        yield plan.variant(kind), partial(rendered, plan.variant(kind))


def rendered(variant: str) -> dict:
    """Compares frozen with plain renders at each of LENGTHS_UM, the coherence lengths in µm.

    The surface is CHANGED, whose coherence length the calls replace. `differing` is the largest fraction of pixels that
    differ between both by more than rounding, and STRAY the largest accepted one. `between lengths` is the fraction
    that differs between the first two lengths. `recordings` is how often Dr.Jit recorded the function.
    """
    use(variant)
    scene = ball({"type": "diffraction", **CHANGED})
    parameters = mi.traverse(scene)

    @dr.freeze
    def frozen(scene, seed):
        return mi.render(scene, spp=SPP, seed=seed)

    fractions, pictures = [], []
    for length_um in LENGTHS_UM:
        parameters["ball.bsdf.coherence_length"] = length_um
        parameters.update()
        pictures.append(np.array(frozen(scene, mi.UInt32(0)), dtype=float)[..., :3])
        # `picture` renders without freezing, with the same seed.
        fractions.append(differing(pictures[-1], picture(scene)))
    # The pictures of two lengths must differ by more than the tolerance; otherwise the check would prove nothing.
    apart = differing(pictures[1], pictures[0])
    largest = max(fractions)
    passed = largest <= STRAY < apart
    return {"passed": passed, "differing": largest, "between lengths": apart, "recordings": int(frozen.n_recordings)}
