"""Gratings by Maxwell's equations in Mitsuba: samples, energy, reciprocity, and agreement of the interfaces."""

import json
import os
import subprocess
import sys

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from batches import direction, eval_pdf
from conftest import PLUGIN_FOLDER, REPOSITORY, built, use_variant
from test_chi2 import ANGLES, SIGNIFICANCE, bsdf_test

VARIANTS = ("llvm_ad_spectral", "llvm_ad_rgb")
# Number of χ² tests: of these variants, and of the polarised one in test_polarised_orders.py.
TEST_COUNT = len(ANGLES) * (len(VARIANTS) + 1)
# A small period is quick to solve; a short coherence length makes orders wide against the cells of the χ² test.
METAL = {
    "preset": "sinusoidal",
    "period": 0.9,
    "height": 0.15,
    "theory": "rigorous",
    "eta": 0.96,
    "k": 6.69,
    "coherence_length": 8.0,
}
PERFECT = {"preset": "lamellar", "period": 0.9, "theory": "rigorous", "coherence_length": 8.0}
# Error of interpolation in single precision, relative to the largest value, beside the square roots at passing-off
# lines.
SINGLE = 2e-3


def arguments(parameters):
    """Parameters of the plugin as arguments of the command."""
    return [word for name, value in parameters.items() for word in (f"--{name.replace('_', '-')}", value)]


def asked(*words, lines=""):
    """Output of the command."""
    tool = REPOSITORY / "target" / "release" / "sunbeam"
    return subprocess.run([tool, *map(str, words)], input=lines, capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("angles", ANGLES)
def test_samples_follow_the_density(variant, angles):
    bsdf = built(variant, **METAL)
    test = bsdf_test(bsdf, direction(*angles))
    assert test.run(SIGNIFICANCE, TEST_COUNT, quiet=True), test.messages


def pairs(count, seed):
    """Random directions and wavelengths, each with a direction near an order of the grating."""
    rng = np.random.default_rng(seed)
    xy = np.sqrt(rng.random((2, count))) * [np.cos(t := 2 * np.pi * rng.random(count)), np.sin(t)]
    wi = np.stack([*xy, np.sqrt(np.maximum(1 - (xy**2).sum(0), 1e-4))], axis=-1)
    nm = rng.uniform(400, 700, (count, 4))
    order = rng.integers(-3, 4, count)
    to = np.stack([order * nm[:, 0] * 1e-3 / METAL["period"] - wi[:, 0], -wi[:, 1]], axis=-1)
    to += rng.normal(0, 0.02, to.shape)
    inside = (to**2).sum(-1) < 0.999
    wo = np.concatenate([to, np.sqrt(np.maximum(1 - (to**2).sum(-1), 1e-4))[:, None]], axis=-1)
    return wi[inside], wo[inside], nm[inside]


@pytest.mark.parametrize("variant", VARIANTS)
def test_values_are_reciprocal(variant):
    bsdf = built(variant, **METAL)
    wi, wo, nm = pairs(4000, 1)
    there, _ = eval_pdf(bsdf, wi, wo, nm)
    back, _ = eval_pdf(bsdf, wo, wi, nm)
    there, back = there / wo[:, 2:], back / wi[:, 2:]
    assert np.isfinite(there).all()
    assert (np.abs(there) > 0.01).mean() > 0.1
    assert np.abs(there - back).max() < SINGLE * np.abs(there).max()


def test_plugin_command_and_oracle_agree():
    bsdf = built("scalar_spectral", **METAL)
    wi, wo, nm = pairs(60, 2)
    plugin, _ = eval_pdf(bsdf, wi, wo, nm)
    lines = "".join(
        json.dumps({"wi": list(a), "wo": list(b), "wavelength": list(c)}) + "\n" for a, b, c in zip(wi, wo, nm)
    )

    def answered(method):
        answers = asked("eval", "--method", method, *arguments(METAL), lines=lines)
        return np.array([json.loads(line)["f"] for line in answers.splitlines()])

    table, exact = answered("table"), answered("exact")
    largest = exact.max()
    assert largest > 1
    assert np.abs(plugin / wo[:, 2:] - table).max() < SINGLE * largest
    # Errors of efficiencies: differences relative to the peak of an order with all of the light, 4πs²/λ². Beside
    # plasmons one in a hundred exceeds 0.015.
    off = np.abs(table - exact) * (nm * 1e-3) ** 2 / (4 * np.pi * (METAL["coherence_length"] / 4) ** 2)
    assert np.quantile(off, 0.98) < 0.015
    assert off.max() < 0.06
    assert off.max() > 0, "the oracle solves anew"


@pytest.mark.parametrize("grating", [PERFECT, METAL])
def test_the_albedo_is_the_sum_of_the_orders(grating):
    # Error of a sum of orders: the table's, and the change over an order's width beside a plasmon.
    absolute = 0.02
    narrow = {**grating, "coherence_length": 65.0}
    bsdf = built("llvm_ad_spectral", **narrow)
    rng, nm, count = np.random.default_rng(3), [450, 520, 590, 650], 100_000
    for theta in (0, 20, 45):
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi = mi.Vector3f(direction(theta, 30))
        si.wavelengths = mi.Spectrum(nm)
        u = rng.random((3, count)).astype(np.float32)
        _, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(u[0]), mi.Point2f(u[1:]))
        weight = np.array(weight)
        error = 4 * weight.std(axis=1) / np.sqrt(count)
        for k, wavelength in enumerate(nm):
            light = ["--theta-i", theta, "--phi-i", 30, "--wavelength", wavelength, "--json"]
            orders = json.loads(asked("orders", *light, *arguments(narrow)))["orders"]
            assert abs(weight[k].mean() - sum(order["mean"] for order in orders)) < absolute + error[k], (theta, k)


@pytest.mark.parametrize(
    ("parameters", "named"),
    [
        ({"preset": "elaphe"}, "preset"),
        ({"preset": "blazed", "model": "patch"}, "model"),
        ({"preset": "blazed", "obliquity": "stam"}, "obliquity"),
        ({"preset": "blazed", "period": 20.0}, "building the tables"),
        # Refused with any build limit.
        ({"preset": "blazed", "period": 900.0, "build_limit": 1e6}, "2500.0 wavelengths of 360 nm in air.*at most 108"),
        ({"preset": "lamellar", "period": 30.0, "eta": 1.5, "build_limit": 1e6}, "in the medium below.*at most 108"),
        (
            {"preset": "sinusoidal", "period": 30.0, "height": 25.0, "build_limit": 1e6},
            "height of 25 µm.*at most 62",
        ),
        ({"preset": "blazed", "eta": {"type": "checkerboard"}}, "theory"),
    ],
)
def test_unsupported_parameters_are_refused_in_one_line(parameters, named):
    use_variant("scalar_rgb")
    with pytest.raises(RuntimeError, match=named):
        mi.load_dict({"type": "diffraction", "theory": "rigorous", **parameters})


def test_the_material_cannot_change():
    use_variant("llvm_ad_rgb")
    bsdf = mi.load_dict({"type": "diffraction", **METAL})
    parameters = mi.traverse(bsdf)
    parameters["eta.value"] = 1.2
    with pytest.raises(RuntimeError, match="not changed later"):
        parameters.update()
    assert "Maxwell" in str(mi.load_dict({"type": "diffraction", **METAL}))


# Runs in its own process, in which the first scene starts the threads that build tables.
IN_A_SCENE = """
import json, sys
import mitsuba as mi
mi.set_variant("scalar_spectral")
mi.file_resolver().append(sys.argv[1])
balls = [{"type": "sphere", "bsdf": bsdf} for bsdf in json.loads(sys.argv[2])]
scene = mi.load_dict({"type": "scene", **{f"ball{i}": ball for i, ball in enumerate(balls)}})
si = mi.SurfaceInteraction3f()
si.wi, wo, si.wavelengths = json.loads(sys.argv[3])
print(scene.shapes()[0].bsdf().eval(mi.BSDFContext(), si, wo)[0] / wo[2])
"""


def test_renderer_threads_solve_gratings(tmp_path):
    # Mitsuba's threads flush subnormal numbers to zero and load parts of a scene in parallel. This grating's systems
    # have pivots between 1 and √2, which the library faer inverts through subnormal numbers.
    grating = {"preset": "sinusoidal", "period": 0.3, "height": 0.1, "theory": "rigorous", "eta": 2.5}
    bsdfs = [{"type": "diffraction", **grating}, {"type": "diffuse"}]
    wi, wo, nm = direction(15, 10), direction(15, 190.2), [500] * 4
    environment = {**os.environ, "SUNBEAM_CACHE_DIR": str(tmp_path)}
    child = [sys.executable, "-c", IN_A_SCENE, str(PLUGIN_FOLDER), json.dumps(bsdfs), json.dumps([wi, wo, nm])]
    done = subprocess.run(child, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    line = json.dumps({"wi": wi, "wo": wo, "wavelength": nm})
    exact = json.loads(asked("eval", "--method", "exact", *arguments(grating), lines=line))["f"][0]
    assert exact > 0.1
    # Error of the table of efficiencies, for an order of some tenths.
    assert float(done.stdout) == pytest.approx(exact, rel=0.05)
