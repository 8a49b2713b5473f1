"""The small-slope factor of plugin and command, against first-order perturbation theory."""

import json

import mitsuba as mi
import numpy as np
import pytest
from batches import eval_alone, random_directions
from conftest import built
from perturbation import first_order

from mitsuba_scenes.tool import sunbeam

# A window so short that an order's light is in all directions.
EVERYWHERE = {"preset": "blazed", "coherence_length": 1.0, "conserve_energy": False}
WAVELENGTHS = [450.0, 520.0, 590.0, 660.0]
# Relative error of a quotient of two values in single precision, in which cosines are subtracted.
SINGLE = 5e-4
# For a relief of 4 nm and κ up to 0.028 /nm, the second order is (κh/2)² ≈ 3e-3 of the first.
SHALLOW = {"preset": "sinusoidal", "period": 1.3, "height": 0.004, "coherence_length": 65, "conserve_energy": "false"}
SECOND_ORDER = 4e-3
INDICES = [{"eta": 1.56}, {"eta": 0.2, "k": 3.4}]


def factor(wi, wo, n):
    """Q from the boundary conditions: `|c|²` of a shallow relief is `(κh)²`, with `κ = k(cosθi + cosθo)`."""
    jones = first_order(wi, wo, n)
    return 0.5 * (np.abs(jones) ** 2).sum(axis=(-1, -2)) / (wi[:, 2] + wo[:, 2]) ** 2


def perfect(wi, wo):
    """Rice's kernel for a perfect conductor."""
    k, k0 = (np.hypot(w[:, 0], w[:, 1]) for w in (wo, wi))
    q, q0 = wo[:, 2], wi[:, 2]
    cos = -(wi[:, :2] * wo[:, :2]).sum(-1) / (k * k0)
    sin_squared = 1 - cos**2
    squares = cos**2 + sin_squared * (1 / q**2 + 1 / q0**2) + ((cos - k * k0) / (q * q0)) ** 2
    return 2 * q * q0 / (q + q0) ** 2 * squares


def pairs(count, seed=4, lowest=0.05):
    rng = np.random.default_rng(seed)
    wi, wo = (random_directions(rng, 2 * count) for _ in range(2))
    kept = np.minimum(wi[:, 2], wo[:, 2]) > lowest
    return wi[kept][:count], wo[kept][:count]


@pytest.mark.parametrize("optics", [*INDICES, {}], ids=str)
@pytest.mark.parametrize(
    "variant", ["scalar_rgb", "scalar_spectral", "llvm_ad_rgb", "llvm_ad_mono", "llvm_ad_spectral"]
)
def test_the_factor_agrees_with_perturbation_theory(variant, optics):
    count = 300 if variant.startswith("scalar") else 3000
    wi, wo = pairs(count)
    nm = np.broadcast_to(np.float32(WAVELENGTHS), (len(wi), 4))
    bent = eval_alone(built(variant, obliquity="small_slope", **EVERYWHERE, **optics), wi, wo, nm)
    bare = eval_alone(built(variant, obliquity="unit", **EVERYWHERE), wi, wo, nm)
    lit = np.abs(bare) > 1e-3 * np.abs(bare).max()
    wi, wo = wi.astype(float), wo.astype(float)
    expected = factor(wi, wo, optics["eta"] + 1j * optics.get("k", 0)) if optics else perfect(wi, wo)
    found = bent[lit] / bare[lit]
    expected = np.broadcast_to(expected[:, None], bare.shape)[lit]
    assert lit.mean() > 0.2
    np.testing.assert_allclose(found, expected, rtol=SINGLE, atol=SINGLE * np.median(expected))


@pytest.mark.parametrize("optics", INDICES, ids=str)
def test_shallow_sinusoids_have_rices_first_orders(optics):
    """The power of orders ±1 of the direct sum, lit from anywhere: a·cos(Kx) is two exponentials of half of it."""
    questions, expected = [], []
    height, period, nm = SHALLOW["height"], SHALLOW["period"], 550.0
    rng = np.random.default_rng(2)
    wi = random_directions(rng, 30).astype(float)
    wi = wi[wi[:, 2] > 0.2]
    for sign in (1, -1):
        wo = np.stack([sign * nm / 1e3 / period - wi[:, 0], -wi[:, 1]], -1)
        there = (wo**2).sum(-1) < 0.95
        out = np.concatenate([wo, np.sqrt(np.maximum(1 - (wo**2).sum(-1, keepdims=True), 0))], -1)[there]
        ka = 2 * np.pi / (nm / 1e3) * height / 4
        jones = first_order(wi[there], out, optics["eta"] + 1j * optics.get("k", 0))
        expected += list(0.5 * (np.abs(jones) ** 2).sum(axis=(-1, -2)) * ka**2)
        questions += [{"wi": list(a), "wo": list(b), "wavelength": nm} for a, b in zip(wi[there], out)]
    words = [
        str(word) for name, value in {**SHALLOW, **optics}.items() for word in (f"--{name.replace('_', '-')}", value)
    ]
    lines = "".join(json.dumps(question) + "\n" for question in questions)
    answers = sunbeam("eval", "--method", "exact", "--obliquity", "small_slope", *words, stdin=lines)
    peak = 4 * np.pi * (SHALLOW["coherence_length"] / 4) ** 2
    found = np.array([json.loads(line)["f"] for line in answers.splitlines()]) * (nm / 1e3) ** 2 / peak
    assert len(found) > 20
    np.testing.assert_allclose(found, expected, rtol=SECOND_ORDER)


def test_auto_depends_on_the_index():
    """Dielectrics get the small-slope factor, metals and perfect reflectors Stam's, as `str` shows."""
    for variant in ("scalar_rgb", "llvm_ad_spectral"):
        for optics, name in [
            ({"eta": 1.56}, "small_slope"),
            ({"eta": 1.56, "k": 0.15}, "small_slope"),
            ({"eta": 1.56, "k": 0.3}, "stam"),
            ({"material": "Al"}, "stam"),
            ({}, "stam"),
            ({"obliquity": "unit", "eta": 1.56}, "unit"),
        ]:
            assert f"{name} obliquity" in str(built(variant, **EVERYWHERE, **optics)), optics


def test_changing_the_index_changes_the_factor():
    """An index changed through `mi.traverse` changes the values, but not the choice of the factor."""
    wi, wo = pairs(200)
    nm = np.broadcast_to(np.float32(WAVELENGTHS), (len(wi), 4))
    for variant in ("llvm_ad_rgb", "llvm_ad_spectral"):
        fresh = built(variant, **EVERYWHERE, eta=1.33)
        bsdf = mi.load_dict({"type": "diffraction", **EVERYWHERE, "eta": 1.56})
        params = mi.traverse(bsdf)
        params["eta.value"] = 1.33
        params.update()
        expected = eval_alone(fresh, wi, wo, nm)
        found = eval_alone(bsdf, wi, wo, nm)
        np.testing.assert_allclose(found, expected, rtol=SINGLE, atol=1e-7)
