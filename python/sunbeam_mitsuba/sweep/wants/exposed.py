"""Exposure of a picture, and the figures that the wants ``map`` and ``render`` have in common.

A *want* is a group of figures of a sweep (want.py).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..pictures import automatic_exposure, encoded
from .want import Answer, WantError

if TYPE_CHECKING:
    from ..pictures import Bytes8, Doubles


def exposed(pixels: Doubles, averaged: Doubles, exposure: float) -> tuple[Answer, Bytes8]:
    """Exposes the picture ``pixels[height, width, 3]`` in linear sRGB.

    ``exposure`` is a factor; 0 selects automatic exposure.

    Returns an answer with the figures ``exposure``, ``mean_r``, ``mean_g`` and ``mean_b``, and the 8-bit sRGB picture.
    The means are over ``averaged[count, 3]``, at least one of these pixels, before exposure. Raises :class:`WantError`
    where a pixel is not finite.
    """
    bad = int(np.count_nonzero(~np.isfinite(pixels)))
    if bad:
        raise WantError(f"{bad} of {pixels.size} values are not finite")
    exposure = exposure or automatic_exposure(pixels)
    answer = Answer()
    answer.number("exposure", exposure)
    for channel, mean in zip("rgb", averaged.mean(axis=0)):
        answer.number(f"mean_{channel}", float(mean))
    return answer, encoded(pixels, exposure)
