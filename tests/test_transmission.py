"""Transparent bodies in Mitsuba: films and interfaces, their samples, energy, transport modes, and polarisation."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from batches import direction, eval_pdf, random_directions, random_wavelengths, sample
from conftest import VARIANTS, built, use_variant
from mueller import FORMULA, WAVELENGTHS, evaluated, normalised, turned

from mitsuba_scenes.chi_square import SphereDomain, bsdf_test

# Probability that any of the χ² tests rejects a correct density.
SIGNIFICANCE = 0.01
ETA = 1.5
ANGLES = [(0, 0), (25, 45), (50, 180), (75, 120)]
# Incidences on either side.
SIDES = [(theta, phi, side) for theta, phi in ANGLES for side in (1, -1)]
# Orders are wide, so that histograms resolve them.
GRATING = {"preset": "sinusoidal", "period": 1.6, "height": 0.3, "eta": ETA, "coherence_length": 12.0}
SURFACES = {
    "film": {**GRATING, "transmission": "film", "rotation": 25.0, "back_reflection": False},
    "interface": {**GRATING, "transmission": "interface"},
    "skin": {"preset": "xenopeltis", "eta": 1.56, "coherence_length": 10.0, "transmission": "interface"},
    "sized": {
        **GRATING,
        "transmission": "film",
        "back_reflection": False,
        "scale": {"type": "uniform", "value": 0.8},
        "depth": {"type": "uniform", "value": 0.6},
    },
}
# Relative difference of variants in single precision.
SINGLE = 5e-4
# Standard errors of a mean that count as agreement.
SIGMAS = 5.0


def on_side(theta, phi, side):
    x, y, z = direction(theta, phi)
    return [x, y, side * z]


def both_sides(rng, count):
    """Directions `(count, 3)`, uniform over the sphere."""
    w = random_directions(rng, count)
    w[:, 2] *= np.where(rng.random(count) < 0.5, 1, -1).astype(np.float32)
    return w


def index_of(parameters, w):
    """Index of the medium that each direction is in."""
    inside = (w[:, 2] < 0) & (parameters["transmission"] == "interface")
    return np.where(inside, parameters["eta"], 1.0)


@pytest.mark.parametrize("angles", SIDES, ids=str)
@pytest.mark.parametrize("name", SURFACES)
def test_samples_follow_the_density(name, angles):
    bsdf = built("llvm_ad_spectral", **SURFACES[name])
    test = bsdf_test(bsdf, on_side(*angles), domain=SphereDomain(), res=101)
    assert test.run(SIGNIFICANCE, len(SURFACES) * len(SIDES), quiet=True), test.messages


@pytest.mark.parametrize("angles", SIDES[::3], ids=str)
@pytest.mark.parametrize("name", ["film", "interface"])
def test_colour_samples_follow_the_density(name, angles):
    bsdf = built("llvm_ad_rgb", **SURFACES[name])
    test = bsdf_test(bsdf, on_side(*angles), domain=SphereDomain(), res=71)
    assert test.run(SIGNIFICANCE, 2 * len(SIDES[::3]), quiet=True), test.messages


@pytest.mark.parametrize("name", SURFACES)
def test_values_are_reciprocal_and_no_light_is_made(name):
    parameters = SURFACES[name]
    bsdf = built("llvm_ad_spectral", **parameters)
    rng = np.random.default_rng(3)
    count = 20_000
    wi, wo, nm = both_sides(rng, count), both_sides(rng, count), random_wavelengths(rng, count)
    # Radiance from wo to wi is in proportion to the squared index of wi's medium.
    there = eval_pdf(bsdf, wi, wo, nm)[0] / np.abs(wo[:, 2:]) / index_of(parameters, wi)[:, None] ** 2
    back = eval_pdf(bsdf, wo, wi, nm)[0] / np.abs(wi[:, 2:]) / index_of(parameters, wo)[:, None] ** 2
    # Values much below the mean are differences of larger ones.
    np.testing.assert_allclose(there, back, rtol=5e-3, atol=5e-3 * there.mean())
    assert np.all(np.isfinite(there))
    assert np.all(there >= 0)
    for angles in SIDES:
        wis = np.broadcast_to(np.float32(on_side(*angles)), (count, 3))
        wos, _, weight = sample(bsdf, wis, nm, rng.random((count, 3)).astype(np.float32))
        # The power of a sample of radiance is its weight times the squared ratio of indices.
        power = weight * (index_of(parameters, wos) / index_of(parameters, wis))[:, None] ** 2
        mean, noise = power.mean(), power.mean(axis=1).std() / np.sqrt(count)
        assert 0.05 < mean <= 1.01 + SIGMAS * noise, (angles, mean)


@pytest.mark.parametrize("variant", [v for v in VARIANTS if "polarized" not in v])
def test_variants_agree(variant):
    rng = np.random.default_rng(7)
    count = 200 if variant.startswith("scalar") else 4000
    wi, wo, nm = both_sides(rng, count), both_sides(rng, count), random_wavelengths(rng, count)
    kind = "spectral" if "spectral" in variant else "rgb"
    for name in ("film", "interface"):
        found = eval_pdf(built(variant, **SURFACES[name]), wi, wo, nm)
        expected = eval_pdf(built(f"llvm_ad_{kind}", **SURFACES[name]), wi, wo, nm)
        for a, b in zip(found, expected):
            if a.shape == b.shape and variant != "scalar_rgb":
                np.testing.assert_allclose(a, b, rtol=SINGLE, atol=SINGLE * np.abs(b).mean())


@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
def test_a_flat_interface_divides_light_as_dielectric_does(mode):
    use_variant("llvm_ad_spectral")
    mine = built("llvm_ad_spectral", preset="flat", coherence_length=200.0, eta=ETA, transmission="interface")
    other = mi.load_dict({"type": "dielectric", "int_ior": ETA, "ext_ior": 1.0})
    ctx = mi.BSDFContext(getattr(mi.TransportMode, mode))
    rng = np.random.default_rng(11)
    count = 50_000
    u = rng.random((count, 3)).astype(np.float32)
    for theta, side in [(0, 1), (40, 1), (70, 1), (20, -1), (60, -1)]:
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi = mi.Vector3f(on_side(theta, 30, side)) + dr.zeros(mi.Float, count)
        si.wavelengths = [mi.Float(550.0)] * 4
        powers = []
        for bsdf in (mine, other):
            bs, weight = bsdf.sample(ctx, si, mi.Float(u[:, 0]), mi.Point2f(u[:, 1:].T.copy()))
            weight, transmitted = np.array(weight)[0], np.array(bs.wo)[2] * side < 0
            eta = np.array(bs.eta)
            assert set(np.round(eta[transmitted & (weight > 0)], 5)) <= {
                np.float32(round(ETA if side > 0 else 1 / ETA, 5))
            }
            powers.append([weight[~transmitted].sum() / count, weight[transmitted].sum() / count])
        # Noise of both, and a thousandth of the tables.
        np.testing.assert_allclose(powers[0], powers[1], atol=0.02, rtol=0.01)


def test_an_index_of_one_changes_nothing():
    rng = np.random.default_rng(5)
    count = 4000
    wi, nm = both_sides(rng, count), random_wavelengths(rng, count)
    for kind in ("film", "interface"):
        bsdf = built("llvm_ad_spectral", preset="blazed", eta=1.0, transmission=kind)
        wo, _, weight = sample(bsdf, wi, nm, rng.random((count, 3)).astype(np.float32))
        lit = weight[:, 0] > 1e-3
        # Light goes straight on, within the width of an order. Samples of reflection carry nothing.
        assert lit.mean() > 0.85
        far = np.abs(wi[:, 2]) > 0.2
        assert np.abs(wo + wi)[lit & far].max() < 0.1
        assert abs(weight[far].mean() - 1) < 0.02


def test_a_film_mirrors_light_from_behind():
    use_variant("llvm_ad_spectral")
    bsdf = built("llvm_ad_spectral", preset="flat", coherence_length=60.0, eta=ETA, transmission="film")
    ctx = mi.BSDFContext()
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wavelengths = [550.0] * 4
    for theta in (0, 50):
        si.wi = on_side(theta, 30, -1)
        bs, weight = bsdf.sample(ctx, si, 1e-4, [0.3, 0.6])
        assert mi.has_flag(bs.sampled_type, mi.BSDFFlags.DeltaReflection)
        np.testing.assert_allclose(np.array(bs.wo)[:2].ravel(), -np.array(si.wi)[:2].ravel(), atol=1e-6)
        reflectance = mi.fresnel(float(np.cos(np.radians(theta))), ETA)[0]
        np.testing.assert_allclose(np.array(bs.pdf).item() * np.array(weight)[0], reflectance, rtol=1e-4)
        # None from above.
        si.wi = on_side(theta, 30, 1)
        assert not mi.has_flag(bsdf.sample(ctx, si, 1e-4, [0.3, 0.6])[0].sampled_type, mi.BSDFFlags.DeltaReflection)


def test_gradients_are_central_differences():
    bsdf = built("llvm_ad_spectral", **SURFACES["film"])
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wavelengths = [550.0] * 4
    wi, wo = np.array(on_side(30, 10, 1)), np.array(on_side(26, 195, -1))

    def value(x):
        si.wi = mi.Vector3f(wi.tolist())
        return dr.mean(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(x, float(wo[1]), float(wo[2]))))

    x = mi.Float(float(wo[0]))
    dr.enable_grad(x)
    y = value(x)
    dr.backward(y)
    step = 2e-3
    expected = (np.array(value(mi.Float(wo[0] + step))) - np.array(value(mi.Float(wo[0] - step)))) / (2 * step)
    # Both are difference quotients, with other steps.
    np.testing.assert_allclose(np.array(dr.grad(x)), expected, rtol=0.05, atol=0.02 * abs(np.array(y)).item())


def perturbation(wi, wo, eta):
    """Jones matrix `[out, in]` of first-order perturbation (Rice 1951) of a shallow relief, and the s axes of both.

    Light arrives from `wi` and leaves along `wo`, on either side; below, both are directions in the medium. Amplitudes
    follow from the continuity of tangential fields on the relief. Their common factor is arbitrary.
    """

    def states(k, n):
        s = np.array([-k[1], k[0], 0]) / np.hypot(k[0].real, k[1].real)
        p = np.cross(k, s) / n
        return [(e, np.cross(k, e)) for e in (s, p)]

    def wave(tangent, sign, n):
        return np.array([*tangent, sign * np.sqrt(n * n - tangent @ tangent + 0j)])

    def tangential(field):
        return np.array([*field[0][:2], *field[1][:2]])

    def solve(tangent, jump):
        up, down = states(wave(tangent, 1, 1), 1), states(wave(tangent, -1, eta), eta)
        columns = [tangential(up[0]), tangential(up[1]), -tangential(down[0]), -tangential(down[1])]
        return np.linalg.solve(np.stack(columns, 1), jump)

    n_in, n_out = (eta if w[2] < 0 else 1.0 for w in (wi, wo))
    before, after = -n_in * np.array(wi[:2]), n_out * np.array(wo[:2])
    arriving, side = wave(before, 1 if wi[2] < 0 else -1, n_in), -1 if wi[2] < 0 else 1
    jones = np.zeros((2, 2), complex)
    for state, incident in enumerate(states(arriving, n_in)):
        flat = solve(before, -side * tangential(incident))
        up, down = wave(before, 1, 1), wave(before, -1, eta)
        waves = [(incident, arriving[2], side)]
        waves += [(field, up[2], a) for field, a in zip(states(up, 1), flat[:2])]
        waves += [(field, down[2], -a) for field, a in zip(states(down, eta), flat[2:])]
        jump = np.zeros(4, complex)
        for fields, kz, amplitude in waves:
            jump -= tangential(fields) * (1j * kz * amplitude)
            for i, field in enumerate(fields):
                jump[2 * i : 2 * i + 2] -= 1j * (after - before) * field[2] * amplitude
        found = solve(after, jump)
        jones[:, state] = found[2:] if wo[2] < 0 else found[:2]
    axes = [np.array([-t[1], t[0], 0]) / np.hypot(*t) for t in (before, after)]
    return jones, axes


def mueller_of(jones):
    """Mueller matrix of a Jones matrix, over its first element. The fourth Stokes component is 2 Im(x y*)."""
    change = np.array([[1, 0, 0, 1], [1, 0, 0, -1], [0, 1, 1, 0], [0, -1j, 1j, 0]])
    matrix = (change @ np.kron(jones, jones.conj()) @ np.linalg.inv(change)).real
    return matrix / matrix[0, 0]


@pytest.mark.parametrize("variant", ["llvm_ad_spectral_polarized", "scalar_spectral_polarized"])
def test_matrices_are_those_of_a_shallow_relief(variant):
    # A skin scatters to all directions.
    bsdf = built(variant, **{**SURFACES["skin"], "eta": ETA})
    rng = np.random.default_rng(13)
    wi, wo = both_sides(rng, 60), both_sides(rng, 60)
    keep = (np.abs(wi[:, 2]) > 0.1) & (np.abs(wo[:, 2]) > 0.1)
    keep &= (np.abs(wi[:, 2]) < 0.99) & (np.abs(wo[:, 2]) < 0.99)
    wi, wo = wi[keep], wo[keep]
    # Radiance: light comes from wo and leaves towards wi.
    found = normalised(evaluated(bsdf, wi, wo))
    for pair in range(len(wi)):
        jones, (s_in, s_out) = perturbation(wo[pair].astype(float), wi[pair].astype(float), ETA)
        expected = in_stokes_bases(mueller_of(jones), wo[pair], s_in, wi[pair], s_out)
        np.testing.assert_allclose(found[pair, 0], expected, atol=FORMULA, err_msg=f"{wi[pair]} {wo[pair]}")


def in_stokes_bases(matrix, source, s_in, to, s_out):
    """A Mueller matrix between Mitsuba's frames of reference, from one between the frames with the given first axes."""
    from mueller import basis

    forward_in, forward_out = -np.asarray(source, float), np.asarray(to, float)
    into = turned(forward_in, basis(forward_in), s_in)
    out = turned(forward_out, s_out, basis(forward_out))
    return out @ matrix @ into


@pytest.mark.parametrize("kind", ["film", "interface"])
def test_polarised_variants_have_the_unpolarised_values(kind):
    rng = np.random.default_rng(17)
    wi, wo = both_sides(rng, 500), both_sides(rng, 500)
    nm = np.broadcast_to(np.float32(WAVELENGTHS), (500, 4))
    plain = eval_pdf(built("llvm_ad_spectral", **SURFACES[kind]), wi, wo, nm)[0]
    first = evaluated(built("llvm_ad_spectral_polarized", **SURFACES[kind]), wi, wo)[:, :, 0, 0]
    np.testing.assert_allclose(first, plain, rtol=SINGLE, atol=SINGLE * plain.mean())


def test_matrices_of_a_flat_film_are_those_of_thindielectric():
    use_variant("llvm_ad_spectral_polarized")
    bsdf = built("llvm_ad_spectral_polarized", preset="flat", coherence_length=100.0, eta=ETA, transmission="film")
    wi = np.float32([on_side(theta, phi, side) for theta, phi, side in [(20, 10, 1), (50, 70, 1), (70, 200, -1)]])
    found = normalised(evaluated(bsdf, wi, -wi))
    for pair, w in enumerate(wi):
        cos, eps = abs(w[2]), ETA**2
        inside = np.sqrt(eps - 1 + cos**2)
        # Each state passes both sides: the squared transmittances.
        passed = np.array([4 * cos * inside / (cos + inside) ** 2, 4 * eps * cos * inside / (eps * cos + inside) ** 2])
        s, p = passed**2
        s_axis = np.array([-w[1], w[0], 0.0]) / np.hypot(w[0], w[1])
        matrix = np.diag([s + p, s + p, 2 * np.sqrt(s * p), 2 * np.sqrt(s * p)]) / (s + p)
        matrix[0, 1] = matrix[1, 0] = (s - p) / (s + p)
        # Light comes from −wi and leaves along wi.
        expected = in_stokes_bases(matrix, -w, s_axis, w, s_axis)
        np.testing.assert_allclose(found[pair, 0], expected, atol=FORMULA)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"transmission": "glass"}, "unknown variant"),
        ({"transmission": "film", "eta": 0.5}, "1, or in"),
        ({"transmission": "film", "eta": 1.5, "k": 0.1}, '"k" contradicts'),
        ({"transmission": "film", "material": "Al"}, '"material" contradicts'),
        ({"transmission": "film", "eta": 1.5, "diffuse_reflectance": 0.2}, '"diffuse_reflectance" contradicts'),
        ({"transmission": "film", "eta": 1.5, "cover_eta": 1.4}, '"cover_eta" contradicts'),
        ({"transmission": "film", "eta": 1.5, "specular_transmittance": 1.5}, '"specular_transmittance" is'),
        ({"transmission": "film", "eta": {"type": "checkerboard"}}, "one number"),
        ({"transmission": "film", "eta": 1.5, "int_ior": 1.5}, '"int_ior" contradicts "eta"'),
        ({"transmission": "interface", "eta": 1.5, "back_reflection": True}, '"back_reflection" contradicts'),
        ({"transmission": "interface", "int_ior": 1.5, "ext_ior": 1.33}, '"ext_ior" is'),
        ({"transmission": "interface", "int_ior": "unobtainium"}, "unobtainium"),
        ({"int_ior": 1.5}, 'unknown parameter "int_ior" without transmission'),
        ({"specular_transmittance": 0.5}, 'unknown parameter "specular_transmittance"'),
    ],
    ids=str,
)
def test_bad_parameters_are_refused_in_one_line(parameters, message):
    use_variant("llvm_ad_rgb")
    with pytest.raises(Exception, match=message):
        mi.load_dict({"type": "diffraction", "preset": "blazed", **parameters})


def test_twosided_refuses_a_body():
    use_variant("llvm_ad_rgb")
    with pytest.raises(Exception, match="transmission"):
        mi.load_dict(
            {
                "type": "twosided",
                "bsdf": {"type": "diffraction", "preset": "blazed", "transmission": "film", "eta": 1.5},
            }
        )


def test_names_of_media_are_mitsubas():
    named = built("llvm_ad_rgb", preset="flat", transmission="interface", int_ior="water", ext_ior="air")
    assert "eta 1.3326" in str(named)
    # Numbers may be integers.
    numbered = built("llvm_ad_rgb", preset="flat", transmission="interface", int_ior=2, ext_ior=1)
    assert "eta 2" in str(numbered)
