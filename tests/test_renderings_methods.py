"""Measurements of the part `renderings-methods`, on pictures and surfaces with known values."""

import numpy as np
import pytest
from conftest import use_variant

from docs.figures import alignment, hues, stam_maps

# Parameters of a scan.
PIXEL_UM, PIXELS = 0.065, 100
PERIOD_UM = 1.1


def waves(shift_um) -> np.ndarray:
    """Waves along x, whose crests are shifted by so many um, a function of y in um."""
    x, y = np.meshgrid(np.arange(PIXELS) * PIXEL_UM, np.arange(PIXELS) * PIXEL_UM)
    return 0.1 * np.cos(2 * np.pi * (x - shift_um(y)) / PERIOD_UM)


def test_wander_is_zero_for_straight_lines_and_follows_shifts():
    """A slow sine is flattened by the Gaussian to exp(−2π²σ²/L²) of its amplitude, 0.94 here, and by the plane that is
    taken off by a few per cent more. Windows cut at two deviations leave 2 nm of straight lines."""
    inside = alignment.inside(PERIOD_UM, PIXEL_UM)
    straight = alignment.wave_shift_um(waves(lambda y: 0.05 * y), PIXEL_UM, "x", PERIOD_UM)
    assert np.abs(straight[inside]).max() < 3e-3
    length_um = 6.5
    bent = waves(lambda y: 0.05 * np.cos(2 * np.pi * y / length_um))
    flattened = np.exp(-0.5 * (2 * np.pi * alignment.WINDOW_PERIODS * PERIOD_UM / length_um) ** 2)
    y = np.arange(PIXELS) * PIXEL_UM
    expected = 0.05 * flattened * np.cos(2 * np.pi * y / length_um)
    for axis, heights in (("x", bent), ("y", bent.T)):
        found = alignment.wave_shift_um(heights, PIXEL_UM, axis, PERIOD_UM)
        found = found if axis == "x" else found.T
        line = found[inside][:, PIXELS // 4]
        assert np.corrcoef(line, expected[inside[0]])[0, 1] > 0.99
        assert np.ptp(line) == pytest.approx(np.ptp(expected[inside[0]]), rel=0.1)


def test_peaks_are_found_between_pixels():
    """A parabola's vertex is found exactly, to rounding; what lies outside the order's range does not count."""
    size, spacing_um = 101, 1.6
    sine = (np.arange(size) + 0.5) * 2 / size - 1
    tops = (0.4, 0.337, 0.2812)
    pixels = np.zeros((size, size, 3))
    for channel, top in enumerate(tops):
        pixels[size // 2, :, channel] = np.maximum(1 - (sine - top) ** 2 / 0.1**2, 0)
        pixels[size // 2, np.abs(sine) < 0.02, channel] = 5
    assert stam_maps.peaks(pixels, spacing_um, (0.38, 0.78)).sines == pytest.approx(tops, abs=1e-9)


def test_gems_peaks_match_the_chapter(tmp_path):
    """sin θ = top/d for tops at 0.875, 0.75 and 0.625 um, to single precision; and the map is symmetric."""
    use_variant("scalar_rgb")
    pixels = stam_maps.brdf_map(tmp_path, {"preset": "blazed"}, 151, {**stam_maps.GEMS, "period_um": 2.0})
    found = stam_maps.peaks(pixels, 2.0, stam_maps.GEMS_RANGE_UM).sines
    assert found == pytest.approx([0.4375, 0.375, 0.3125], abs=1e-5)
    assert stam_maps.right_over_left(pixels) == pytest.approx(1, abs=1e-5)


def test_right_over_left_excludes_the_middle_column():
    pixels = np.ones((5, 5, 3))
    pixels[:, 2] = 100
    pixels[:, 3:] *= 3
    assert stam_maps.right_over_left(pixels) == pytest.approx(3)


def test_effective_hues_count_equally_full_bins():
    """To rounding, by the definition of entropy."""
    assert hues.effective_hues(np.full(36, 1 / 36)) == pytest.approx(36)
    assert hues.effective_hues(np.eye(36)[3]) == pytest.approx(1)
    assert hues.effective_hues(np.array([0.5, 0.5, 0])) == pytest.approx(2)


def test_hues_of_the_primaries():
    """sRGB's primaries in CIELAB are at 40.0°, 136.0° and 306.3°, to a tenth; grey and dark pixels do not count."""
    primaries = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.5, 0.5], [1e-3, 0, 0]], dtype=float)
    shares = hues.histogram(primaries)
    assert np.flatnonzero(shares).tolist() == [40 // hues.BIN_DEG - (hues.hue_deg(hues.lab(primaries[0])) < 40), 13, 30]
    assert shares[shares > 0] == pytest.approx([1 / 3] * 3)
    assert hues.hue_deg(hues.lab(primaries[:3])) == pytest.approx([40.0, 136.0, 306.3], abs=0.1)


def test_dark_pixels_are_counted_after_exposure():
    """A picture times any factor has the same share: two of its four pixels are below 1 % of the brightest."""
    pixels = np.array([1, 1, 1e-3, 1e-4])[:, None] * np.ones(3)
    among = np.array([True, False, True, False])
    for factor in (1e-3, 1.0, 50.0):
        assert hues.dark_fraction(factor * pixels, np.ones(4, dtype=bool)) == 0.5
        assert hues.dark_fraction(factor * pixels, among) == 0.5


def test_a_shift_of_blue_towards_purple_is_measured():
    """Red added to blue pixels raises their a*; pixels that were not blue stay out of it."""
    blue, green = np.tile([0.1, 0.3, 1.0], (50, 1)), np.tile([0.1, 1.0, 0.1], (50, 1))
    before = np.concatenate([blue, green])
    after = before + np.concatenate([np.tile([0.3, 0, 0], (50, 1)), np.zeros((50, 3))])
    same, shifted = hues.blue_means(before, before), hues.blue_means(before, after)
    assert same["count"] == shifted["count"] == 50
    assert shifted["a"] > same["a"] + 5
    assert shifted["hue_deg"] > same["hue_deg"] + 5


def test_pixels_near_a_highlight_have_a_tilted_half_vector():
    """Light along the normal: the half vector's angle is half of the view's. What is not lit does not count."""
    pairs = np.zeros((5, 8))
    for row, (view_deg, lit) in enumerate([(2, 1), (10, 1), (10, 0), (18, 1), (30, 1)]):
        angle = np.radians(view_deg)
        pairs[row] = [0, 0, 1, np.sin(angle), 0, np.cos(angle), lit, 1]
    assert hues.near_highlight(pairs).tolist() == [False, True, False, True, False]
