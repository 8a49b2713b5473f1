"""Chroma and colour differences of pictures, which are compared at the exposure EXPOSURE_STOPS of the documentation."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
from PIL import Image

from mitsuba_scenes.crosscheck import realtime
from mitsuba_scenes.render import EXPOSURE_STOPS

from .rgb_against_spectral import LUMINANCE, lab


def read_exr(path: Path) -> np.ndarray:
    """The picture of a linear EXR in sRGB primaries, (rows, columns, 3)."""
    bitmap = mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
    return np.array(bitmap)


def mean_chroma(linear: np.ndarray, mask: Path) -> float:
    """Mean CIELAB chroma √(a*² + b*²) of a linear sRGB picture (rows, columns, 3) where the PNG `mask` is not black.

    The mask is grey, of the picture's size. The picture is exposed, and its channels are clipped to [0, 1].
    """
    exposed = np.clip(linear * 2.0**EXPOSURE_STOPS, 0, 1)
    with Image.open(mask) as picture:
        inside = np.array(picture) > 0
    _, a, b = lab(exposed[inside]).T
    return float(np.hypot(a, b).mean())


def greyed(linear: np.ndarray) -> np.ndarray:
    """A linear sRGB picture (..., 3) in grey, with the luminance of every pixel unchanged."""
    return np.repeat((linear @ LUMINANCE)[..., None], 3, axis=-1)


def mean_delta_e(reference: Path, other: Path, mask: Path) -> float:
    """Mean colour difference CIEDE2000 of two linear EXR pictures, exposed, where the PNG `mask` is not black."""
    return realtime.compare(reference, other, exposure=EXPOSURE_STOPS, mask=mask)["delta_e_2000"]["mean"]
