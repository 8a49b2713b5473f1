"""Random gratings: the solver in Rust against stored answers of independent solvers.

Bounds are errors of an order's power in unpolarised light: root mean square and 99th percentile.
"""

import numpy as np
import pytest

from tests.judges.gratings.drawn import METALS, SETTLED, judged, load
from tests.judges.gratings.theories import EXACT, FRESNEL, SCALAR, fresnel, mueller, mueller_errors, powers

# Silver's bounds are larger, since the solvers of lamellar gratings converge least in it.
BOUNDS = {"none": (0.001, 0.005), "Al": (0.001, 0.005), "Au": (0.001, 0.005), "Ag": (0.004, 0.015)}
MUELLER = (0.005, 0.03)
KEPT = load()


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
    """Both solvers in pure Python reproduce their stored answer of the shortest period, the quickest."""
    for chosen in (lambda s: s.metal == "none", lambda s: s.shape == "sinusoidal" and s.metal != "none"):
        answer = min((answer for answer in KEPT if chosen(answer.setting)), key=lambda a: a.setting.period_um)
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
