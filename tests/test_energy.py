"""Energy is conserved, and values are reciprocal."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from batches import direction, eval_pdf, random_directions, random_wavelengths, sample
from conftest import built, use_variant
from surfaces import PRESETS

# Accepted excess of an albedo over 1 between the nodes of its table (docs/tables.md, "Energy").
ALBEDO_EXCESS = 1e-2
# Standard errors of a mean that count as agreement; one of a thousand samples of a true mean lies beyond 3.3.
SIGMAS = 5.0
# Relative error of the quadrature over the hemisphere: cells are half a standard deviation of an order wide, and values
# have steps at the horizon.
QUADRATURE_RTOL = 3e-3
# Relative difference in single precision, and the fraction of the density below which values are compared absolutely,
# as in test_twins.py.
RECIPROCITY_RTOL, RECIPROCITY_FLOOR = 2e-4, 2e-2
# Error of a mirror's integral over its lobe: the colour table's splines, its mantissas of nine bits, and the albedo of
# wide orders near the normal, 1.001, which is not divided. Measured 1.6e-3.
MIRROR_RTOL = 2e-3

# Five standard errors of a channel of one pixel with 256 samples (0.012).
FURNACE_NOISE = 0.06
# Five standard errors of the mean over sixteen pixels.
FURNACE_MEAN_NOISE = FURNACE_NOISE / 4

WAVELENGTHS = [410.0, 487.5, 561.0, 655.0]
ANGLES = [(0, 0), (35, 20), (60, 110), (80, 250)]


def mean_weight(bsdf, wi, count, seed=3, nm=WAVELENGTHS):
    """Mean and standard error of the sampling weight for each wavelength."""
    rng = np.random.default_rng(seed)
    wis, nms = np.broadcast_to(np.float32(wi), (count, 3)), np.broadcast_to(np.float32(nm), (count, 4))
    _, _, weight = sample(bsdf, wis, nms, rng.random((count, 3)).astype(np.float32))
    return weight.mean(axis=0), weight.std(axis=0) / np.sqrt(count)


def brute_force(bsdf, wi, resolution=1400):
    """Integral of `eval` over the hemisphere, by the midpoint rule in equal solid angles."""
    x, y = dr.meshgrid(*[(dr.arange(mi.Float, resolution) + 0.5) / resolution] * 2)
    si = dr.zeros(mi.SurfaceInteraction3f, resolution**2)
    si.wi = mi.Vector3f([dr.opaque(mi.Float, c) for c in wi])
    si.wavelengths = mi.Spectrum([dr.opaque(mi.Float, c) for c in WAVELENGTHS])
    value = bsdf.eval(mi.BSDFContext(), si, mi.warp.square_to_uniform_hemisphere(mi.Point2f(x, y)))
    return np.array([dr.mean(channel)[0] * 2 * np.pi for channel in value])


@pytest.mark.parametrize("preset", PRESETS)
def test_no_direction_reflects_more_than_it_receives(preset):
    """The albedo of 64 random directions and wavelengths, each a mean of weights, is at most 1."""
    bsdf = built("llvm_ad_spectral", preset=preset)
    rng = np.random.default_rng(17)
    directions, per_direction = 64, 4000
    wi = np.repeat(random_directions(rng, directions), per_direction, axis=0)
    nm = np.repeat(random_wavelengths(rng, directions), per_direction, axis=0)
    _, _, weight = sample(bsdf, wi, nm, rng.random((len(wi), 3)).astype(np.float32))
    weight = weight.reshape(directions, per_direction, 4)
    noise = weight.std(axis=1) / np.sqrt(per_direction)
    excess = weight.mean(axis=1) - 1 - ALBEDO_EXCESS
    assert np.all(excess <= SIGMAS * noise), excess.max()
    assert weight.mean() > 0.3


def test_unscaled_surfaces_exceed_the_bound():
    """Without conservation the obliquity factor makes energy on a deep sinusoid."""
    deep = {"preset": "sinusoidal", "period": 1.25, "height": 0.6}
    free = built("llvm_ad_spectral", **deep, conserve_energy=False)
    mean, noise = mean_weight(free, direction(0, 0), 400_000)
    assert np.any(mean - SIGMAS * noise > 1 + 2 * ALBEDO_EXCESS)
    kept, noise = mean_weight(built("llvm_ad_spectral", **deep), direction(0, 0), 100_000)
    assert np.all(kept - SIGMAS * noise <= 1 + ALBEDO_EXCESS)


# Surfaces and angles: near the normal and grazing for each sampler, each Fresnel factor and each obliquity factor.
INTEGRATED = [
    ({"preset": "blazed"}, ANGLES[1]),
    ({"preset": "blazed"}, ANGLES[3]),
    ({"preset": "elaphe"}, ANGLES[0]),
    ({"preset": "elaphe"}, ANGLES[2]),
    ({"preset": "xenopeltis", "eta": 1.56}, ANGLES[1]),
    ({"preset": "xenopeltis", "eta": 1.56}, ANGLES[3]),
    ({"preset": "blazed", "eta": 1.56, "k": 4.0, "obliquity": "small_slope"}, ANGLES[0]),
    ({"preset": "blazed", "eta": 1.56, "k": 4.0, "obliquity": "small_slope"}, ANGLES[2]),
]


@pytest.mark.parametrize(("surface", "angles"), INTEGRATED, ids=str)
def test_mean_weight_is_the_integral(surface, angles):
    bsdf = built("llvm_ad_spectral", **surface)
    truth = brute_force(bsdf, direction(*angles))
    mean, noise = mean_weight(bsdf, direction(*angles), 200_000)
    allowed = SIGMAS * noise + QUADRATURE_RTOL * truth
    assert np.all(np.abs(mean - truth) <= allowed), (mean, truth)
    core, core_noise = mean_weight(built("scalar_spectral", **surface), direction(*angles), 10_000)
    assert np.all(np.abs(core - truth) <= SIGMAS * core_noise + QUADRATURE_RTOL * truth), (core, truth)
    # A loss of five per cent is detectable at one wavelength at least.
    assert np.any(np.abs(0.95 * mean - truth) > allowed), allowed


def test_values_are_reciprocal(variant):
    bsdf = built(variant, preset="blazed", eta=1.56, rotation=20.0)
    rng = np.random.default_rng(23)
    count = 400 if variant.startswith("scalar") else 4000
    wi, nm = random_directions(rng, count), random_wavelengths(rng, count) if mi.is_spectral else None
    wo, pdf, _ = sample(bsdf, wi, nm, rng.random((count, 3)).astype(np.float32))
    seen = pdf > 0
    wi, wo, nm = wi[seen], wo[seen].astype(np.float32), nm[seen] if mi.is_spectral else None
    there, density = eval_pdf(bsdf, wi, wo, nm)
    back, _ = eval_pdf(bsdf, wo, wi, nm)
    there, back = there / wo[:, 2:], back / wi[:, 2:]
    floor = RECIPROCITY_FLOOR * (density / wo[:, 2])[:, None]
    error = np.abs(there - back) / np.maximum(np.maximum(there, back), np.maximum(floor, 1e-30))
    assert error.max() <= RECIPROCITY_RTOL
    # Values that include the cosine are not reciprocal.
    assert np.median(np.abs(there * wo[:, 2:] - back * wi[:, 2:]) / np.maximum(there, 1e-6)) > RECIPROCITY_RTOL


@pytest.mark.parametrize("angles", [(0, 0), (45, 30)], ids=str)
@pytest.mark.parametrize("colours", ["scalar_rgb", "llvm_ad_rgb", "llvm_ad_mono"])
def test_a_mirror_is_white(colours, angles):
    """The integral over the lobe is 1 in every channel; in direction cosines dω = du dv / cosθo."""
    bsdf = built(colours, preset="flat", coherence_length=10.0)
    wi = np.array(direction(*angles))
    reach, side = 0.2, 61
    offsets = np.linspace(-reach, reach, side)
    du, dv = np.meshgrid(offsets, offsets)
    x, y = du.ravel() - wi[0], dv.ravel() - wi[1]
    wo = np.stack([x, y, np.sqrt(1 - x * x - y * y)], axis=1).astype(np.float32)
    values, _ = eval_pdf(bsdf, np.broadcast_to(np.float32(wi), wo.shape), wo, None)
    total = (values / wo[:, 2:]).sum(axis=0) * (offsets[1] - offsets[0]) ** 2
    np.testing.assert_allclose(total, 1, rtol=MIRROR_RTOL)


def furnace(bsdf, spp, sensor_spp_seed=1):
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 6},
            "sensor": {
                "type": "perspective",
                "fov": 25,
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
            },
            "light": {"type": "constant", "radiance": 1.0},
            "shape": {"type": "sphere", "bsdf": bsdf},
        }
    )
    return np.array(mi.render(scene, spp=spp, seed=sensor_spp_seed))


@pytest.mark.parametrize("preset", ["blazed", "elaphe", "xenopeltis"])
def test_a_furnace_is_not_brighter_than_its_walls(preset):
    use_variant("llvm_ad_mono")
    bsdf = built("llvm_ad_mono", preset=preset)
    images = np.stack([furnace(bsdf, 64, seed) for seed in range(6)])
    noise = images.std(axis=0, ddof=1) / np.sqrt(len(images))
    assert np.all(images.mean(axis=0) <= 1 + ALBEDO_EXCESS + SIGMAS * noise + 1e-4)
    assert abs(images.mean() - 1) < 0.3


def test_a_perfect_reflector_vanishes_in_a_furnace():
    """The sphere's centre is as bright as the walls; towards the horizon half of the lobe is lost."""
    image = furnace(built("llvm_ad_rgb", preset="flat"), 512)
    assert np.all(image <= 1 + FURNACE_NOISE)
    np.testing.assert_allclose(image[2:6, 2:6].mean(axis=(0, 1)), 1, atol=FURNACE_MEAN_NOISE)
