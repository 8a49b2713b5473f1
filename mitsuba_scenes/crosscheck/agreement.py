"""Relative error between the pixels of two linear pictures."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

# Pixels below this fraction of the picture's 99th percentile do not count: they appear black, and single precision
# resolves them only relative to the bright orders beside them.
FLOOR_SHARE = 0.01
# Pixels below this fraction of the brightest do not enter the percentile: a grating's order lights few pixels and
# leaves the others in the tail of a Gaussian.
BLACK_SHARE = 1e-6
# Largest accepted median and 99th percentile of the error; measured are 1e-4 and 4e-3 at most (docs/crosscheck.md).
MEDIAN_LIMIT = 1e-3
P99_LIMIT = 1e-2
# Smallest number of counted pixels for which percentiles are meaningful.
FEWEST_PIXELS = 50


@dataclass(frozen=True)
class Agreement:
    """Relative errors over the `pixels` with a colour above `floor` in at least one of the pictures."""

    pixels: int
    floor: float
    median: float
    p99: float
    largest: float

    @property
    def holds(self) -> bool:
        """Whether both limits are kept."""
        return self.median < MEDIAN_LIMIT and self.p99 < P99_LIMIT

    def figures(self) -> dict:
        """All values, for a report."""
        return {**asdict(self), "holds": self.holds, "text": str(self)}

    def __str__(self) -> str:
        return f"median {self.median:.1e}, 99 % below {self.p99:.1e}, largest {self.largest:.1e} ({self.pixels} pixels)"


def agreement(a: np.ndarray, b: np.ndarray, mask: np.ndarray) -> Agreement:
    """Compares pictures, (height, width, 3), where `mask` is set; the size of a colour is the length of its vector."""
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
