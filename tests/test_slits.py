"""Gratings of N slits: intensities against sums of waves, and angles of the drawings against lengths of paths."""

import json
import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from doc_pages import REPOSITORY

from docs.figures.slits import Slits, colour_weights, full_width, limit_of_width, relative_intensity, white_light
from docs.figures.spacing import Evaluation
from mitsuba_scenes.tool import sunbeam

PICTURES = REPOSITORY / "docs" / "images" / "slits"
NM = 500.0
# Division of a slit into this many parts changes an intensity by at most 1/(3 PARTS²): sin²β/β² becomes
# (sin β / (M sin(β/M)))² with M parts, which is larger by at most sin²β/(3M²).
PARTS = 120
DIVIDED = 1.1 / (3 * PARTS**2)
# Coordinates in an SVG have six decimals, in hundreds of points.
DRAWN_DEG = 1e-3
# Angles in degrees and lengths in nm of the drawings, as docs/templates/slits.md.j2 gives them.
ORDERS_THETA_I, PATHS_THETA_I, PLANE_THETA_I, MAP_PHI_V = 30.0, 50.0, 75.0, 40.0
DRAWN_NM, GROOVES_NM, SLITS_NM = 550.0, 2500.0, 1250.0


def waves_added_one_by_one(count, sine):
    """Relative intensity as the squared mean of the waves of all parts of all slits."""
    total = 0j
    for slit in range(count):
        for part in range(PARTS):
            place_um = 150.0 * slit + 30.0 * (part + 0.5) / PARTS
            total += np.exp(-2j * math.pi * place_um * sine / 0.5)
    return abs(total / (count * PARTS)) ** 2


@pytest.mark.parametrize("count", [1, 2, 3, 5, 10, 50])
def test_closed_form_is_the_sum_of_the_waves(count):
    """At maxima, zeros and the missing order 5, up to the error of the division into parts."""
    sine = np.concatenate([np.arange(7) * 0.5 / 150, [0.5 / 150 / count], np.linspace(-0.06, 0.06, 38)])
    found = relative_intensity(Slits(count), sine, NM)
    np.testing.assert_allclose(found, waves_added_one_by_one(count, sine), atol=DIVIDED)
    assert found[0] == 1
    assert found[5] < 1e-12, "order 5 is on the first zero of a slit a fifth as wide as the spacing"


def test_another_spacing_is_noticed():
    sine = np.linspace(-0.06, 0.06, 45)
    wrong = relative_intensity(Slits(5, spacing_um=151.0), sine, NM)
    assert np.abs(wrong - waves_added_one_by_one(5, sine)).max() > 100 * DIVIDED


@pytest.mark.parametrize("count", [5, 7, 10, 50])
def test_width_tends_to_its_limit_as_one_over_n(count):
    """The limit is 2t/π with (sin t / t)² = 1/2, t = 1.39156; the excess is below 1/N² of it."""
    assert limit_of_width() == pytest.approx(2 * 1.39156 / math.pi, abs=1e-5)
    width = full_width(Slits(count), NM)
    half = width / 2 * 0.5 / (count * 150.0)
    assert waves_added_one_by_one(count, np.array([half]))[0] == pytest.approx(0.5, abs=2 * DIVIDED)
    assert 0 < width / limit_of_width() - 1 < 1 / count**2


def test_white_light_is_white_as_a_whole_and_blue_in_the_middle():
    """Beyond a sine of 0.2 a slit of 30 µm sends λ/(0.2 π² 30 µm) of its light, at most 1.3 %."""
    wavelengths_nm, weights = colour_weights()
    sine = np.linspace(-0.2, 0.2, 20001)
    coarse = weights[::20] / weights[::20].sum(axis=0)
    seen = white_light(Slits(2), sine, (wavelengths_nm[::20], coarse))
    whole = seen.mean(axis=0)
    np.testing.assert_allclose(whole / whole[1], 1, atol=0.013)
    red, green, blue = seen[10000]
    assert blue > green > red


def rays(picture):
    """Start and end of each line with an id in a picture, y upwards, by id."""
    found = {}
    for group in ElementTree.parse(PICTURES / picture).iter("{http://www.w3.org/2000/svg}g"):
        path = group.find("{http://www.w3.org/2000/svg}path")
        numbers = re.fullmatch(r"M (\S+) (\S+)\s+L (\S+) (\S+)\s*", path.get("d")) if path is not None else None
        if numbers:
            x0, y0, x1, y1 = map(float, numbers.groups())
            found[group.get("id")] = np.array([[x0, -y0], [x1, -y1]])
    return found


def angle_deg(ray):
    """Angle of a leaving ray with the vertical, positive to the right."""
    return math.degrees(math.atan2(*(ray[1] - ray[0])))


def sine_by_paths(order, wavelength_nm, theta_i_deg, period_nm):
    """ωo,x of an order, by bisection on path lengths.

    The path from a distant source over the groove at +x to a distant eye is `order` wavelengths shorter than that over
    the groove at -x. The grating equation is not used.
    """
    far = 1e11
    source = far * np.array([math.sin(math.radians(theta_i_deg)), math.cos(math.radians(theta_i_deg))])
    grooves = period_nm * np.array([[-0.5, 0.0], [0.5, 0.0]])

    def shorter(sine):
        eye = far * np.array([sine, math.sqrt(1 - sine**2)])
        a, b = (np.linalg.norm(source - groove) + np.linalg.norm(eye - groove) for groove in grooves)
        return (a - b) / wavelength_nm

    low, high = -1.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if shorter(middle) < order else (low, middle)
    return low


def test_orders_are_drawn_where_paths_have_them():
    drawn = rays("orders.svg")
    assert angle_deg(drawn.pop("light")[::-1]) == pytest.approx(ORDERS_THETA_I, abs=DRAWN_DEG)
    assert angle_deg(drawn.pop("order0")) == pytest.approx(-ORDERS_THETA_I, abs=DRAWN_DEG)
    fans = {name: ray for name, ray in drawn.items() if name.startswith("order")}
    assert len(fans) >= 4 * 5
    for name, ray in fans.items():
        order, wavelength_nm = re.fullmatch(r"order(-?\d+)-(\d+)nm", name).groups()
        sine = sine_by_paths(int(order), float(wavelength_nm), ORDERS_THETA_I, GROOVES_NM)
        assert math.sin(math.radians(angle_deg(ray))) == pytest.approx(sine, abs=2e-5), name


@pytest.mark.parametrize(
    ("picture", "light", "view", "theta_i_deg"),
    [
        ("groove-paths.svg", "arriving-A", "leaving-B", PATHS_THETA_I),
        ("incident-plane.svg", "incident-light", "incident-view", PLANE_THETA_I),
    ],
)
def test_light_and_view_are_drawn_where_paths_have_them(picture, light, view, theta_i_deg):
    drawn = rays(picture)
    assert angle_deg(drawn[light][::-1]) == pytest.approx(theta_i_deg, abs=DRAWN_DEG)
    sine = sine_by_paths(1, DRAWN_NM, theta_i_deg, GROOVES_NM)
    assert angle_deg(drawn[view]) == pytest.approx(math.degrees(math.asin(sine)), abs=DRAWN_DEG)


@pytest.mark.parametrize("ray", ["screen-order1", "path-upper", "path-lower"])
def test_rays_to_the_screen_are_drawn_where_paths_have_them(ray):
    first_deg = math.degrees(math.asin(sine_by_paths(1, DRAWN_NM, 0.0, SLITS_NM)))
    # The grating's normal is horizontal in this drawing.
    assert 90 - angle_deg(rays("slits-and-screen.svg")[ray]) == pytest.approx(first_deg, abs=DRAWN_DEG)


def test_the_view_of_the_map_is_drawn_at_its_azimuth():
    assert 90 - angle_deg(rays("map-coordinates.svg")["map-view"]) == pytest.approx(MAP_PHI_V, abs=DRAWN_DEG)


def test_the_command_has_its_orders_where_they_are_drawn():
    """Order 1 of `blazed` at 75° peaks at the angle of figure 1.6; the search steps by 0.01°."""
    words = ["--preset", "blazed", "--method", "flss", "--theta-i", PLANE_THETA_I, "--wavelength-step", 10]
    found = json.loads(sunbeam("evaluate", *words, "--angles=-57,-39", "--angle-step", 0.01))
    peak_deg = found["peaks_deg"][found["wavelengths_nm"].index(DRAWN_NM)]
    assert peak_deg == pytest.approx(angle_deg(rays("incident-plane.svg")["incident-view"]), abs=0.02)


def test_spacings_that_no_angle_of_view_has_are_refused():
    """At 500 nm, angles from -50° to -41° have spacings between 1600 and 2500 nm."""
    report = {"wavelengths_nm": [500.0], "angles_deg": [-50.0, -40.0], "angle_step_deg": 1.0}
    evaluation = Evaluation(report, np.ones((1, 10)))
    assert 1600 < evaluation.within(1600, 2600).report["mean_nm"] < 2600
    with pytest.raises(ValueError, match="no angle of view"):
        evaluation.within(100, 200)
