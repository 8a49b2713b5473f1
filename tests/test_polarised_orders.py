"""Gratings by Maxwell's equations in polarised variants: each order has its Jones matrix."""

import json

import mitsuba as mi
import numpy as np
import pytest
from batches import direction, eval_pdf, is_scalar, random_directions
from conftest import built, use_variant
from mueller import (
    ROUNDING,
    WAVELENGTHS,
    basis,
    coherency,
    evaluated,
    mirrored,
    normalised,
    pairs,
    reversed_path,
    turned,
)
from test_chi2 import ANGLES, SIGNIFICANCE, bsdf_test
from test_rigorous import METAL, TEST_COUNT, asked

POLARISED = ["scalar_spectral_polarized", "llvm_ad_mono_polarized", "llvm_ad_spectral_polarized"]
# Errors of an order's matrix elements, root mean square and largest: interpolation between nodes of the table, beside
# the anomalies of a grating with a pitch of one to two wavelengths.
RMS, LARGEST = 0.02, 0.2
# Interpolation of the reversed path in single precision, beside the square roots at passing-off lines.
SINGLE = 3e-3


@pytest.mark.parametrize("surface", [{"material": "Au", "rotation": 25.0}, {}], ids=str)
@pytest.mark.parametrize("variant", POLARISED)
def test_a_flat_relief_polarises_as_a_mirror_does(variant, surface):
    """Mueller matrices at every azimuth equal those of Mitsuba's `conductor`."""
    use_variant(variant)
    wi = random_directions(np.random.default_rng(3), 40 if is_scalar() else 400)
    wi = np.concatenate([wi, np.float32([direction(80, 10), direction(1e-3, 200)])])
    # A table of a few nodes does not resolve the approach to the horizon, which `conductor` has in closed form.
    wi = wi[wi[:, 2] > 0.1]
    wo = wi * np.float32([-1, -1, 1])
    flat = built(variant, preset="flat", theory="rigorous", **surface)
    # The perfect reflector is compared with a nearly perfect conductor; the index of Mitsuba's `none` turns phases.
    optics = {"material": surface["material"]} if surface else {"eta": 1.0, "k": 1e5}
    judge = mi.load_dict({"type": "conductor", **optics})
    found, expected = normalised(evaluated(flat, wi, wo)), normalised(mirrored(judge, wi))
    # Interpolation between the table's nodes, for gold above all between its wavelengths.
    np.testing.assert_allclose(found, expected, atol=0.05)
    assert np.sqrt(np.mean((found - expected) ** 2)) < 0.006
    # A perfect conductor has one matrix at all angles, so it is compared with one that turns phases.
    another = np.roll(expected, 1, axis=0) if surface else expected * np.diag([1, 1, 1, -1])
    assert np.abs(found - another).max() > 0.1


def transverse(forward):
    """First axis of the polarisation states of `sunbeam orders`: the grooves' direction, made normal to the light's."""
    along = np.array([0.0, 1.0, 0.0])
    across = along - forward * (forward @ along)[..., None]
    return across / np.linalg.norm(across, axis=-1, keepdims=True)


def jones_to_mueller(jones):
    """Mueller matrices of Jones matrices `[..., out, in]` between right-handed states, for fields of exp(-iωt)."""
    pauli = np.array([[[1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, 1j], [-1j, 0]]])
    adjoint = np.conj(np.swapaxes(jones, -1, -2))
    return 0.5 * np.einsum("iab,...bc,jcd,...da->...ij", pauli, jones, pauli, adjoint).real


def test_orders_have_their_jones_matrices():
    """Matrices equal those of `sunbeam orders`, which solves Maxwell's equations for each direction."""
    grating = {name: METAL[name] for name in ("preset", "period", "height", "theory", "eta", "k")}
    bsdf = built("llvm_ad_spectral_polarized", **METAL)
    wi, wo, expected = [], [], []
    words = [word for name, value in grating.items() for word in (f"--{name}", value)]
    for theta_deg, phi_deg in [(20, 15), (35, 80), (50, -40), (65, 130), (10, 250)]:
        found = json.loads(
            asked(
                "orders", *words, "--theta-i", theta_deg, "--phi-i", phi_deg, "--wavelength", WAVELENGTHS[1], "--json"
            )
        )
        for order in found["orders"]:
            start, end = np.array(direction(theta_deg, phi_deg), float), np.array(order["direction"])
            if end[2] < 0.05:
                continue
            jones = np.array(order["jones"])[..., 0] + 1j * np.array(order["jones"])[..., 1]
            # The second state's electric field is opposite to the second axis of a right-handed frame.
            jones = jones * np.array([[1, -1], [-1, 1]])
            matrix = jones_to_mueller(jones)
            forward = -start, end
            into, out = (turned(k[None], basis(k[None]), transverse(k[None])) for k in forward)
            expected.append((np.swapaxes(out, -1, -2) @ matrix @ into)[0])
            wi.append(end)
            wo.append(start)
    expected = normalised(np.array(expected))
    found = normalised(evaluated(bsdf, np.float32(wi), np.float32(wo))[:, 1])
    assert len(found) > 10
    error = found - expected
    assert np.sqrt(np.mean(error**2)) < RMS
    assert np.abs(error).max() < LARGEST
    # Wrong signs of crossed elements and of phases are noticed.
    for i, j in ((0, 1), (0, 2), (2, 0), (1, 2), (3, 2)):
        wrong = expected.copy()
        wrong[:, i, j] *= -1
        assert np.sqrt(np.mean((found - wrong)[:, i, j] ** 2)) > 3 * np.sqrt(np.mean(error[:, i, j] ** 2))


@pytest.mark.parametrize("kinds", [("llvm_ad_spectral", "llvm_ad_spectral_polarized"), ("llvm_ad_mono",) * 2], ids=str)
def test_intensity_equals_unpolarised_variants(kinds):
    wi, wo = pairs(3000, lowest=0.1)
    nm = np.broadcast_to(np.float32(WAVELENGTHS), (len(wi), 4))
    wide = {**METAL, "coherence_length": 2.0}
    plain, plain_pdf = eval_pdf(built(kinds[0], **wide), wi, wo, nm)
    polarised_kind = kinds[1] if "polarized" in kinds[1] else kinds[1] + "_polarized"
    bsdf = built(polarised_kind, **wide)
    found = evaluated(bsdf, wi, wo)[..., 0, 0]
    # Both are one sum; the luminance of a colour is taken before or after it.
    np.testing.assert_allclose(found, plain, rtol=1e-4, atol=1e-6 * plain.max())
    assert (plain > 0).mean() > 0.5
    assert np.all(plain_pdf > 0)


def test_samples_follow_the_density():
    bsdf = built("llvm_ad_spectral_polarized", **METAL)
    for angles in ANGLES:
        test = bsdf_test(bsdf, direction(*angles))
        assert test.run(SIGNIFICANCE, TEST_COUNT, quiet=True), (angles, test.messages)


def test_matrices_are_physical():
    """Coherency matrices of random pairs have no negative eigenvalue."""
    bsdf = built("llvm_ad_spectral_polarized", **{**METAL, "coherence_length": 1.0})
    least, count = np.inf, 0
    for seed in range(2):
        wi, wo = pairs(60_000, seed=seed, lowest=0.0)
        found = evaluated(bsdf, wi, wo).reshape(-1, 4, 4)
        assert np.isfinite(found).all()
        found = normalised(found[found[:, 0, 0] > 1e-12])
        least = min(least, np.linalg.eigvalsh(coherency(found)).min())
        count += len(found)
    assert count > 400_000
    # An order has a Jones matrix; the rest is rounding in single precision and in the rotation of frames.
    assert least > -1e-6


def test_matrices_are_reciprocal():
    """The matrix of the reversed path is the transpose, in frames seen from behind."""
    bsdf = built("llvm_ad_spectral_polarized", **{**METAL, "coherence_length": 1.0})
    wi, wo = pairs(2000)
    there, back = (evaluated(bsdf, *both) / both[1][:, 2, None, None, None] for both in ((wi, wo), (wo, wi)))
    largest = there[..., 0, 0].max()
    wi, wo = wi.astype(float), wo.astype(float)
    np.testing.assert_allclose(back, reversed_path(there, wi, wo), atol=SINGLE * largest)
    assert np.abs(back - there).max() > 100 * SINGLE * largest


def test_rotation_turns_the_frames_too():
    """A rotated relief has the rotated matrices for rotated directions."""
    turned_by = 33.0
    both = [built("llvm_ad_spectral_polarized", **METAL, rotation=angle) for angle in (0.0, turned_by)]
    wi, wo = (w.astype(float) for w in pairs(1000))
    c, s = np.cos(np.radians(turned_by)), np.sin(np.radians(turned_by))
    spin = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    plain = evaluated(both[0], np.float32(wi), np.float32(wo))
    spun = evaluated(both[1], np.float32(wi @ spin.T), np.float32(wo @ spin.T))
    into = turned(-wo @ spin.T, basis(-wo) @ spin.T, basis(-wo @ spin.T))
    out = turned(wi @ spin.T, basis(wi) @ spin.T, basis(wi @ spin.T))
    expected = out[:, None] @ plain @ np.swapaxes(into, -1, -2)[:, None]
    # Rounding of directions changes the Gaussian of a narrow order.
    lit = plain[..., 0, 0] > 1e-3
    assert lit.sum() > 100
    np.testing.assert_allclose(normalised(spun[lit]), normalised(expected[lit]), atol=100 * ROUNDING)
