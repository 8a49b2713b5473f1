"""Colour differences between pictures by an RGB and by a spectral variant of Mitsuba, and conversion to CIELAB.

Pictures are linear sRGB. A picture is an array of two *halves*, (2, rows, columns, 3): pictures from independent halves
of its samples. Their mean is the picture, and their difference shows its noise. `difference` also accepts a selection
of pixels, (2, pixels, 3).
"""

from __future__ import annotations

import time
from collections.abc import Callable

import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant

from .benchmark_scenes import SKIN, BenchmarkScene, scanned_surface, scenes
from .time_to_error import render

# The compared RGB variant of Mitsuba.
RGB = "llvm_ad_rgb"
# The compared spectral variant of Mitsuba.
SPECTRAL = "llvm_ad_spectral"
# Materials by name, as parameters of the plugin `diffraction`.
MATERIALS = {"keratin": SKIN, "gold": {"material": "Au"}}
# Width and height of the pictures in pixels. Each pixel of a larger picture would get fewer samples in the same time,
# and more noise.
SIZE = (24, 16)
# Default rendering time of each picture in seconds, without building tables and compiling. A longer time lowers the
# noise.
BUDGET_S = 4.0
# Smallest and largest number of averaged renders. Both are even, for two halves.
RENDERS_MIN = 2
RENDERS_MAX = 256
# Mean luminance, relative to white, to which the spectral picture is exposed: middle grey.
GREY = 0.18

# Matrix from linear sRGB to XYZ, from the chromaticities of the primaries and of D65 in IEC 61966-2-1.
XYZ_OF_SRGB = np.array(
    [[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923], [0.0193308, 0.1191948, 0.9505322]]
)
# Weights of linear sRGB in the luminance Y.
LUMINANCE = XYZ_OF_SRGB[1]
# XYZ of white.
WHITE = XYZ_OF_SRGB.sum(axis=1)


def figures(budget_s: float = BUDGET_S) -> list[dict]:
    """A row for each scene and medium, with the scan's relief: `scene`, `material`, and the numbers of `difference`."""
    surface, _ = scanned_surface()
    rows = []
    for scene in scenes():
        for name, material in MATERIALS.items():
            scene_of_row = scene.with_materials({"scan": surface}, material)

            # The default binds the scene of this pass of the loop.
            def make_scene(scene: BenchmarkScene = scene_of_row) -> mi.Scene:
                return scene.load(mi.load_dict(scene.diffraction(surface)), SIZE)

            rows.append({"scene": scene.name, "material": name, **colour_difference(make_scene, budget_s)})
    return rows


def colour_difference(make_scene: Callable[[], mi.Scene], budget_s: float = BUDGET_S) -> dict:
    """The numbers of `difference` for pictures of a scene in both variants.

    `make_scene` makes the scene in the active variant, and `budget_s` is the time of each picture in seconds.
    """
    pictures = {}
    for variant in (RGB, SPECTRAL):
        use_variant(variant, fall_back=False)
        pictures[variant] = halves(make_scene(), budget_s)
    return difference(pictures[RGB], pictures[SPECTRAL])


def halves(scene: mi.Scene, budget_s: float) -> np.ndarray:
    """The mean of the even renders and that of the odd ones, (2, rows, columns, 3).

    The scene is rendered for `budget_s` seconds, within the bounds of RENDERS_MIN and RENDERS_MAX.
    """
    # The first render compiles kernels, and is not counted.
    render(scene, seed=1)
    sums, count, start = [0, 0], 0, time.perf_counter()
    while count < RENDERS_MIN or (count < RENDERS_MAX and time.perf_counter() - start < budget_s):
        for half in (0, 1):
            sums[half] = sums[half] + render(scene, seed=2 + count).image
            count += 1
    return np.array(sums) / (count / 2)


def difference(rgb: np.ndarray, spectral: np.ndarray) -> dict:
    """Differences of two pictures. ΔE76 is the distance of two colours in CIELAB.

    First both pictures are multiplied by the same exposure. Colours brighter than white are not clipped.

    - `delta_e_mean`, `delta_e_p95`: mean and 95th percentile of ΔE76 over pixels, noise included.
    - `noise_delta_e_mean`, `noise_delta_e_p95`: estimates of the ΔE76 that noise alone would cause. Half the difference
      of a picture's halves has the same rms as the noise of their mean. The squares of both pictures' noise are added.
    - `delta_e_rms`: an estimate of the rms difference without noise. It is the root of the mean product of two
      differences with independent noise, those of the first halves and of the second halves; 0 if that is negative.
    - `energy_ratio`: the ratio, RGB over spectral, of sums over pixels and channels.
    - `channel_ratios`: the ratios, RGB over spectral, of sums over pixels for each channel.
    """
    exposure = GREY / (spectral.mean(axis=0) @ LUMINANCE).mean()
    rgb, spectral = rgb * exposure, spectral * exposure
    found = delta_e76(rgb.mean(axis=0), spectral.mean(axis=0))
    noise = np.sqrt(sum((delta_e76(*picture) / 2) ** 2 for picture in (rgb, spectral)))
    # Differences of the first and of the second halves.
    first, second = lab(rgb) - lab(spectral)
    channels = rgb.reshape(-1, 3).sum(axis=0) / spectral.reshape(-1, 3).sum(axis=0)
    return {
        "delta_e_mean": float(found.mean()),
        "delta_e_p95": float(np.percentile(found, 95)),
        "delta_e_rms": float(np.sqrt(max((first * second).sum(axis=-1).mean(), 0))),
        "noise_delta_e_mean": float(noise.mean()),
        "noise_delta_e_p95": float(np.percentile(noise, 95)),
        "energy_ratio": float(rgb.sum() / spectral.sum()),
        "channel_ratios": channels.tolist(),
    }


def delta_e76(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distance of linear sRGB colours (..., 3) in CIE 1976 L*a*b* under D65."""
    return np.linalg.norm(lab(a) - lab(b), axis=-1)


def lab(linear: np.ndarray) -> np.ndarray:
    """CIE 1976 L*a*b* of linear sRGB (..., 3)."""
    return lab_of_xyz(linear @ XYZ_OF_SRGB.T)


def lab_of_xyz(xyz: np.ndarray) -> np.ndarray:
    """CIE 1976 L*a*b* of XYZ (..., 3) under D65, by CIE 15:2004, 8.2.1, except that negative XYZ counts as zero."""
    relative = np.maximum(xyz / WHITE, 0)
    # Below this value the cube root is replaced by its tangent, as in the standard.
    low = (6 / 29) ** 3
    f = np.where(relative > low, np.cbrt(relative), relative / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)
