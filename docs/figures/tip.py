"""A relief imaged by the tip of an atomic-force microscope: dilation by a sphere.

The tip is a sphere of radius R on a shaft that is not wider than the sphere. At each position x the tip is lowered
until it touches the relief h somewhere. The image is then the height of the tip's apex, its lowest point,
s(x) = max over |u| ≤ R of h(x + u) + √(R² − |u|²) − R. Here u is the offset of a point of the relief from the tip's
axis.
"""

from __future__ import annotations

import numpy as np

# Number of steps of the offset u along a radius R, for tiles. At half a step, R/20, from the axis the underside of the
# sphere is only about (R/20)²/(2R) = R/800 above the apex, so finer steps would hardly matter.
STEPS = 10


def seen_profile(heights_um: np.ndarray, step_um: float, radius_um: float) -> np.ndarray:
    """The image of one period of a grating, (samples,), from samples of the profile that are `step_um` apart.

    `step_um` should be far below the radius, since offsets u are whole steps.
    """
    # The largest offset u in steps.
    reach = int(radius_um / step_um)
    # Offset 0 is included, so the image is never below the relief.
    offsets = np.arange(-reach, reach + 1)
    return np.max([np.roll(heights_um, -u) + cap_um(u * step_um, radius_um) for u in offsets], axis=0)


def seen_tile(heights_um: np.ndarray, pixel_um: float, radius_um: float) -> np.ndarray:
    """The image of a tile [iy, ix] that repeats, at its pixels.

    Between pixels the relief is interpolated as a band-limited function, by shifts of its spectrum. The tip may
    therefore be smaller than a pixel.
    """
    spectrum = np.fft.rfft2(heights_um)
    rows, columns = heights_um.shape
    # Spatial frequencies in cycles per µm.
    ky = np.fft.fftfreq(rows)[:, None] / pixel_um
    kx = np.fft.rfftfreq(columns) / pixel_um
    image_um = heights_um.copy()
    offsets_um = np.arange(-STEPS, STEPS + 1) * (radius_um / STEPS)
    for y_um in offsets_um:
        for x_um in offsets_um:
            distance_um = np.hypot(x_um, y_um)
            if 0 < distance_um <= radius_um:
                phase = 2 * np.pi * (kx * x_um + ky * y_um)
                shifted_um = np.fft.irfft2(spectrum * np.exp(1j * phase), s=heights_um.shape)
                np.maximum(image_um, shifted_um + cap_um(distance_um, radius_um), out=image_um)
    return image_um


def cap_um(distance_um: float, radius_um: float) -> float:
    """√(R² − d²) − R, the apex's height minus that of the sphere's underside, at the distance d ≤ R from the axis."""
    return float(np.sqrt(max(radius_um**2 - distance_um**2, 0.0)) - radius_um)
