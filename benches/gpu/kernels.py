"""Kernels that Dr.Jit shares or reuses: their answers must equal those of a BSDF or scene alone in the process.

Cases: a changed parameter, a frozen call (`dr.freeze` records a call's kernels and replays them), two living scenes,
and eight BSDFs behind one array of pointers.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

from .parts import Check
from .plan import Plan
from .questions import Questions, drawn, interactions, random_numbers
from .scenes import STRAY, ball, differing, picture
from .variants import use

# Number of questions of each check: pairs of directions with wavelengths and random numbers (questions.py).
COUNT = 300
# Largest error of an answer, relative to the largest answer of its quantity, such as the density. Kernels of different
# structure round differently.
ROUNDING = 1e-5
# Parameters with which tables are built in a second or two.
QUICK = {"conserve_energy": False, "tolerance": 0.01}
# The surface whose coherence length, in µm, changes.
CHANGED = {"preset": "blazed", "coherence_length": 6.0, **QUICK}
# Another relief than that of CHANGED.
OTHER = {"preset": "sinusoidal", "coherence_length": 10.0, **QUICK}
# Eight surfaces of two reliefs, which have three coherence lengths in all. Their tables, materials, pigments and
# rotations make them trace different code.
EIGHT = (
    {"preset": "blazed"},
    {"preset": "blazed", "rotation": 30.0, "material": "Al"},
    {"preset": "blazed", "eta": 1.56, "diffuse_reflectance": 0.2},
    CHANGED,
    {**CHANGED, "rotation": 70.0},
    OTHER,
    {**OTHER, "material": "Al"},
    {**OTHER, "specular_reflectance": 0.5},
)
# Coherence lengths in µm that a BSDF gets one after the other. The first one returns at the end, when its tables exist
# already.
LENGTHS_UM = (10.0, 6.0, 20.0, 10.0)
# Number of calls of a frozen function: the first two may record, the others replay.
FROZEN_CALLS = 4


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """Four checks per kind of variant, such as `rgb`."""
    for kind in plan.kinds:
        variant = plan.variant(kind)
        yield f"{variant}, a changed coherence length", partial(changed, variant)
        yield f"{variant}, a frozen call", partial(frozen, variant)
        yield f"{variant}, two scenes", partial(two_scenes, variant)
        yield f"{variant}, eight BSDFs in one kernel", partial(eight, variant)


def load(parameters: dict) -> mi.BSDF:
    """The plugin's BSDF with these parameters."""
    return mi.load_dict({"type": "diffraction", **parameters})


def answers(bsdf: mi.BSDF | mi.BSDFPtr, asked: Questions) -> list:
    """Values, densities, sampled directions and weights of a BSDF, or of an array of pointers to BSDFs, unevaluated."""
    ctx, si = mi.BSDFContext(), interactions(asked)
    value, pdf = bsdf.eval_pdf(ctx, si, mi.Vector3f(asked.wo))
    sample, weight = bsdf.sample(ctx, si, *random_numbers(asked))
    return [value, pdf, sample.wo, weight]


def numbers(unevaluated: list) -> list[np.ndarray]:
    """Evaluates Dr.Jit arrays in one kernel. Their last axis is the question."""
    dr.eval(unevaluated)
    return [np.array(each) for each in unevaluated]


def largest_error(ours: list[np.ndarray], theirs: list[np.ndarray]) -> float:
    """The largest difference, relative to the largest answer of the same quantity; NaN counts as infinity.

    The answers of each quantity are arrays in both lists. The divisor is at least 1e-30, for answers that are all 0.
    """
    errors = [np.abs(a - b).max() / max(np.abs(b).max(), 1e-30) for a, b in zip(ours, theirs)]
    # Unlike `max`, NumPy's maximum is NaN if any error is.
    return float(np.nan_to_num(np.max(errors), nan=np.inf))


def eight(variant: str) -> dict:
    """Compares all BSDFs behind one array of pointers with each alone."""
    use(variant)
    bsdfs, asked = [load(parameters) for parameters in EIGHT], drawn(np.random.default_rng(17), COUNT)
    alone = [numbers(answers(bsdf, asked)) for bsdf in bsdfs]
    # Index of the BSDF that answers each question: one BSDF after the other.
    which = np.arange(COUNT) % len(bsdfs)
    chosen, pointers = mi.UInt32(which), mi.BSDFPtr(bsdfs[0])
    for i, bsdf in enumerate(bsdfs):
        pointers = dr.select(chosen == i, mi.BSDFPtr(bsdf), pointers)
    together = numbers(answers(pointers, asked))
    errors = [
        largest_error([each[..., which == i] for each in together], [each[..., which == i] for each in wanted])
        for i, wanted in enumerate(alone)
    ]
    return {"passed": max(errors) <= ROUNDING, "error": max(errors), "bsdfs": len(bsdfs)}


def changed(variant: str) -> dict:
    """Compares a BSDF with a changed coherence length with a new one of that length.

    `moved` is the largest change of an answer by a new length. If nothing changed, the check would prove nothing.
    """
    use(variant)
    bsdf, asked = load(CHANGED), drawn(np.random.default_rng(18), COUNT)
    parameters = mi.traverse(bsdf)
    before = numbers(answers(bsdf, asked))
    errors, moved = [], 0.0
    for length_um in LENGTHS_UM:
        parameters["coherence_length"] = length_um
        parameters.update()
        after = numbers(answers(bsdf, asked))
        new = load({**CHANGED, "coherence_length": length_um})
        errors.append(largest_error(after, numbers(answers(new, asked))))
        moved = max(moved, largest_error(after, before))
    return {"passed": max(errors) <= ROUNDING < moved, "error": max(errors), "moved": moved}


def frozen(variant: str) -> dict:
    """Compares replays of a frozen call with plain calls, on new questions each time."""
    use(variant)
    # The plugin's default coherence length in µm.
    bsdf = load({**CHANGED, "coherence_length": 65.0})

    @dr.freeze
    def replayed(bsdf, si, wo, u):
        ctx = mi.BSDFContext()
        sample, weight = bsdf.sample(ctx, si, u.x, mi.Point2f(u.y, u.z))
        return [*bsdf.eval_pdf(ctx, si, wo), sample.wo, weight]

    errors = []
    for seed in range(FROZEN_CALLS):
        asked = drawn(np.random.default_rng(seed), COUNT)
        si, wo, u = interactions(asked), mi.Vector3f(asked.wo), mi.Vector3f(asked.u)
        # Evaluated here rather than by the frozen function.
        dr.eval(si, wo, u)
        errors.append(largest_error(numbers(replayed(bsdf, si, wo, u)), numbers(answers(bsdf, asked))))
    # Dr.Jit records a second time if a value of the first recording is not constant.
    recordings = int(replayed.n_recordings)
    return {"passed": max(errors) <= ROUNDING and recordings <= 2, "error": max(errors), "recordings": recordings}


def two_scenes(variant: str) -> dict:
    """Compares renders of two scenes while both are alive with renders while one of them is.

    `differing` is the fraction of pixels that differ, at most STRAY (scenes.py). `between the scenes` is the fraction
    by which the two scenes differ, which must be larger than STRAY.
    """
    use(variant)
    first = ball({"type": "diffraction", **EIGHT[0]})
    alone = picture(first)
    second = ball({"type": "diffraction", **OTHER})
    beside, other = picture(first), picture(second)
    del first
    gc.collect()
    after = picture(second)
    stray = max(differing(beside, alone), differing(after, other))
    apart = differing(other, alone)
    return {"passed": stray <= STRAY < apart, "differing": stray, "between the scenes": apart}
