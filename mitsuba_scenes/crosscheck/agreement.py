"""Relative error between the pixels of two linear pictures."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

# Threshold of counted pixels, as a fraction of the 99th percentile. Darker pixels appear black, and the sums in single
# precision have an error relative to the bright orders nearby. Chosen.
FLOOR_SHARE = 0.01
# Threshold of pixels that enter the 99th percentile, as a fraction of the brightest. A grating's order lights few
# pixels; the others have only the tail of its Gaussian and would pull the percentile down. Chosen.
BLACK_SHARE = 1e-6
# Largest accepted median of the error; the largest measured is 1e-4 (docs/crosscheck.md).
MEDIAN_LIMIT = 1e-3
# Largest accepted 99th percentile of the error; the largest measured is 4e-3 (docs/crosscheck.md).
P99_LIMIT = 1e-2
# Smallest number of counted pixels for which percentiles are meaningful.
FEWEST_PIXELS = 50


@dataclass(frozen=True)
class Agreement:
    """Relative errors over the counted pixels: those whose colour exceeds `floor` in at least one of the pictures.

    `pixels` is their number, `p99` the 99th percentile of the error.
    """

    pixels: int
    floor: float
    median: float
    p99: float
    largest: float

    @property
    def holds(self) -> bool:
        """Whether median and 99th percentile are below their limits."""
        return self.median < MEDIAN_LIMIT and self.p99 < P99_LIMIT

    def figures(self) -> dict:
        """All values, for a report."""
        return {**asdict(self), "holds": self.holds, "text": str(self)}

    def __str__(self) -> str:
        return f"median {self.median:.1e}, 99 % below {self.p99:.1e}, largest {self.largest:.1e} ({self.pixels} pixels)"


def agreement(a: np.ndarray, b: np.ndarray, mask: np.ndarray) -> Agreement:
    """Compares pictures, (height, width, 3), where `mask` is set.

    The error at a pixel is |a − b| / max(|a|, |b|), with the length of the colour as a vector. Raises ValueError for
    values that are not finite and for fewer than FEWEST_PIXELS counted pixels.
    """
    a, b = a[mask], b[mask]
    size = np.maximum(np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1))
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise ValueError("a picture has values that are not finite")
    shown = size[size > BLACK_SHARE * size.max(initial=0)]
    floor = FLOOR_SHARE * float(np.percentile(shown, 99)) if len(shown) else 0.0
    counted = size >= floor if floor > 0 else np.zeros(len(size), dtype=bool)
    if counted.sum() < FEWEST_PIXELS:
        raise ValueError(f"only {counted.sum()} pixels are lit, and {FEWEST_PIXELS} are needed to compare pictures")
    error = np.linalg.norm(a - b, axis=1)[counted] / size[counted]
    median, p99 = np.percentile(error, [50, 99])
    return Agreement(int(counted.sum()), floor, float(median), float(p99), float(error.max()))
