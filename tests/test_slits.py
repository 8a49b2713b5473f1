"""The page `slits`: intensities against sums of waves, drawings against the lengths of paths and the built command."""

import json
import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from doc_pages import REPOSITORY

from docs.figures import slits_drawings, slits_space
from docs.figures.slits import fitted_exponent
from docs.figures.slits_intensity import (
    Slits,
    colour_weights,
    direct_amplitude,
    first_zero_sine,
    full_width_sine,
    limit_of_width,
    on_bare_screen,
    relative_intensity,
    white_light,
)
from mitsuba_scenes.tool import sunbeam

PICTURES = REPOSITORY / "docs" / "images" / "slits"
DATA = json.loads((REPOSITORY / "docs" / "data" / "slits.json").read_text(encoding="utf-8"))
NM = 500.0
# A slit divided into so many parts moves an intensity by at most 1/(3 PARTS²): the square of sin β/(M sin(β/M)) minus
# that of sin β/β is sin²β/(3M²) and less.
PARTS = 120
DIVIDED = 1.1 / (3 * PARTS**2)
# SVG has its coordinates in six decimals, of hundreds of points.
DRAWN_DEG = 1e-3


def waves_added_one_by_one(count, sine):
    """Relative intensity from the definition: waves of all parts of all slits, in plain numbers."""
    total = 0j
    for slit in range(count):
        for part in range(PARTS):
            place_um = 150.0 * slit + 30.0 * (part + 0.5) / PARTS
            total += np.exp(-2j * math.pi * place_um * sine / 0.5)
    return abs(total / (count * PARTS)) ** 2


@pytest.mark.parametrize("count", [1, 2, 3, 5, 10, 50])
def test_closed_form_is_the_sum_of_the_waves(count):
    """At places that include maxima, zeros and the missing order 5, to what the division into parts costs."""
    sine = np.concatenate([np.arange(7) * 0.5 / 150, [0.5 / 150 / count], np.linspace(-0.06, 0.06, 38)])
    expected = waves_added_one_by_one(count, sine)
    found = relative_intensity(Slits(count), sine, NM)
    np.testing.assert_allclose(found, expected, atol=DIVIDED)
    np.testing.assert_allclose(np.abs(direct_amplitude(Slits(count), sine, NM, PARTS)) ** 2, expected, atol=1e-12)
    assert found[0] == 1
    assert found[5] < 1e-12, "order 5 is on the first zero of a slit a fifth as wide as the spacing"


def test_another_spacing_is_noticed():
    sine = np.linspace(-0.06, 0.06, 45)
    wrong = relative_intensity(Slits(5, spacing_um=151.0), sine, NM)
    assert np.abs(wrong - waves_added_one_by_one(5, sine)).max() > 100 * DIVIDED


@pytest.mark.parametrize("count", [2, 3, 5, 10, 50])
def test_first_zero_is_at_lambda_over_nd(count):
    """The sum's amplitude changes sign there, to rounding, and nowhere before."""
    expected = 0.5 / (count * 150.0)
    assert first_zero_sine(Slits(count), NM) == pytest.approx(expected, rel=1e-9)
    assert waves_added_one_by_one(count, np.array([expected]))[0] < 1e-20
    assert waves_added_one_by_one(count, np.linspace(0, 0.99, 30) * expected).min() > 1e-6


def test_width_goes_as_one_over_n():
    """The sum of the waves is a half where the width ends. The width tends to 0.8859 λ/(Nd), t = 1.39156 being where
    (sin t / t)² is a half; from 5 slits on it is wider by less than 1/N² of that."""
    assert limit_of_width() == pytest.approx(2 * 1.39156 / math.pi, abs=1e-5)
    rows = []
    for count in (5, 7, 10, 50):
        slits = Slits(count)
        width = full_width_sine(slits, NM)
        assert waves_added_one_by_one(count, np.array([width / 2]))[0] == pytest.approx(0.5, abs=2 * DIVIDED)
        assert 0 < width / slits.zero_sine(NM) / limit_of_width() - 1 < 1 / count**2
        rows.append({"count": count, "width_mm": width})
    assert fitted_exponent(rows) == pytest.approx(-1, abs=0.01)
    assert DATA["exponent"] == pytest.approx(fitted_exponent(rows), abs=1e-4), "the page is stale"


def test_a_far_screen_shows_the_far_field_and_a_near_one_does_not():
    """At a thousand times (Nd)²/λ, what is left of the curvature is π/4/1000 of a radian at the grating's edges, which
    changes an intensity of 1 by 1e-3 at most."""
    slits = Slits(10)
    for distance_mm, low, high in ((1e3 * slits.far_field_mm(NM), 0, 1e-3), (500.0, 0.5, 1)):
        x_mm = distance_mm * np.linspace(-2, 2, 401) * 0.5 / 150
        sine = x_mm / np.hypot(x_mm, distance_mm)
        difference = on_bare_screen(slits, x_mm, distance_mm, NM) - relative_intensity(slits, sine, NM)
        assert low <= np.abs(difference).max() < high


def test_white_light_is_white_as_a_whole_and_blue_in_the_middle():
    """Every wavelength passes the slits alike, so that all that the screen receives is white. The screen of this test
    ends at a sine of 0.2, beyond which a slit of 30 µm sends λ/(0.2 π² 30 µm), 1.3 % at most."""
    wavelengths_nm, weights = colour_weights()
    np.testing.assert_allclose(weights.sum(axis=0), 1, atol=1e-12)
    assert weights[np.abs(wavelengths_nm - 450).argmin()].argmax() == 2
    assert weights[np.abs(wavelengths_nm - 650).argmin()].argmax() == 0
    sine = np.linspace(-0.2, 0.2, 20001)
    coarse = weights[::20] / weights[::20].sum(axis=0)
    seen = white_light(Slits(2), sine, (wavelengths_nm[::20], coarse))
    whole = seen.mean(axis=0)
    np.testing.assert_allclose(whole / whole[1], 1, atol=0.013)
    centre = seen[10000]
    assert centre[2] > centre[1] > centre[0]


def rays(picture):
    """Start and end of each line with an id in a picture, with y upwards."""
    found = {}
    for group in ElementTree.parse(PICTURES / picture).iter("{http://www.w3.org/2000/svg}g"):
        path = group.find("{http://www.w3.org/2000/svg}path")
        numbers = re.fullmatch(r"M (\S+) (\S+)\s+L (\S+) (\S+)\s*", path.get("d")) if path is not None else None
        if numbers:
            x0, y0, x1, y1 = map(float, numbers.groups())
            found[group.get("id")] = np.array([[x0, -y0], [x1, -y1]])
    return found


def angle_deg(ray):
    """The angle of a ray that leaves, with the vertical, positive to the right."""
    return math.degrees(math.atan2(*(ray[1] - ray[0])))


def sine_by_paths(order, wavelength_nm, theta_i_deg, period_nm):
    """ωo,x of an order from lengths of paths: light from far away to two grooves and on to a far place, the path over
    the groove at +x being `order` wavelengths shorter. Found by halving; the grating equation does not enter."""
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


def test_orders_are_drawn_where_paths_say():
    """The lines of the picture itself, each wavelength of each order."""
    drawn = rays("orders.svg")
    light = drawn.pop("light")
    theta_i_deg = angle_deg(light[::-1])
    assert theta_i_deg == pytest.approx(slits_drawings.ORDERS_THETA_I_DEG, abs=DRAWN_DEG)
    assert angle_deg(drawn.pop("order0")) == pytest.approx(-theta_i_deg, abs=DRAWN_DEG)
    fans = {name: ray for name, ray in drawn.items() if name.startswith("order")}
    assert len(fans) == 4 * len(slits_drawings.FAN_NM)
    for name, ray in fans.items():
        order, wavelength_nm = re.fullmatch(r"order(-?\d+)-(\d+)nm", name).groups()
        sine = sine_by_paths(int(order), float(wavelength_nm), slits_drawings.ORDERS_THETA_I_DEG, 2500.0)
        assert math.sin(math.radians(angle_deg(ray))) == pytest.approx(sine, abs=2e-5), name


def test_paths_and_planes_are_drawn_where_paths_say():
    paths, plane, screen = rays("groove-paths.svg"), rays("incident-plane.svg"), rays("slits-and-screen.svg")
    for light, view, theta_i_deg in (
        (paths["arriving-A"], paths["leaving-B"], slits_drawings.PATHS_THETA_I_DEG),
        (plane["incident-light"], plane["incident-view"], slits_space.EVALUATED_THETA_I_DEG),
    ):
        assert angle_deg(light[::-1]) == pytest.approx(theta_i_deg, abs=DRAWN_DEG)
        sine = sine_by_paths(1, 550.0, theta_i_deg, 2500.0)
        assert angle_deg(view) == pytest.approx(math.degrees(math.asin(sine)), abs=DRAWN_DEG)
    # From left to right, so that the angle with the axis is what the vertical lacks.
    first_deg = math.degrees(math.asin(sine_by_paths(1, 550.0, 0.0, 1250.0)))
    for ray in (screen["screen-order1"], screen["path-upper"], screen["path-lower"]):
        assert 90 - angle_deg(ray) == pytest.approx(first_deg, abs=DRAWN_DEG)


def test_the_two_parts_of_the_path_make_the_order():
    """Order 1: what is saved on the way to B less what is lost on the way from it is one wavelength. Rounding only."""
    parts = DATA["drawings"]["paths"]
    assert parts["saved_waves"] - parts["lost_waves"] == pytest.approx(1, abs=1e-9)
    assert parts["saved_waves"] == pytest.approx(2.5 * math.sin(math.radians(50)) / 0.55, abs=1e-9)


def test_the_command_has_its_orders_where_they_are_drawn():
    """The drawn sign is the code's: order 1 of `blazed` at 75° peaks at the angle of figure 1.6. The spacing is right
    to 3e-5, so the angle to a few thousandths of a degree; the search is in steps of 0.01°."""
    angle = DATA["drawings"]["plane"]["theta_r_deg"]
    words = ["--preset", "blazed", "--method", "flss", "--theta-i", 75, "--wavelength-step", 10]
    found = json.loads(sunbeam("evaluate", *words, "--angles=-57,-39", "--angle-step", 0.01))
    at = found["wavelengths_nm"].index(slits_drawings.WAVELENGTH_NM)
    assert found["peaks_deg"][at] == pytest.approx(angle, abs=0.02)


def test_the_map_has_its_orders_and_angles_in_place():
    """Orders are λ/d apart with order 0 in the mirror's direction; the direction of view is at its azimuth."""
    x = {row["order"]: row["x"] for row in DATA["drawings"]["map_orders"]}
    assert x[0] == pytest.approx(-math.sin(math.radians(slits_space.MAP_THETA_I_DEG)))
    for order, place in x.items():
        assert place == pytest.approx(sine_by_paths(order, 550.0, slits_space.MAP_THETA_I_DEG, 2500.0), abs=2e-5)
    view = rays("map-coordinates.svg")["map-view"]
    assert 90 - angle_deg(view) == pytest.approx(slits_space.PHI_V_DEG, abs=DRAWN_DEG)
