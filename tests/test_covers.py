"""A clear cover over the relief, in Mitsuba: sampling, energy, the cover's mirror, and polarisation."""

import mitsuba as mi
import numpy as np
import pytest
from batches import direction, eval_alone, eval_pdf, random_directions, random_wavelengths, sample
from conftest import VARIANTS, built, use_variant

from docs.figures.rgb_against_spectral import GREY, WHITE, lab_of_xyz
from mitsuba_scenes.chi_square import bsdf_test
from mitsuba_scenes.discs import CD
from tests.judges.gratings import covers
from tests.judges.gratings.drawn import Setting, leaving, sinusoid

# Probability that any of the χ² tests rejects a correct density.
SIGNIFICANCE = 0.01
ETA = 1.58
ANGLES = [(0, 0), (20, 45), (30, 70), (45, 180), (55, 10), (60, 0), (75, 120), (80, 70)]
# Orders are wide, so that histograms resolve them.
DISC = {"preset": "sinusoidal", "period": 1.6, "height": 0.2, "material": "Al", "coherence_length": 12.0}
# A grating that the judge solves, too. Few orders, so that its tables are soon built.
JUDGED = Setting("Al", "sinusoidal", 0.5, 0.08, 550.0, 72.0, 0.0, cover_eta=ETA)
RIGOROUS = {
    "preset": "sinusoidal",
    "period": 0.5,
    "height": 0.08,
    "theory": "rigorous",
    "eta": JUDGED.index.real,
    "k": JUDGED.index.imag,
    "coherence_length": 8.0,
}
SURFACES = {
    "grating": {**DISC, "rotation": 25.0},
    "skin": {"preset": "xenopeltis", "eta": 2.0, "coherence_length": 10.0, "diffuse_reflectance": 0.3},
    "rigorous": RIGOROUS,
}
# Relative difference of variants in single precision.
SINGLE = 2e-4
# Error of an order's power in a table of a grating (docs/validity.md#metals).
TABLED = 5e-3
# Standard errors of a mean that count as agreement.
SIGMAS = 5.0


def covered(variant, **parameters):
    return built(variant, cover_eta=ETA, **parameters)


def fresnel(cos):
    """Reflectances of the cover's flat side for s and p polarised light."""
    normal = np.sqrt(ETA**2 - 1 + cos**2)
    return ((cos - normal) / (cos + normal)) ** 2, ((ETA**2 * cos - normal) / (ETA**2 * cos + normal)) ** 2


@pytest.mark.parametrize("angles", ANGLES, ids=str)
@pytest.mark.parametrize("name", SURFACES)
def test_samples_follow_the_density(name, angles):
    bsdf = covered("llvm_ad_spectral", cover_reflection=False, **SURFACES[name])
    test = bsdf_test(bsdf, direction(*angles))
    assert test.run(SIGNIFICANCE, len(SURFACES) * len(ANGLES), quiet=True), test.messages


@pytest.mark.parametrize("angles", ANGLES[::2], ids=str)
def test_colour_samples_follow_the_density(angles):
    bsdf = covered("llvm_ad_rgb", cover_reflection=False, **DISC)
    test = bsdf_test(bsdf, direction(*angles), res=51, ires=8)
    assert test.run(SIGNIFICANCE, len(ANGLES) // 2, quiet=True), test.messages


@pytest.mark.parametrize("name", SURFACES)
def test_values_are_reciprocal_and_no_light_is_made(name):
    bsdf = covered("llvm_ad_spectral", **SURFACES[name])
    rng = np.random.default_rng(3)
    count = 20_000
    wi, wo, nm = random_directions(rng, count), random_directions(rng, count), random_wavelengths(rng, count)
    there, back = eval_pdf(bsdf, wi, wo, nm)[0], eval_pdf(bsdf, wo, wi, nm)[0]
    there, back = there / wo[:, 2:], back / wi[:, 2:]
    # Values much below the mean are differences of larger ones.
    np.testing.assert_allclose(there, back, rtol=2e-3, atol=2e-3 * there.mean())
    assert np.all(np.isfinite(there))
    assert np.all(there >= 0)
    for angles in ANGLES[::3]:
        wis = np.broadcast_to(np.float32(direction(*angles)), (count, 3))
        _, _, weight = sample(bsdf, wis, nm, rng.random((count, 3)).astype(np.float32))
        mean, noise = weight.mean(), weight.mean(axis=1).std() / np.sqrt(count)
        assert 0.05 < mean <= 1.01 + SIGMAS * noise, (angles, mean)


def test_an_index_of_one_is_no_cover():
    rng = np.random.default_rng(5)
    wi, wo, nm = random_directions(rng, 5000), random_directions(rng, 5000), random_wavelengths(rng, 5000)
    bare = eval_pdf(built("llvm_ad_spectral", **DISC), wi, wo, nm)
    one = eval_pdf(built("llvm_ad_spectral", cover_eta=1.0, **DISC), wi, wo, nm)
    for a, b in zip(bare, one):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    "given",
    [
        "pet",
        # The value at 589.3 nm, between two of the spectrum.
        {"type": "spectrum", "value": [(400, 1.62), (579.3, 1.57), (599.3, 1.58), (700, 1.57)]},
        {"type": "spectrum", "value": [(600, 1.575), (700, 1.57)]},
    ],
    ids=str,
)
def test_names_and_spectra_give_the_index_at_the_sodium_line(given):
    rng = np.random.default_rng(6)
    wi, wo, nm = random_directions(rng, 500), random_directions(rng, 500), random_wavelengths(rng, 500)
    found = eval_pdf(built("llvm_ad_spectral", cover_eta=given, **DISC), wi, wo, nm)
    expected = eval_pdf(built("llvm_ad_spectral", cover_eta=1.575, **DISC), wi, wo, nm)
    assert "cover_eta 1.575" in str(built("llvm_ad_spectral", cover_eta=given, **DISC))
    for a, b in zip(found, expected):
        np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("variant", [name for name in VARIANTS if name.startswith(("scalar", "llvm"))])
def test_the_mirror_of_the_cover_has_fresnels_reflectance(variant):
    use_variant(variant)
    bsdf = covered(variant, preset="flat", coherence_length=10.0, conserve_energy=False)
    context = mi.BSDFContext()
    context.type_mask = +mi.BSDFFlags.DeltaReflection
    for theta in (0, 40, 70):
        wi = np.float32([direction(theta, 30)])
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(*wi[0].tolist())
        if mi.is_spectral:
            si.wavelengths = [450.0, 500.0, 550.0, 600.0]
        bs, weight = bsdf.sample(context, si, 0.3, [0.2, 0.7])
        np.testing.assert_allclose(np.ravel(bs.wo), [-wi[0, 0], -wi[0, 1], wi[0, 2]], atol=1e-6)
        found = np.ravel(weight[0, 0] if mi.is_polarized else weight)
        np.testing.assert_allclose(found, np.mean(fresnel(wi[0, 2])), rtol=SINGLE)


def test_a_perfect_mirror_under_a_cover_loses_what_goes_to_and_fro():
    """R + T² of the light is reflected: the mirror of the cover, and the relief once."""
    bsdf = covered("llvm_ad_spectral", preset="flat", coherence_length=20.0)
    count = 200_000
    rng = np.random.default_rng(7)
    for theta in (0, 50):
        wi = np.broadcast_to(np.float32(direction(theta, 20)), (count, 3))
        nm = np.full((count, 4), 550.0, np.float32)
        _, _, weight = sample(bsdf, wi, nm, rng.random((count, 3)).astype(np.float32))
        mirrored = np.mean(fresnel(wi[0, 2]))
        expected = mirrored + (1 - mirrored) ** 2
        noise = weight[:, 0].std() / np.sqrt(count)
        # Tables, and factors that vary over the width of the order.
        assert abs(weight[:, 0].mean() - expected) < 5e-3 + SIGMAS * noise, theta


@pytest.mark.parametrize("name", ["grating", "rigorous"])
def test_polarised_intensities_are_the_unpolarised_values(name):
    rng = np.random.default_rng(9)
    wi, wo, nm = random_directions(rng, 3000), random_directions(rng, 3000), random_wavelengths(rng, 3000)
    surface = {**SURFACES[name], "cover_reflection": False}
    plain, _ = eval_pdf(covered("llvm_ad_spectral", **surface), wi, wo, nm)
    polarised, _ = eval_pdf(covered("llvm_ad_spectral_polarized", **surface), wi, wo, nm)
    # Side and metal both prefer a polarisation, so the mean of their products differs from the product of their means.
    # Within 26° of the normal the difference is below 0.6 %.
    near = (wi[:, 2] > 0.9) & (wo[:, 2] > 0.9)
    np.testing.assert_allclose(polarised[near], plain[near], rtol=6e-3, atol=1e-3 * plain.max())
    assert np.all(polarised >= 0)


def test_at_brewsters_angle_light_in_the_plane_passes_without_loss():
    bsdf = covered("llvm_ad_spectral_polarized", preset="flat", coherence_length=10.0, cover_reflection=False)
    bare = built("llvm_ad_spectral_polarized", preset="flat", coherence_length=10.0)
    brewster = np.degrees(np.arctan(ETA))
    wi, wo = direction(brewster, 0), direction(brewster, 180)

    def matrix(bsdf, wi, wo):
        si = mi.SurfaceInteraction3f()
        si.wi, si.wavelengths = mi.Vector3f(*wi), [550.0] * 4
        value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*wo))
        # From Mitsuba's frames of reference to those whose first axis is s.
        s = mi.Vector3f(0, 1, 0)
        arrives, leaves = -mi.Vector3f(*wo), mi.Vector3f(*wi)
        turned = mi.mueller.rotate_mueller_basis(
            value, arrives, mi.mueller.stokes_basis(arrives), s, leaves, mi.mueller.stokes_basis(leaves), s
        )
        return np.array([[np.ravel(turned[i, j])[0] for j in range(4)] for i in range(4)])

    through = matrix(bsdf, wi, wo)
    inside = [c / ETA for c in wi[:2]] + [float(np.sqrt(1 - (wi[0] / ETA) ** 2))]
    mirrored = [-inside[0], -inside[1], inside[2]]
    alone = matrix(bare, inside, mirrored)
    # Intensities of light that is p polarised before and after: (1, −1, 0, 0) on both sides.
    p = np.array([1, -1, 0, 0])
    passed, full = p @ through @ p, p @ alone @ p
    # Mirror orders of equal power, each over the cosine of its value.
    ratio = (passed / wi[2]) / (full / inside[2])
    np.testing.assert_allclose(ratio, 1.0, rtol=2e-2)


def polycarbonate(nm):
    """Index of polycarbonate at wavelengths in nm, within 1e-3 of the measured ones (Sultanova et al. 2009)."""
    squared = (nm / 1e3) ** 2
    return np.sqrt(1 + 1.4182 * squared / (squared - 0.021304))


def values_at(bsdf, wi, wo, nm):
    """Values `(directions, wavelengths)` at wavelengths in nm, whose number is a multiple of four."""
    fours = [np.tile(np.float32(four), (len(wi), 1)) for four in np.reshape(nm, (-1, 4))]
    return np.concatenate([eval_alone(bsdf, wi, wo, four) for four in fours], axis=1)


def test_dispersion_hardly_changes_the_colours_of_a_disc():
    """Differences that docs/model.md states for a disc's tracks under one index, beside the index by wavelength."""
    indices, nm = [ETA, 1.60, 1.64], np.arange(390.0, 701.0, 10.0)
    rng = np.random.default_rng(11)
    # Lit directions lie across the tracks.
    x, y = rng.uniform(-0.95, 0.95, 2000), rng.normal(0, 0.01, 2000)
    wo = np.stack([x, y, np.sqrt(1 - x**2 - y**2)], axis=1).astype(np.float32)
    tracks = {name: value for name, value in CD.tracks().items() if name not in ("type", "cover_eta")}
    tracks |= {"cover_reflection": False, "conserve_energy": False}
    bsdfs = [built("llvm_ad_spectral", cover_eta=eta, **tracks) for eta in indices]
    si = mi.SurfaceInteraction3f()
    si.wavelengths = [mi.Float(nm)] * 4
    power = np.array(mi.load_dict({"type": "d65"}).eval(si))[0]
    # XYZ of a unit of reflectance at each wavelength.
    weights = np.array(mi.cie1931_xyz(mi.Float(nm))).T * power[:, None]
    weights *= WHITE / weights.sum(axis=0)
    found = []
    for theta in (0, 30, 60):
        wi = np.broadcast_to(np.float32(direction(theta, 0)), wo.shape)
        # Values by index, direction and wavelength.
        values = np.stack([values_at(bsdf, wi, wo, nm) for bsdf in bsdfs])
        # The parabola through three indices.
        basis = np.linalg.inv(np.vander(indices)).T @ np.vander(polycarbonate(nm), 3).T
        dispersed = np.einsum("kw,kdw->dw", basis, values) @ weights
        constant = values[0] @ weights
        lit = dispersed[:, 1] > 0.01 * np.quantile(dispersed[:, 1], 0.99)
        exposure = GREY / dispersed[lit, 1].mean()
        colours = lab_of_xyz(exposure * constant[lit]), lab_of_xyz(exposure * dispersed[lit])
        found.append(np.linalg.norm(colours[0] - colours[1], axis=1))
    found = np.concatenate(found)
    # The page's number is rounded to a tenth.
    assert found.mean() == pytest.approx(0.6, abs=0.05)
    assert np.quantile(found, 0.95) < 2


def test_orders_have_the_powers_of_the_judge():
    """A solver of Maxwell's equations in a medium of the cover's index, through the flat side.

    Polarised variants pass each polarisation with its own transmittance, others with the mean.
    """
    answer = leaving(JUDGED, sinusoid(JUDGED, 1.0), 0.0)
    wo = np.float32(JUDGED.wo(answer.orders))
    wi, nm = np.tile(np.float32(JUDGED.wi), (len(wo), 1)), np.full((len(wo), 4), JUDGED.wavelength_nm, np.float32)

    def powers(variant):
        surface = {**RIGOROUS, "coherence_length": covers.COHERENCE_LENGTH_UM, "cover_reflection": False}
        value, _ = eval_pdf(covered(variant, **surface), wi, wo, nm)
        return value[:, 0] / wo[:, 2] * covers.power_of_value(JUDGED.wavelength_nm)

    means, states = covers.through_means(answer), covers.through_states(answer)
    assert len(means) == 2
    assert np.abs(powers("llvm_ad_spectral") - means).max() < TABLED
    assert np.abs(powers("scalar_spectral_polarized") - states).max() < TABLED
    # Negative control: the other variant's transmittances.
    assert np.abs(means - states).max() > 2 * TABLED
