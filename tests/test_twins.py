"""The Rust core, which scalar variants call ray by ray, and its twin in Dr.Jit give equal lobes."""

import mitsuba as mi
import numpy as np
import pytest
from batches import eval_pdf, random_directions, random_wavelengths, sample
from conftest import built, use_variant

# Largest relative difference between the twins, in single precision.
RTOL = 1e-4
# Fraction of the sampling density below which values are compared absolutely. Single precision in κ leaves errors of
# 1.5e-7 of an order's largest power. The density is the mean over four wavelengths of the powers at nearly equal κ.
# Where an order passes through zero at one wavelength and is dim at the others, the density is a twentieth of the
# largest power (sinusoid, order 0: J0² is 1e-4 at 627 nm and 0.09 at 813 nm), so the error is 3.3e-6 of the density.
FLOOR = 4e-2
# Largest difference of a direction's components. Random numbers are stretched to each interval that they fall into,
# which costs digits of single precision.
WO_ATOL = 1e-3
# Fraction of samples that may differ: their random number lies on the edge of an interval, or in a very short one.
EDGE_FRACTION = 2e-3
# The fraction by surface, where it is larger: with a window of 1 µm the lost digits are 1e-3 of the direction.
WIDE_EDGE_FRACTION = {"1 µm": 2e-2}
# Largest difference of colours, relative to the luminance because channels cancel. Measured: 99.5 % of the directions
# are within 1.3e-4 (blazed) and all within 2.6e-4.
RGB_RTOL = 3e-4
# Fraction of directions beyond RGB_RTOL, where only the tail of an order's Gaussian is left.
RGB_FRACTION = 5e-3
# Largest difference between a monochromatic value and the luminance of the colour, relative to the largest channel. One
# sum in another order; measured 1.2e-7.
MONO_RTOL = 1e-6

QUERIES = 2000
QUERIES_RGB = 500

SURFACES = {
    "flat": {"preset": "flat"},
    "blazed": {"preset": "blazed"},
    "cd": {"preset": "cd"},
    "xenopeltis": {"preset": "xenopeltis"},
    "unscaled": {"preset": "sinusoidal", "conserve_energy": False},
    "unit": {"preset": "sinusoidal", "obliquity": "unit", "period": 1.25, "height": 0.15},
    "small slope": {"preset": "sinusoidal", "eta": 1.56, "period": 1.25, "height": 0.15},
    "small slope of a metal": {"preset": "blazed", "eta": 1.0, "k": 6.0, "obliquity": "small_slope"},
    "small slope of everything": {"preset": "sinusoidal", "obliquity": "small_slope", "conserve_energy": False},
    "shadowing": {"preset": "blazed", "shadowing": True, "conserve_energy": False},
    "patch grating": {"preset": "lamellar", "model": "patch"},
    "patch grating scaled": {"preset": "blazed", "model": "patch", "conserve_energy": True},
    "patch skin": {"preset": "elaphe", "model": "patch", "coherence_length": 20.0},
    "1 µm": {"preset": "blazed", "coherence_length": 1.0, "conserve_energy": False},
    "10 µm": {"preset": "blazed", "coherence_length": 10.0, "conserve_energy": False},
    "10 mm": {"preset": "blazed", "coherence_length": 1e4, "conserve_energy": False},
    "tolerance": {"preset": "blazed", "tolerance": 1e-5, "conserve_energy": False},
    "file": {"filename": "rough.npy", "pixel_size": 0.1, "coherence_length": 20.0},
    "patch file": {"filename": "rough.npy", "pixel_size": 0.1, "coherence_length": 3.0, "model": "patch"},
    "periodic file": {"filename": "rough.npy", "pixel_size": 0.1, "tiling": "periodic", "conserve_energy": False},
}
IN_COLOUR = ["blazed", "unit", "small slope", "small slope of everything", "10 µm", "patch grating", "file"]


@pytest.fixture(scope="module")
def parameters_of(tmp_path_factory):
    """Parameters of a surface by its name. The file holds a small, smooth, random relief, longer than wide."""
    path = tmp_path_factory.mktemp("reliefs") / "rough.npy"
    rng = np.random.default_rng(5)
    waves = np.fft.rfft2(rng.normal(size=(36, 50)))
    waves[6:-6], waves[:, 8:] = 0, 0
    relief = np.fft.irfft2(waves, s=(36, 50))
    np.save(path, 0.3 * relief / np.ptp(relief))

    def parameters(name):
        given = dict(SURFACES[name])
        if "filename" in given:
            given["filename"] = str(path)
        return given

    return parameters


def queries(parameters, variant, count):
    """Random incidence, outgoing directions, wavelengths and random numbers; most directions lie in orders."""
    rng = np.random.default_rng(11)
    wi, nm = random_directions(rng, count), random_wavelengths(rng, count)
    u = rng.random((count, 3)).astype(np.float32)
    wo, pdf, _ = sample(built(variant, **parameters), wi, nm, u)
    elsewhere = (pdf == 0) | (np.arange(count) < count // 5)
    wo = np.where(elsewhere[:, None], random_directions(rng, count), wo).astype(np.float32)
    return wi, wo, nm, u


def evaluated(variant, parameters, wi, wo, nm):
    return eval_pdf(built(variant, **parameters), wi, wo, nm)


def worst(ours, theirs):
    """The largest error of values and densities: relative, with `FLOOR`."""
    (value, pdf), (other_value, other_pdf) = ours, theirs
    scale = np.maximum(np.maximum(np.abs(value), np.abs(other_value)), FLOOR * np.maximum(pdf, other_pdf)[:, None])
    of_value = np.max(np.abs(value - other_value) / np.maximum(scale, 1e-30))
    of_pdf = np.max(np.abs(pdf - other_pdf) / np.maximum(np.maximum(pdf, other_pdf), 1e-30))
    return max(of_value, of_pdf)


def is_sane(value, pdf):
    return bool(np.all(np.isfinite(value)) and np.all(value >= 0) and np.all(np.isfinite(pdf)) and np.all(pdf > 0))


@pytest.mark.parametrize("name", SURFACES)
def test_values_and_densities_agree(parameters_of, name):
    parameters = parameters_of(name)
    wi, wo, nm, _ = queries(parameters, "llvm_ad_spectral", QUERIES)
    twin = evaluated("llvm_ad_spectral", parameters, wi, wo, nm)
    core = evaluated("scalar_spectral", parameters, wi, wo, nm)
    assert is_sane(*core)
    assert is_sane(*twin)
    assert worst(core, twin) <= RTOL


@pytest.mark.parametrize("name", SURFACES)
def test_samples_agree(parameters_of, name):
    parameters = parameters_of(name)
    wi, _, nm, u = queries(parameters, "llvm_ad_spectral", QUERIES)
    wo, pdf, weight = sample(built("llvm_ad_spectral", **parameters), wi, nm, u)
    core_wo, core_pdf, core_weight = sample(built("scalar_spectral", **parameters), wi, nm, u)
    together = np.abs(wo - core_wo).max(axis=1) <= WO_ATOL
    assert together.mean() >= 1 - WIDE_EDGE_FRACTION.get(name, EDGE_FRACTION)
    # The density varies within an order, so both are evaluated at one direction.
    value, density = evaluated("scalar_spectral", parameters, wi, wo.astype(np.float32), nm)
    kept = pdf > 0
    assert worst((value[kept], density[kept]), (weight[kept] * pdf[kept, None], pdf[kept])) <= RTOL
    assert np.array_equal(core_pdf[together] == 0, pdf[together] == 0)
    assert np.all(weight[~kept] == 0)
    assert np.all(core_weight[core_pdf == 0] == 0)


WRONG = {
    "turned by 1°": {"rotation": 1.0},
    "coherence of 64 µm": {"coherence_length": 64.0},
    "0.1 % less height": {"height": 0.25 * 0.999},
    "other obliquity": {"obliquity": "unit"},
    "unscaled": {"conserve_energy": False},
}


@pytest.mark.parametrize("wrong", WRONG)
def test_another_surface_disagrees(wrong):
    parameters = {"preset": "blazed"}
    wi, wo, nm, _ = queries(parameters, "llvm_ad_spectral", QUERIES)
    core = evaluated("scalar_spectral", parameters, wi, wo, nm)
    assert worst(core, evaluated("llvm_ad_spectral", {**parameters, **WRONG[wrong]}, wi, wo, nm)) > 10 * RTOL


@pytest.mark.parametrize("flip", [[-1, 1, 1], [1, -1, 1]], ids=str)
def test_a_flipped_sign_disagrees(flip):
    parameters = {"preset": "elaphe"}
    wi, wo, nm, _ = queries(parameters, "llvm_ad_spectral", QUERIES)
    core = evaluated("scalar_spectral", parameters, wi, wo, nm)
    flip = np.array(flip, dtype=np.float32)
    assert worst(core, evaluated("llvm_ad_spectral", parameters, wi * flip, wo * flip, nm)) > 10 * RTOL


def test_the_blaze_leans_the_right_way():
    """A facet that rises along +x reflects light from the normal to −x; both twins could have the other sign."""
    tilt = 2 * np.arctan(0.1)
    wo = np.array([[-np.sin(tilt), 0, np.cos(tilt)], [np.sin(tilt), 0, np.cos(tilt)]], dtype=np.float32)
    wi, nm = np.array([[0, 0, 1]] * 2, dtype=np.float32), np.full((2, 4), 2.5e3 * np.sin(tilt), dtype=np.float32)
    for variant in ["scalar_spectral", "llvm_ad_spectral"]:
        (towards, away), _ = evaluated(variant, {"preset": "blazed"}, wi, wo, nm)
        assert np.all(towards > 100 * away), variant


LUMINANCE = np.array([0.2126729, 0.7151522, 0.072175])


def desaturated(rgb):
    """The colour mixed with grey of its luminance until no channel is negative, as scalar variants do."""
    grey, least = np.maximum(rgb @ LUMINANCE, 0)[:, None], rgb.min(axis=1, keepdims=True)
    saturation = np.where(least < 0, grey / np.maximum(grey - least, 1e-30), 1)
    return np.maximum(grey + saturation * (rgb - grey), 0)


def fraction_off(rgb, other):
    """Fraction of the colours that differ by more than `RGB_RTOL` of the luminance."""
    luminance = np.maximum(rgb @ LUMINANCE, 1e-30)
    return np.mean(np.abs(rgb - other).max(axis=1) > RGB_RTOL * luminance)


@pytest.mark.parametrize("name", IN_COLOUR)
def test_colours_agree(parameters_of, name):
    parameters = parameters_of(name)
    wi, wo, _, _ = queries(parameters, "llvm_ad_rgb", QUERIES_RGB)
    twin, twin_pdf = evaluated("llvm_ad_rgb", parameters, wi, wo, None)
    core, core_pdf = evaluated("scalar_rgb", parameters, wi, wo, None)
    assert is_sane(core, core_pdf)
    # Kernels keep colours outside sRGB.
    assert np.any(twin < 0)
    twin = desaturated(twin)
    assert is_sane(twin, twin_pdf)
    assert fraction_off(core, twin) <= RGB_FRACTION
    np.testing.assert_allclose(twin_pdf, core_pdf, rtol=RTOL)
    turned = evaluated("llvm_ad_rgb", {**parameters, "rotation": 1.0}, wi, wo, None)[0]
    assert fraction_off(core, desaturated(turned)) > 10 * RGB_FRACTION


@pytest.mark.parametrize("name", IN_COLOUR)
def test_mono_is_the_luminance(parameters_of, name):
    parameters = parameters_of(name)
    wi, wo, _, _ = queries(parameters, "llvm_ad_rgb", QUERIES_RGB)
    rgb = evaluated("llvm_ad_rgb", parameters, wi, wo, None)[0]
    mono = evaluated("llvm_ad_mono", parameters, wi, wo, None)[0][:, 0]
    assert np.all(np.abs(mono - rgb @ LUMINANCE) <= MONO_RTOL * np.abs(rgb).max(axis=1))


def test_hero_wavelengths_share_one_density():
    """The density for four wavelengths is the mean of the densities for each."""
    parameters = {"preset": "blazed"}
    wi, wo, nm, _ = queries(parameters, "llvm_ad_spectral", QUERIES)
    for variant in ["llvm_ad_spectral", "scalar_spectral"]:
        use_variant(variant)
        _, pdf = evaluated(variant, parameters, wi, wo, nm)
        alone = [evaluated(variant, parameters, wi, wo, np.repeat(nm[:, k : k + 1], 4, axis=1))[1] for k in range(4)]
        np.testing.assert_allclose(pdf, np.mean(alone, axis=0), rtol=RTOL)
    assert mi.is_spectral
