"""Relative sizes, `scale` and `depth`: direct sums, and textures in Mitsuba with values, sampling and derivatives."""

import json

import drjit as dr
import mitsuba as mi
import needs
import numpy as np
import pytest
from batches import direction, eval_pdf, interactions, random_directions, random_wavelengths, sample
from conftest import built, use_variant

from mitsuba_scenes.chi_square import bsdf_test
from mitsuba_scenes.crosscheck.cases import SCANS
from mitsuba_scenes.tool import sunbeam
from tests.judges.gratings.scalar import ask

# Probability that any of the χ² tests rejects a correct density.
SIGNIFICANCE = 0.01
ANGLES = [(0, 0), (20, 45), (30, 70), (45, 180), (55, 10), (60, 0), (75, 120), (80, 70)]
# Random numbers of the χ² tests. With those of seed 0 the same grating built at its size is rejected, too.
SEED = 1
# Orders are wide, so that histograms resolve them.
GRATING = {"preset": "sinusoidal", "period": 2.4, "height": 0.25, "material": "Al", "coherence_length": 12.0}
SKIN = {"preset": "xenopeltis", "material": "Au", "coherence_length": 10.0}
SURFACES = {"grating": GRATING, "skin": SKIN, "covered": {**GRATING, "cover_eta": 1.5, "cover_reflection": False}}
SCALE, DEPTH = 0.6, 0.8
# Difference of two direct sums in double precision, relative to the largest value. Rounding of phases is far below.
DIRECT = 1e-6
RELIEFS = ("sinusoidal", "lamellar", "scan")


def texture(value):
    return {"type": "uniform", "value": value}


def bitmap(values):
    """A texture of raw values, one row."""
    array = np.asarray(values, dtype=np.float32).reshape(1, -1, 1)
    return {"type": "bitmap", "bitmap": mi.Bitmap(array), "raw": True, "filter_type": "nearest"}


def sized(variant, scale=SCALE, depth=DEPTH, **parameters):
    return built(variant, scale=texture(scale), depth=texture(depth), **parameters)


def random_queries(seed, count=20_000):
    rng = np.random.default_rng(seed)
    return random_directions(rng, count), random_directions(rng, count), random_wavelengths(rng, count)


def reliefs(name, folder):
    """Arguments of the command for a relief, and for a relief of the size SCALE and DEPTH that is built as such."""
    if name != "scan":
        period, height = 2.4, 0.25
        sizes = (period, height), (SCALE * period, DEPTH * height)
        return [["--preset", name, "--period", size[0], "--height", size[1]] for size in sizes]
    scan = SCANS["xenopeltis"]
    if not scan.exists():
        needs.skip("scans", f"{scan} is missing")
    whole, small = folder / "whole.npy", folder / "small.npy"
    pixel_um = json.loads(sunbeam("height-field", "--height-field", scan, "-o", whole))["pixel_um"][0]
    np.save(small, DEPTH * np.load(whole))
    files = (scan, "--level", "plane"), (small, "--level", "none", "--pixel-size", SCALE * pixel_um)
    return [["--height-field", *file] for file in files]


def direct_sums(relief, wi, wo, nm, *more):
    """Values of the direct sum by the command, without energy conservation and without an obliquity factor."""
    questions = [{"wi": a, "wo": b, "wavelength": c} for a, b, c in zip(wi.tolist(), wo.tolist(), nm.tolist())]
    words = ["eval", "--method", "exact", "--conserve-energy", "false", "--obliquity", "unit"]
    return np.array(ask([*words, *relief, *more], questions))


@pytest.mark.parametrize("model", ["ensemble", "patch"])
@pytest.mark.parametrize("name", RELIEFS)
def test_direct_sums_of_a_size_equal_a_relief_built_at_that_size(name, model, tmp_path):
    """The coherence window of numbers keeps its width."""
    given, small = reliefs(name, tmp_path)
    wi, wo, nm = random_queries(31, 200)
    common = ("--coherence-length", 12, "--model", model)
    expected = direct_sums(small, wi, wo, nm[:, 0], *common)
    found = direct_sums(given, wi, wo, nm[:, 0], *common, "--scale", SCALE, "--depth", DEPTH)
    assert np.abs(found - expected).max() < DIRECT * expected.max()
    # Negative control: a size that differs by 0.1 %.
    other = direct_sums(given, wi, wo, nm[:, 0], *common, "--scale", SCALE, "--depth", 1.001 * DEPTH)
    assert np.abs(other - expected).max() > 10 * DIRECT * expected.max()


@pytest.mark.parametrize("name", RELIEFS)
def test_direct_sums_follow_the_rule_by_which_textures_read_tables(name, tmp_path):
    """S_sd(f; κ) = s² S(s f; d κ), with a window that is resized with the pattern (docs/model.md).

    At the wavelength λ/d, a pair with the scattering vector (us/d, vs/d, w) has the frequencies s f and the rate d κ.
    """
    given, small = reliefs(name, tmp_path)
    wi, wo, nm = (values.astype(float) for values in random_queries(32, 200))
    wi, wo = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in (wi, wo))
    vector = (wi + wo) * [SCALE / DEPTH, SCALE / DEPTH, 1]
    # Half of the difference of two unit vectors with this sum; it is horizontal, so both lie above the surface.
    apart = np.stack([-vector[:, 1], vector[:, 0], 0 * vector[:, 0]], axis=1)
    apart *= (np.sqrt(1 - (vector**2).sum(axis=1) / 4) / np.hypot(vector[:, 0], vector[:, 1]))[:, None]
    whole = direct_sums(given, vector / 2 + apart, vector / 2 - apart, nm[:, 0] / DEPTH, "--coherence-length", 12)
    expected = direct_sums(small, wi, wo, nm[:, 0], "--coherence-length", 12 * SCALE)
    # f is S/λ².
    found = (SCALE / DEPTH) ** 2 * whole
    assert expected.max() > 0.1
    assert np.abs(found - expected).max() < DIRECT * expected.max()
    # Negative control: a window that keeps its width.
    kept = direct_sums(small, wi, wo, nm[:, 0], "--coherence-length", 12)
    assert np.abs(kept - expected).max() > 0.1 * expected.max()


@pytest.mark.parametrize("angles", ANGLES, ids=str)
@pytest.mark.parametrize("name", SURFACES)
def test_samples_follow_the_density(name, angles):
    bsdf = sized("llvm_ad_spectral", **SURFACES[name])
    test = bsdf_test(bsdf, direction(*angles), seed=SEED)
    assert test.run(SIGNIFICANCE, len(SURFACES) * len(ANGLES), quiet=True), test.messages


@pytest.mark.parametrize("angles", ANGLES[::2], ids=str)
@pytest.mark.parametrize("name", ["grating", "skin"])
def test_colour_samples_follow_the_density(name, angles):
    # Albedo tables of all sizes take most of the time to build. Division by them changes no density.
    bsdf = sized("llvm_ad_rgb", conserve_energy=False, **SURFACES[name])
    test = bsdf_test(bsdf, direction(*angles), res=51, ires=8)
    assert test.run(SIGNIFICANCE, len(ANGLES), quiet=True), test.messages


@pytest.mark.parametrize(
    ("variant", "name", "tolerance"),
    [
        # Two tables, each to 1e-3 of its peaks.
        ("llvm_ad_spectral", "grating", 5e-3),
        ("llvm_ad_spectral", "skin", 5e-3),
        # Colours are fitted to the sizes of their own tables, and R of gold is corrected by band means.
        ("llvm_ad_rgb", "grating", 1e-2),
        ("llvm_ad_rgb", "skin", 2e-2),
    ],
)
def test_textures_equal_a_relief_of_that_size(variant, name, tolerance):
    surface = {**SURFACES[name], "conserve_energy": False}
    # A grating's window keeps its width in spectral variants. Elsewhere the window is resized with the pattern.
    keeps_window = name == "grating" and variant == "llvm_ad_spectral"
    length = surface.pop("coherence_length") * (1 if keeps_window else SCALE)
    by_texture = sized(variant, coherence_length=SURFACES[name]["coherence_length"], **surface)
    by_number = built(variant, scale=SCALE, depth=DEPTH, coherence_length=length, **surface)
    wi, wo, nm = random_queries(5)
    found, expected = eval_pdf(by_texture, wi, wo, nm)[0], eval_pdf(by_number, wi, wo, nm)[0]
    assert expected.max() > 0
    assert np.abs(found - expected).sum() < tolerance * expected.sum()


def test_every_variant_takes_textures(variant):
    if "polarized" in variant and "mono" in variant:
        pytest.skip("as mono without polarisation")
    wi, wo, nm = random_queries(6, 200)
    surface = {**GRATING, "conserve_energy": False}
    if not mi.is_spectral:
        surface["coherence_length"] *= SCALE
    expected = eval_pdf(built(variant, scale=SCALE, depth=DEPTH, **surface), wi, wo, nm)[0]
    found = eval_pdf(sized(variant, **{**surface, "coherence_length": GRATING["coherence_length"]}), wi, wo, nm)[0]
    # Tolerance of colours above, for few queries.
    assert np.abs(found - expected).sum() < 2e-2 * np.abs(expected).sum()


@pytest.mark.parametrize("name", SURFACES)
def test_values_are_reciprocal_and_no_light_is_made(name):
    bsdf = sized("llvm_ad_spectral", **SURFACES[name])
    wi, wo, nm = random_queries(3)
    there, back = eval_pdf(bsdf, wi, wo, nm)[0], eval_pdf(bsdf, wo, wi, nm)[0]
    there, back = there / wo[:, 2:], back / wi[:, 2:]
    # Rounding of positions on the lattice, where orders are narrow.
    np.testing.assert_allclose(there, back, rtol=2e-3, atol=2e-4 * there.max())
    rng = np.random.default_rng(4)
    for angles in ANGLES:
        count = 20_000
        wi, nm = np.tile(direction(*angles), (count, 1)), random_wavelengths(rng, count)
        weights = sample(bsdf, wi, nm, rng.random((count, 3)))[2]
        # Five standard errors, and the limiter's bound.
        error = weights.std(axis=0) / np.sqrt(count)
        assert np.all(weights.mean(axis=0) < 1.01 + 5 * error), angles


@pytest.mark.parametrize("name", SURFACES)
def test_weights_are_as_even_as_those_of_one_size(name):
    rng = np.random.default_rng(9)
    spreads = []
    for bsdf in (
        sized("llvm_ad_spectral", **SURFACES[name]),
        built("llvm_ad_spectral", scale=SCALE, depth=DEPTH, **SURFACES[name]),
    ):
        count = 100_000
        wi, nm = np.tile(direction(30, 40), (count, 1)), np.repeat(random_wavelengths(rng, count)[:, :1], 4, axis=1)
        weights = sample(bsdf, wi, nm, rng.random((count, 3)))[2][:, 0]
        spreads.append(weights.std() / weights.mean())
    assert spreads[0] < 1.2 * spreads[1], spreads


@pytest.mark.parametrize("variant", ["llvm_ad_spectral", "llvm_ad_rgb"])
@pytest.mark.parametrize("name", ["scale", "depth"])
@pytest.mark.parametrize("at_end", [False, True])
def test_derivatives_match_differences(variant, name, at_end):
    use_variant(variant)
    sizes = {"scale": SCALE, "depth": DEPTH}
    if at_end:
        # The largest size.
        sizes[name] = 1.0
    textures = {key: texture(size) for key, size in sizes.items()}
    bsdf = mi.load_dict({"type": "diffraction", **GRATING, "conserve_energy": False, **textures})
    params = mi.traverse(bsdf)
    key = f"{name}.value"
    wi, wo, nm = random_queries(12, 2000)
    si, wo = interactions(wi, nm), mi.Vector3f(np.ascontiguousarray(wo.T))
    start = float(params[key][0]) if hasattr(params[key], "__len__") else float(params[key])

    def values(at):
        params[key] = at
        params.update()
        return np.array(bsdf.eval(mi.BSDFContext(), si, wo))

    if at_end:
        # One-sided, of second order.
        step = 5e-4
        expected = (3 * values(start) - 4 * values(start - step) + values(start - 2 * step)) / (2 * step)
    else:
        step = 1e-3
        expected = (values(start + step) - values(start - step)) / (2 * step)
    size = mi.Float(start)
    dr.enable_grad(size)
    params[key] = size
    params.update()
    value = bsdf.eval(mi.BSDFContext(), si, wo)
    dr.forward(size)
    found = np.array(dr.grad(value))
    # Both are difference quotients with steps of their own. At the end the plugin's is one-sided, so its error is
    # proportional to the step instead of its square.
    tolerance = 0.1 if at_end else 0.02
    assert np.abs(found - expected).sum() < tolerance * np.abs(expected).sum()


def test_bitmaps_give_each_place_its_size():
    use_variant("llvm_ad_spectral")
    surface = {"type": "diffraction", **GRATING, "conserve_energy": False}
    varying = mi.load_dict({**surface, "scale": bitmap([0.5, 0.75, 1.0]), "depth": bitmap([1.0, 0.8, 0.6])})
    assert mi.has_flag(varying.flags(), mi.BSDFFlags.SpatiallyVarying)
    wi, wo, nm = random_queries(13, 2000)
    for place, (scale, depth) in enumerate([(0.5, 1.0), (0.75, 0.8), (1.0, 0.6)]):
        si = interactions(wi, nm)
        si.uv = mi.Point2f((place + 0.5) / 3, 0.5)
        outgoing = mi.Vector3f(np.ascontiguousarray(wo.T))
        found = np.array(varying.eval(mi.BSDFContext(), si, outgoing))
        expected = np.array(
            sized("llvm_ad_spectral", scale, depth, **GRATING, conserve_energy=False).eval(
                mi.BSDFContext(), si, outgoing
            )
        )
        # Rounding of the textures' own interpolation.
        np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-4 * expected.max())


def test_numbers_are_live():
    use_variant("llvm_ad_spectral")
    wi, wo, nm = random_queries(14, 2000)
    bsdf = mi.load_dict({"type": "diffraction", **GRATING})
    params = mi.traverse(bsdf)
    params["scale"], params["depth"] = SCALE, DEPTH
    params.update()
    expected = eval_pdf(built("llvm_ad_spectral", scale=SCALE, depth=DEPTH, **GRATING), wi, wo, nm)[0]
    np.testing.assert_array_equal(eval_pdf(bsdf, wi, wo, nm)[0], expected)
    params["scale"] = 1.5
    with pytest.raises(RuntimeError, match='"scale" is'):
        params.update()
    assert params["scale"] == pytest.approx(SCALE)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"scale": [0.5, 1.5]}, 'parameter "scale" has values from 0.5 to 1.5 in its texture'),
        ({"depth": [-0.5, 1.0]}, 'parameter "depth" has values from -0.5 to 1 in its texture'),
        ({"scale": [0.5, 1.0], "theory": "rigorous"}, "give numbers"),
    ],
)
def test_refused_in_one_line(parameters, message):
    use_variant("scalar_rgb")
    read = {name: bitmap(value) if isinstance(value, list) else value for name, value in parameters.items()}
    with pytest.raises(RuntimeError, match=message):
        mi.load_dict({"type": "diffraction", **GRATING, **read})


@pytest.mark.parametrize("variant", ["scalar_spectral", "llvm_ad_spectral"])
def test_tables_cover_all_pixels_of_a_transformed_bitmap(variant):
    """A bitmap twice across the surface: its pixels' centres, taken as coordinates on the surface, miss two of four."""
    use_variant(variant)
    texture = bitmap([1.0, 0.5, 0.6, 0.5])
    plain = mi.load_dict({"type": "diffraction", **GRATING, "scale": texture})
    twice = {**texture, "to_uv": mi.ScalarTransform3f().scale([2, 1])}
    transformed = mi.load_dict({"type": "diffraction", **GRATING, "scale": twice})
    wi, wo = direction(20, 0), direction(5, 180)

    def value(bsdf, u):
        si = mi.SurfaceInteraction3f()
        si.wi, si.uv, si.wavelengths = mi.Vector3f(*wi), mi.Point2f(u, 0.5), [450.0, 500.0, 550.0, 600.0]
        return np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*wo)))

    # Equal tables and sizes: rounding in single precision only.
    for u in (0.1, 0.4, 0.6, 0.9):
        np.testing.assert_allclose(value(transformed, u / 2), value(plain, u), rtol=1e-5, atol=1e-6)
    # Sizes matter to this value.
    assert np.abs(value(plain, 0.1) - value(plain, 0.4)).max() > 0.01


# Albedo tables over all sizes take most of the time, so only one case has them.
@pytest.mark.parametrize(
    ("variant", "cover_eta", "conserve_energy"), [("llvm_ad_spectral", 1.0, True), ("llvm_ad_rgb", 1.58, False)]
)
def test_random_queries_at_random_sizes_are_finite(variant, cover_eta, conserve_energy):
    use_variant(variant)
    count = 200_000
    rng = np.random.default_rng(21)
    # Sizes over the whole accepted range, and directions down to the horizon.
    scale, depth = (10 ** rng.uniform(-3, 0, 64) for _ in range(2))
    surface = {"type": "diffraction", **GRATING, "cover_eta": cover_eta, "cover_reflection": cover_eta > 1}
    surface["conserve_energy"] = conserve_energy
    if cover_eta == 1:
        del surface["cover_eta"], surface["cover_reflection"]
    bsdf = mi.load_dict({**surface, "scale": bitmap(scale), "depth": bitmap(depth)})
    wi, wo, nm = random_directions(rng, count), random_directions(rng, count), random_wavelengths(rng, count)
    grazing = rng.random(count) < 0.2
    wi[grazing, 2] *= 1e-4
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    si = interactions(wi, nm)
    si.uv = mi.Point2f(rng.random((2, count)).astype(np.float32))
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, mi.Vector3f(np.ascontiguousarray(wo.T)))
    u = rng.random((3, count)).astype(np.float32)
    drawn, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(u[0]), mi.Point2f(u[1:]))
    for found in (value, pdf, drawn.wo, drawn.pdf, weight):
        assert np.all(np.isfinite(np.array(found)))
    assert np.all(np.array(pdf) >= 0)
    assert np.array(value).max() > 0
