"""Pearson's χ² test of a BSDF's samples against its density, by `mitsuba.chi2` over cells of equal solid angle.

`vectorised` tests a BSDF of a vectorised variant; `chi_square_test` tests any pair of functions.
"""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import mitsuba as mi

# The four wavelengths in nm that one spectral path carries: arbitrary values, spread over the visible range. The BSDF's
# density for such a path is the mean of the densities at the four wavelengths.
WAVELENGTHS = [410.0, 487.5, 561.0, 655.0]


class HemisphereDomain:
    """The unit square mapped to the upper hemisphere, with equal areas to equal solid angles.

    Unlike `SphericalDomain`, it does not distort orders near the normal, and its edge is the horizon.
    """

    def bounds(self):
        return mi.ScalarBoundingBox2f(0, 1)

    def aspect(self):
        return 1

    def map_forward(self, p):
        return mi.warp.square_to_uniform_hemisphere(p)

    def map_backward(self, p):
        return mi.warp.uniform_hemisphere_to_square(p)


def chi_square_test(sample_func: Callable, pdf_func: Callable, **resolution):
    """The test of samples `sample_func(u) -> (wo, pdf)` against the density `pdf_func(wo)` in 1/sr.

    `u` are three uniform random numbers a sample; `resolution` are further arguments of the test, such as `res`.
    """
    from mitsuba.chi2 import ChiSquareTest

    def counted(u):
        wo, pdf = sample_func(u)
        # A sample of density 0 is below the horizon and gets weight 0. All others get weight 1, even where the BSDF is
        # 0: Mitsuba's own `BSDFAdapter` would drop those, but the density includes them.
        is_valid = pdf > 0
        return dr.select(is_valid, wo, mi.Vector3f(0, 0, 1)), dr.select(is_valid, mi.Float(1), 0)

    # Density per unit area of the domain: the domain has area 1, the hemisphere 2π sr.
    return ChiSquareTest(
        domain=HemisphereDomain(),
        sample_func=counted,
        pdf_func=lambda wo: pdf_func(wo) * dr.two_pi,
        sample_dim=3,
        **resolution,
    )


def vectorised(bsdf: mi.BSDF, wi, pdf_of: mi.BSDF | None = None, nm=WAVELENGTHS, **resolution):
    """The test of the samples of `bsdf` at incident direction `wi`, for a vectorised variant of Mitsuba.

    The density is that of the BSDF `pdf_of`, by default `bsdf` itself. `nm` are the path's wavelengths in nm.
    Defaults: 200 000 samples, 75 cells along each side of the domain, and 24 quadrature intervals a cell.
    """
    ctx = mi.BSDFContext()

    def interactions(count):
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        # Opaque values, so that one kernel serves all directions.
        si.wi = mi.Vector3f([dr.opaque(mi.Float, c) for c in wi])
        if mi.is_spectral:
            si.wavelengths = type(si.wavelengths)([dr.opaque(mi.Float, c) for c in nm])
        return si

    def sample_func(u):
        bs, _ = bsdf.sample(ctx, interactions(dr.width(u)), u.x, mi.Point2f(u.y, u.z))
        return bs.wo, bs.pdf

    def pdf_func(wo):
        return (pdf_of or bsdf).pdf(ctx, interactions(dr.width(wo)), wo)

    return chi_square_test(sample_func, pdf_func, **{"sample_count": 200_000, "res": 75, "ires": 24, **resolution})
