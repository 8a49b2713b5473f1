"""Exposure of pictures, and their encoding as files: linear EXR, sRGB PNG, and small PNGs for the contact sheet.

Pictures are arrays ``[height, width, 3]`` of sRGB, the top row first: linear ``Doubles``, or encoded 8-bit ``Bytes8``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .reflector import mitsuba, use_variant

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]
    Bytes8 = NDArray[np.uint8]

# Largest side of a thumbnail in pixels.
_THUMBNAIL_PIXELS = 96
# Fraction of the lit pixels that automatic exposure clips, as in ``sunbeam brdf-map`` (src/colour/exposure.rs). Larger
# values brighten pictures; smaller ones keep more highlights.
_CLIPPED_FRACTION = 0.01


def automatic_exposure(pixels: Doubles) -> float:
    """Factor on linear sRGB ``[..., 3]`` that brings about _CLIPPED_FRACTION of the lit pixels above 1 in some channel.

    Lit pixels have a positive channel. The factor of a black picture is 1.
    """
    largest_channels = np.sort(pixels.max(axis=-1).ravel())
    lit = largest_channels[largest_channels > 0]
    rank = int((1 - _CLIPPED_FRACTION) * len(lit))
    return float(1 / lit[rank]) if rank < len(lit) else 1.0


def encoded(pixels: Doubles, exposure: float) -> Bytes8:
    """Linear sRGB ``[..., 3]`` times the factor ``exposure``, clipped to [0, 1], as 8-bit sRGB (IEC 61966-2-1)."""
    linear = np.clip(pixels * exposure, 0, 1)
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(255 * curve).astype(np.uint8)


def png(pixels: Bytes8) -> bytes:
    """Encodes 8-bit sRGB as PNG."""
    return _file_content(pixels, "PNG")


def exr(pixels: Doubles) -> bytes:
    """Encodes linear sRGB as OpenEXR with 32-bit floats."""
    return _file_content(pixels.astype(np.float32), "OpenEXR")


def thumbnail(pixels: Bytes8) -> bytes:
    """Encodes a PNG of means over square blocks of pixels, with sides of at most _THUMBNAIL_PIXELS.

    The encoded values are averaged. Partial blocks at the right and bottom are cut off. A picture with a side shorter
    than a block keeps its size.
    """
    height, width = pixels.shape[:2]
    # Side of a block in pixels, by a division that rounds up.
    block = -(-max(height, width) // _THUMBNAIL_PIXELS)
    rows, columns = height // block, width // block
    if rows == 0 or columns == 0:
        return png(pixels)
    whole_blocks = pixels[: rows * block, : columns * block].astype(np.float64)
    # Indices [block row, row within, block column, column within, channel]; the mean is over both "within".
    means = whole_blocks.reshape(rows, block, columns, block, 3).mean(axis=(1, 3))
    return png(np.round(means).astype(np.uint8))


def _file_content(pixels: NDArray[np.float32] | Bytes8, file_format: str) -> bytes:
    """Encodes pixels by Mitsuba; ``file_format`` is a name of its ``Bitmap.FileFormat``."""
    mi = mitsuba()
    # Mitsuba has no Bitmap before a variant is selected; any variant serves.
    if mi.variant() is None:
        use_variant("scalar_rgb")
    stream = mi.MemoryStream()
    mi.Bitmap(np.ascontiguousarray(pixels)).write(stream, getattr(mi.Bitmap.FileFormat, file_format))
    return bytes(stream.raw_buffer())
