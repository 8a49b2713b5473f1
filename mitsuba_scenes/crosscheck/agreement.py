"""Relative error between the pixels of two linear pictures."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

# Smallest brightness of compared pixels, as a fraction of the 99th percentile of the brightness. It is the
# percentile, not the maximum, because a few pixels would set the maximum. In darker pixels the amplitudes of
# diffraction orders may cancel, and their sum in the realtime renderer's single precision has few digits. A smaller
# fraction would compare such rounding, a larger one fewer pixels.
FLOOR_FRACTION = 0.01
# Smallest brightness of pixels that enter the percentile of FLOOR_FRACTION, as a fraction of the brightest pixel. A
# diffraction order of a grating lights few pixels. The others have only the tail of the order, a Gaussian over
# direction, and would lower the percentile.
BLACK_FRACTION = 1e-6
# Upper limit on the median of the error, several times the largest measured one (docs/crosscheck.md).
MEDIAN_LIMIT = 1e-3
# Upper limit on the 99th percentile of the error, about twice the largest measured one (docs/crosscheck.md).
P99_LIMIT = 1e-2
# Smallest number of compared pixels. The 99th percentile of fewer pixels is hardly smaller than their largest error.
FEWEST_PIXELS = 50


@dataclass(frozen=True)
class Agreement:
    """Relative errors over the compared pixels: those whose brightness reaches `floor` in at least one of the pictures.

    `pixels` is their number. `floor` is a brightness as in `agreement`, the length of a linear sRGB colour as a vector.
    `median`, `p99` (the 99th percentile) and `largest` summarise the errors of single pixels.
    """

    pixels: int
    floor: float
    median: float
    p99: float
    largest: float

    @property
    def holds(self) -> bool:
        """Whether median and 99th percentile are below `MEDIAN_LIMIT` and `P99_LIMIT`."""
        return self.median < MEDIAN_LIMIT and self.p99 < P99_LIMIT

    def figures(self) -> dict:
        """All values, for a report."""
        return {**asdict(self), "holds": self.holds, "text": str(self)}

    def __str__(self) -> str:
        return f"median {self.median:.1e}, 99 % below {self.p99:.1e}, largest {self.largest:.1e} ({self.pixels} pixels)"


def agreement(a: np.ndarray, b: np.ndarray, mask: np.ndarray) -> Agreement:
    """Compares linear sRGB pictures, (height, width, 3), where the boolean array `mask`, (height, width), is true.

    The error of a pixel is |a − b| / max(|a|, |b|), and its brightness max(|a|, |b|). Here |·| is the length of a
    colour as a vector. Raises ValueError for values that are not finite and for fewer than FEWEST_PIXELS pixels to
    compare.
    """
    # From here on the pictures are (pixels, 3).
    a, b = a[mask], b[mask]
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise ValueError("a picture has values that are not finite")
    brightness = np.maximum(np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1))
    shown = brightness[brightness > BLACK_FRACTION * brightness.max(initial=0)]
    # Black pictures show nothing; no pixel reaches an infinite floor.
    floor = FLOOR_FRACTION * float(np.percentile(shown, 99)) if len(shown) else math.inf
    compared = brightness >= floor
    count = int(compared.sum())
    if count < FEWEST_PIXELS:
        raise ValueError(f"only {count} pixels are bright enough, and {FEWEST_PIXELS} are needed to compare pictures")
    error = np.linalg.norm(a - b, axis=1)[compared] / brightness[compared]
    median, p99 = np.percentile(error, [50, 99])
    return Agreement(count, floor, float(median), float(p99), float(error.max()))
