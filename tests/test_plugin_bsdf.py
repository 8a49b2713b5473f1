"""The plugin fulfils the contract of Mitsuba's BSDF interface."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from batches import direction, is_scalar
from conftest import built
from surfaces import QUICK

# Relative difference between calls of one routine in single precision, which the JIT fuses differently.
RTOL = 1e-5


def opaque(value):
    """Makes the value an input of the kernel, so that one kernel serves every value."""
    if not is_scalar():
        dr.make_opaque(value)
    return value


def interaction(wi):
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = opaque(mi.Vector3f(wi))
    si.sh_frame = mi.Frame3f([0, 0, 1])
    si.n = [0, 0, 1]
    if mi.is_spectral:
        si.wavelengths = opaque(type(si.wavelengths)([450, 520, 590, 660]))
    return si


def together(*answers):
    """Evaluates all answers in one kernel."""
    if not is_scalar():
        dr.eval(answers)
    return answers


def first_entry(spectrum):
    """The intensity of a value as an array; other Stokes elements must not exceed it."""
    together(spectrum)
    if mi.is_polarized:
        intensity = np.array(spectrum[0, 0])
        rest = [np.array(spectrum[i, j]) for i in range(4) for j in range(4) if (i, j) != (0, 0)]
        assert all(np.all(np.abs(entry) <= (1 + RTOL) * intensity) for entry in rest)
        spectrum = spectrum[0, 0]
    return np.array(spectrum).ravel()


PAIRS = [((0, 0), (0, 0)), ((30, 10), (40, 200)), ((75, 90), (20, 300)), ((89.9, 0), (89.9, 0)), ((60, 0), (60, 180))]


@pytest.mark.parametrize(("wi", "wo"), PAIRS)
def test_eval_and_pdf_agree_with_eval_pdf(variant, wi, wo):
    bsdf = built(variant, preset="blazed", eta=1.56, diffuse_reflectance=0.3, rotation=20.0)
    ctx, si = mi.BSDFContext(), interaction(direction(*wi))
    wo = opaque(mi.Vector3f(direction(*wo)))
    value, pdf = together(*bsdf.eval_pdf(ctx, si, wo))
    np.testing.assert_allclose(first_entry(bsdf.eval(ctx, si, wo)), first_entry(value), rtol=RTOL)
    np.testing.assert_allclose(bsdf.pdf(ctx, si, wo), pdf, rtol=RTOL)
    assert np.all(np.isfinite(first_entry(value)))
    assert np.all(first_entry(value) >= 0)


@pytest.mark.parametrize("sample1", [0.0, 0.5, 0.999])
@pytest.mark.parametrize("parameters", [{}, {"material": "Au"}, {"eta": 1.56, "diffuse_reflectance": 0.3}], ids=str)
def test_weight_is_value_over_density(variant, parameters, sample1):
    bsdf, ctx = built(variant, **QUICK, rotation=35.0, **parameters), mi.BSDFContext()
    si = interaction(direction(50, 20))
    bs, weight = together(*bsdf.sample(ctx, si, opaque(mi.Float(sample1)), opaque(mi.Point2f(0.3, 0.7))))
    value, pdf = together(*bsdf.eval_pdf(ctx, si, bs.wo))
    np.testing.assert_allclose(bs.pdf, pdf, rtol=RTOL)
    if np.all(np.array(bs.pdf) > 0):
        np.testing.assert_allclose(first_entry(weight), first_entry(value) / np.array(pdf), rtol=RTOL)
    else:  # The order is beyond the horizon.
        assert np.all(first_entry(weight) == 0)


def test_eval_pdf_sample_is_both(typical_variant, make_bsdf):
    bsdf = make_bsdf(**QUICK, diffuse_reflectance=0.3, eta=1.56)
    ctx, si = mi.BSDFContext(), interaction(direction(50, 20))
    wo = mi.Vector3f(direction(30, 100))
    value, pdf, bs, weight = together(*bsdf.eval_pdf_sample(ctx, si, wo, 0.2, [0.3, 0.7]))
    np.testing.assert_allclose(first_entry(value), first_entry(bsdf.eval(ctx, si, wo)), rtol=RTOL)
    np.testing.assert_allclose(pdf, bsdf.pdf(ctx, si, wo), rtol=RTOL)
    other, other_weight = together(*bsdf.sample(ctx, si, 0.2, [0.3, 0.7]))
    np.testing.assert_allclose(np.array(bs.wo), np.array(other.wo), rtol=RTOL)
    np.testing.assert_allclose(first_entry(weight), first_entry(other_weight), rtol=RTOL)


def test_back_side_is_black(variant):
    bsdf, ctx = built(variant, **QUICK, eta=1.56, diffuse_reflectance=0.3), mi.BSDFContext()
    up, down = direction(30, 0), direction(150, 0)
    for wi, wo in [(up, down), (down, up), (down, down)]:
        value, pdf = together(*bsdf.eval_pdf(ctx, interaction(wi), opaque(mi.Vector3f(wo))))
        assert np.all(first_entry(value) == 0)
        assert np.all(np.array(pdf) == 0)


def test_components_and_flags(typical_variant, make_bsdf):
    plain = make_bsdf(**QUICK)
    pigmented = make_bsdf(**QUICK, diffuse_reflectance=0.2, rotation={"type": "checkerboard"})
    assert plain.component_count() == 1
    assert pigmented.component_count() == 2
    assert mi.has_flag(plain.flags(), mi.BSDFFlags.GlossyReflection)
    assert mi.has_flag(plain.flags(), mi.BSDFFlags.Anisotropic)
    assert not mi.has_flag(plain.flags(), mi.BSDFFlags.SpatiallyVarying)
    assert not mi.has_flag(plain.flags(), mi.BSDFFlags.BackSide)
    assert mi.has_flag(pigmented.flags(1), mi.BSDFFlags.DiffuseReflection)
    assert mi.has_flag(pigmented.flags(), mi.BSDFFlags.SpatiallyVarying)


def test_components_add_up(variant):
    bsdf = built(variant, **QUICK, eta=1.56, diffuse_reflectance=0.4)
    si, wo = interaction(direction(40, 0)), mi.Vector3f(direction(20, 90))
    whole = first_entry(bsdf.eval(mi.BSDFContext(), si, wo))
    parts = []
    for component in range(2):
        ctx = mi.BSDFContext()
        ctx.component = component
        parts.append(first_entry(bsdf.eval(ctx, si, wo)))
    np.testing.assert_allclose(whole, parts[0] + parts[1], rtol=RTOL)
    assert np.all(parts[1] > 0)


def test_the_pigment_reflects_transmitted_light(variant):
    """The pigment is black below a perfect reflector, and below a dielectric has Fresnel's transmission twice."""
    si, wo = interaction(direction(40, 0)), mi.Vector3f(direction(20, 90))
    ctx = mi.BSDFContext()
    ctx.component = 1
    assert np.all(first_entry(built(variant, **QUICK, diffuse_reflectance=0.4).eval(ctx, si, wo)) == 0)
    below = first_entry(built(variant, **QUICK, eta=1.56, diffuse_reflectance=0.4).eval(ctx, si, wo))
    through = [1 - mi.fresnel(float(np.cos(np.radians(angle))), 1.56)[0] for angle in (40, 20)]
    expected = 0.4 * np.array(through[0]) * np.array(through[1]) * np.cos(np.radians(20)) / np.pi
    np.testing.assert_allclose(below, np.broadcast_to(expected, below.shape), rtol=1e-4)


def test_gradients_reach_the_parameters(llvm_ad_rgb, make_bsdf):
    bsdf = make_bsdf(**QUICK, eta=1.56, diffuse_reflectance=0.4)
    ctx, si = mi.BSDFContext(), interaction(direction(40, 0))
    params = mi.traverse(bsdf)
    for key in ["eta.value", "k.value", "specular_reflectance.value", "diffuse_reflectance.value"]:
        dr.enable_grad(params[key])
        params.update()
        dr.backward(dr.sum(bsdf.eval(ctx, si, mi.Vector3f(direction(30, 90)))))
        gradient = np.array(dr.grad(params[key]))
        assert np.all(np.isfinite(gradient)), key
        # k enters squared, so its gradient vanishes at k = 0.
        assert key == "k.value" or np.all(gradient != 0), key
        dr.disable_grad(params[key])
