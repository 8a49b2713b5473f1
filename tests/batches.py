"""Batches of BSDF queries as NumPy arrays, in scalar variants (a loop) and in vectorised ones.

`wi` and `wo` are unit vectors `(count, 3)` in the local frame. `nm` has wavelengths `(count, 4)`, which only spectral
variants use. Values are those of Mitsuba, the BSDF times cosθo in 1/sr; densities are in 1/sr.
"""

import drjit as dr
import mitsuba as mi
import numpy as np

# Range of Mitsuba's spectral variants.
WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM = 360.0, 830.0


def direction(theta, phi):
    """Unit vector from the polar angle and the azimuth in degrees."""
    theta, phi = np.radians(theta), np.radians(phi)
    return [float(np.sin(theta) * np.cos(phi)), float(np.sin(theta) * np.sin(phi)), float(np.cos(theta))]


def random_directions(rng, count):
    """Directions `(count, 3)`, uniform in solid angle over the upper hemisphere, in single precision."""
    z, phi = 1 - rng.random(count), 2 * np.pi * rng.random(count)
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1).astype(np.float32)


def random_wavelengths(rng, count):
    """Wavelengths `(count, 4)` in nm, the four of a path."""
    return rng.uniform(WAVELENGTH_MIN_NM, WAVELENGTH_MAX_NM, (count, 4)).astype(np.float32)


def is_scalar():
    return mi.variant().startswith("scalar")


def intensity(spectrum):
    """The value's channels, first axis; of a Mueller matrix the element [0, 0], which is the intensity's."""
    return np.atleast_1d(np.array(spectrum[0, 0] if mi.is_polarized else spectrum))


def interactions(wi, nm):
    """Surface interactions of a vectorised variant.

    Arrays are no literals of Dr.Jit, so one kernel serves all directions.
    """
    si = dr.zeros(mi.SurfaceInteraction3f, len(wi))
    si.wi = mi.Vector3f(np.ascontiguousarray(np.transpose(wi)))
    if mi.is_spectral:
        si.wavelengths = [mi.Float(np.ascontiguousarray(column)) for column in np.transpose(nm)]
    return si


def one_by_one(wi, nm):
    """Yields one surface interaction of a scalar variant, changed for each query."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    for i in range(len(wi)):
        si.wi = mi.Vector3f(wi[i].tolist())
        if mi.is_spectral:
            si.wavelengths = nm[i].tolist()
        yield si


def eval_alone(bsdf, wi, wo, nm):
    """Values `(count, channels)`, without compiling the density as `eval_pdf` does."""
    ctx = mi.BSDFContext()
    if is_scalar():
        return np.array([intensity(bsdf.eval(ctx, si, o)) for si, o in zip(one_by_one(wi, nm), wo.tolist())])
    return intensity(bsdf.eval(ctx, interactions(wi, nm), mi.Vector3f(np.ascontiguousarray(np.transpose(wo))))).T


def eval_pdf(bsdf, wi, wo, nm):
    """Values `(count, channels)` and densities `(count,)`."""
    ctx = mi.BSDFContext()
    if is_scalar():
        answers = [bsdf.eval_pdf(ctx, si, o) for si, o in zip(one_by_one(wi, nm), wo.tolist())]
        return np.array([intensity(value) for value, _ in answers]), np.array([pdf for _, pdf in answers])
    value, pdf = bsdf.eval_pdf(ctx, interactions(wi, nm), mi.Vector3f(np.ascontiguousarray(np.transpose(wo))))
    # One kernel computes both.
    dr.eval(value, pdf)
    return intensity(value).T, np.array(pdf)


def sample(bsdf, wi, nm, u):
    """Directions `(count, 3)`, densities `(count,)` and weights `(count, channels)` from random numbers `(count, 3)`.

    The first number is Mitsuba's `sample1`, the others are `sample2`.
    """
    ctx = mi.BSDFContext()
    if is_scalar():
        u = u.tolist()
        answers = [bsdf.sample(ctx, si, u[i][0], u[i][1:]) for i, si in enumerate(one_by_one(wi, nm))]
        return (
            np.array([np.array(bs.wo) for bs, _ in answers]),
            np.array([bs.pdf for bs, _ in answers]),
            np.array([intensity(weight) for _, weight in answers]),
        )
    u = np.ascontiguousarray(np.transpose(u))
    bs, weight = bsdf.sample(ctx, interactions(wi, nm), mi.Float(u[0]), mi.Point2f(u[1:]))
    dr.eval(bs, weight)
    return np.array(bs.wo).T, np.array(bs.pdf), intensity(weight).T
