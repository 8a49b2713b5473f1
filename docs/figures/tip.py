"""A relief as the tip of an atomic-force microscope sees it: dilated by a sphere.

The tip is a sphere of radius R on a shaft no wider. Its apex stops above x where it first touches the relief h, so that
the picture is s(x) = max over |u| ≤ R of h(x + u) + √(R² − |u|²) − R.
"""

from __future__ import annotations

import numpy as np

# Offsets u along a radius. Half a step of R/10 off, the sphere is R/800 from its highest point.
STEPS = 10


def seen_profile(heights_um: np.ndarray, step_um: float, radius_um: float) -> np.ndarray:
    """The picture of one period of a grating, whose heights are `step_um` apart and do not vary along the grooves."""
    reach = int(radius_um / step_um)
    # The heights themselves are among the offsets, so that nothing is seen below the relief.
    offsets = np.arange(-reach, reach + 1)
    return np.max([np.roll(heights_um, -u) + cap_um(u * step_um, radius_um) for u in offsets], axis=0)


def seen_tile(heights_um: np.ndarray, pixel_um: float, radius_um: float) -> np.ndarray:
    """The picture of a tile `[iy, ix]` that repeats, at its pixels.

    Between the pixels the relief is the band-limited function through them, evaluated by shifts of its spectrum, so
    that a tip may be finer than a pixel.
    """
    spectrum = np.fft.rfft2(heights_um)
    rows, columns = heights_um.shape
    ky = np.fft.fftfreq(rows)[:, None] / pixel_um
    kx = np.fft.rfftfreq(columns) / pixel_um
    seen = heights_um.copy()
    steps = np.arange(-STEPS, STEPS + 1) * (radius_um / STEPS)
    for y in steps:
        for x in steps:
            if 0 < np.hypot(x, y) <= radius_um:
                shifted = np.fft.irfft2(spectrum * np.exp(2j * np.pi * (kx * x + ky * y)), s=heights_um.shape)
                np.maximum(seen, shifted + cap_um(np.hypot(x, y), radius_um), out=seen)
    return seen


def cap_um(distance_um: float, radius_um: float) -> float:
    """√(R² − d²) − R: the apex's height less that of the sphere's underside at the distance d from the axis."""
    return float(np.sqrt(max(radius_um**2 - distance_um**2, 0.0)) - radius_um)
