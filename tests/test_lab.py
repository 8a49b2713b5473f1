"""Samples of the BSDF on the laboratory's screen, against the grating equation."""

import mitsuba as mi
import numpy as np
import pytest
from conftest import built, use_variant

from mitsuba_scenes.laboratory import Bench, film_position, line, photograph, spot_mm

# A strip of the screen is enough for a grating.
BENCH = Bench(height_mm=20.0, pixels_per_mm=2.0)
PERIOD_UM, WAVELENGTH_NM = 2.5, 550.0
# Deviation of an order's lobe in cycles per um at the default coherence length, the window of the centroid.
LOBE_PER_UM = 0.0069
# The lobe is 0.8 mm wide on the screen and has some ten thousand paths: 0.01 mm of noise, and less than 0.05 mm from
# the efficiency's slope across the lobe. A period wrong by 2 % moves the order by 0.9 mm.
TOLERANCE_MM = 0.15


@pytest.fixture(scope="module")
def first_order_mm():
    """Measured x of order −1 of the blazed preset, into which most of the light goes."""
    bsdf = built("scalar_spectral", preset="blazed", conserve_energy=False)
    picture = photograph(bsdf, BENCH, line(WAVELENGTH_NM), paths=20_000)
    assert np.all(np.isfinite(picture))
    return spot_mm(BENCH, picture, PERIOD_UM, -1, WAVELENGTH_NM, LOBE_PER_UM)


def test_the_first_order_follows_the_grating_equation(first_order_mm):
    assert first_order_mm == pytest.approx(BENCH.position_mm(PERIOD_UM, -1, WAVELENGTH_NM), abs=TOLERANCE_MM)


@pytest.mark.parametrize("wrong", [0.98, 1.02])
def test_a_period_wrong_by_two_percent_is_distinguished(first_order_mm, wrong):
    moved = BENCH.position_mm(wrong * PERIOD_UM, -1, WAVELENGTH_NM)
    assert abs(first_order_mm - moved) > 4 * TOLERANCE_MM


def test_the_film_is_parallel_to_the_screen():
    """To single precision: columns go along +x, rows against +y."""
    use_variant("scalar_rgb")
    bench = Bench()
    for x, y in [(0.0, 0.0), (100.0, 50.0), (-399.0, 299.0)]:
        column, row = film_position(bench, x, y)
        assert column == pytest.approx(400 + x, abs=1e-3)
        assert row == pytest.approx(300 - y, abs=1e-3)


def test_a_mirror_sends_the_beam_to_the_mirror_direction():
    use_variant("scalar_spectral")
    bench = Bench(theta_i_deg=30.0, height_mm=20.0)
    picture = photograph(mi.load_dict({"type": "conductor"}), bench, line(WAVELENGTH_NM), paths=16_000).sum(axis=(0, 2))
    # The beam is a fifth of a pixel wide.
    assert abs(np.average(bench.x_mm(), weights=picture) + 200 * np.tan(np.radians(30))) < 0.5


def test_the_mirrored_beam_meets_the_middle_of_the_drawn_screen():
    """At 45° to sample and screen alike; the beam's own width is a fifth of a mm. Sent 1° elsewhere it is 1 mm off."""
    use_variant("scalar_spectral")
    drawn = Bench(45.0, 45.0, distance_mm=60.0, width_mm=130.0, height_mm=6.0, pixels_per_mm=2.0)
    picture = photograph(mi.load_dict({"type": "conductor"}), drawn, line(WAVELENGTH_NM), paths=16_000).sum(axis=(0, 2))
    assert abs(np.average(drawn.x_mm(), weights=picture)) < 0.25


@pytest.mark.parametrize("side", [1, -1])
def test_orders_on_a_tilted_screen_follow_the_grating_equation(side):
    """Order ±1 of light at ±45°: the sine to the normal is λ/d − sin 45°, and the screen's axis 45° from that."""
    drawn = Bench(45.0 * side, 45.0 * side, distance_mm=60.0)
    to_normal = np.arcsin(WAVELENGTH_NM / 1e3 / PERIOD_UM - np.sqrt(0.5))
    place = drawn.position_mm(PERIOD_UM, side, WAVELENGTH_NM)
    assert place == pytest.approx(side * 60 * np.tan(to_normal + np.pi / 4), rel=1e-12)
    assert drawn.angle_deg(place) == pytest.approx(side * np.degrees(to_normal), rel=1e-12)
