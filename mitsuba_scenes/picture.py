"""Renders the snake scene with timing, checks and tone-maps pictures, and writes them as EXR and PNG."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path

import mitsuba as mi
import numpy as np

from .scene import MAX_DEPTH, View, snake_scene

# Largest number of paths in memory during a pass. A path typically takes 1 kB, so a pass takes about 8 GB.
PATHS_PER_PASS = 1 << 23


class PictureError(Exception):
    """A picture with values that are not finite, or a black one."""


@dataclass
class Picture:
    """A picture in linear sRGB, (height, width, 3), its BSDF, and render times in seconds."""

    pixels: np.ndarray
    bsdf: mi.BSDF
    seconds: dict


def render(bsdf, files, light, view: View, spp: int = 64, max_depth: int = MAX_DEPTH, passes: int = 1) -> Picture:
    """Builds the scene and renders the mean of at least `passes` passes.

    The samples of a pass are rounded up to a square number, as the sampler requires. `bsdf` is a dictionary, or the
    object of an earlier `Picture`. Times: `tables` is the creation of the BSDF (absent for an object), `scene` that of
    the scene, `first_pass` includes the compilation of kernels, `later_pass` is the median of the other passes (absent
    if there are none).
    """
    passes = max(passes, math.ceil(view.width * view.height * spp / PATHS_PER_PASS))
    spp_per_pass = math.ceil(math.sqrt(spp / passes)) ** 2
    seconds = {}
    skin = bsdf
    if isinstance(bsdf, dict):
        start = time.perf_counter()
        skin = mi.load_dict(bsdf)
        seconds["tables"] = time.perf_counter() - start
    start = time.perf_counter()
    scene = mi.load_dict(snake_scene(skin, files, light, view, spp_per_pass, max_depth))
    seconds["scene"] = time.perf_counter() - start

    pixels, times = 0, []
    for seed in range(passes):
        start = time.perf_counter()
        pixels = pixels + np.array(mi.render(scene, spp=spp_per_pass, seed=seed)) / passes
        times.append(time.perf_counter() - start)
    seconds["first_pass"] = times[0]
    if passes > 1:
        seconds["later_pass"] = float(np.median(times[1:]))
    return Picture(pixels.astype(np.float32), skin, seconds)


def check(pixels: np.ndarray, name: str) -> None:
    """Raises PictureError for values that are not finite and for black pictures."""
    bad = int(np.count_nonzero(~np.isfinite(pixels)))
    if bad:
        raise PictureError(f"{name}: {bad} of {pixels.size} values are not finite")
    if not pixels.max() > 0 or not pixels.mean() > 1e-4:
        raise PictureError(f"{name}: the picture is black (mean {pixels.mean():.2g})")


def tone_mapped(pixels: np.ndarray, exposure_stops: float) -> np.ndarray:
    """8-bit sRGB of linear pixels times 2^stops, with highlights compressed.

    A pixel whose brightest channel p exceeds k = 0.8 is scaled so that p becomes k + 0.2 e/(e + 0.6), e = p − k. The
    curve tends to 1. All three numbers are chosen.
    """
    linear = np.maximum(pixels * 2.0**exposure_stops, 0)
    # One factor for the three channels keeps the hue.
    peak = linear.max(axis=-1, keepdims=True)
    excess = np.maximum(peak - 0.8, 0)
    linear = linear * np.where(excess > 0, (0.8 + 0.2 * excess / (excess + 0.6)) / np.maximum(peak, 1e-9), 1)
    bitmap = mi.Bitmap(linear.astype(np.float32))
    return np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True))


def write(pixels: np.ndarray, exr: Path, exposure_stops: float) -> Path:
    """Writes the linear picture to `exr` and the tone-mapped one to a PNG beside it; returns the PNG's path."""
    exr.parent.mkdir(parents=True, exist_ok=True)
    mi.Bitmap(pixels).write(str(exr))
    png = exr.with_suffix(".png")
    mi.Bitmap(tone_mapped(pixels, exposure_stops)).write(str(png))
    return png
