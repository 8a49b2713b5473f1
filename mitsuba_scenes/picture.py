"""Renders scenes with timing, checks and tone-maps pictures, and writes them as EXR and PNG.

A *pass* renders the whole picture with a part of the samples and a seed of its own.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path

import mitsuba as mi
import numpy as np

from .light import Light
from .scene import MAX_DEPTH, View, snake_scene
from .snake import SnakeFiles

# Largest number of paths of a pass before its samples per pixel are rounded up to a square number (`split`). All paths
# of a pass are in memory at once. A path typically takes 1 kB, so a pass takes about 8 GB. Smaller values take less
# memory and more passes.
PATHS_PER_PASS = 1 << 23
# Smallest mean of a picture that is not black, in linear sRGB. Pictures of lit scenes have larger means.
BLACK_MEAN = 1e-4
# Tone mapping: largest channel up to which colours are displayed unchanged. Larger values leave less contrast to
# highlights; smaller ones darken more of the picture. KNEE and SHOULDER equal those of the realtime renderer
# (src/colour/tone.rs); no test compares them.
KNEE = 0.8
# Excess over KNEE that is displayed halfway between KNEE and 1. Larger values keep contrast between brighter
# highlights; smaller ones display moderate highlights brighter.
SHOULDER = 0.6


class PictureError(Exception):
    """A picture with values that are not finite, or a black one."""


@dataclass
class Picture:
    """A picture in linear sRGB, (height, width, 3), its BSDF, and the times in seconds of its stages (see `render`)."""

    pixels: np.ndarray
    bsdf: mi.BSDF
    seconds: dict


def render(
    bsdf: dict | mi.BSDF,
    files: SnakeFiles,
    light: Light,
    view: View,
    spp: int = 64,
    max_depth: int = MAX_DEPTH,
    passes: int = 1,
) -> Picture:
    """Builds the scene of the snake and renders it; the picture is the mean of at least `passes` passes.

    `spp` is the number of samples per pixel of all passes together. Each pass has an equal part, rounded up to a square
    number, which the sampler requires. `bsdf` is a dictionary, or the object of an earlier `Picture`, whose tables are
    not built again. `max_depth` is the largest number of segments of a path.

    Keys of `seconds`: `tables` is the creation of the BSDF (absent for an object), `scene` that of the scene.
    `first_pass` includes the compilation of kernels; `later_pass` is the median of the other passes (absent if there
    are none).
    """
    seconds = {}
    skin = bsdf
    if isinstance(bsdf, dict):
        start = time.perf_counter()
        skin = mi.load_dict(bsdf)
        seconds["tables"] = time.perf_counter() - start
    pixels, other = render_scene(snake_scene(skin, files, light, view, max_depth=max_depth), spp, passes)
    return Picture(pixels, skin, {**seconds, **other})


def split(width: int, height: int, spp: int, passes: int = 1) -> tuple[int, int]:
    """Number of passes of a picture of `width` × `height` pixels, and samples per pixel of each pass.

    There are at least `passes` passes, and more where one would exceed PATHS_PER_PASS. Each has an equal part of `spp`,
    rounded up to a square number.
    """
    passes = max(passes, math.ceil(width * height * spp / PATHS_PER_PASS))
    return passes, math.ceil(math.sqrt(spp / passes)) ** 2


def render_scene(scene: dict, spp: int, passes: int = 1) -> tuple[np.ndarray, dict]:
    """Renders a scene dictionary in at least `passes` passes; `spp` replaces the sampler's number of samples.

    `spp` and `passes` are as in `render`, and the passes have the seeds 0, 1, …. Returns the picture in linear sRGB,
    (height, width, 3), and the `seconds` of `render` without `tables`.
    """
    film = scene["sensor"]["film"]
    passes, spp_per_pass = split(film["width"], film["height"], spp, passes)
    start = time.perf_counter()
    loaded = mi.load_dict(scene)
    seconds = {"scene": time.perf_counter() - start}
    # Mean over the passes, summed up in parts. The number 0 becomes an array at the first pass.
    pixels, times = 0, []
    for seed in range(passes):
        start = time.perf_counter()
        pixels = pixels + np.array(mi.render(loaded, spp=spp_per_pass, seed=seed)) / passes
        times.append(time.perf_counter() - start)
    seconds["first_pass"] = times[0]
    if passes > 1:
        seconds["later_pass"] = float(np.median(times[1:]))
    return pixels.astype(np.float32), seconds


def check(pixels: np.ndarray, name: str) -> None:
    """Raises PictureError for values that are not finite and for black pictures; `name` begins the message."""
    bad = int(np.count_nonzero(~np.isfinite(pixels)))
    if bad:
        raise PictureError(f"{name}: {bad} of {pixels.size} values are not finite")
    if pixels.mean() <= BLACK_MEAN:
        raise PictureError(f"{name}: the picture is black (mean {pixels.mean():.2g})")


def tone_mapped(pixels: np.ndarray, exposure_stops: float) -> np.ndarray:
    """8-bit sRGB, (height, width, 3), of linear pixels times 2^stops, with compressed highlights.

    Let p be a pixel's brightest channel, k = KNEE, s = SHOULDER and e = p − k. Where p exceeds k, the pixel is scaled
    so that p becomes k + (1 − k) e/(e + s). The curve tends to 1.
    """
    linear = np.maximum(pixels * 2.0**exposure_stops, 0)
    # One factor for the three channels keeps the hue. The floor 1e-9 avoids 0/0 at black pixels, which are kept.
    peak = linear.max(axis=-1, keepdims=True)
    excess = np.maximum(peak - KNEE, 0)
    compressed = KNEE + (1 - KNEE) * excess / (excess + SHOULDER)
    linear = linear * np.where(excess > 0, compressed / np.maximum(peak, 1e-9), 1)
    bitmap = mi.Bitmap(linear.astype(np.float32))
    return np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True))


def write(pixels: np.ndarray, exr: Path, exposure_stops: float) -> Path:
    """Writes the linear picture to `exr` and the tone-mapped one to a PNG beside it; returns the PNG's path."""
    exr.parent.mkdir(parents=True, exist_ok=True)
    mi.Bitmap(pixels).write(str(exr))
    png = exr.with_suffix(".png")
    mi.Bitmap(tone_mapped(pixels, exposure_stops)).write(str(png))
    return png
