"""Random gratings, bare and under a clear cover: the solver in Rust against stored answers of independent solvers.

Bounds are errors of an order's power in unpolarised light: root mean square and 99th percentile.
"""

import numpy as np
import pytest

from tests.judges.gratings import covers
from tests.judges.gratings.drawn import COVERED, COVERED_MEDIA, METALS, SETTLED, judged, load
from tests.judges.gratings.theories import EXACT, FRESNEL, SCALAR, fresnel, mueller, mueller_errors, powers

# Silver's bounds are larger, since the solvers of lamellar gratings converge least in it.
BOUNDS = {"none": (0.001, 0.005), "Al": (0.001, 0.005), "Au": (0.001, 0.005), "Ag": (0.004, 0.015)}
MUELLER = (0.005, 0.03)
# Under covers the judges' own errors are those of bare gratings; the dielectric's orders have a hundredth of the power.
COVERED_BOUNDS = {"Al": (0.001, 0.005), "Ag": (0.001, 0.005), "Au": (0.001, 0.005), "dielectric": (1e-4, 5e-4)}
# Factor on the index of a cover whose error exceeds the bounds.
OTHER_COVER = 1.01
KEPT, KEPT_COVERED = load(), load(COVERED)


@pytest.mark.parametrize("metal", METALS)
def test_the_solver_agrees_with_the_judges(metal):
    group = [answer for answer in KEPT if answer.setting.metal == metal]
    assert len(group) >= 12
    errors = {SCALAR: [], FRESNEL: [], EXACT: []}
    for answer in group:
        for name, values in powers(answer).items():
            errors[name].append(np.abs(values - answer.power))
    rms, p99 = ({name: f(np.concatenate(e)) for name, e in errors.items()} for f in (root, percentile))
    assert rms[EXACT] < BOUNDS[metal][0], rms
    assert p99[EXACT] < BOUNDS[metal][1], p99
    # Negative control: the other theories exceed the bounds.
    assert rms[SCALAR] > 5 * BOUNDS[metal][0]
    assert metal == "none" or rms[FRESNEL] > 2 * BOUNDS[metal][0]


@pytest.mark.parametrize("medium", COVERED_MEDIA)
def test_covered_gratings_agree_with_the_judges(medium):
    """The judges solve in a medium of the cover's index; the solver in Rust enlarges the grating instead."""
    group = [answer for answer in KEPT_COVERED if answer.setting.metal == medium]
    assert len(group) >= 20
    true = np.concatenate([covers.through_means(answer) for answer in group])
    exact = np.concatenate([covers.powers(answer, EXACT) for answer in group])
    rms, p99 = COVERED_BOUNDS[medium]
    assert root(exact - true) < rms
    assert percentile(np.abs(exact - true)) < p99
    # Negative controls on every fourth setting: the other theory, and another index of the cover.
    few = group[::4]
    true = np.concatenate([covers.through_means(answer) for answer in few])
    scalar = np.concatenate([covers.powers(answer, SCALAR) for answer in few])
    assert root(scalar - true) > 5 * rms
    other = [covers.powers(answer, EXACT, OTHER_COVER * answer.setting.cover_eta) for answer in few]
    assert root(np.concatenate(other) - true) > 2 * rms


def test_the_flat_sides_transmittances_have_their_closed_forms():
    """Both are 4n/(n + 1)² along the normal; p passes wholly at Brewster's angle, and nothing at grazing incidence."""
    n = 1.58
    np.testing.assert_allclose(covers.transmittances(n, 1.0), 4 * n / (n + 1) ** 2)
    assert covers.transmittances(n, np.cos(np.arctan(n)))[1] == pytest.approx(1)
    np.testing.assert_allclose(covers.transmittances(n, 0.0), 0)


def root(errors):
    return np.sqrt(np.mean(errors**2))


def percentile(errors):
    return np.quantile(errors, 0.99)


def test_mueller_matrices_agree_with_the_judges():
    """Errors of Mueller matrices of sinusoids in metals, at random azimuths, are within the bounds."""
    errors = np.abs(np.concatenate([mueller_errors(answer) for answer in KEPT if answer.jones is not None]))
    assert len(errors) > 1000
    assert root(errors) < MUELLER[0]
    assert percentile(errors) < MUELLER[1]


def test_stored_answers_are_the_judges():
    """Both solvers in pure Python reproduce their stored answers of the shortest periods, the quickest."""
    for kept, chosen in (
        (KEPT, lambda s: s.metal == "none"),
        (KEPT, lambda s: s.shape == "sinusoidal" and s.metal != "none"),
        (KEPT_COVERED, lambda s: s.shape == "sinusoidal"),
    ):
        answer = min((answer for answer in kept if chosen(answer.setting)), key=lambda a: a.setting.period_um)
        found = judged(answer.setting)
        assert found.orders.tolist() == answer.orders.tolist()
        # Rounding in the file, and between libraries of linear algebra.
        np.testing.assert_allclose(found.power, answer.power, atol=1e-6)
        assert answer.unsettled <= SETTLED


def test_a_mirrors_mueller_matrix_and_reflectance():
    """The comparison's formulas have their closed forms: s and p without phase, and light along the normal."""
    found = mueller(np.diag([1.0, -0.5])[None])[0]
    np.testing.assert_allclose(found[:2, :2], [[0.625, 0.375], [0.375, 0.625]])
    normal = np.array([0.0, 0.0, 1.0])
    n = 0.96 + 6.69j
    assert fresnel(n, normal, normal[None])[0] == pytest.approx(abs((n - 1) / (n + 1)) ** 2)
