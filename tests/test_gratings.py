"""What the page `gratings` says of classic curves, at a few points of each."""

import numpy as np
import pytest

from docs.figures.gratings_curves import blaze_angle_deg, echelette, littrow, mirror_curve, preset, vertex
from tests.judges.gratings.metals import index, surface_plasmon

PERIOD_UM = 0.8


def test_indices_equal_mitsubas():
    """At wavelengths of the files; between them values lie between those."""
    assert index("Au", 855.063293) == pytest.approx(0.198125 + 5.63125j, rel=1e-5)
    between = index("Al", 870.0)
    assert 2.24 < between.real < 2.58
    with pytest.raises(ValueError, match="not at 1000"):
        index("Ag", 1000.0)


def test_an_echelette_of_a_perfect_conductor_sends_tm_back_at_its_blaze(tmp_path):
    """Maréchal and Stroke 1959. The file's corners are the profile's, to rounding."""
    samples = (50, 553)
    relief = echelette(PERIOD_UM, samples, tmp_path / "echelette.npy")
    blaze = 2 * np.sin(np.radians(blaze_angle_deg(samples)))
    found = littrow(relief, blaze, None)
    assert found["tm"] == pytest.approx(1, abs=1e-4)
    assert found["te"] < 0.9
    # From the other side the facets are turned away.
    wavelength_nm = 1e3 * PERIOD_UM * blaze
    assert littrow(preset("lamellar", PERIOD_UM, 0.1), blaze, None)["tm"] < 0.9
    assert wavelength_nm == pytest.approx(481.1, abs=0.1)


def test_passing_orders_break_the_curve_of_tm():
    """At λ/d = 2/3 TM of a perfect conductor changes as the root of the distance, by 1e-2 here, and TE does not."""
    steps = {}
    for key in ("te", "tm"):
        below, above = (
            littrow(preset("sinusoidal", PERIOD_UM, 0.24), 2 / 3 + apart, None)[key] for apart in (-2e-4, 2e-4)
        )
        further = littrow(preset("sinusoidal", PERIOD_UM, 0.24), 2 / 3 + 6e-4, None)[key]
        steps[key] = abs(above - below), abs(further - above)
    assert max(steps["tm"]) > 5 * max(steps["te"])


def test_shallow_silver_has_its_dip_at_the_plasmon():
    """Raether's closed form; 4 nm of groove move the dip by less than a hundredth of a degree."""
    nm = 632.8
    expected = float(np.degrees(np.arcsin(surface_plasmon(index("Ag", nm)) - nm * 1e-3 / PERIOD_UM)))
    curve = mirror_curve(preset("sinusoidal", PERIOD_UM, 0.004), "Ag", nm, (expected - 0.5, expected + 0.5, 21))
    angle, depth = vertex(curve["theta_deg"], -np.array(curve["tm"]))
    assert angle == pytest.approx(expected, abs=0.02)
    assert -depth < 0.97
    # The negative control: gold's plasmon is elsewhere.
    other = float(np.degrees(np.arcsin(surface_plasmon(index("Au", nm)) - nm * 1e-3 / PERIOD_UM)))
    assert abs(other - expected) > 0.1


def test_the_vertex_of_a_parabola_is_found():
    x = np.linspace(0, 1, 11)
    assert vertex(x, 3 - (x - 0.43) ** 2) == pytest.approx((0.43, 3.0))
    with pytest.raises(ValueError, match="end"):
        vertex(x, x)
