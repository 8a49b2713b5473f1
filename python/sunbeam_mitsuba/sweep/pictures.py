"""Encodes pictures as files: linear EXR, sRGB PNG, and small PNGs for the contact sheet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .reflector import mitsuba, use_variant

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]
    Bytes8 = NDArray[np.uint8]

#: Longer side of a thumbnail in pixels.
THUMBNAIL_PIXELS = 96
# Fraction of the lit pixels that automatic exposure clips, as in ``sunbeam brdf-map``.
_CLIPPED = 0.01


def automatic_exposure(pixels: Doubles) -> float:
    """The factor at which 1 % of the lit pixels exceed 1 in a channel; 1 for a black picture."""
    largest = np.sort(pixels.max(axis=-1).ravel())
    largest = largest[largest > 0]
    rank = int((1 - _CLIPPED) * len(largest))
    return float(1 / largest[rank]) if rank < len(largest) else 1.0


def encoded(pixels: Doubles, exposure: float) -> Bytes8:
    """Linear sRGB times the exposure, clipped to [0, 1] and encoded as 8-bit sRGB."""
    linear = np.clip(pixels * exposure, 0, 1)
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(255 * curve).astype(np.uint8)


def png(pixels: Bytes8) -> bytes:
    """Encodes 8-bit sRGB ``[height, width, 3]`` as PNG."""
    return _written(pixels, "PNG")


def exr(pixels: Doubles) -> bytes:
    """Encodes linear sRGB ``[height, width, 3]`` as OpenEXR with 32-bit floats."""
    return _written(pixels.astype(np.float32), "OpenEXR")


def thumbnail(pixels: Bytes8) -> bytes:
    """Encodes a small PNG of means over square blocks of pixels; partial blocks at the right and bottom are cut off."""
    height, width = pixels.shape[:2]
    block = max(1, -(-max(height, width) // THUMBNAIL_PIXELS))
    cut = pixels[: max(1, height // block) * block, : max(1, width // block) * block].astype(np.float64)
    if height < block or width < block:
        return png(pixels)
    rows, columns = cut.shape[0] // block, cut.shape[1] // block
    means = cut.reshape(rows, block, columns, block, 3).mean(axis=(1, 3))
    return png(np.round(means).astype(np.uint8))


def _written(pixels: NDArray[np.float32] | Bytes8, file_format: str) -> bytes:
    """Encodes pixels by Mitsuba; ``file_format`` is a name of its ``Bitmap.FileFormat``."""
    mi = mitsuba()
    if mi.variant() is None:
        use_variant("scalar_rgb")
    stream = mi.MemoryStream()
    mi.Bitmap(np.ascontiguousarray(pixels)).write(stream, getattr(mi.Bitmap.FileFormat, file_format))
    return bytes(stream.raw_buffer())
