"""Parameters can change in a loaded scene, and be differentiated by."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from batches import direction
from conftest import use_variant

# A surface with quick tables and wide orders, with light in every direction.
QUICK = {"preset": "blazed", "period": 2.0, "coherence_length": 6.0, "tolerance": 0.01, "conserve_energy": False}
PIGMENTED = {**QUICK, "eta": 1.56, "k": 0.3, "diffuse_reflectance": 0.4, "rotation": 10.0}
# Direction on the slope of the first order, 5° wide, where every parameter matters.
IN, OUT = direction(40, 20), direction(20, 200)
# Relative error of central differences in single precision: rounding of 1e-7 over steps of 1e-2, and the change of the
# slope over the step. The derivative by directions has an error of 1e-3 itself (cpp_shim/src/bridge/steps.rs).
DERIVATIVE_RTOL = 1e-2


def interaction():
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(IN)
    if mi.is_spectral:
        si.wavelengths = [430, 520, 580, 650]
    return si


def evaluated(bsdf):
    return bsdf.eval(mi.BSDFContext(), interaction(), mi.Vector3f(OUT))


def scene(**parameters):
    """A plate under a small lamp, lit directly, so that noise stems from the pixels alone."""
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "prb", "max_depth": 2} if "ad" in mi.variant() else {"type": "path", "max_depth": 2},
            "sensor": {
                "type": "perspective",
                "fov": 40,
                "to_world": mi.ScalarTransform4f().look_at([0.5, -2, 3], [0, 0, 0], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
            },
            "plate": {"type": "rectangle", "bsdf": {"type": "diffraction", **parameters}},
            "lamp": {"type": "point", "position": [-1, 1.5, 2.5], "intensity": 10.0},
        }
    )


@pytest.mark.parametrize(
    ("key", "parameter", "value"),
    [
        ("coherence_length", "coherence_length", 9.5),
        ("eta.value", "eta", 1.33),
        ("k.value", "k", 2.0),
        ("specular_reflectance.value", "specular_reflectance", 0.6),
        ("diffuse_reflectance.value", "diffuse_reflectance", 0.1),
        ("rotation.value", "rotation", -35.0),
    ],
)
def test_a_changed_bsdf_equals_a_new_one(typical_variant, make_bsdf, key, parameter, value):
    bsdf, made = make_bsdf(**PIGMENTED), make_bsdf(**{**PIGMENTED, parameter: value})
    before = np.array(evaluated(bsdf))
    params = mi.traverse(bsdf)
    params[key] = value
    params.update()
    after, expected = np.array(evaluated(bsdf)), np.array(evaluated(made))
    # Equal code and numbers; colours may pass through textures that round differently.
    np.testing.assert_allclose(after, expected, rtol=1e-5)
    assert np.any(np.abs(after - before) > 1e-3 * np.abs(before))


def test_a_changed_coherence_length_is_described(scalar_rgb, make_bsdf):
    bsdf = make_bsdf(**QUICK)
    params = mi.traverse(bsdf)
    assert params["coherence_length"] == 6.0
    params["coherence_length"] = 0.1
    params.update()
    # The value is 0.1 and not 0.10000000149, its rounding to single precision, which has other tables.
    assert "over 0.1 µm" in str(bsdf)


@pytest.mark.parametrize("value", [-1.0, 0.0, 1e9, float("nan")])
def test_a_refused_coherence_length_changes_nothing(typical_variant, make_bsdf, value):
    bsdf = make_bsdf(**QUICK)
    before = np.array(evaluated(bsdf))
    params = mi.traverse(bsdf)
    params["coherence_length"] = value
    with pytest.raises(Exception, match=r"coherence_length.*\[1e-3, 1e5\]"):
        params.update()
    np.testing.assert_array_equal(evaluated(bsdf), before)
    assert mi.traverse(bsdf)["coherence_length"] == 6.0


@pytest.mark.parametrize("name", ["scalar_rgb", "llvm_ad_spectral"])
def test_a_render_follows_a_changed_parameter(name):
    use_variant(name)
    changed, made = scene(**PIGMENTED), scene(**{**PIGMENTED, "coherence_length": 12.0, "rotation": 40.0})
    before = np.array(mi.render(changed, spp=4, seed=1))
    params = mi.traverse(changed)
    params["plate.bsdf.coherence_length"] = 12.0
    params["plate.bsdf.rotation.value"] = 40.0
    params.update()
    after, expected = np.array(mi.render(changed, spp=4, seed=1)), np.array(mi.render(made, spp=4, seed=1))
    np.testing.assert_allclose(after, expected, rtol=1e-4, atol=1e-6)
    assert np.abs(after - before).max() > 0.05 * before.max()


@pytest.mark.parametrize("name", ["llvm_ad_rgb", "llvm_ad_spectral"])
@pytest.mark.parametrize(
    ("key", "step"),
    [
        ("eta.value", 1e-2),
        ("k.value", 1e-2),
        ("specular_reflectance.value", 1e-2),
        ("diffuse_reflectance.value", 1e-2),
        ("rotation.value", 5e-2),
    ],
)
def test_derivatives_agree_with_finite_differences(make_bsdf, name, key, step):
    use_variant(name)
    bsdf = make_bsdf(**{**PIGMENTED, "specular_reflectance": 0.8})
    params = mi.traverse(bsdf)
    value = mi.Float(params[key])

    def answer(at):
        params[key] = at
        params.update()
        return dr.sum(evaluated(bsdf))

    expected = float(((answer(value + step) - answer(value - step)) / (2 * step))[0])
    assert expected != 0
    for back in (False, True):
        at = mi.Float(value)
        dr.enable_grad(at)
        made = answer(at)
        if back:
            dr.backward(made)
        else:
            dr.forward(at)
        found = float(dr.grad(at if back else made)[0])
        assert found == pytest.approx(expected, rel=DERIVATIVE_RTOL), "backward" if back else "forward"


@pytest.mark.parametrize("of", ["wi", "wo"])
def test_derivatives_by_directions_agree_with_finite_differences(make_bsdf, of):
    """Directions move along the sphere with all three components, as with normal maps and moving shapes."""
    use_variant("llvm_ad_spectral")
    bsdf = make_bsdf(**QUICK)
    angle, step = 40.0, 0.05

    def answer(theta):
        si, wo = interaction(), mi.Vector3f(OUT)
        sine, cosine = dr.sincos(theta * (np.pi / 180))
        if of == "wi":
            si.wi = mi.Vector3f(sine * 0.94, sine * 0.34, cosine)
        else:
            wo = mi.Vector3f(-sine * 0.8, -sine * 0.6, cosine)
        return dr.sum(bsdf.eval(mi.BSDFContext(), si, wo))

    expected = float(((answer(mi.Float(angle + step)) - answer(mi.Float(angle - step))) / (2 * step))[0])
    theta = mi.Float(angle)
    dr.enable_grad(theta)
    dr.backward(answer(theta))
    assert float(dr.grad(theta)[0]) == pytest.approx(expected, rel=DERIVATIVE_RTOL)


@pytest.mark.parametrize(("key", "step"), [("plate.bsdf.eta.value", 0.02), ("plate.bsdf.rotation.value", 0.2)])
def test_the_derivative_of_a_picture_agrees_with_finite_differences(key, step):
    use_variant("llvm_ad_spectral")
    lit = scene(**PIGMENTED)
    params = mi.traverse(lit)
    value = mi.Float(params[key])

    def picture(at, seed):
        params[key] = at
        params.update()
        return mi.render(lit, params, spp=16384, seed=seed)

    # Weights as in a fit to a picture; without them light that turns into and out of view would cancel.
    weights = dr.detach(picture(value + 20 * step, seed=2) - picture(value, seed=2))

    def brightness(at):
        return dr.mean(picture(at, seed=3) * weights, axis=None)

    expected = float(np.ravel((brightness(value + step) - brightness(value - step)) / (2 * step))[0])
    at = mi.Float(value)
    dr.enable_grad(at)
    dr.backward(brightness(at))
    # The derivative uses other random numbers. With a million samples either side has a standard deviation of 1.3 %, so
    # the tolerance is four standard deviations of the difference.
    assert float(dr.grad(at)[0]) == pytest.approx(expected, rel=0.08)
