"""The Maxwell solver for reliefs that repeat along x and y, against closed forms, other solvers and the model."""

import csv
import json

import needs
import numpy as np
import pytest
from perturbation import first_order, fresnel

from mitsuba_scenes.crosscheck.cases import DATA
from mitsuba_scenes.tool import sunbeam
from tests.judges.crossed.cases import KERATIN, answers
from tests.judges.crossed.crops import FADE, Crop, cropped
from tests.judges.crossed.model import FORMS, efficiencies, misplaced
from tests.judges.crossed.panels import panels
from tests.judges.crossed.relief import Relief, synthetic
from tests.judges.crossed.solver import Resolution, solve

# Crops of the scans and the powers of their orders by another Maxwell solver.
GIVEN = DATA / "maxwell"
PIXEL_UM = 0.065
NM = 550.0
# Resolution for reliefs of few harmonics.
QUICK = Resolution(cutoff_per_um=5.0, nodes=9)
# GMRES stops at a residual of 1e-6 of the sources; the error of powers is smaller.
SOLVED = 1e-6


def outgoing(relief, theta_deg, phi_deg, jx, jy):
    """Directions to the light and of its orders."""
    theta, phi = np.radians([theta_deg, phi_deg])
    wi = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    xy = NM * 1e-3 * np.stack([jx, jy], -1) / relief.period - wi[:2]
    return wi, np.concatenate([xy, np.sqrt(1 - (xy**2).sum(-1, keepdims=True))], -1)


def test_polynomials_pass_through_their_nodes():
    """Values and slopes of a cubic are exact to rounding."""
    made = panels(0.3, 0.2, 6)
    at = -np.cos(np.pi * np.arange(6) / 5)
    nodes = np.concatenate([0.3 * (at - 1) / 2, 0.2 * (at + 1) / 2])
    np.testing.assert_allclose(made.value @ nodes**3, made.points**3, atol=1e-14)
    np.testing.assert_allclose(made.slope @ nodes**3, 3 * made.points**2, atol=1e-12)


@pytest.mark.parametrize("above", [1.0, 1.4])
@pytest.mark.parametrize("n", [KERATIN, 0.96 + 6.69j])
@pytest.mark.parametrize("angles", [(0.0, 0.0), (40.0, 25.0), (75.0, -110.0)])
def test_a_flat_relief_is_a_mirror(n, angles, above):
    """Order 0 has Fresnel's amplitudes and phases; the polynomials resolve the exponentials in the metal, too."""
    flat = Relief(np.zeros((3, 3)), (0.4 / above, 0.5 / above))
    found = solve(flat, NM, *angles, n, QUICK, above)
    mirror = (found.jx == 0) & (found.jy == 0)
    expected = fresnel(np.cos(np.radians(angles[0])), n / above)
    np.testing.assert_allclose(found.jones[mirror][0], expected, atol=SOLVED)
    assert found.unpolarised[~mirror].max(initial=0) < SOLVED**2


@pytest.mark.parametrize("n", [KERATIN, 0.96 + 6.69j, 0.06 + 3.59j])
@pytest.mark.parametrize("angles", [(20.0, 0.0), (60.0, 35.0)])
def test_reliefs_along_x_agree_with_the_boundary_integral(n, angles):
    """`sunbeam orders` solves other equations, by a boundary integral. A metal needs more nodes."""
    x = np.arange(33) / 33
    wave = Relief(0.05 * (1 + np.sin(2 * np.pi * x))[None], (0.9, 0.02))
    found = solve(wave, NM, *angles, n, Resolution(14.0, 24, 1e-7))
    words = ["--preset", "sinusoidal", "--period", 0.9, "--height", 0.1, "--eta", np.real(n), "--k", np.imag(n)]
    words += ["--theory", "rigorous", "--theta-i", angles[0], "--phi-i", angles[1], "--json"]
    expected = {order["order"]: order["mean"] for order in json.loads(sunbeam("orders", *words))["orders"]}
    assert set(found.jx) == set(expected)
    np.testing.assert_allclose(found.unpolarised, [expected[j] for j in found.jx], atol=SOLVED)


def test_shallow_reliefs_agree_with_perturbation_theory():
    """Amplitudes and phases are of first order; the second order is smaller by 2k times the height, 1e-3."""
    relief = synthetic().scaled(1e-3)
    theta, phi = 40.0, 35.0
    found = solve(relief, NM, theta, phi, KERATIN, QUICK)
    wi, wo = outgoing(relief, theta, phi, found.jx, found.jy)
    spectrum = np.fft.fft2(relief.heights) / relief.heights.size
    # A relief a·exp(iK·x) has the amplitude ka times the matrix; the transform's harmonics are those of exp(+i).
    relevant = ((found.jx != 0) | (found.jy != 0)) & (np.abs(spectrum[found.jy, found.jx]) > 1e-7)
    assert relevant.sum() >= 8
    height = spectrum[found.jy, found.jx][relevant]
    k = 2e3 * np.pi / NM
    jones = first_order(np.broadcast_to(wi, wo.shape), wo, KERATIN)[relevant] * (k * height)[:, None, None]
    largest = np.abs(jones).max()
    np.testing.assert_allclose(found.jones[relevant], jones, atol=3e-3 * largest)


def test_power_is_kept_and_orders_are_reciprocal():
    relief = synthetic()
    there = solve(relief, NM, 40.0, 35.0, KERATIN)
    assert there.balance < 1e-5
    assert there.residual < 1e-5
    i = int(np.argmax(there.unpolarised * ((there.jx != 0) | (there.jy != 0))))
    _, wo = outgoing(relief, 40.0, 35.0, there.jx[i], there.jy[i])
    angles = np.degrees([np.arccos(wo[2]), np.arctan2(wo[1], wo[0])])
    back = solve(relief, NM, *map(float, angles), KERATIN)
    same = (back.jx == there.jx[i]) & (back.jy == there.jy[i])
    assert there.unpolarised[i] > 1e-3
    assert back.unpolarised[same][0] == pytest.approx(there.unpolarised[i], abs=1e-6)


def test_stored_answers_are_the_solvers():
    """A solution of lower resolution reproduces stored answers to its error and their rounding."""
    kept = answers("synthetic")["synthetic"]
    for answer in (kept[0], kept[3]):
        light = answer.light
        found = solve(synthetic(), light.wavelength_nm, light.theta_deg, light.phi_deg, KERATIN, Resolution(7.0, 9))
        assert found.jx.tolist() == answer.jx.tolist()
        assert found.jy.tolist() == answer.jy.tolist()
        np.testing.assert_allclose(found.s, answer.s, atol=3e-6)
        np.testing.assert_allclose(found.p, answer.p, atol=3e-6)


def test_small_slopes_are_nearest_to_maxwell():
    """The small slope misplaces clearly the least of all forms on a skin with the slopes of the gentler scan."""
    kept = answers("synthetic")["synthetic"]
    lights = [(answer.light, answer.jx, answer.jy) for answer in kept]
    means = {}
    for form in FORMS:
        # Energy conservation needs tables, which take seconds.
        if not form.conserve_energy:
            powers = efficiencies(synthetic(), complex(KERATIN), form, lights)
            means[form.name] = np.mean([misplaced(a, b.unpolarised) for a, b in zip(powers, kept)])
    assert means["small_slope"] < SMALL_SLOPE_MISPLACES, means
    assert min(value for name, value in means.items() if name != "small_slope") > 1.5 * means["small_slope"], means


# Fraction of the reflected power in wrong orders, mean over the lights.
SMALL_SLOPE_MISPLACES = 0.02


def test_crops_repeat():
    """Steps across the seam are no larger than between neighbouring rows."""
    rng = np.random.default_rng(1)
    y, x = np.indices((60, 60))
    heights = 0.1 * np.sin(x / 5) + 0.01 * y + 0.005 * rng.standard_normal((60, 60))
    crop = Crop("elaphe", "test", (10, 12), (30, 28))
    relief = cropped(heights, PIXEL_UM, crop, 1.0)
    assert relief.heights.shape == (30, 28)
    assert relief.period == pytest.approx((28 * PIXEL_UM, 30 * PIXEL_UM))
    steps = np.abs(np.diff(relief.heights, axis=0)).max(), np.abs(relief.heights[0] - relief.heights[-1]).max()
    assert steps[1] < 1.5 * steps[0]
    assert FADE < 12


@pytest.mark.parametrize("skin", ["elaphe", "xenopeltis"])
def test_scans_agree_with_the_other_maxwell_solver(skin):
    """The other solver, with a residual of 2e-5, has equal powers at the light with the weakest orders."""
    if not (GIVEN / f"{skin}_A.npy").exists():
        needs.skip("scans", f"{GIVEN} is missing")
    heights = np.load(GIVEN / f"{skin}_A.npy")
    relief = Relief(heights, (heights.shape[1] * PIXEL_UM, heights.shape[0] * PIXEL_UM))
    with (GIVEN / f"maxwell_{skin}_A.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if (row["lambda"], row["theta"], row["phi"]) == ("650", "60", "90")]
    found = solve(relief, 650.0, 60.0, 90.0, KERATIN, Resolution(8.0, 10))
    given = {(int(row["jx"]), int(row["jy"])): float(row["eff_unpol"]) for row in rows}
    assert len(given) == len(found.jx)
    expected = np.array([given[j] for j in zip(found.jx, found.jy)])
    assert misplaced(found.unpolarised, expected) < 1e-3
