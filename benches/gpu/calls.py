"""Times calls of the plugin's BSDFs and of `roughconductor` in ns per question, on large wavefronts of questions.

A question is one set of arguments of a call: directions, wavelengths and random numbers. A wavefront is an array of
questions that one kernel answers. docs/figures/bsdf_calls.py has the materials and the timing.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import mitsuba as mi

from docs.figures import bsdf_calls
from docs.figures.benchmark_scenes import REFERENCE

from .parts import Check
from .plan import Plan
from .variants import use


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """One timing per kind of variant, such as `rgb`, and call, such as `eval`. `folder`, for pictures, stays empty."""
    for kind in plan.kinds:
        for call in plan.calls:
            yield f"{plan.variant(kind)}, {call}", partial(timed, plan, kind, call)


def timed(plan: Plan, kind: str, call: str) -> dict:
    """Nanoseconds `ns` per question of a call by material, and their `ratio` to REFERENCE, the rough conductor.

    `elements` is the number of questions in the wavefront.
    """
    use(plan.variant(kind))
    parameters = bsdf_calls.bsdfs()
    bsdfs = {name: mi.load_dict(parameters[name]) for name in plan.materials}
    ns = bsdf_calls.call_ns(bsdfs, call, plan.wavefront)
    # Dr.Jit compiles every living BSDF into the kernels that follow, so these are freed.
    del bsdfs
    gc.collect()
    # The rough conductor's density takes so little time that a ratio would be noise.
    ratios = {} if call == "pdf" else {name: ns[name] / ns[REFERENCE] for name in ns if name != REFERENCE}
    return {"kind": kind, "call": call, "elements": plan.wavefront, "ns": ns, "ratio": ratios}
