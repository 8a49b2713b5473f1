"""Classic curves of the page `gratings`, at a few points each."""

import numpy as np
import pytest

from docs.figures.gratings_curves import blaze_angle_deg, echelette, littrow, mirror_curve, preset, vertex
from tests.judges.gratings.metals import index, surface_plasmon

PERIOD_UM = 0.8


def test_indices_equal_mitsubas():
    """Indices equal those of Mitsuba's files at the files' wavelengths, and are interpolated between them."""
    assert index("Au", 855.063293) == pytest.approx(0.198125 + 5.63125j, rel=1e-5)
    between = index("Al", 870.0)
    assert 2.24 < between.real < 2.58
    with pytest.raises(ValueError, match="not at 1000"):
        index("Ag", 1000.0)


def test_an_echelette_of_a_perfect_conductor_sends_tm_back_at_its_blaze(tmp_path):
    """The efficiency in TM is 1 (Maréchal and Stroke 1959). The file's corners are the profile's, to rounding."""
    samples = (50, 553)
    relief = echelette(PERIOD_UM, samples, tmp_path / "echelette.npy")
    blaze = 2 * np.sin(np.radians(blaze_angle_deg(samples)))
    found = littrow(relief, blaze, None)
    assert found["tm"] == pytest.approx(1, abs=1e-4)
    assert found["te"] < 0.9
    # A lamellar grating has no blaze.
    wavelength_nm = 1e3 * PERIOD_UM * blaze
    assert littrow(preset("lamellar", PERIOD_UM, 0.1), blaze, None)["tm"] < 0.9
    assert wavelength_nm == pytest.approx(481.1, abs=0.1)


def test_passing_orders_break_the_curve_of_tm():
    """At λ/d = 2/3 TM changes with the root of the distance, here by 1e-2; TE does not (perfect conductor)."""
    steps = {}
    for key in ("te", "tm"):
        below, above = (
            littrow(preset("sinusoidal", PERIOD_UM, 0.24), 2 / 3 + apart, None)[key] for apart in (-2e-4, 2e-4)
        )
        further = littrow(preset("sinusoidal", PERIOD_UM, 0.24), 2 / 3 + 6e-4, None)[key]
        steps[key] = abs(above - below), abs(further - above)
    assert max(steps["tm"]) > 5 * max(steps["te"])


def test_shallow_silver_has_its_dip_at_the_plasmon():
    """The dip is at Raether's closed form; a depth of 4 nm moves it by less than 0.01°."""
    nm = 632.8
    expected = float(np.degrees(np.arcsin(surface_plasmon(index("Ag", nm)) - nm * 1e-3 / PERIOD_UM)))
    curve = mirror_curve(preset("sinusoidal", PERIOD_UM, 0.004), "Ag", nm, (expected - 0.5, expected + 0.5, 21))
    angle, depth = vertex(curve["theta_deg"], -np.array(curve["tm"]))
    assert angle == pytest.approx(expected, abs=0.02)
    assert -depth < 0.97
    # Negative control: gold's plasmon is at another angle.
    other = float(np.degrees(np.arcsin(surface_plasmon(index("Au", nm)) - nm * 1e-3 / PERIOD_UM)))
    assert abs(other - expected) > 0.1


def test_the_vertex_of_a_parabola_is_found():
    x = np.linspace(0, 1, 11)
    assert vertex(x, 3 - (x - 0.43) ** 2) == pytest.approx((0.43, 3.0))
    with pytest.raises(ValueError, match="end"):
        vertex(x, x)
