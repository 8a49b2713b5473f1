"""Colours of spectral reflectances: CIE XYZ (1931 observer), linear sRGB, CIELAB, and gamuts in CIE 1976 u'v'.

The colour of a reflectance R under an illuminant L is XYZ = Σ R(λ) L(λ) x̄ȳz̄(λ) / Σ L(λ) ȳ(λ), with sums over uniform
wavelengths λ. So a perfect reflector (R = 1) has Y = 1. The sums also apply to a BSDF; colours are then in 1/sr.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from .reflector import mitsuba, use_variant

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]

#: The CIE's names of the illuminants: daylight, equal energy, incandescent lamp.
ILLUMINANTS = ("D65", "E", "A")
# Matrix from CIE XYZ to linear sRGB (IEC 61966-2-1). White under D65 has Y = 1 and all channels 1.
_SRGB_OF_XYZ = np.array(
    [
        [3.2404541621, -1.5371385128, -0.4985314096],
        [-0.9692660305, 1.8760108454, 0.0415560175],
        [0.0556434310, -0.2040259135, 1.0572251882],
    ]
)
# Temperature in K of the black body that defines illuminant A (CIE 15).
_LAMP_K = 2848.0
# Second radiation constant hc/k_B in nm·K, the value of 1931 to which _LAMP_K belongs (CIE 15).
_C2_NM_K = 1.435e7


def wavelengths_nm(step_nm: float) -> Doubles:
    """Visible wavelengths in nm from 380 in uniform steps, up to at most 780."""
    # The margin keeps 780 where rounding would exclude it.
    return np.arange(380.0, 780.0 + 1e-9, step_nm)


@lru_cache(maxsize=16)
def xyz_weights(illuminant: str, step_nm: float) -> Doubles:
    """Weights ``[wavelengths, 3]`` from a reflectance at ``wavelengths_nm(step_nm)`` to CIE XYZ.

    ``illuminant`` is one of ILLUMINANTS. A perfect reflector has Y = 1. The result is cached: callers must not change
    it.
    """
    # In a scalar variant Mitsuba's functions of wavelength take and return plain numbers.
    use_variant("scalar_spectral")
    mi = mitsuba()
    nm = wavelengths_nm(step_nm)
    observer = np.array([[float(value) for value in mi.cie1931_xyz(float(one))] for one in nm])
    if illuminant == "D65":
        power = np.array([float(mi.cie_d65(float(one))) for one in nm])
    elif illuminant == "A":
        # Planck's law relative to 560 nm; the common factor cancels below.
        power = (560.0 / nm) ** 5 * np.expm1(_C2_NM_K / (_LAMP_K * 560.0)) / np.expm1(_C2_NM_K / (_LAMP_K * nm))
    else:
        # Illuminant E: equal energy.
        power = np.ones_like(nm)
    weights: Doubles = observer * power[:, None]
    weights /= weights[:, 1].sum()
    return weights


@lru_cache(maxsize=16)
def rgb_weights(illuminant: str, step_nm: float) -> Doubles:
    """Weights ``[wavelengths, 3]`` from a reflectance at ``wavelengths_nm(step_nm)`` to linear sRGB.

    Each channel is scaled so that a perfect reflector is (1, 1, 1) under any of the ILLUMINANTS. The result is cached:
    callers must not change it.
    """
    weights = np.einsum("ij,kj->ik", xyz_weights(illuminant, step_nm), _SRGB_OF_XYZ)
    scaled: Doubles = weights / weights.sum(axis=0)
    return scaled


def weighted(values: NDArray[np.float32] | Doubles, weights: Doubles) -> Doubles:
    """Sums over wavelength, ``[directions, 3]``, of ``values[directions, wavelengths]`` times ``weights``.

    The order of einsum's additions does not depend on the number of threads, so results are reproducible.
    """
    summed: Doubles = np.einsum("ij,jk->ik", values.astype(np.float64), weights)
    return summed


def lab(xyz: Doubles, white: Doubles) -> Doubles:
    """CIELAB ``[L*, a*, b*]`` of the colour ``xyz[3]``, relative to ``white[3]``, the illuminant's XYZ (CIE 15)."""
    ratio = xyz / white
    # The cube root, or its tangent at δ³ below δ³. `maximum` keeps negative ratios, which take the tangent, from cbrt.
    delta = 6 / 29
    tangent = ratio / (3 * delta**2) + 4 / 29
    f = np.where(ratio > delta**3, np.cbrt(np.maximum(ratio, 0)), tangent)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def chromaticities(xyz: Doubles) -> Doubles:
    """CIE 1976 u', v' ``[n, 2]`` of colours ``xyz[n, 3]``, none of them black."""
    denominator = xyz[:, 0] + 15 * xyz[:, 1] + 3 * xyz[:, 2]
    return np.stack([4 * xyz[:, 0] / denominator, 9 * xyz[:, 1] / denominator], axis=-1)


def hull(points: Doubles) -> list[int]:
    """Indices of the corners of the convex hull of ``points[n, 2]``, counter-clockwise (Andrew's monotone chain).

    Points on an edge are no corners. The list is empty without points, and [0] for a single one.
    """
    ascending = sorted(range(len(points)), key=lambda i: (points[i, 0], points[i, 1]))

    def turns_left(a: int, b: int, c: int) -> bool:
        """Whether the path through the points a, b and c turns left at b."""
        (ax, ay), (bx, by), (cx, cy) = points[a], points[b], points[c]
        return bool((bx - ax) * (cy - ay) - (by - ay) * (cx - ax) > 0)

    def half_hull(indices: list[int]) -> list[int]:
        """The lower hull for ascending points, the upper one for descending.

        The last corner is left out, since it begins the other half.
        """
        corners: list[int] = []
        for index in indices:
            while len(corners) > 1 and not turns_left(corners[-2], corners[-1], index):
                corners.pop()
            corners.append(index)
        return corners[:-1]

    return half_hull(ascending) + half_hull(ascending[::-1]) if len(ascending) > 1 else ascending


def polygon_area(corners: Doubles) -> float:
    """Area of a polygon with counter-clockwise corners ``[n, 2]`` (shoelace formula)."""
    x, y = corners[:, 0], corners[:, 1]
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
