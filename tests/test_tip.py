"""A relief imaged by a microscope's tip, against closed forms."""

import numpy as np
import pytest

from docs.figures.tip import STEPS, seen_profile, seen_tile
from docs.figures.tour_scan import two_strongest

STEP_UM, PERIOD_UM = 0.0005, 1.0
X_UM = np.arange(round(PERIOD_UM / STEP_UM)) * STEP_UM


@pytest.mark.parametrize("radius_um", [0.005, 0.01, 0.03])
def test_a_step_becomes_a_quarter_circle(radius_um):
    """Beyond the edge the sphere rolls over it: s = h + √(R² − d²) − R at the distance d."""
    height_um = 0.1
    seen = seen_profile(np.where(X_UM < 0.5, height_um, 0.0), STEP_UM, radius_um)
    # The last point of the upper level is the edge.
    distance_um = X_UM - X_UM[X_UM < 0.5].max()
    # Rounding of distances is magnified without bound where the circle is vertical.
    over = (distance_um > 0) & (distance_um < 0.99 * radius_um)
    circle = height_um + np.sqrt(radius_um**2 - distance_um[over] ** 2) - radius_um
    np.testing.assert_allclose(seen[over], circle, rtol=0, atol=1e-9)
    assert (seen[(distance_um > 1.01 * radius_um) & (X_UM < 0.9)] == 0).all()
    assert (seen[X_UM < 0.5] == height_um).all()


def offset_curve_um(heights, slopes, x_um, radius_um):
    """Where the apex is when the sphere touches at x: the curve moved by R along its normal, less R."""
    norm = np.hypot(1.0, slopes)
    return x_um - radius_um * slopes / norm, heights + radius_um / norm - radius_um


def sine(x_um):
    k = 2 * np.pi / PERIOD_UM
    return 0.1 * np.cos(k * x_um), -0.1 * k * np.sin(k * x_um)


@pytest.mark.parametrize("radius_um", [0.01, 0.03])
def test_a_smooth_relief_becomes_its_offset_curve(radius_um):
    """The sphere is smaller than every curvature, 0.25 µm, so that it touches everywhere."""
    heights, slopes = sine(X_UM)
    x_um, expected = offset_curve_um(heights, slopes, X_UM, radius_um)
    seen = np.interp(x_um, X_UM, seen_profile(heights, STEP_UM, radius_um), period=PERIOD_UM)
    # The gap between sphere and relief has at most the curvature (1 + slope²)^1.5/R + 4/µm, and offsets are a step
    # apart. Linear interpolation adds 4/µm · step²/8.
    curvature = np.hypot(1.0, slopes).max() ** 3 / radius_um + 4.0
    missed_um = curvature * (STEP_UM / 2) ** 2 / 2 + 4.0 * STEP_UM**2 / 8
    np.testing.assert_allclose(seen, expected, rtol=0, atol=missed_um)


@pytest.mark.parametrize("radius_um", [0.005, 0.03])
@pytest.mark.parametrize("along_y", [False, True])
def test_a_tip_finer_than_a_pixel_sees_the_smooth_relief(radius_um, along_y):
    pixels = 16
    pixel_um = PERIOD_UM / pixels
    heights = np.tile(sine(np.arange(pixels) * pixel_um)[0], (4, 1))
    seen = seen_tile(heights.T if along_y else heights, pixel_um, radius_um)
    seen = seen.T if along_y else seen
    x_um, expected = offset_curve_um(*sine(X_UM), X_UM, radius_um)
    at = np.arange(pixels) * pixel_um
    order = np.argsort(x_um)
    expected = np.interp(at, x_um[order], expected[order], period=PERIOD_UM)
    # The tip's surface at offsets R/10 apart, along both axes.
    curvature = np.hypot(1.0, sine(X_UM)[1]).max() ** 3 / radius_um + 4.0
    missed_um = 2 * curvature * (radius_um / STEPS / 2) ** 2 / 2
    np.testing.assert_allclose(seen, np.tile(expected, (4, 1)), rtol=0, atol=missed_um)


def test_a_tilted_plane_is_raised_by_the_flank():
    """On a slope the sphere touches beside its apex: the picture lies higher by R(√(1 + slope²) − 1)."""
    heights = np.interp(X_UM, [0, 0.5, 1.0], [0, 0.25, 0])
    seen = seen_profile(heights, STEP_UM, 0.03)
    middle = (X_UM > 0.1) & (X_UM < 0.4)
    np.testing.assert_allclose((seen - heights)[middle], 0.03 * (np.hypot(1, 0.5) - 1), rtol=0, atol=5e-6)


def test_one_of_two_mirrored_orders_is_reported():
    assert two_strongest({0: 0.1, 1: 0.4, -1: 0.4, 3: 0.05, -3: 0.05}) in ([1, 0], [-1, 0])
    assert two_strongest({-1: 0.8, 0: 0.1, 1: 0.2}) == [-1, 1]
