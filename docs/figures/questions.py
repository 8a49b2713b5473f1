"""Random evaluations of the plugin in Mitsuba, which must be finite and not negative.

The twin of `crates/cli/src/benchmarks/stability/questions.rs`, in single precision and through Dr.Jit's kernels.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant

VARIANT = "llvm_ad_spectral"
# Wavelengths of one pair of directions.
CARRIED = 4
# Smallest reflectance in the test of reciprocity; smaller ones are lost in single precision.
RECIPROCITY_FLOOR = 1e-6
# Largest height, with κH = 200 at 360 nm, as in the Rust twin.
DEEPEST_UM = 400 * 0.36 / (4 * np.pi)


def random_surface(random: np.random.Generator, folder: Path) -> dict:
    """Parameters of the plugin for a random surface."""

    def log(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    height = log(1e-3, DEEPEST_UM)
    parameters: dict = {
        "type": "diffraction",
        "coherence_length": log(1.0, 1e4),
        "tolerance": log(1e-4, 1e-2),
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
        parameters |= {"period": log(0.3, 20.0), "height": height}
    else:
        size = random.integers(1, 25, 2)
        file = folder / f"{random.integers(1 << 62)}.npy"
        # A fifth of the fields have an offset of a millimetre, which must not matter.
        np.save(file, 1000.0 * (random.random() < 0.2) + height * random.random(tuple(size)))
        parameters |= {"filename": str(file), "pixel_size": log(0.05, 0.6)}
    return parameters


def directions(random: np.random.Generator, count: int) -> np.ndarray:
    """Random directions above the surface, one in four within a degree of the horizon, up to 89.99°."""
    z = 1 - random.random(count)
    grazing = random.random(count) < 0.25
    z[grazing] = np.cos(np.radians(random.uniform(89, 89.99, grazing.sum())))
    phi, r = 2 * np.pi * random.random(count), np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z]).astype(np.float32)


def questions(count: int, surfaces: int, seed: int = 1) -> dict:
    """Evaluates about `count` questions, pairs of directions at one wavelength, on `surfaces` random surfaces.

    Returns the numbers of values that are not finite, negative, or without density, and the largest relative
    difference of the reflectance when the directions are exchanged.
    """
    use_variant(VARIANT)
    random = np.random.default_rng(seed)
    each = -(-count // (surfaces * CARRIED))
    found = {"asked": each * surfaces * CARRIED, "surfaces": surfaces, "variant": VARIANT, "samples": 0}
    found |= {"not_finite": 0, "negative": 0, "without_density": 0, "reciprocity": 0.0}
    with TemporaryDirectory() as folder:
        for _ in range(surfaces):
            bsdf = mi.load_dict(random_surface(random, Path(folder)))
            for key, value in one_surface(bsdf, random, each).items():
                found[key] = max(found[key], value) if key == "reciprocity" else found[key] + value
    return found


def one_surface(bsdf: mi.BSDF, random: np.random.Generator, count: int) -> dict:
    """The counts of one surface; half of the outgoing directions are sampled from it."""
    ctx = mi.BSDFContext()
    nm = random.uniform(360, 830, (CARRIED, count)).astype(np.float32)
    wi, wo = directions(random, count), directions(random, count)

    def answers(wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        value, pdf = bsdf.eval_pdf(ctx, interaction(wi, nm), mi.Vector3f(wo))
        return np.array(value), np.array(pdf)

    u, uv = mi.Float(random.random(count, "f4")), mi.Point2f(random.random((2, count), "f4"))
    bs, weight = bsdf.sample(ctx, interaction(wi, nm), u, uv)
    weight, pdf_sampled = np.array(weight), np.array(bs.pdf)
    sampled = np.array(bs.wo)
    lit = (pdf_sampled > 0) & (random.random(count) < 0.5)
    wo[:, lit] = sampled[:, lit]

    (there, pdf), (back, pdf_back) = answers(wi, wo), answers(wo, wi)
    numbers = [there, back, pdf, pdf_back, weight, pdf_sampled]
    # The values include the outgoing cosine.
    f_there, f_back = there / wo[2], back / wi[2]
    most = np.maximum(f_there, f_back)
    judged = most > RECIPROCITY_FLOOR
    difference = np.abs(f_there - f_back)[judged] / most[judged]
    return {
        "samples": int(np.count_nonzero(pdf_sampled)),
        "not_finite": sum(int(np.count_nonzero(~np.isfinite(each))) for each in numbers),
        "negative": sum(int(np.count_nonzero(each < 0)) for each in numbers),
        "without_density": int(np.count_nonzero(pdf == 0) + np.count_nonzero(pdf_back == 0)),
        "reciprocity": float(np.max(difference, initial=0.0)),
    }


def interaction(wi: np.ndarray, nm: np.ndarray) -> mi.SurfaceInteraction3f:
    """An interaction with these incident directions and wavelengths."""
    si = dr.zeros(mi.SurfaceInteraction3f, wi.shape[1])
    si.wi = mi.Vector3f(wi)
    si.wavelengths = [mi.Float(np.ascontiguousarray(row)) for row in nm]
    return si
