"""The path-traced snake in each variant of Mitsuba under test, compared with a reference variant.

Each variant renders the same scene several times with different seeds. The means of the two sets of pictures may
differ by a few of their standard errors. The plan (plan.py) names the kinds of variants, such as `rgb`; variants.py
chooses the reference of each.
"""

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

# Largest difference of a pixel, and of a channel's sum over all pixels, in standard errors. Normally distributed
# differences exceed four with a probability of 6e-5.
ERRORS = 4.0
# Fraction of the pixels' channels that may exceed ERRORS. The standard deviation is estimated from few pictures and is
# uncertain by about 20 %, so more of them exceed four errors than of a normal distribution.
EXCEEDING = 0.01
# Largest relative difference, by rounding alone, of the same paths in two variants.
ROUNDING = 1e-3


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """One check per kind of variant."""
    for kind in plan.kinds:
        yield plan.variant(kind), partial(compared, plan, kind)


def compared(plan: Plan, kind: str) -> dict:
    """The results of `judged` for the checked variant of a kind and its reference."""
    checked_variant, reference_variant = plan.variant(kind), reference(plan, kind)
    ours, theirs = pictures(plan, checked_variant), pictures(plan, reference_variant)
    if reference_variant == "scalar_rgb":
        # The plugin's scalar RGB variant removes negative channels by mixing a colour with grey of its luminance. The
        # luminance alone is therefore the same in both variants.
        ours, theirs = ((each @ LUMINANCE)[..., None] for each in (ours, theirs))
    return {"reference": reference_variant, **judged(ours, theirs)}


def pictures(plan: Plan, variant: str) -> np.ndarray:
    """Renders of one variant in linear sRGB with different seeds, (pictures, rows, columns, 3)."""
    use(variant)
    files, view = snake_files(plan.mesh_resolution), View(*plan.snake_size)
    bsdf = mi.load_dict(skin_bsdf(plan.skin, files.pigment))
    # A directional sun. With a sun of finite extent, rare bright samples would dominate the noise.
    light = Light(sun="directional")
    scene = mi.load_dict(snake_scene(bsdf, files, light, view, plan.snake_spp))
    made = np.array([np.array(mi.render(scene, seed=seed))[..., :3] for seed in range(plan.snake_pictures)])
    # Frees the memory of this variant before the next one is selected.
    del scene, bsdf
    gc.collect()
    return made.astype(float)


def judged(ours: np.ndarray, theirs: np.ndarray) -> dict:
    """Differences of two sets of pictures (n, rows, columns, channels) in standard errors, by pixel and by channel.

    A glint in a single picture raises the mean and its standard error alike, so it counts as one error. Figures:
    `exceeding` is the fraction of the pixels' channels above ERRORS, `channels_in_errors` the differences of the
    channels' sums, `channel_ratios` their ratios. `same_pixels` is the fraction of the pixels of all pictures that are
    equal up to ROUNDING for the same seed.
    """
    pixels = difference_in_errors(ours, theirs)
    channels = difference_in_errors(*(each.sum(axis=(1, 2)) for each in (ours, theirs)))
    # The negation counts NaN.
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


def difference_in_errors(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """The difference of the means of two sets (n, …) in its standard errors; NaN if one mean is NaN.

    The error includes ROUNDING, and 1e-12 for pixels that are black in both sets.
    """
    means = [each.mean(axis=0) for each in (ours, theirs)]
    errors = np.hypot(*(each.std(axis=0, ddof=1) / np.sqrt(len(each)) for each in (ours, theirs)))
    return np.abs(means[0] - means[1]) / (errors + ROUNDING * np.abs(means[1]) + 1e-12)
