"""A relief imaged by the tip of an atomic-force microscope: dilation by a sphere.

The tip is a sphere of radius R on a shaft no wider. Its apex stops above x where the tip first touches the relief h, so
the image is s(x) = max over |u| ≤ R of h(x + u) + √(R² − |u|²) − R.
"""

from __future__ import annotations

import numpy as np

# Number of offsets u along a radius. Half a step of R/10 from the apex, the sphere is lower by R/800.
STEPS = 10


def seen_profile(heights_um: np.ndarray, step_um: float, radius_um: float) -> np.ndarray:
    """The image of one period of a grating that is constant along its grooves, with samples `step_um` apart."""
    reach = int(radius_um / step_um)
    # Offset 0 is included, so the image is never below the relief.
    offsets = np.arange(-reach, reach + 1)
    return np.max([np.roll(heights_um, -u) + cap_um(u * step_um, radius_um) for u in offsets], axis=0)


def seen_tile(heights_um: np.ndarray, pixel_um: float, radius_um: float) -> np.ndarray:
    """The image of a tile `[iy, ix]` that repeats, at its pixels.

    Between pixels the relief is band-limited and evaluated by shifts of its spectrum, so the tip may be smaller than
    a pixel.
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
    """√(R² − d²) − R: the apex's height minus the height of the sphere's underside at distance d from the axis."""
    return float(np.sqrt(max(radius_um**2 - distance_um**2, 0.0)) - radius_um)
