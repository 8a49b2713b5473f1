"""How well two linear pictures agree, pixel by pixel."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

# The error of a pixel is relative to its own colour, but to no less than this share of the picture's 99th percentile:
# what is darker is black to the eye, and known in single precision only against the bright orders beside it.
FLOOR_SHARE = 0.01
# Pixels that are lit, but darker than this share of the brightest, are no part of a picture's percentile: an order of a
# grating lights a few of its pixels, and leaves the others at the tail of a Gaussian.
BLACK_SHARE = 1e-6
MEDIAN_LIMIT = 1e-3
P99_LIMIT = 1e-2
# With fewer pixels that are not black the figures would say nothing.
FEWEST_PIXELS = 50


@dataclass(frozen=True)
class Agreement:
    """Relative errors over the `pixels` whose colours are above the floor in one picture at least."""

    pixels: int
    floor: float
    median: float
    p99: float
    largest: float

    @property
    def holds(self) -> bool:
        return self.median < MEDIAN_LIMIT and self.p99 < P99_LIMIT

    def figures(self) -> dict:
        """Everything, for a report."""
        return {**asdict(self), "holds": self.holds, "text": str(self)}

    def __str__(self) -> str:
        return f"median {self.median:.1e}, 99 % below {self.p99:.1e}, largest {self.largest:.1e} ({self.pixels} pixels)"


def agreement(a: np.ndarray, b: np.ndarray, mask: np.ndarray) -> Agreement:
    """Compares (height, width, 3) pictures where the mask is set. The size of a colour is the length of its vector."""
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
