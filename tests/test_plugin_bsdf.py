"""The BSDF interface keeps its promises, whatever the diffracted lobe is."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

# Both sides come from one routine in single precision, fused differently by the JIT.
RTOL = 1e-5


def interaction(wi):
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(wi)
    si.sh_frame = mi.Frame3f([0, 0, 1])
    si.n = [0, 0, 1]
    if mi.is_spectral:
        si.wavelengths = [450, 520, 590, 660]
    return si


def first_entry(spectrum):
    """The intensity part of a value as an array, checked to be depolarising."""
    if mi.is_polarized:
        rest = [spectrum[i, j] for i in range(4) for j in range(4) if (i, j) != (0, 0)]
        assert all(np.all(np.array(entry) == 0) for entry in rest)
        spectrum = spectrum[0, 0]
    return np.array(spectrum).ravel()


def direction(theta, phi):
    theta, phi = np.radians(theta), np.radians(phi)
    return [float(np.sin(theta) * np.cos(phi)), float(np.sin(theta) * np.sin(phi)), float(np.cos(theta))]


PAIRS = [((0, 0), (0, 0)), ((30, 10), (40, 200)), ((75, 90), (20, 300)), ((89.9, 0), (89.9, 0)), ((60, 0), (60, 180))]


@pytest.mark.parametrize(("wi", "wo"), PAIRS)
def test_eval_and_pdf_agree_with_eval_pdf(variant, make_bsdf, wi, wo):
    bsdf, ctx, si = (
        make_bsdf(eta=1.56, diffuse_reflectance=0.3, rotation=20.0),
        mi.BSDFContext(),
        interaction(direction(*wi)),
    )
    wo = mi.Vector3f(direction(*wo))
    value, pdf = bsdf.eval_pdf(ctx, si, wo)
    np.testing.assert_allclose(first_entry(bsdf.eval(ctx, si, wo)), first_entry(value), rtol=RTOL)
    np.testing.assert_allclose(bsdf.pdf(ctx, si, wo), pdf, rtol=RTOL)
    assert np.all(np.isfinite(first_entry(value)))
    assert np.all(first_entry(value) >= 0)


@pytest.mark.parametrize("sample1", [0.0, 0.5, 0.999])
@pytest.mark.parametrize("parameters", [{}, {"material": "Au"}, {"eta": 1.56, "diffuse_reflectance": 0.3}], ids=str)
def test_weight_is_value_over_density(variant, make_bsdf, parameters, sample1):
    bsdf, ctx, si = make_bsdf(rotation=35.0, **parameters), mi.BSDFContext(), interaction(direction(50, 20))
    bs, weight = bsdf.sample(ctx, si, sample1, [0.3, 0.7])
    value, pdf = bsdf.eval_pdf(ctx, si, bs.wo)
    np.testing.assert_allclose(bs.pdf, pdf, rtol=RTOL)
    np.testing.assert_allclose(first_entry(weight), first_entry(value) / np.array(pdf), rtol=RTOL)


def test_eval_pdf_sample_is_both(typical_variant, make_bsdf):
    bsdf, ctx, si = make_bsdf(diffuse_reflectance=0.3, eta=1.56), mi.BSDFContext(), interaction(direction(50, 20))
    wo = mi.Vector3f(direction(30, 100))
    value, pdf, bs, weight = bsdf.eval_pdf_sample(ctx, si, wo, 0.2, [0.3, 0.7])
    np.testing.assert_allclose(first_entry(value), first_entry(bsdf.eval(ctx, si, wo)), rtol=RTOL)
    np.testing.assert_allclose(pdf, bsdf.pdf(ctx, si, wo), rtol=RTOL)
    other, other_weight = bsdf.sample(ctx, si, 0.2, [0.3, 0.7])
    np.testing.assert_allclose(np.array(bs.wo), np.array(other.wo), rtol=RTOL)
    np.testing.assert_allclose(first_entry(weight), first_entry(other_weight), rtol=RTOL)


def test_back_side_is_black(variant, make_bsdf):
    bsdf, ctx, up, down = make_bsdf(diffuse_reflectance=0.3), mi.BSDFContext(), direction(30, 0), direction(150, 0)
    for wi, wo in [(up, down), (down, up), (down, down)]:
        value, pdf = bsdf.eval_pdf(ctx, interaction(wi), mi.Vector3f(wo))
        assert np.all(first_entry(value) == 0)
        assert np.all(np.array(pdf) == 0)


def test_components_and_flags(typical_variant, make_bsdf):
    plain, pigmented = make_bsdf(), make_bsdf(diffuse_reflectance=0.2, rotation={"type": "checkerboard"})
    assert plain.component_count() == 1
    assert pigmented.component_count() == 2
    assert mi.has_flag(plain.flags(), mi.BSDFFlags.GlossyReflection)
    assert mi.has_flag(plain.flags(), mi.BSDFFlags.Anisotropic)
    assert not mi.has_flag(plain.flags(), mi.BSDFFlags.SpatiallyVarying)
    assert not mi.has_flag(plain.flags(), mi.BSDFFlags.BackSide)
    assert mi.has_flag(pigmented.flags(1), mi.BSDFFlags.DiffuseReflection)
    assert mi.has_flag(pigmented.flags(), mi.BSDFFlags.SpatiallyVarying)


def test_components_add_up(variant, make_bsdf):
    bsdf, si, wo = make_bsdf(eta=1.56, diffuse_reflectance=0.4), interaction(direction(40, 0)), direction(20, 90)
    wo = mi.Vector3f(wo)
    whole = first_entry(bsdf.eval(mi.BSDFContext(), si, wo))
    parts = []
    for component in range(2):
        ctx = mi.BSDFContext()
        ctx.component = component
        parts.append(first_entry(bsdf.eval(ctx, si, wo)))
    np.testing.assert_allclose(whole, parts[0] + parts[1], rtol=RTOL)
    assert np.all(parts[1] > 0)


def test_sampling_passes_chi_square(llvm_ad_rgb):
    from mitsuba.chi2 import BSDFAdapter, ChiSquareTest, SphericalDomain

    xml = '<float name="eta" value="1.56"/><float name="diffuse_reflectance" value="0.4"/>'
    sample, pdf = BSDFAdapter("diffraction", xml, wi=mi.ScalarVector3f(direction(60, 30)))
    test = ChiSquareTest(domain=SphericalDomain(), sample_func=sample, pdf_func=pdf, sample_dim=3)
    assert test.run(), test.messages


def test_gradients_reach_the_parameters(llvm_ad_rgb, make_bsdf):
    bsdf, ctx, si = make_bsdf(eta=1.56, diffuse_reflectance=0.4), mi.BSDFContext(), interaction(direction(40, 0))
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


SKIN = {"type": "diffraction", "eta": 1.56, "diffuse_reflectance": 0.3}


def pixels(values):
    """A small texture of these values, as they are."""
    return {"type": "bitmap", "bitmap": mi.Bitmap(np.array(values, dtype=np.float32)), "raw": True}


WRAPPERS = {
    "bare": SKIN,
    "twosided": {"type": "twosided", "nested": SKIN},
    "blendbsdf": {"type": "blendbsdf", "weight": 0.5, "a": SKIN, "b": {"type": "diffuse"}},
    "mask": {"type": "mask", "opacity": 0.5, "nested": SKIN},
    "normalmap": {"type": "normalmap", "normalmap": lambda: pixels([[[0.6, 0.5, 1.0]] * 2] * 2), "nested": SKIN},
    "bumpmap": {"type": "bumpmap", "map": lambda: pixels([[[0.0], [0.1]], [[0.1], [0.0]]]), "nested": SKIN},
}


def sphere_scene(bsdf):
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 4},
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "pixel_format": "luminance"},
            },
            "light": {"type": "constant"},
            "shape": {"type": "sphere", "bsdf": bsdf},
        }
    )


@pytest.mark.parametrize("wrapper", WRAPPERS)
def test_works_inside(typical_variant, wrapper):
    # Bitmaps are made late, since they need a variant.
    bsdf = {name: value() if callable(value) else value for name, value in WRAPPERS[wrapper].items()}
    image = np.array(mi.render(sphere_scene(bsdf), spp=16))
    centre = image[2:6, 2:6]
    assert np.all(np.isfinite(image))
    assert np.all(image >= 0)
    assert 0 < centre.mean() < np.array(mi.render(sphere_scene({"type": "null"}), spp=16))[2:6, 2:6].mean()


def test_a_perfect_reflector_vanishes_in_a_furnace(llvm_ad_rgb):
    scene = sphere_scene({"type": "diffraction", "preset": "flat"})
    np.testing.assert_allclose(np.array(mi.render(scene, spp=256)), 1, atol=0.02)
