"""The path-traced snake compared with the reference variant, in standard errors of both sets of pictures."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import mitsuba as mi
import numpy as np

from mitsuba_scenes.light import Light
from mitsuba_scenes.scene import View, snake_scene
from mitsuba_scenes.skin import skin_bsdf
from mitsuba_scenes.snake import snake_files

from .agreement import LUMINANCE
from .parts import Check
from .plan import Plan
from .variants import reference, use

# Largest difference of a pixel, and of a channel's sum over all pixels, in standard errors.
ERRORS = 4.0
# Fraction of pixels that may exceed ERRORS: the standard deviation of few pictures is known to 20 % only.
EXCEEDING = 0.01
# Relative rounding, which pictures without noise differ by. A pixel that differs by less has the same paths.
ROUNDING = 1e-3


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    for kind in plan.kinds:
        yield plan.variant(kind), partial(compared, plan, kind)


def compared(plan: Plan, kind: str) -> dict:
    variants = (plan.variant(kind), reference(plan, kind))
    ours, theirs = (pictures(plan, variant) for variant in variants)
    if variants[1] == "scalar_rgb":
        # Scalar variants mix grey of the same luminance into colours with a negative channel.
        ours, theirs = ((each @ LUMINANCE)[..., None] for each in (ours, theirs))
    return {"reference": variants[1], **judged(ours, theirs)}


def pictures(plan: Plan, variant: str) -> np.ndarray:
    """Renders in linear sRGB with different seeds, (pictures, rows, columns, 3)."""
    use(variant)
    files, view = snake_files(plan.mesh_resolution), View(*plan.snake_size)
    bsdf = mi.load_dict(skin_bsdf(plan.skin, files.pigment))
    # A sun without extent: with a disc, rare bright samples would dominate the noise.
    light = Light(sun="directional")
    scene = mi.load_dict(snake_scene(bsdf, files, light, view, plan.snake_spp))
    made = np.array([np.array(mi.render(scene, seed=seed))[..., :3] for seed in range(plan.snake_pictures)])
    del scene, bsdf
    gc.collect()
    return made.astype(float)


def judged(ours: np.ndarray, theirs: np.ndarray) -> dict:
    """Differences of two sets of pictures (n, rows, columns, 3) in standard errors, by pixel and by channel.

    A glint in a single picture moves the mean by one standard error, so it does not count as a difference.
    """
    pixels = apart(ours, theirs)
    channels = apart(*(each.sum(axis=(1, 2)) for each in (ours, theirs)))
    exceeding = float(np.mean(~(pixels <= ERRORS)))
    alike = np.abs(ours - theirs).max(axis=-1) <= ROUNDING * np.abs(theirs).max(axis=-1)
    ratios = ours.sum(axis=(0, 1, 2)) / theirs.sum(axis=(0, 1, 2))
    return {
        "passed": bool(ours.mean() > 0 and exceeding <= EXCEEDING and np.all(channels <= ERRORS)),
        "exceeding": exceeding,
        "channel_ratios": ratios.tolist(),
        "channels_in_errors": channels.tolist(),
        "same_pixels": float(np.mean(alike)),
    }


def apart(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """The difference of the means of two sets (n, …) in its standard errors; NaN if one mean is NaN."""
    means = [each.mean(axis=0) for each in (ours, theirs)]
    errors = np.hypot(*(each.std(axis=0, ddof=1) / np.sqrt(len(each)) for each in (ours, theirs)))
    return np.abs(means[0] - means[1]) / (errors + ROUNDING * np.abs(means[1]) + 1e-12)
