"""Questions to a BSDF and its answers as NumPy arrays, for scalar and vectorised variants.

A question is one set of arguments of a BSDF's methods: a pair of directions, wavelengths and random numbers. The last
axis of every array is the question, as in Dr.Jit's arrays.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from .variants import is_scalar

# Range of the wavelengths in nm: that of Mitsuba's spectral variants.
WAVELENGTH_NM = (360.0, 830.0)
# Number of wavelengths of a question, equal to that of a path in Mitsuba's spectral variants.
CARRIED = 4


@dataclass(frozen=True)
class Questions:
    """Arguments of a BSDF's methods, in single precision.

    Unit directions `wi` and `wo` (3, n) are in the shading frame and point away from the surface. `nm` (4, n) are
    wavelengths in nm, and `u` (3, n) random numbers in [0, 1): `u[0]` is `sample1` of `BSDF.sample`, `u[1:]` `sample2`.
    """

    wi: np.ndarray
    wo: np.ndarray
    nm: np.ndarray
    u: np.ndarray

    @property
    def count(self) -> int:
        """The number of questions, n."""
        return self.wi.shape[1]


@dataclass(frozen=True)
class Answers:
    """Values and weights (channels, n) or Mueller matrices (4, 4, channels, n), densities (n,) and directions (3, n).

    Values include the cosine of `wo`. `value` and `pdf` are from `eval` and `pdf`, `both_value` and `both_pdf` from
    `eval_pdf`; `weight` (value over density), `sampled_wo` and `sampled_pdf` are from `sample`.
    """

    value: np.ndarray
    pdf: np.ndarray
    both_value: np.ndarray
    both_pdf: np.ndarray
    sampled_wo: np.ndarray
    sampled_pdf: np.ndarray
    weight: np.ndarray


def drawn(rng: np.random.Generator, count: int) -> Questions:
    """Random questions: directions uniform in solid angle above the surface, wavelengths over Mitsuba's range."""
    nm = rng.uniform(*WAVELENGTH_NM, (CARRIED, count)).astype(np.float32)
    u = rng.random((3, count), dtype=np.float32)
    return Questions(directions(rng, count), directions(rng, count), nm, u)


def directions(rng: np.random.Generator, count: int) -> np.ndarray:
    """Unit vectors (3, count), uniform in solid angle over the upper hemisphere."""
    # z is in (0, 1], so no direction lies in the surface.
    z, phi = 1 - rng.random(count), 2 * np.pi * rng.random(count)
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z]).astype(np.float32)


def ask(bsdf: mi.BSDF, asked: Questions) -> Answers:
    """The answers of `eval`, `pdf`, `eval_pdf` and `sample` in the current variant."""
    return ask_one_by_one(bsdf, asked) if is_scalar() else ask_at_once(bsdf, asked)


def ask_at_once(bsdf: mi.BSDF, asked: Questions) -> Answers:
    """The answers of a vectorised variant, from one kernel."""
    ctx, si, wo = mi.BSDFContext(), interactions(asked), mi.Vector3f(asked.wo)
    value, pdf = bsdf.eval(ctx, si, wo), bsdf.pdf(ctx, si, wo)
    both_value, both_pdf = bsdf.eval_pdf(ctx, si, wo)
    sample, weight = bsdf.sample(ctx, si, *random_numbers(asked))
    dr.eval(value, pdf, both_value, both_pdf, sample.wo, sample.pdf, weight)
    return Answers(
        spectra(value),
        np.array(pdf),
        spectra(both_value),
        np.array(both_pdf),
        np.array(sample.wo),
        np.array(sample.pdf),
        spectra(weight),
    )


def ask_one_by_one(bsdf: mi.BSDF, asked: Questions) -> Answers:
    """The answers of a scalar variant, one question after another."""
    ctx, si, answers = mi.BSDFContext(), dr.zeros(mi.SurfaceInteraction3f), []
    for i in range(asked.count):
        si.wi = mi.Vector3f(asked.wi[:, i].tolist())
        if mi.is_spectral:
            si.wavelengths = asked.nm[:, i].tolist()
        wo, u = asked.wo[:, i].tolist(), asked.u[:, i].tolist()
        both_value, both_pdf = bsdf.eval_pdf(ctx, si, wo)
        sample, weight = bsdf.sample(ctx, si, u[0], u[1:])
        answers.append(
            Answers(
                spectra(bsdf.eval(ctx, si, wo)),
                bsdf.pdf(ctx, si, wo),
                spectra(both_value),
                both_pdf,
                np.array(sample.wo),
                sample.pdf,
                spectra(weight),
            )
        )
    return Answers(**{name: np.stack([getattr(each, name) for each in answers], axis=-1) for name in vars(answers[0])})


def interactions(asked: Questions) -> mi.SurfaceInteraction3f:
    """Surface interactions of a vectorised variant.

    The values are arrays, not literals, so that Dr.Jit does not compile a kernel for each set of questions.
    """
    si = dr.zeros(mi.SurfaceInteraction3f, asked.count)
    si.wi = mi.Vector3f(asked.wi)
    if mi.is_spectral:
        si.wavelengths = [mi.Float(row) for row in asked.nm]
    return si


def random_numbers(asked: Questions) -> tuple[mi.Float, mi.Point2f]:
    """The arguments `sample1` and `sample2` of `BSDF.sample` in a vectorised variant."""
    return mi.Float(asked.u[0]), mi.Point2f(asked.u[1:])


def spectra(spectrum) -> np.ndarray:
    """A spectrum as (channels, n), a Mueller matrix as (4, 4, channels, n); without n in scalar variants."""
    if not mi.is_polarized:
        return np.atleast_1d(np.array(spectrum))
    return np.array([[np.array(spectrum[i, j]) for j in range(4)] for i in range(4)])
