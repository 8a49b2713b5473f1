"""Colours of spectral reflectances: illuminants, the CIE 1931 observer, linear sRGB, CIELAB, chromaticities' hulls.

A colour of a reflectance R under an illuminant L is Σ R(λ) L(λ) x̄ȳz̄(λ) / Σ L(λ) ȳ(λ), at uniform wavelengths λ.
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
#: Matrix from CIE XYZ, with Y = 1 for white, to linear sRGB (IEC 61966-2-1).
_SRGB_OF_XYZ = np.array(
    [
        [3.2404541621, -1.5371385128, -0.4985314096],
        [-0.9692660305, 1.8760108454, 0.0415560175],
        [0.0556434310, -0.2040259135, 1.0572251882],
    ]
)


def wavelengths_nm(step_nm: float) -> Doubles:
    """Visible wavelengths from 380 to 780 nm in uniform steps."""
    return np.arange(380.0, 780.0 + 1e-9, step_nm)


@lru_cache(maxsize=16)
def xyz_weights(illuminant: str, step_nm: float) -> Doubles:
    """Weights ``[wavelengths, 3]`` from a spectral reflectance to CIE XYZ, with Y = 1 for a perfect reflector."""
    use_variant("scalar_spectral")
    mi = mitsuba()
    nm = wavelengths_nm(step_nm)
    observer = np.array([[float(value) for value in mi.cie1931_xyz(float(one))] for one in nm])
    if illuminant == "D65":
        light = np.array([float(mi.cie_d65(float(one))) for one in nm])
    elif illuminant == "A":
        # CIE 15 defines illuminant A as a black body of 2848 K with the radiation constant of 1931.
        light = (560.0 / nm) ** 5 * np.expm1(1.435e7 / (2848 * 560.0)) / np.expm1(1.435e7 / (2848 * nm))
    else:
        light = np.ones_like(nm)
    weights: Doubles = observer * light[:, None]
    weights /= weights[:, 1].sum()
    return weights


@lru_cache(maxsize=16)
def rgb_weights(illuminant: str, step_nm: float) -> Doubles:
    """Weights ``[wavelengths, 3]`` to linear sRGB, scaled by channel to (1, 1, 1) for a perfect reflector."""
    weights = np.einsum("ij,kj->ik", xyz_weights(illuminant, step_nm), _SRGB_OF_XYZ)
    scaled: Doubles = weights / weights.sum(axis=0)
    return scaled


def weighted(values: NDArray[np.float32] | Doubles, weights: Doubles) -> Doubles:
    """Weighted sums over wavelength, ``[directions, 3]``. The order of einsum's sums is independent of threads."""
    summed: Doubles = np.einsum("ij,jk->ik", values.astype(np.float64), weights)
    return summed


def lab(xyz: Doubles, white: Doubles) -> Doubles:
    """CIELAB ``[L*, a*, b*]`` of a colour, relative to the illuminant's white (CIE 15)."""
    ratio = xyz / white
    linear = ratio / (3 * (6 / 29) ** 2) + 4 / 29
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(np.maximum(ratio, 0)), linear)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def chromaticities(xyz: Doubles) -> Doubles:
    """CIE 1976 u', v' of colours ``[n, 3]``, none of them black."""
    denominator = xyz[:, 0] + 15 * xyz[:, 1] + 3 * xyz[:, 2]
    return np.stack([4 * xyz[:, 0] / denominator, 9 * xyz[:, 1] / denominator], axis=-1)


def hull(points: Doubles) -> list[int]:
    """Indices of the corners of the convex hull, counter-clockwise (Andrew's monotone chain)."""
    order = sorted(range(len(points)), key=lambda i: (points[i, 0], points[i, 1]))

    def turns_left(a: int, b: int, c: int) -> bool:
        (ax, ay), (bx, by), (cx, cy) = points[a], points[b], points[c]
        return bool((bx - ax) * (cy - ay) - (by - ay) * (cx - ax) > 0)

    def chain(indices: list[int]) -> list[int]:
        corners: list[int] = []
        for index in indices:
            while len(corners) > 1 and not turns_left(corners[-2], corners[-1], index):
                corners.pop()
            corners.append(index)
        return corners[:-1]

    return chain(order) + chain(order[::-1]) if len(order) > 1 else order


def polygon_area(corners: Doubles) -> float:
    """Area of a polygon with counter-clockwise corners ``[n, 2]`` (shoelace formula)."""
    x, y = corners[:, 0], corners[:, 1]
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
