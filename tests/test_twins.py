"""The Rust core, which scalar variants ask ray by ray, and its twin in Dr.Jit give the same lobe."""

import mitsuba as mi
import numpy as np
import pytest
from batches import eval_pdf, random_directions, random_wavelengths, sample
from conftest import built, use_variant

# What the twins promise each other: relative, in single precision.
RTOL = 1e-4
# Below this share of the sampling density a value counts as this share: κ and the splines in it are single precision,
# which leaves 1.5e-7 of an order's largest power. The density is made of the powers at nearly the κ asked for and is
# the mean over four wavelengths: where an order passes through zero at one and the others are dim too, it is a
# twentieth of that (sinusoid, zeroth order, J0² of 1e-4 at 627 nm and 0.09 at 813 nm). So such an order is known to
# 3.3e-6 of the density, and no better relatively.
FLOOR = 4e-2
# Directions are differences of numbers up to 2 in single precision, with random numbers stretched over and over.
WO_ATOL = 1e-3
# Share of samples whose random number falls on the edge of an interval, or into one so short that stretching it leaves
# few digits, and which so land elsewhere.
EDGE_SHARE = 2e-3
# Orders are gone through one by one, and the random number is stretched at each. A window of 1 µm turns what digits
# are lost into directions that are 1e-3 off (1 % of the samples).
WIDE_EDGE_SHARE = {"1 µm": 2e-2}
# Colours are sums of about a hundred wavelengths of both signs, whose steps may differ by one: the midpoint rule errs
# by 2e-4 of the peak there. Relative to luminance, since the channels cancel.
RGB_RTOL = 2e-3
# Share of directions in which an order lies so far in the dark that its tail is all there is.
RGB_SHARE = 5e-3

QUERIES = 2000
QUERIES_RGB = 500

SURFACES = {
    "flat": {"preset": "flat"},
    "sinusoidal": {"preset": "sinusoidal"},
    "blazed": {"preset": "blazed"},
    "lamellar": {"preset": "lamellar"},
    "cd": {"preset": "cd"},
    "elaphe": {"preset": "elaphe"},
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
    "1 mm": {"preset": "blazed", "coherence_length": 1e3, "conserve_energy": False},
    "10 mm": {"preset": "blazed", "coherence_length": 1e4, "conserve_energy": False},
    "tolerance": {"preset": "blazed", "tolerance": 1e-5, "conserve_energy": False},
    "file": {"filename": "rough.npy", "pixel_size": 0.1, "coherence_length": 20.0},
    "patch file": {"filename": "rough.npy", "pixel_size": 0.1, "coherence_length": 3.0, "model": "patch"},
    "periodic file": {"filename": "rough.npy", "pixel_size": 0.1, "tiling": "periodic", "conserve_energy": False},
}
IN_COLOUR = ["blazed", "unit", "small slope", "small slope of everything", "10 µm", "patch grating", "file"]


@pytest.fixture(scope="module")
def parameters_of(tmp_path_factory):
    """Parameters of a surface by its name; the file is a small, smooth, random relief that is no square."""
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
    """Random incidence, wavelengths and random numbers, and outgoing directions: most of them where orders are."""
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
    """The largest error of values and densities, relative as `RTOL` is."""
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
    assert together.mean() >= 1 - WIDE_EDGE_SHARE.get(name, EDGE_SHARE)
    # Where a sample lies in its order moves its density, so that is judged at the same place.
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
    """Both could be wrong together: a facet that rises along +x throws light from the normal to −x."""
    tilt = 2 * np.arctan(0.1)
    wo = np.array([[-np.sin(tilt), 0, np.cos(tilt)], [np.sin(tilt), 0, np.cos(tilt)]], dtype=np.float32)
    wi, nm = np.array([[0, 0, 1]] * 2, dtype=np.float32), np.full((2, 4), 2.5e3 * np.sin(tilt), dtype=np.float32)
    for variant in ["scalar_spectral", "llvm_ad_spectral"]:
        (towards, away), _ = evaluated(variant, {"preset": "blazed"}, wi, wo, nm)
        assert np.all(towards > 100 * away), variant


LUMINANCE = np.array([0.2126729, 0.7151522, 0.072175])


def desaturated(rgb):
    """As much grey of the same luminance mixed in as leaves no channel negative, which scalar variants do."""
    grey, least = np.maximum(rgb @ LUMINANCE, 0)[:, None], rgb.min(axis=1, keepdims=True)
    share = np.where(least < 0, grey / np.maximum(grey - least, 1e-30), 1)
    return np.maximum(grey + share * (rgb - grey), 0)


def worst_share(rgb, other):
    """The share of colours that differ by more than `RGB_RTOL` of the luminance."""
    luminance = np.maximum(rgb @ LUMINANCE, 1e-30)
    return np.mean(np.abs(rgb - other).max(axis=1) > RGB_RTOL * luminance)


@pytest.mark.parametrize("name", IN_COLOUR)
def test_colours_agree(parameters_of, name):
    parameters = parameters_of(name)
    wi, wo, _, _ = queries(parameters, "llvm_ad_rgb", QUERIES_RGB)
    twin, twin_pdf = evaluated("llvm_ad_rgb", parameters, wi, wo, None)
    core, core_pdf = evaluated("scalar_rgb", parameters, wi, wo, None)
    assert is_sane(core, core_pdf)
    # What lies outside sRGB is kept in kernels.
    assert np.any(twin < 0)
    twin = desaturated(twin)
    assert is_sane(twin, twin_pdf)
    assert worst_share(core, twin) <= RGB_SHARE
    assert np.mean(np.abs(core_pdf - twin_pdf) > RGB_RTOL * core_pdf) <= RGB_SHARE
    turned = evaluated("llvm_ad_rgb", {**parameters, "rotation": 1.0}, wi, wo, None)[0]
    assert worst_share(core, desaturated(turned)) > 10 * RGB_SHARE


@pytest.mark.parametrize("name", IN_COLOUR)
def test_mono_is_the_luminance(parameters_of, name):
    parameters = parameters_of(name)
    wi, wo, _, _ = queries(parameters, "llvm_ad_rgb", QUERIES_RGB)
    rgb = evaluated("llvm_ad_rgb", parameters, wi, wo, None)[0]
    mono = evaluated("llvm_ad_mono", parameters, wi, wo, None)[0][:, 0]
    # Where channels cancel, luminance is known as well as they are.
    off = np.abs(mono - rgb @ LUMINANCE)
    assert np.all(off <= RGB_RTOL * np.abs(rgb).max(axis=1))


def test_hero_wavelengths_share_one_density():
    """The density of four wavelengths is the mean of each one's own."""
    parameters = {"preset": "blazed"}
    wi, wo, nm, _ = queries(parameters, "llvm_ad_spectral", QUERIES)
    for variant in ["llvm_ad_spectral", "scalar_spectral"]:
        use_variant(variant)
        _, pdf = evaluated(variant, parameters, wi, wo, nm)
        alone = [evaluated(variant, parameters, wi, wo, np.repeat(nm[:, k : k + 1], 4, axis=1))[1] for k in range(4)]
        np.testing.assert_allclose(pdf, np.mean(alone, axis=0), rtol=RTOL)
    assert mi.is_spectral
