"""Random evaluations through Mitsuba; `make figures PAGES=stability` has ten million."""

import numpy as np
import pytest
from conftest import use_variant

from docs.figures.questions import one_surface, questions

# Values are products of the same factors in another order, each rounded in single precision.
RECIPROCITY = 1e-5


def test_random_evaluations_are_finite_and_not_negative():
    use_variant("llvm_ad_spectral")
    found = questions(160_000, 4, seed=7)
    assert found["asked"] == 160_000
    assert (found["not_finite"], found["negative"], found["without_density"]) == (0, 0, 0)
    assert found["reciprocity"] <= RECIPROCITY
    # Negative control: there were samples to judge.
    assert found["samples"] > 10_000


@pytest.mark.parametrize(("break_it", "key"), [(lambda f: f * np.nan, "not_finite"), (lambda f: -f, "negative")])
def test_broken_values_are_counted(make_bsdf, break_it, key):
    use_variant("llvm_ad_spectral")
    bsdf = make_bsdf(preset="flat", coherence_length=2.0, conserve_energy=False)

    class Broken:
        sample = bsdf.sample

        @staticmethod
        def eval_pdf(*arguments):
            value, pdf = bsdf.eval_pdf(*arguments)
            return break_it(value), pdf

    assert one_surface(Broken, np.random.default_rng(1), 500)[key] > 500
