"""Colour differences between RGB and spectral variants, in converged pictures of one scene."""

from __future__ import annotations

import time
from collections.abc import Callable

import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant

from .benchmark_scenes import SKIN, scanned_surface, scenes
from .time_to_error import render

# The compared RGB variant of Mitsuba.
RGB = "llvm_ad_rgb"
# The compared spectral variant.
SPECTRAL = "llvm_ad_spectral"
GOLD = {"material": "Au"}
OPTICS = {"keratin": SKIN, "gold": GOLD}
SIZE = (24, 16)
# Default seconds of each of the two pictures, without building tables and compiling.
BUDGET_S = 4.0
# Smallest number of averaged renders. The number is even, since its halves give the noise.
RENDERS_MIN = 2
# Largest number of averaged renders.
RENDERS_MAX = 256
# Mean luminance of the spectral picture at the exposure of the comparison, middle grey; white is 1.
GREY = 0.18

# Linear sRGB to XYZ, from the chromaticities of the primaries and of D65 in IEC 61966-2-1.
XYZ_OF_SRGB = np.array(
    [[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923], [0.0193308, 0.1191948, 0.9505322]]
)
# XYZ of white.
WHITE = XYZ_OF_SRGB.sum(axis=1)


def figures(budget_s: float = BUDGET_S) -> list[dict]:
    """Rows of each scene with the scan, in keratin and in gold."""
    surface, _ = scanned_surface()
    rows = []
    for scene in scenes():
        for name, optics in OPTICS.items():
            worn = scene.with_materials({"scan": surface}, optics)
            found = colour_difference(
                lambda worn=worn: worn.load(mi.load_dict(worn.diffraction(worn.surfaces["scan"])), SIZE), budget_s
            )
            rows.append({"scene": scene.name, "material": name, **found})
    return rows


def colour_difference(make_scene: Callable[[], mi.Scene], budget_s: float = BUDGET_S) -> dict:
    """ΔE76 of the RGB variant's picture from the spectral one's, and the ratio of their energies.

    `make_scene` makes the scene in the selected variant. `difference` describes the result.
    """
    halves = {}
    for variant in (RGB, SPECTRAL):
        use_variant(variant, fall_back=False)
        halves[variant] = converged(make_scene(), budget_s)
    return difference(halves[RGB], halves[SPECTRAL])


def converged(scene: mi.Scene, budget_s: float) -> np.ndarray:
    """Linear sRGB, (2, rows, columns, 3): the means of two halves of the renders within the budget."""
    # The first render compiles kernels.
    render(scene, seed=1)
    sums, count, start = [0, 0], 0, time.perf_counter()
    while count < RENDERS_MIN or (count < RENDERS_MAX and time.perf_counter() - start < budget_s):
        for half in (0, 1):
            sums[half] = sums[half] + render(scene, seed=2 + count).image
            count += 1
    return np.array(sums) / (count / 2)


def difference(rgb: np.ndarray, spectral: np.ndarray) -> dict:
    """Figures of two converged pictures, each given as two halves (2, rows, columns, 3) of linear sRGB.

    `delta_e_mean` and `delta_e_p95` are over pixels, after one exposure for both. `noise_delta_e_mean` estimates the
    mean by noise alone: halves of a picture differ twice as much as the picture from its limit. `energy_ratio` is the
    ratio of sums over pixels and channels, `channel_ratios` of sums over pixels, RGB over spectral.
    """
    exposure = GREY / (spectral.mean(axis=0) @ XYZ_OF_SRGB[1]).mean()
    rgb, spectral = rgb * exposure, spectral * exposure
    found = delta_e76(rgb.mean(axis=0), spectral.mean(axis=0))
    noise = np.sqrt(sum((delta_e76(*halves) / 2) ** 2 for halves in (rgb, spectral)))
    channels = rgb.sum(axis=(0, 1, 2)) / spectral.sum(axis=(0, 1, 2))
    return {
        "delta_e_mean": float(found.mean()),
        "delta_e_p95": float(np.percentile(found, 95)),
        "noise_delta_e_mean": float(noise.mean()),
        "energy_ratio": float(rgb.sum() / spectral.sum()),
        "channel_ratios": channels.tolist(),
    }


def delta_e76(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distance in CIE 1976 L*a*b* under D65 of linear sRGB colours (..., 3)."""
    return np.linalg.norm(lab(a) - lab(b), axis=-1)


def lab(linear: np.ndarray) -> np.ndarray:
    """CIE 1976 L*a*b* of linear sRGB; negative XYZ, from noise alone, counts as zero."""
    relative = np.maximum(linear @ XYZ_OF_SRGB.T / WHITE, 0)
    # CIE 15:2004, 8.2.1.
    low = (6 / 29) ** 3
    f = np.where(relative > low, np.cbrt(relative), relative / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)
