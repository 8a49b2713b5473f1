"""Bodies that transmit, by Maxwell's equations in Mitsuba: samples, reciprocity, and the Jones matrices of orders."""

import json

import numpy as np
import pytest
from batches import direction, eval_alone, eval_pdf
from conftest import built
from mueller import WAVELENGTHS, basis, evaluated, normalised, reversed_path, turned
from test_polarised_orders import jones_to_mueller, transverse
from test_rigorous import asked
from test_transmission import SINGLE as VARIANTS_DIFFER
from test_transmission import both_sides, index_of, on_side

from mitsuba_scenes.chi_square import SphereDomain, bsdf_test

# Relief of tests/core/transmission_rigorous.rs, whose tables are shared: few orders, so that they are soon built.
RELIEF = {"preset": "sinusoidal", "period": 0.6, "height": 0.1, "theory": "rigorous", "eta": 1.5}
GRATING = {**RELIEF, "coherence_length": 8.0}
FILM = {**GRATING, "transmission": "film", "back_reflection": False}
INTERFACE = {**GRATING, "transmission": "interface"}
BODIES = {"film": FILM, "interface": INTERFACE}
# Incidences on either side, and the probability that any of the χ² tests rejects a correct density.
SIDES = [(0, 0, 1), (40, 60, 1), (25, 45, -1), (70, 160, -1)]
VARIANTS = ("llvm_ad_spectral", "llvm_ad_rgb", "llvm_ad_spectral_polarized")
SIGNIFICANCE = 0.01
# Error of interpolation in single precision, relative to the largest value, beside the square roots at passing-off
# lines.
SINGLE = 2e-3
# Errors of an order's matrix elements, root mean square and largest: interpolation between nodes of the table.
RMS, LARGEST = 0.02, 0.2


@pytest.mark.parametrize("angles", SIDES, ids=str)
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("body", BODIES)
def test_samples_follow_the_density(body, variant, angles):
    test = bsdf_test(built(variant, **BODIES[body]), on_side(*angles), domain=SphereDomain(), res=101)
    assert test.run(SIGNIFICANCE, len(BODIES) * len(VARIANTS) * len(SIDES), quiet=True), test.messages


def pairs(count, seed, body=FILM):
    """Random directions on both sides and wavelengths; each pair lies near an order of the grating on the body."""
    rng = np.random.default_rng(seed)
    wi = both_sides(rng, count)
    nm = rng.uniform(400, 700, (count, 4)).astype(np.float32)
    order = rng.integers(-2, 3, count)
    # Tangential wave vectors, over the wave number in vacuum.
    incident = wi[:, :2] * index_of(body, wi)[:, None]
    to = np.stack([order * nm[:, 0] * 1e-3 / body["period"] - incident[:, 0], -incident[:, 1]], axis=-1)
    to += rng.normal(0, 0.02, to.shape)
    side = np.where(rng.random(count) < 0.5, 1, -1)
    to /= index_of(body, np.stack([side] * 3, axis=-1))[:, None]
    squared = (to**2).sum(-1)
    z = np.sqrt(np.maximum(1 - squared, 1e-4)) * side
    kept = squared < 0.99
    return wi[kept], np.concatenate([to, z[:, None]], axis=-1)[kept].astype(np.float32), nm[kept]


@pytest.mark.parametrize("variant", VARIANTS[:2])
@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_values_are_reciprocal(body, variant):
    bsdf = built(variant, **body)
    wi, wo, nm = pairs(4000, 1, body)
    # Radiance from wo to wi is in proportion to the squared index of wi's medium.
    there, back = (
        eval_pdf(bsdf, *both, nm)[0] / np.abs(both[1][:, 2:]) / index_of(body, both[0])[:, None] ** 2
        for both in ((wi, wo), (wo, wi))
    )
    assert np.isfinite(there).all()
    for transmitted in (False, True):
        chosen = (wi[:, 2] * wo[:, 2] < 0) == transmitted
        scale = np.abs(there[chosen]).max()
        assert scale > 0.1
        assert np.abs(there - back)[chosen].max() < SINGLE * scale


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_plugin_and_command_agree(body):
    wi, wo, nm = pairs(300, 2, body)
    plugin = eval_alone(built("llvm_ad_spectral", **body), wi, wo, nm)
    words = [word for name in body if name != "back_reflection" for word in (f"--{name.replace('_', '-')}", body[name])]
    lines = "".join(
        json.dumps({"wi": a.tolist(), "wo": b.tolist(), "wavelength": c.tolist()}) + "\n"
        for a, b, c in zip(wi.astype(float), wo.astype(float), nm.astype(float))
    )
    answers = asked("eval", "--method", "table", *words, lines=lines).splitlines()
    expected = np.array([json.loads(line)["f"] for line in answers])
    assert expected.max() > 1
    # The command has the power of light from wi to wo, the plugin the radiance from wo to wi.
    plugin *= (index_of(body, wo) / index_of(body, wi))[:, None] ** 2 / np.abs(wo[:, 2:])
    assert np.abs(plugin - expected).max() < SINGLE * expected.max()


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_orders_have_their_jones_matrices(body):
    """Matrices equal those of `sunbeam orders`, which solves Maxwell's equations for each direction."""
    bsdf = built("llvm_ad_spectral_polarized", **body)
    words = [word for name in RELIEF for word in (f"--{name}", body[name])]
    wi, wo, expected = [], [], []
    for theta, phi in [(20, 15), (35, 80), (50, -40), (65, 130), (10, 250)]:
        light = ["--theta-i", theta, "--phi-i", phi, "--wavelength", WAVELENGTHS[1], "--json"]
        for order in json.loads(asked("orders", *words, "--transmission", body["transmission"], *light))["orders"]:
            start, end = np.array(direction(theta, phi), float), np.array(order["direction"])
            # Orders near the horizon, and those that the flat side reflects totally.
            if abs(end[2]) < 0.05 or order["side"] == "trapped":
                continue
            # The second state's electric field is opposite to the second axis of a right-handed frame.
            jones = (np.array(order["jones"]) @ [1, 1j]) * np.array([[1, -1], [-1, 1]])
            into, out = (turned(k[None], basis(k[None]), transverse(k[None])) for k in (-start, end))
            expected.append((np.swapaxes(out, -1, -2) @ jones_to_mueller(jones) @ into)[0])
            # Radiance: light comes from wo and leaves towards wi.
            wi.append(end)
            wo.append(start)
    wi, wo, expected = np.float32(wi), np.float32(wo), normalised(np.array(expected))
    below = wi[:, 2] < 0
    assert below.sum() > 10
    assert (~below).sum() > 10
    found = normalised(evaluated(bsdf, wi, wo)[:, 1])
    for side in (below, ~below):
        error = (found - expected)[side]
        assert np.sqrt(np.mean(error**2)) < RMS
        assert np.abs(error).max() < LARGEST
        # Wrong signs of crossed elements and of phases are noticed.
        for i, j in ((0, 1), (0, 2), (2, 0), (1, 2), (3, 2)):
            wrong = expected[side] * np.where((np.arange(4)[:, None] == i) & (np.arange(4) == j), -1, 1)
            off = np.sqrt(np.mean((found[side] - wrong)[:, i, j] ** 2))
            assert off > 3 * np.sqrt(np.mean(error[:, i, j] ** 2)), (i, j)


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_light_from_below_has_the_matrices_of_the_reversed_path(body):
    bsdf = built("llvm_ad_spectral_polarized", **body)
    wi, wo, _ = pairs(2000, 3, body)
    there, back = (
        evaluated(bsdf, a, b) / (np.abs(b[:, 2]) * index_of(body, a) ** 2)[:, None, None, None]
        for a, b in ((wi, wo), (wo, wi))
    )
    expected = reversed_path(there, wi.astype(float), wo.astype(float))
    assert np.abs(back - expected).max() < 2 * SINGLE * np.abs(there).max()


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_polarised_variants_have_the_unpolarised_values(body):
    wi, wo, _ = pairs(1000, 4, body)
    nm = np.broadcast_to(np.float32(WAVELENGTHS), (len(wi), 4))
    plain = eval_alone(built("llvm_ad_spectral", **body), wi, wo, nm)
    first = evaluated(built("llvm_ad_spectral_polarized", **body), wi, wo)[:, :, 0, 0]
    np.testing.assert_allclose(first, plain, rtol=VARIANTS_DIFFER, atol=VARIANTS_DIFFER * plain.mean())
    mono = eval_alone(built("llvm_ad_mono", **body), wi, wo, nm)
    first = evaluated(built("llvm_ad_mono_polarized", **body), wi, wo)[:, :, 0, 0]
    np.testing.assert_allclose(first, mono, rtol=VARIANTS_DIFFER, atol=VARIANTS_DIFFER * np.abs(mono).mean())


def test_shallow_reliefs_have_the_matrices_of_the_scalar_theory():
    shallow = {**FILM, "period": 0.9, "height": 0.01, "coherence_length": 3.0}
    scalar = {name: value for name, value in shallow.items() if name != "theory"}
    wi, wo, _ = pairs(400, 5, shallow)
    kept = (np.abs(wi[:, 2]) > 0.2) & (np.abs(wo[:, 2]) > 0.2)
    # Orders ±1, whose factor the small slope has to first order in the height.
    u = (wi + wo)[:, 0] * shallow["period"] / (1e-3 * WAVELENGTHS[1])
    kept &= np.abs(np.abs(u) - 1) < 0.2
    wi, wo = wi[kept], wo[kept]
    found, expected = (
        evaluated(built("llvm_ad_spectral_polarized", **surface), wi, wo)[:, 1] for surface in (shallow, scalar)
    )
    # The rigorous orders end at the horizon.
    has_light = found[:, 0, 0] > 1e-3 * found[:, 0, 0].max()
    assert has_light.sum() > 40
    found, expected = normalised(found[has_light]), normalised(expected[has_light])
    # Nodes of the table, and the change of the scalar factor over the width of an order.
    assert np.sqrt(np.mean((found - expected) ** 2)) < 2 * RMS


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_a_million_random_queries_are_finite(body):
    rng = np.random.default_rng(6)
    bsdf = built("llvm_ad_spectral", **body)
    wi, wo = both_sides(rng, 1_000_000), both_sides(rng, 1_000_000)
    nm = rng.uniform(360, 830, (1_000_000, 4)).astype(np.float32)
    value, pdf = eval_pdf(bsdf, wi, wo, nm)[:2]
    assert np.isfinite(value).all()
    assert np.isfinite(pdf).all()
    assert value.min() >= 0
