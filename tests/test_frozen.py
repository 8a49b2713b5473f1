"""Frozen functions (`dr.freeze`), whose kernels stay while parameters, tables and BSDFs change."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from conftest import TRACED_VARIANTS, use_variant
from test_rigorous import PERFECT
from test_traced import COUNT, SINGLE, as_numbers, assert_same, question

# A surface with quick tables, and orders wide enough for random directions.
QUICK = {"preset": "blazed", "period": 2.0, "coherence_length": 6.0, "tolerance": 0.01, "conserve_energy": False}
SKIN = {**QUICK, "eta": 1.56, "k": 0.3, "diffuse_reflectance": 0.4, "rotation": 10.0}
METAL = {**QUICK, "preset": "sinusoidal", "material": "Al"}
# Dr.Jit turns a literal that changed into an input, so the third value is the first to meet an old kernel.
VALUES = {
    "coherence_length": [6.0, 4.0, 9.0, 6.0],
    "eta.value": [1.56, 1.2, 1.9, 1.4],
    "k.value": [0.3, 1.0, 2.0, 0.1],
    "specular_reflectance.value": [1.0, 0.5, 0.2, 0.8],
    "diffuse_reflectance.value": [0.4, 0.1, 0.8, 0.3],
    "rotation.value": [10.0, -20.0, 50.0, 0.0],
}
# Smallest change of answers with a parameter, relative to the largest value; far above rounding.
CHANGE = 100 * SINGLE


def diffraction(**parameters):
    return mi.load_dict({"type": "diffraction", **parameters})


def either(first, second):
    """Pointers to both BSDFs in turn, as in a scene of two."""
    turn = dr.arange(mi.UInt32, COUNT) % 2 == 0
    return dr.select(turn, mi.BSDFPtr(first), mi.BSDFPtr(second))


def answers(bsdf, si, wo):
    return bsdf.eval_pdf(mi.BSDFContext(), si, wo)


def assert_as_usual(frozen, bsdf):
    """Checks that a frozen function equals `answers`. Returns the values of `answers`."""
    si, wo, _ = question()
    usual = as_numbers(answers(bsdf, si, wo))
    assert_same(as_numbers(frozen(bsdf, si, wo)), usual)
    return usual[0]


def assert_changing(values):
    for before, after in zip(values, values[1:]):
        assert np.abs(after - before).max() > CHANGE * np.abs(before).max()


def assert_changes_count(parameters, key, frozen):
    """Checks that a frozen function follows a parameter that changes between calls."""
    changing, other = diffraction(**parameters), diffraction(**METAL)
    params = mi.traverse(changing)
    values = []
    for value in VALUES[key]:
        params[key] = value
        params.update()
        values.append(assert_as_usual(frozen, either(changing, other)))
    assert_changing(values)


@pytest.mark.parametrize("auto_opaque", [True, False])
@pytest.mark.parametrize("parameters", [SKIN, PERFECT], ids=lambda given: given["preset"])
@pytest.mark.parametrize("name", [*TRACED_VARIANTS, "llvm_ad_spectral_polarized"])
def test_a_changed_coherence_length_counts(name, parameters, auto_opaque):
    use_variant(name)
    assert_changes_count(parameters, "coherence_length", dr.freeze(answers, auto_opaque=auto_opaque))


@pytest.mark.parametrize(
    ("parameters", "key"),
    [
        *((SKIN, key) for key in VALUES if key != "coherence_length"),
        (PERFECT, "specular_reflectance.value"),
        (PERFECT, "rotation.value"),
    ],
    ids=lambda given: given if isinstance(given, str) else given["preset"],
)
def test_changed_textures_count(traced, parameters, key):
    frozen = dr.freeze(answers)
    assert_changes_count(parameters, key, frozen)
    # One recording for the first value, one for an index outside the tables, and one with the value as an input.
    assert frozen.n_recordings <= 3


def test_a_replaced_bsdf_counts(traced):
    frozen = dr.freeze(answers)
    other = diffraction(**METAL)
    values = []
    for parameters in [{"period": 1.5}, {"period": 2.5}, {"height": 0.1}, {"obliquity": "unit"}]:
        # The BSDF is deleted before the next is made, which takes its number in Dr.Jit's registry.
        bsdf = diffraction(**{**SKIN, **parameters})
        values.append(assert_as_usual(frozen, either(bsdf, other)))
        del bsdf
    assert_changing(values)


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral"])
def test_another_cover_over_shared_tables_counts(variant):
    """A covered grating, and a bare one whose lengths are those inside the cover, have equal relative parameters."""
    use_variant(variant)
    cover_eta = 1.5
    # Lengths in µm, whose products with the index are exact.
    lengths = {"period": 0.75, "height": 0.125, "coherence_length": 8.0}
    covered = {**PERFECT, **lengths, "cover_eta": cover_eta, "cover_reflection": False}
    bare = {**PERFECT, **{name: cover_eta * length for name, length in lengths.items()}}
    frozen = dr.freeze(answers)
    # Tables are shared while both exist.
    surfaces = [diffraction(**parameters) for parameters in (covered, bare)]
    assert_changing([assert_as_usual(frozen, surfaces[i]) for i in (0, 1, 0, 1)])


def test_a_frozen_render_uses_the_current_tables():
    use_variant("llvm_ad_rgb")
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at([0.5, -2, 3], [0, 0, 0], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
            },
            "plate": {"type": "rectangle", "bsdf": {"type": "diffraction", **METAL}},
            "other": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().translate([1, 0, 0.2]),
                "bsdf": {"type": "diffraction", **SKIN},
            },
            "lamp": {"type": "point", "position": [-1, 1.5, 2.5], "intensity": 10.0},
        }
    )
    params = mi.traverse(scene)
    frozen = dr.freeze(lambda scene, seed: mi.render(scene, spp=4, seed=seed))
    pictures = []
    for key, value in [("coherence_length", 4.0), ("coherence_length", 9.0), ("eta.value", 1.5), ("eta.value", 1.2)]:
        params[f"plate.bsdf.{key}"] = value
        params.update()
        pictures.append(np.array(mi.render(scene, spp=4, seed=3)))
        assert_same([np.array(frozen(scene, mi.UInt32(3)))], pictures[-1:])
    assert_changing(pictures)


def test_derivatives_of_frozen_functions_agree():
    use_variant("llvm_ad_spectral")
    bsdf = diffraction(**SKIN)
    params = mi.traverse(bsdf)
    si, wo, _ = question()

    def derivative(bsdf, eta, si, wo):
        dr.enable_grad(eta)
        params = mi.traverse(bsdf)
        params["eta.value"] = eta
        params.update()
        dr.backward(dr.sum(bsdf.eval(mi.BSDFContext(), si, wo), axis=None))
        return dr.grad(eta)

    frozen = dr.freeze(derivative)
    for length in VALUES["coherence_length"]:
        params["coherence_length"] = length
        params.update()
        usual = derivative(bsdf, mi.Float(1.4), si, wo)
        assert usual[0] != 0
        np.testing.assert_allclose(frozen(bsdf, mi.Float(1.4), si, wo), usual, rtol=SINGLE)
