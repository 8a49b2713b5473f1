"""Random evaluations of the plugin in Mitsuba, whose values must be finite and not negative.

A *question* is a pair of directions and a wavelength. Dr.Jit's kernels evaluate a random surface's BSDF and sampling
density for it, in single precision. The counterpart for the Rust core, in double precision, is
crates/cli/src/benchmarks/stability/random_queries.rs.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant

# Mitsuba's variant of the evaluations.
VARIANT = "llvm_ad_spectral"
# Number of wavelengths that the variant evaluates for one pair of directions.
CARRIED = 4
# Reflectance in 1/sr below which reciprocity is not tested. Smaller reflectances have large relative errors in single
# precision.
RECIPROCITY_FLOOR = 1e-6
# Largest range of heights 2H, as in the Rust counterpart. At the shortest wavelength λ, 360 nm, and the largest phase
# rate κ = 4π/λ, the phase κH is then 200, so 2H = 400 λ/(4π).
DEEPEST_UM = 400 * 0.36 / (4 * np.pi)


def random_surface(random: np.random.Generator, folder: Path) -> dict:
    """The plugin's dictionary for a random surface: a preset, or a random relief that is written to `folder`.

    Ranges extend beyond those of practice, to provoke numbers that are not finite. Heights are white noise.
    """

    def log_uniform(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    height_um = log_uniform(1e-3, DEEPEST_UM)
    parameters: dict = {
        "type": "diffraction",
        "coherence_length": log_uniform(1.0, 1e4),
        "tolerance": log_uniform(1e-4, 1e-2),
        "model": str(random.choice(["ensemble", "patch"])),
        "tiling": str(random.choice(["periodic", "aperiodic"])),
        "obliquity": str(random.choice(["stam", "unit"])),
        "conserve_energy": bool(random.random() < 0.5),
        "shadowing": bool(random.random() < 0.5),
        "rotation": float(random.uniform(-180, 180)),
    }
    if random.random() < 0.5:
        parameters["eta"] = float(random.uniform(1.1, 2.5))
        parameters["diffuse_reflectance"] = float(random.uniform(0, 1))
    if random.random() < 0.5:
        parameters["preset"] = str(random.choice(["blazed", "sinusoidal", "lamellar"]))
        parameters |= {"period": log_uniform(0.3, 20.0), "height": height_um}
    else:
        size = random.integers(1, 25, 2)
        # A random name, which no other relief has.
        file = folder / f"{random.integers(1 << 62)}.npy"
        # A fifth of the reliefs have an offset of 1000 µm, which must not change any value.
        np.save(file, 1000.0 * (random.random() < 0.2) + height_um * random.random(tuple(size)))
        parameters |= {"filename": str(file), "pixel_size": log_uniform(0.05, 0.6)}
    return parameters


def directions(random: np.random.Generator, count: int) -> np.ndarray:
    """Random unit vectors above the surface, (3, count).

    Three in four are uniform over the hemisphere, the others are 89° to 89.99° from the normal.
    """
    # Uniform over solid angle: the area of a sphere between two heights is proportional to their distance.
    z = 1 - random.random(count)
    grazing = random.random(count) < 0.25
    z[grazing] = np.cos(np.radians(random.uniform(89, 89.99, grazing.sum())))
    phi, r = 2 * np.pi * random.random(count), np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z]).astype(np.float32)


def questions(count: int, surfaces: int, seed: int = 1) -> dict:
    """Evaluates `count` questions, rounded up to equal numbers for each of `surfaces` random surfaces.

    Returns the number of questions, `asked`, and the results of `one_surface` for all surfaces together: sums of the
    counts, and the largest `reciprocity`.
    """
    use_variant(VARIANT, fall_back=False)
    random = np.random.default_rng(seed)
    # Pairs of directions for each surface, rounded up.
    pairs = -(-count // (surfaces * CARRIED))
    found = {"asked": pairs * surfaces * CARRIED, "surfaces": surfaces, "variant": VARIANT, "samples": 0}
    found |= {"not_finite": 0, "negative": 0, "without_density": 0, "reciprocity": 0.0}
    with TemporaryDirectory() as folder:
        for _ in range(surfaces):
            bsdf = mi.load_dict(random_surface(random, Path(folder)))
            for key, value in one_surface(bsdf, random, pairs).items():
                found[key] = max(found[key], value) if key == "reciprocity" else found[key] + value
    return found


def one_surface(bsdf: mi.BSDF, random: np.random.Generator, count: int) -> dict:
    """Evaluates `count` pairs of directions, each at CARRIED wavelengths, on one surface.

    About half of the outgoing directions are sampled from the BSDF, the others are random. The result has

    - `samples`, `without_density`: the numbers of samples with a density other than 0, and of evaluated densities that
      are 0.
    - `not_finite`, `negative`: the numbers of such values and densities.
    - `reciprocity`: the largest relative difference of the reflectance when the directions are exchanged.
    """
    ctx = mi.BSDFContext()
    nm = random.uniform(360, 830, (CARRIED, count)).astype(np.float32)
    wi, wo = directions(random, count), directions(random, count)

    def answers(wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values of the BSDF, (CARRIED, count), and densities, (count,)."""
        value, pdf = bsdf.eval_pdf(ctx, interaction(wi, nm), mi.Vector3f(wo))
        return np.array(value), np.array(pdf)

    sample1, sample2 = mi.Float(random.random(count, "f4")), mi.Point2f(random.random((2, count), "f4"))
    sample, weight = bsdf.sample(ctx, interaction(wi, nm), sample1, sample2)
    weight, pdf_sampled = np.array(weight), np.array(sample.pdf)
    taken = (pdf_sampled > 0) & (random.random(count) < 0.5)
    wo[:, taken] = np.array(sample.wo)[:, taken]

    (there, pdf), (back, pdf_back) = answers(wi, wo), answers(wo, wi)
    values = [there, back, pdf, pdf_back, weight, pdf_sampled]
    # Values of the BSDF include the outgoing cosine, which is divided out.
    f_there, f_back = there / wo[2], back / wi[2]
    larger = np.maximum(f_there, f_back)
    compared = larger > RECIPROCITY_FLOOR
    difference = np.abs(f_there - f_back)[compared] / larger[compared]
    return {
        "samples": int(np.count_nonzero(pdf_sampled)),
        "not_finite": sum(int(np.count_nonzero(~np.isfinite(each))) for each in values),
        "negative": sum(int(np.count_nonzero(each < 0)) for each in values),
        "without_density": int(np.count_nonzero(pdf == 0) + np.count_nonzero(pdf_back == 0)),
        "reciprocity": float(np.max(difference, initial=0.0)),
    }


def interaction(wi: np.ndarray, nm: np.ndarray) -> mi.SurfaceInteraction3f:
    """Interactions with incident directions `wi` (3, count) and wavelengths `nm` (CARRIED, count)."""
    si = dr.zeros(mi.SurfaceInteraction3f, wi.shape[1])
    si.wi = mi.Vector3f(wi)
    si.wavelengths = [mi.Float(np.ascontiguousarray(row)) for row in nm]
    return si
