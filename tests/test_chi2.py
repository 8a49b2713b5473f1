"""Samples follow the density `pdf`, by Mitsuba's χ² test."""

import mitsuba as mi
import numpy as np
import pytest
from batches import direction, eval_pdf, sample
from conftest import built, use_variant

from mitsuba_scenes.chi_square import WAVELENGTHS_NM, bsdf_test, chi_square_test

# Probability that any of the tests rejects a correct density: each has a level of SIGNIFICANCE / TEST_COUNT (Šidák).
SIGNIFICANCE = 0.01

# Polar angle and azimuth of the incidence in degrees: each occurs with and across a grating's plane.
ANGLES = [(0, 0), (30, 70), (60, 0), (80, 70)]
# Gratings are sampled order by order, skins on a square of cells.
SURFACES = {
    "blazed": {"preset": "blazed"},
    "elaphe": {"preset": "elaphe"},
    "pigmented": {"preset": "blazed", "eta": 1.56, "diffuse_reflectance": 0.4, "rotation": 25.0},
    "keratin": {"preset": "xenopeltis", "eta": 1.56},
    "patch": {"preset": "elaphe", "model": "patch", "coherence_length": 20.0},
}
# Scalar variants take one call a ray, so orders are wide and histograms coarse.
WIDE = {
    "sinusoidal": {"preset": "sinusoidal", "coherence_length": 8.0, "conserve_energy": False},
    "xenopeltis": {"preset": "xenopeltis", "coherence_length": 4.0, "conserve_energy": False, "tolerance": 1e-2},
}
TEST_COUNT = len(ANGLES) * (len(SURFACES) + len(WIDE))


def by_rays(bsdf, wi):
    """The χ² test of a BSDF in a scalar variant, with its answers collected in arrays."""

    def in_scalar(call, count, *arguments):
        use_variant("scalar_spectral")
        wis, nm = np.broadcast_to(np.float32(wi), (count, 3)), np.broadcast_to(np.float32(WAVELENGTHS_NM), (count, 4))
        answer = call(bsdf, wis, *arguments, nm)
        use_variant("llvm_ad_rgb")
        return answer

    def sample_func(u):
        u = np.array(u).T
        wo, pdf, _ = in_scalar(lambda bsdf, wis, nm: sample(bsdf, wis, nm, u), len(u))
        return mi.Vector3f(np.ascontiguousarray(wo.T.astype(np.float32))), mi.Float(pdf.astype(np.float32))

    def pdf_func(wo):
        wo = np.array(wo).T
        return mi.Float(in_scalar(lambda b, wis, nm: eval_pdf(b, wis, wo, nm)[1], len(wo)).astype(np.float32))

    use_variant("llvm_ad_rgb")
    return chi_square_test(sample_func, pdf_func, sample_count=20_000, res=25, ires=7)


@pytest.mark.parametrize("angles", ANGLES, ids=str)
@pytest.mark.parametrize("name", SURFACES)
def test_samples_follow_the_density(name, angles):
    test = bsdf_test(built("llvm_ad_spectral", **SURFACES[name]), direction(*angles))
    assert test.run(SIGNIFICANCE, TEST_COUNT, quiet=True), test.messages


@pytest.mark.parametrize("angles", ANGLES, ids=str)
@pytest.mark.parametrize("name", WIDE)
def test_core_samples_follow_the_density(name, angles):
    test = by_rays(built("scalar_spectral", **WIDE[name]), direction(*angles))
    assert test.run(SIGNIFICANCE, TEST_COUNT, quiet=True), test.messages


# The density is a mean over wavelengths, which smears orders: a coarse grid suffices.
@pytest.mark.parametrize("optics", [{}, {"eta": 1.56}, {"obliquity": "small_slope"}], ids=str)
@pytest.mark.parametrize("angles", ANGLES[1::2], ids=str)
def test_colour_samples_follow_the_density(angles, optics):
    bsdf = built("llvm_ad_rgb", preset="blazed", coherence_length=10.0, conserve_energy=False, **optics)
    test = bsdf_test(bsdf, direction(*angles), res=51, ires=8)
    assert test.run(SIGNIFICANCE, TEST_COUNT, quiet=True), test.messages


WRONG = {
    "coherence of 60 µm": {"coherence_length": 60.0},
    "turned by 0.2°": {"rotation": 0.2},
    "2 % less height": {"height": 0.245},
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_density_is_rejected(wrong):
    bsdf = built("llvm_ad_spectral", **SURFACES["blazed"])
    other = built("llvm_ad_spectral", **SURFACES["blazed"], **WRONG[wrong])
    test = bsdf_test(bsdf, direction(30, 70), pdf_of=other)
    assert not test.run(SIGNIFICANCE, TEST_COUNT, quiet=True), test.messages


def test_a_density_of_one_wavelength_is_rejected():
    """A sample may stem from each of the wavelengths, and the density is the mean over all of them."""
    bsdf = built("llvm_ad_spectral", **SURFACES["blazed"])
    both = [
        bsdf_test(bsdf, direction(30, 70), nm=nm, sample_count=100_000)
        for nm in (WAVELENGTHS_NM, WAVELENGTHS_NM[:1] * 4)
    ]
    both[0].pdf_func = both[1].pdf_func
    assert not both[0].run(SIGNIFICANCE, TEST_COUNT, quiet=True), both[0].messages
