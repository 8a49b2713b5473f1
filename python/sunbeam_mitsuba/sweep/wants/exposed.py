"""Exposure of a picture of radiance, with the figures that every such picture has."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..pictures import automatic_exposure, encoded
from .want import Answer, WantError

if TYPE_CHECKING:
    from ..pictures import Bytes8, Doubles


def exposed(pixels: Doubles, seen: Doubles, exposure: float) -> tuple[Answer, Bytes8]:
    """Encodes a picture at an exposure, with the figures exposure and mean colour of the pixels ``seen[count, 3]``.

    An exposure of 0 selects the automatic one. Returns the answer with these figures, and the picture in 8-bit sRGB.
    Raises :class:`WantError` where a number is not finite.
    """
    bad = int(np.count_nonzero(~np.isfinite(pixels)))
    if bad:
        raise WantError(f"{bad} of {pixels.size} values are not finite")
    exposure = exposure or automatic_exposure(pixels)
    answer = Answer()
    answer.number("exposure", exposure)
    for channel, mean in zip("rgb", seen.mean(axis=0)):
        answer.number(f"mean_{channel}", float(mean))
    return answer, encoded(pixels, exposure)
