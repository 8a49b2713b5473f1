"""Crops of scanned skins, levelled, smoothed, and made periodic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from docs.figures.skin_scans import levelled, read
from mitsuba_scenes.crosscheck.cases import SCANS

from .relief import Relief, harmonics

# Number of pixels over which opposite edges are blended. A larger number makes the seam smoother, but changes more of
# the relief.
FADE = 6


@dataclass(frozen=True)
class Crop:
    """A crop's position on the scan of a skin: first row and column, and numbers of rows and columns.

    `first` are at least FADE, since the pixels before them are blended into the crop's end.
    """

    skin: str
    name: str
    first: tuple[int, int]
    size: tuple[int, int]


# Chosen places, three on each scan. Crops B and C of elaphe share ten rows.
CROPS = (
    Crop("xenopeltis", "A", (10, 12), (29, 24)),
    Crop("xenopeltis", "B", (50, 60), (29, 24)),
    Crop("xenopeltis", "C", (60, 14), (39, 24)),
    Crop("elaphe", "A", (12, 12), (35, 35)),
    Crop("elaphe", "B", (55, 50), (35, 35)),
    Crop("elaphe", "C", (30, 50), (35, 35)),
)


def scanned(skin: str) -> tuple[np.ndarray, float]:
    """Heights of a scan in µm, `[iy, ix]`, and the edge of its pixels in µm."""
    return read("--height-field", SCANS[skin])


def cropped(heights: np.ndarray, pixel_um: float, crop: Crop, smoothing: float) -> Relief:
    """The crop of a scan's heights in µm; `smoothing` is the standard deviation of a Gaussian in pixels."""
    (y, x), (rows, columns) = crop.first, crop.size
    part = heights[y - FADE : y + rows, x - FADE : x + columns].astype(float)
    part = levelled(part)
    for axis in (0, 1):
        part = faded(part, axis)
    # Frequencies in cycles per pixel, in FFT order, and the Gaussian's transfer function.
    fy, fx = (harmonics(count) / count for count in part.shape)
    response = np.exp(-2 * (np.pi * smoothing) ** 2 * (fy[:, None] ** 2 + fx[None, :] ** 2))
    smooth = np.fft.ifft2(np.fft.fft2(part) * response).real
    return Relief(smooth, (columns * pixel_um, rows * pixel_um))


def faded(part: np.ndarray, axis: int) -> np.ndarray:
    """Cuts off the first FADE pixels along an axis and blends them into the last ones, so that the part repeats."""
    part = np.moveaxis(part, axis, 0)
    # Weights of the first pixels, from 0 to 1, (FADE, 1).
    share = 0.5 - 0.5 * np.cos(np.pi * (np.arange(FADE)[:, None] + 0.5) / FADE)
    result = part[FADE:].copy()
    result[-FADE:] = part[-FADE:] * (1 - share) + part[:FADE] * share
    return np.moveaxis(result, 0, axis)
