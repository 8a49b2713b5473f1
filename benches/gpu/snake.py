"""The path-traced snake beside the picture of the reference variant, judged by the noise of both."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import mitsuba as mi
import numpy as np

from mitsuba_scenes.evaluation.rgb_against_spectral import difference
from mitsuba_scenes.light import Light
from mitsuba_scenes.scene import View, snake_scene
from mitsuba_scenes.skin import skin_bsdf
from mitsuba_scenes.snake import snake_files

from .parts import Check
from .plan import Plan
from .variants import reference, use

# The mean colour difference may exceed what noise alone gives by this factor, and by this much in ΔE76: noise is
# estimated from halves of few pictures, to about a tenth.
NOISE_FACTOR, NOISE_FLOOR = 1.3, 0.1
# Standard errors that the energies may be apart, and relative rounding.
ERRORS, ROUNDING = 4.0, 1e-3
# A pixel that differs by less than this of its own value has the same paths in both.
SAME = 1e-3


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    for kind in plan.kinds:
        yield plan.variant(kind), partial(compared, plan, kind)


def compared(plan: Plan, kind: str) -> dict:
    variants = (plan.variant(kind), reference(plan, kind))
    ours, theirs = (pictures(plan, variant) for variant in variants)
    figures = judged(ours, theirs)
    return {"reference": variants[1], **figures}


def pictures(plan: Plan, variant: str) -> np.ndarray:
    """Linear sRGB (pictures, rows, columns, 3), of one seed each."""
    use(variant)
    files, view = snake_files(plan.mesh_resolution), View(*plan.snake_size)
    bsdf = mi.load_dict(skin_bsdf(plan.skin, files.pigment))
    # A sun without extent: no picture has a bright sample that others lack.
    light = Light(sun="directional")
    scene = mi.load_dict(snake_scene(bsdf, files, light, view, plan.snake_spp))
    made = np.array([np.array(mi.render(scene, seed=seed))[..., :3] for seed in range(plan.snake_pictures)])
    del scene, bsdf
    gc.collect()
    return made.astype(float)


def judged(ours: np.ndarray, theirs: np.ndarray) -> dict:
    """Colour difference and ratio of energies of two sets of pictures (n, rows, columns, 3), each beside its noise."""
    found = difference(*(halves(each) for each in (ours, theirs)))
    sums = [each.sum(axis=(1, 2, 3)) for each in (ours, theirs)]
    # The standard error of the ratio, from the spread of the pictures of each set.
    error = float(np.hypot(*(each.std(ddof=1) / np.sqrt(len(each)) / each.mean() for each in sums)))
    off = abs(found["energy_ratio"] - 1)
    finite = bool(np.isfinite(ours).all() and ours.mean() > 0)
    alike = np.abs(ours - theirs).max(axis=-1) <= SAME * np.abs(theirs).max(axis=-1)
    noise = found["noise_delta_e_mean"]
    return {
        "passed": finite
        and found["delta_e_mean"] <= NOISE_FACTOR * noise + NOISE_FLOOR
        and off <= ERRORS * error + ROUNDING,
        "delta_e_mean": found["delta_e_mean"],
        "delta_e_of_noise": noise,
        "energy_ratio": found["energy_ratio"],
        "energy_error": error,
        "same_pixels": float(np.mean(alike)),
    }


def halves(pictures: np.ndarray) -> np.ndarray:
    """The means of the even and of the odd pictures."""
    return np.array([pictures[::2].mean(axis=0), pictures[1::2].mean(axis=0)])
