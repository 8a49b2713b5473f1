"""Polarised variants: diffracted light is polarised by the interface, and not depolarised."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from batches import direction, eval_alone, is_scalar, random_directions
from conftest import built, use_variant
from mueller import (
    FORMULA,
    ROUNDING,
    WAVELENGTHS,
    between_states,
    coherency,
    elements,
    evaluated,
    mirrored,
    normalised,
    pairs,
    reversed_path,
)
from perturbation import first_order, mueller

POLARISED = ["scalar_spectral_polarized", "llvm_ad_mono_polarized", "llvm_ad_spectral_polarized"]
# A window so short that an order's light is in all directions.
EVERYWHERE = {"preset": "blazed", "coherence_length": 1.0, "conserve_energy": False}
ALUMINIUM = {"eta": 1.0, "k": 6.9}
GOLD = {"eta": 0.2, "k": 3.4}
KERATIN = {"eta": 1.56}


SURFACES = [
    {"obliquity": "stam", "material": "Au"},
    {"obliquity": "unit", "eta": 1.56},
    {"eta": 1.56, "rotation": 25.0},
    {"obliquity": "small_slope", "material": "Al"},
    {"obliquity": "stam"},
]


@pytest.mark.parametrize("surface", SURFACES, ids=str)
@pytest.mark.parametrize("variant", POLARISED)
def test_a_flat_relief_polarises_as_a_mirror_does(variant, surface):
    """Mueller matrices at every azimuth equal those of Mitsuba's `conductor`."""
    use_variant(variant)
    rng = np.random.default_rng(3)
    wi = random_directions(rng, 40 if is_scalar() else 400)
    wi = np.concatenate([wi, np.float32([[0, 0, 1], direction(89, 10), direction(1e-3, 200)])])
    wo = wi * np.float32([-1, -1, 1])
    flat = built(variant, preset="flat", conserve_energy=False, **surface)
    # The perfect reflector is compared with a nearly perfect conductor; the index of Mitsuba's `none` turns phases.
    is_perfect = "material" not in surface and "eta" not in surface
    optics = {"material": surface["material"]} if "material" in surface else {"eta": surface.get("eta"), "k": 0.0}
    judge = mi.load_dict({"type": "conductor", **({"eta": 1.0, "k": 1e9} if is_perfect else optics)})
    found, expected = evaluated(flat, wi, wo), mirrored(judge, wi)
    np.testing.assert_allclose(normalised(found), normalised(expected), atol=ROUNDING)
    if mi.is_spectral:
        # The power is Fresnel's reflectance times the power of a perfect reflector's relief.
        relief = evaluated(built(variant, preset="flat", conserve_energy=False, obliquity="unit"), wi, wo)[..., 0, 0]
        np.testing.assert_allclose(found[..., 0, 0] / relief, expected[..., 0, 0], rtol=1e-4)
    # The mirror's matrix for another direction differs. A perfect conductor has one matrix in all directions, so it is
    # compared with one that turns phases.
    another = normalised(expected)
    another = another * np.diag([1, 1, 1, -1]) if is_perfect else np.roll(another, 1, axis=0)
    assert np.abs(normalised(found) - another).max() > 100 * ROUNDING


@pytest.mark.parametrize("optics", [KERATIN, GOLD, ALUMINIUM], ids=str)
def test_amplitudes_agree_with_first_order_maxwell(optics):
    """Matrices of random pairs have the right phases and crossed elements, also on a rotated grating."""
    bsdf = built("llvm_ad_spectral_polarized", obliquity="small_slope", rotation=33.0, **EVERYWHERE, **optics)
    wi, wo = pairs(4000)
    found = evaluated(bsdf, wi, wo)[:, :1]
    lit = found[:, 0, 0, 0] > 0
    assert lit.mean() > 0.9
    wi, wo, found = wi[lit].astype(float), wo[lit].astype(float), found[lit]
    expected = mueller(first_order(wo, wi, optics["eta"] + 1j * optics.get("k", 0.0)))[:, None]
    found = normalised(between_states(found, wo, wi))
    expected = normalised(expected)
    error = np.abs(found - expected).max(axis=(1, 2, 3))
    assert np.quantile(error, 0.999) < FORMULA, np.quantile(error, 0.999)
    # Wrong signs of crossed elements and of phases are noticed.
    for i, j in ((0, 2), (2, 0), (1, 2), (2, 3)):
        wrong = expected.copy()
        wrong[..., i, j] *= -1
        assert np.abs(found - wrong).max() > 10 * FORMULA or np.abs(expected[..., i, j]).max() < FORMULA


@pytest.mark.parametrize("surface", SURFACES[:4], ids=str)
def test_intensity_equals_unpolarised_variants(surface):
    wi, wo = pairs(2000)
    nm = np.broadcast_to(np.float32(WAVELENGTHS), (len(wi), 4))
    plain = eval_alone(built("llvm_ad_spectral", **EVERYWHERE, **surface), wi, wo, nm)
    polarised = eval_alone(built("llvm_ad_spectral_polarized", **EVERYWHERE, **surface), wi, wo, nm)
    # Two forms of one formula; the second has a smaller error in the azimuth.
    np.testing.assert_allclose(polarised, plain, rtol=FORMULA, atol=1e-7)


@pytest.mark.parametrize("surface", [SURFACES[0], SURFACES[2], {"eta": 1.56, "diffuse_reflectance": 0.3}], ids=str)
def test_matrices_are_physical(surface):
    wi, wo = pairs(10_000, lowest=0.0)
    found = evaluated(built("llvm_ad_spectral_polarized", **EVERYWHERE, **surface), wi, wo).reshape(-1, 4, 4)
    found = normalised(found[found[:, 0, 0] > 1e-20])
    values = np.linalg.eigvalsh(coherency(found))
    assert np.all(np.isfinite(values))
    assert len(values) > 25_000
    assert values.min() > -1e-6
    if "diffuse_reflectance" not in surface:
        # A single Jones matrix does not depolarise.
        assert values[:, :3].max() < 1e-6
        # An error of a thousandth is noticed.
        found[:, 1, 1] += 1e-3
        assert np.linalg.eigvalsh(coherency(found[:1000])).min() < -1e-4


@pytest.mark.parametrize("surface", [SURFACES[0], SURFACES[3]], ids=str)
def test_matrices_are_reciprocal(surface):
    """The matrix of the reversed path is the transpose, in frames seen from behind."""
    bsdf = built("llvm_ad_spectral_polarized", **EVERYWHERE, **surface)
    wi, wo = pairs(2000)
    there, back = evaluated(bsdf, wi, wo), evaluated(bsdf, wo, wi)
    lit = (there[..., 0, 0] > 0).all(axis=1)
    wi, wo = wi[lit].astype(float), wo[lit].astype(float)
    there, back = normalised(there[lit]), normalised(back[lit])
    np.testing.assert_allclose(back, reversed_path(there, wi, wo), atol=FORMULA)


@pytest.mark.parametrize("variant", POLARISED)
def test_weight_is_value_over_density(variant):
    bsdf = built(variant, **EVERYWHERE, eta=1.56, diffuse_reflectance=0.3, rotation=20.0)
    ctx = mi.BSDFContext()
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(direction(50, 20))
    if mi.is_spectral:
        si.wavelengths = WAVELENGTHS
    for sample1 in (0.3, 0.999):
        bs, weight = bsdf.sample(ctx, si, sample1, [0.4, 0.6])
        value, pdf = bsdf.eval_pdf(ctx, si, bs.wo)
        np.testing.assert_allclose(elements(weight) * np.array(pdf).ravel()[0], elements(value), rtol=1e-4, atol=1e-7)
        assert np.array(pdf).ravel()[0] > 0
    # The pigment alone depolarises.
    ctx.component = 1
    below = elements(bsdf.eval(ctx, si, mi.Vector3f(direction(30, 100)))).reshape(-1, 4, 4)
    assert np.all(below[:, 0, 0] > 0)
    below[:, 0, 0] = 0
    assert np.all(below == 0)


def test_transport_modes_agree():
    """Importance travels backwards, so the matrix is that of exchanged directions."""
    bsdf = built("llvm_ad_spectral_polarized", **EVERYWHERE, eta=1.56)
    wi, wo = pairs(500)
    radiance = evaluated(bsdf, wi, wo) / wo[:, 2, None, None, None]
    importance = evaluated(bsdf, wo, wi, mi.TransportMode.Importance) / wi[:, 2, None, None, None]
    lit = radiance[..., 0, 0] > 0
    np.testing.assert_allclose(importance[lit] / radiance[lit][..., :1, :1], normalised(radiance[lit]), atol=FORMULA)


def test_both_sides_of_twosided_polarise_as_a_mirrors():
    use_variant("llvm_ad_spectral_polarized")
    nested = {"flat": built("llvm_ad_spectral_polarized", preset="flat", conserve_energy=False, material="Au")}
    both = mi.load_dict({"type": "twosided", **nested})
    judge = mi.load_dict({"type": "twosided", "nested": {"type": "conductor", "material": "Au"}})
    wi = random_directions(np.random.default_rng(8), 300)
    for side in (1, -1):
        seen = wi * np.float32([1, 1, side])
        found = evaluated(both, seen, seen * np.float32([-1, -1, 1]))
        np.testing.assert_allclose(normalised(found), normalised(mirrored(judge, seen)), atol=ROUNDING)


def stokes_of(bsdf):
    """Stokes components of a sphere under a uniform sky, `[row, column, component]` of one channel."""
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "stokes", "nested": {"type": "path", "max_depth": 2}},
            "sensor": {
                "type": "perspective",
                "fov": 25,
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
                "sampler": {"type": "multijitter"},
            },
            "light": {"type": "constant", "radiance": 1.0},
            "shape": {"type": "sphere", "bsdf": bsdf},
        }
    )
    image = np.array(mi.render(scene, spp=1024, seed=3))
    # The channels are red, green and blue of the picture, then of each component.
    return image[..., 3:].reshape(8, 8, 4, 3)[..., 1]


@pytest.mark.parametrize("obliquity", ["stam", "small_slope"])
def test_a_smooth_sphere_is_as_polarised_as_a_mirrors(obliquity):
    """The integrator `stokes` renders narrow orders of a flat relief like `conductor`.

    The variant is scalar, since compiling the renderer would take longer than the picture.
    """
    use_variant("scalar_spectral_polarized")
    optics = {"eta": 1.56, "k": 0.0}
    flat = {"type": "diffraction", "preset": "flat", "obliquity": obliquity, "conserve_energy": False, **optics}
    found, expected = stokes_of(flat), stokes_of({"type": "conductor", **optics})
    # Pixels that see the sphere alone, with 256 samples of weights that deviate by a few per cent.
    inside = (slice(2, 6), slice(2, 6))
    brightest = expected[inside][..., 0].max()
    np.testing.assert_allclose(found[inside], expected[inside], atol=0.03 * brightest)
    polarised = np.hypot(expected[inside][..., 1], expected[inside][..., 2])
    assert polarised.max() > 0.2 * brightest
