"""Colour differences between pictures of RGB and of spectral variants, and conversion to CIELAB.

Pictures are linear sRGB. A *converged* picture is an array of two independent halves, (2, rows, columns, 3), whose
difference gives the noise. Comparisons also take a selection of its pixels, (2, pixels, 3).
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
# The compared spectral variant.
SPECTRAL = "llvm_ad_spectral"
# Media by name, as parameters of the plugin.
OPTICS = {"keratin": SKIN, "gold": {"material": "Au"}}
# Width and height of the pictures in pixels.
SIZE = (24, 16)
# Default seconds of each of the two pictures, without building tables and compiling. More seconds lower the noise.
BUDGET_S = 4.0
# Smallest number of averaged renders; even, for two halves.
RENDERS_MIN = 2
# Largest number of averaged renders.
RENDERS_MAX = 256
# Mean luminance of the spectral picture at the exposure of the comparison, relative to white: middle grey.
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
    """A row for each scene with the scan in each medium: `scene`, `material`, and the numbers of `difference`."""
    surface, _ = scanned_surface()
    rows = []
    for scene in scenes():
        for name, optics in OPTICS.items():
            with_medium = scene.with_materials({"scan": surface}, optics)

            # The default binds the scene of this pass of the loop.
            def make_scene(changed: BenchmarkScene = with_medium) -> mi.Scene:
                return changed.load(mi.load_dict(changed.diffraction(surface)), SIZE)

            rows.append({"scene": scene.name, "material": name, **colour_difference(make_scene, budget_s)})
    return rows


def colour_difference(make_scene: Callable[[], mi.Scene], budget_s: float = BUDGET_S) -> dict:
    """The numbers of `difference` for converged pictures of a scene in both variants.

    `make_scene` makes the scene in the selected variant, and `budget_s` is the time of each picture in seconds.
    """
    halves = {}
    for variant in (RGB, SPECTRAL):
        use_variant(variant, fall_back=False)
        halves[variant] = converged(make_scene(), budget_s)
    return difference(halves[RGB], halves[SPECTRAL])


def converged(scene: mi.Scene, budget_s: float) -> np.ndarray:
    """The means of the even and of the odd renders within about `budget_s` seconds, (2, rows, columns, 3)."""
    # The first render compiles kernels.
    render(scene, seed=1)
    sums, count, start = [0, 0], 0, time.perf_counter()
    while count < RENDERS_MIN or (count < RENDERS_MAX and time.perf_counter() - start < budget_s):
        for half in (0, 1):
            sums[half] = sums[half] + render(scene, seed=2 + count).image
            count += 1
    return np.array(sums) / (count / 2)


def difference(rgb: np.ndarray, spectral: np.ndarray) -> dict:
    """Differences of two converged pictures. ΔE76 is the distance of two colours in CIELAB.

    - `delta_e_mean`, `delta_e_p95`: mean and 95th percentile of ΔE76 over pixels, after one exposure for both pictures.
    - `noise_delta_e_mean`, `noise_delta_e_p95`: estimates of the ΔE76 that noise alone would cause. Half the difference
      of a picture's halves has the rms of the noise of their mean; both pictures' noise adds in squares.
    - `delta_e_rms`: the rms difference without noise. It is the root of the mean product of two differences with
      independent noise, those of the first halves and of the second halves.
    - `energy_ratio`: the ratio, RGB over spectral, of sums over pixels and channels.
    - `channel_ratios`: the ratios, RGB over spectral, of sums over pixels for each channel.
    """
    exposure = GREY / (spectral.mean(axis=0) @ LUMINANCE).mean()
    rgb, spectral = rgb * exposure, spectral * exposure
    found = delta_e76(rgb.mean(axis=0), spectral.mean(axis=0))
    noise = np.sqrt(sum((delta_e76(*halves) / 2) ** 2 for halves in (rgb, spectral)))
    # Differences of the first and of the second halves of the samples.
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
    """CIE 1976 L*a*b* of XYZ (..., 3) under D65, by CIE 15:2004, 8.2.1. Negative XYZ counts as zero."""
    relative = np.maximum(xyz / WHITE, 0)
    # Below this value the cube root is replaced by its tangent, as in the standard.
    low = (6 / 29) ** 3
    f = np.where(relative > low, np.cbrt(relative), relative / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)
