"""Pearson's χ² test of a BSDF's samples against its density, by `mitsuba.chi2` over cells of equal solid angle.

`bsdf_test` tests a BSDF in a vectorised variant of Mitsuba; `chi_square_test` tests any pair of functions.
"""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import mitsuba as mi
from mitsuba.chi2 import ChiSquareTest

# Default for the four wavelengths that one spectral path carries: arbitrary values, spread over the visible range. The
# BSDF's density for such a path is the mean of the densities at the four wavelengths.
WAVELENGTHS_NM = [410.0, 487.5, 561.0, 655.0]


class HemisphereDomain:
    """The unit square mapped to the upper hemisphere, with equal areas to equal solid angles.

    The class has the interface of the domains of `mitsuba.chi2`: the bounds and the aspect ratio of a rectangle, and
    the maps from it to directions and back. Unlike Mitsuba's `SphericalDomain`, it does not distort orders near the
    normal, and its edge is the horizon. Samples below the horizon fall outside the square and fail the test.
    """

    def bounds(self):
        return mi.ScalarBoundingBox2f(0, 1)

    def aspect(self):
        return 1

    def map_forward(self, p):
        return mi.warp.square_to_uniform_hemisphere(p)

    def map_backward(self, p):
        return mi.warp.uniform_hemisphere_to_square(p)


class SphereDomain(HemisphereDomain):
    """A rectangle twice as wide as high, mapped to the sphere, with equal areas to equal solid angles.

    The half x < 1 is the upper hemisphere, as in `HemisphereDomain`. The half x ≥ 1 is the lower hemisphere, which is
    the upper one mirrored at the horizon.
    """

    def bounds(self):
        return mi.ScalarBoundingBox2f([0, 0], [2, 1])

    def aspect(self):
        return 2

    def map_forward(self, p):
        lower = p.x >= 1
        w = super().map_forward(mi.Point2f(p.x - dr.select(lower, 1, 0), p.y))
        return mi.Vector3f(w.x, w.y, dr.select(lower, -w.z, w.z))

    def map_backward(self, p):
        lower = p.z < 0
        square = super().map_backward(mi.Vector3f(p.x, p.y, dr.abs(p.z)))
        return mi.Point2f(square.x + dr.select(lower, 1, 0), square.y)


def chi_square_test(sample_func: Callable, pdf_func: Callable, domain=None, **options):
    """A `ChiSquareTest`, not yet run, of samples `sample_func(u) -> (wo, pdf)` against the density `pdf_func(wo)`.

    The test is run by its method `run`. `domain` is `HemisphereDomain()` by default, and `SphereDomain()` for functions
    with both sides. `u` has three uniform random numbers per sample; `wo` is a unit vector whose z is along the normal.
    Densities are in 1/sr. `options` are further arguments of `ChiSquareTest`, such as `sample_count` and `res`.
    """

    def weighted_samples(u):
        wo, pdf = sample_func(u)
        # A sample of density 0 has no direction: its wave is beyond the horizon. It gets weight 0, and the normal as a
        # direction that the domain can map. All others get weight 1. Mitsuba's own `BSDFAdapter` would drop samples
        # where the BSDF is 0, but the density includes them.
        is_valid = pdf > 0
        return dr.select(is_valid, wo, mi.Vector3f(0, 0, 1)), dr.select(is_valid, mi.Float(1), 0)

    # `pdf_func` is per unit area of the domain. A hemisphere, 2π sr, has the area 1 in both domains above.
    return ChiSquareTest(
        domain=domain or HemisphereDomain(),
        sample_func=weighted_samples,
        pdf_func=lambda wo: pdf_func(wo) * dr.two_pi,
        sample_dim=3,
        **options,
    )


def bsdf_test(bsdf: mi.BSDF, wi, pdf_of: mi.BSDF | None = None, nm=WAVELENGTHS_NM, **options):
    """A `ChiSquareTest`, not yet run, of the samples of `bsdf`, in a vectorised variant of Mitsuba.

    `wi` is the incident direction, a unit vector in the local frame that points away from the surface. The density is
    that of the BSDF `pdf_of`, by default of `bsdf` itself; another one makes a negative control. `nm` are the path's
    four wavelengths in nm, for spectral variants. `options` are those of `chi_square_test`. By default there are
    200 000 samples (`sample_count`) and 75 cells along y (`res`), with 24 quadrature points along each side of a cell
    (`ires`). Along x there are 75 cells over the aspect ratio.
    """
    ctx = mi.BSDFContext()

    def interactions(count):
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        # Opaque values, so that one compiled kernel serves all directions and wavelengths.
        si.wi = mi.Vector3f([dr.opaque(mi.Float, c) for c in wi])
        if mi.is_spectral:
            si.wavelengths = type(si.wavelengths)([dr.opaque(mi.Float, wavelength) for wavelength in nm])
        return si

    def sample_func(u):
        bs, _ = bsdf.sample(ctx, interactions(dr.width(u)), u.x, mi.Point2f(u.y, u.z))
        return bs.wo, bs.pdf

    def pdf_func(wo):
        return (pdf_of or bsdf).pdf(ctx, interactions(dr.width(wo)), wo)

    return chi_square_test(sample_func, pdf_func, **{"sample_count": 200_000, "res": 75, "ires": 24, **options})
