"""The Taylor series of a phase screen in double precision: its sum, the bound of its remainder, and four partial sums.

The amplitude in a direction is P = Σ_n (iκ)ⁿ/n! · F{hⁿ} (docs/model.md), at normal incidence.

- h: the height above the lowest point.
- κ: the phase per height, 2π(1 + cosθo)/λ, with the wavelength λ and the angle θo of the outgoing light.
- F: the Fourier transform under the coherence window, the Gaussian within which light interferes.

The series is that of M. Single's thesis, Single 2014, without the rounding of single precision. The four *parts* of the
series are the terms n ≡ r (mod 4), with r from 0 to 3.

Amplitudes are computed at WAVELENGTH_UM for all directions of a map, as in map_panels.py: pixels are direction sines
(x, y) in [−1, 1]², row by row from the top, where y is largest. In the formulas of bounds and in the plot, x is instead
the largest κh.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, lgamma, log, pi
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from .map_panels import sines
from .map_surfaces import Surface

# Wavelength of the amplitudes, the shortest visible, which needs the most terms.
WAVELENGTH_UM = 0.38
# Side of the map in pixels.
SIZE = 100
# Number of orders summed to either side of a direction along each axis. The coherence length is at least about the
# extent of the tile, so beyond these orders the window's transform is below 1e-6.
REACH = 3
# Largest error of a converged sum, relative to the rms of the amplitudes over the map.
CONVERGED = 1e-2
# Range of the pictures' logarithmic grey scale in powers of ten.
DECADES = 6


@dataclass
class Sums:
    """Sums of a surface's series at the SIZE² pixels of the map, and their errors.

    An error is the rms over the map of the difference from the converged sum, relative to the rms of the whole sum.
    """

    name: str
    # Largest κh, over heights and directions; it is attained along the normal.
    argument: float
    # (count,): error of the sum of the first n terms, by n.
    whole: np.ndarray
    # (4, count): error of the sum of a part's terms among the first n, by n.
    parts: np.ndarray
    # (5, SIZE²): converged sums of the four parts and of the whole, complex, NaN outside the disc.
    limits: np.ndarray

    def bound(self, terms: int) -> float:
        """Lagrange's bound of the remainder after N = `terms` terms: xᴺ/N!, as no derivative of e^(ix) exceeds 1.

        x is `argument`, and log N! is lgamma(N + 1). Bounds end at e³⁰⁰, so that the product in `bound_of_the_source`
        does not overflow.
        """
        return float(np.exp(min(terms * log(self.argument) - lgamma(terms + 1), 300.0)))

    def bound_of_the_source(self, terms: int) -> float:
        """The bound in the appendix of Single 2014, e^x times as large: that of a real exponent."""
        return float(np.exp(min(self.argument, 300.0))) * self.bound(terms)

    def figures(self) -> dict:
        """Name, largest argument, and numbers of terms from which on errors and bounds are at most CONVERGED.

        `whole` and `parts` are the numbers of terms for the sums, `bound` and `bound_of_the_source` those for the
        bounds. `part_over_whole` is the rms of the first part over that of the whole; it tells how much parts cancel.
        """

        count = len(self.whole)

        def least(error, largest: int = count - 1) -> int:
            """The number of terms from which on `error(n)` is at most CONVERGED, for n up to `largest`."""
            return next(n for n in range(largest, -1, -1) if error(n) > CONVERGED) + 1

        return {
            "surface": self.name,
            "argument": self.argument,
            # The bounds converge after the sums, but well before twice their terms.
            "bound": least(self.bound, 2 * count),
            "bound_of_the_source": least(self.bound_of_the_source, 2 * count),
            "whole": least(lambda n: self.whole[n]),
            "parts": [least(lambda n, part=part: part[n]) for part in self.parts],
            "part_over_whole": float(
                np.sqrt(np.nanmean(abs(self.limits[0]) ** 2) / np.nanmean(abs(self.limits[-1]) ** 2))
            ),
        }


def sums(surface: Surface) -> Sums:
    """The series of a surface, which must not be flat, in each direction of the map, at normal incidence."""
    heights_um = surface.heights_um - surface.heights_um.min()
    top_um = heights_um.max()
    argument = float(4 * pi * top_um / WAVELENGTH_UM)
    # The number of terms beyond which each term is below 1e-12. Terms xⁿ/n! fall from n = x on.
    count = ceil(argument)
    while count * log(argument) - lgamma(count + 1) > log(1e-12):
        count += 1
    # y falls from row to row.
    x, y = (axis.ravel() for axis in np.meshgrid(sines(SIZE), -sines(SIZE)))
    inside = np.hypot(x, y) < 1
    x, y = x[inside], y[inside]
    # κh of the highest point in each direction, with cosθo = √(1 − x² − y²).
    kappa_top = 2 * pi * (1 + np.sqrt(1 - x * x - y * y)) / WAVELENGTH_UM * top_um
    orders, window = neighbours(surface, x, y)
    # Term n is coefficient · F{height_power} with coefficient = (i kappa_top)ⁿ/n! and height_power = (h/top)ⁿ.
    terms = np.zeros((count, len(x)), complex)
    coefficient, height_power = np.ones(len(x), complex), np.ones_like(heights_um)
    for n in range(count):
        # `ifft2` has the model's sign of the exponent and divides by the number of pixels.
        transform = np.fft.ifft2(height_power)
        # The sum over the orders about each direction.
        terms[n] = coefficient * (transform[orders] * window).sum(axis=0)
        coefficient *= 1j * kappa_top / (n + 1)
        height_power *= heights_um / top_um
    # A part has the rows of its own terms; its other rows are zero.
    parts = [np.where(np.arange(count)[:, None] % 4 == part, terms, 0) for part in range(4)]
    limits = np.full((5, SIZE * SIZE), np.nan, complex)
    limits[:, inside] = [each.sum(axis=0) for each in (*parts, terms)]
    scale = np.sqrt(np.nanmean(abs(limits[-1]) ** 2))

    def errors(summed: np.ndarray) -> np.ndarray:
        """Errors by n of the sum of the first n rows: the rms of the remaining rows' sum."""
        remainder = np.cumsum(summed[::-1], axis=0)[::-1]
        return np.sqrt((abs(remainder) ** 2).mean(axis=1)) / scale

    return Sums(surface.name, argument, errors(terms), np.array([errors(part) for part in parts]), limits)


def neighbours(surface: Surface, x: np.ndarray, y: np.ndarray) -> tuple[tuple, np.ndarray]:
    """The orders about each direction, and the weights of the coherence window's transform, exp(−2π²s²|f − f_j|²).

    `x` and `y` are direction sines, and s is a quarter of the coherence length (docs/model.md). Orders are
    indices (iy, ix) into the discrete Fourier transform of the heights. Both indices and the weights have the shape
    (orders, directions).
    """
    s_um = surface.coherence_um / 4
    along = []
    for sine, extent_um, pixels in zip((x, y), surface.extent_um, surface.heights_um.shape[::-1]):
        # A relief of one pixel along an axis has order 0 alone there.
        reach = REACH if pixels > 1 else 0
        # The direction in units of orders, by the grating equation at normal incidence.
        position = sine * extent_um / WAVELENGTH_UM
        nearest = np.rint(position) if pixels > 1 else np.zeros_like(position)
        order = nearest + np.arange(-reach, reach + 1)[:, None]
        weight = np.exp(-2 * (pi * s_um * (position - order) / extent_um) ** 2)
        # Orders beyond the Nyquist limit have no weight.
        along.append((order.astype(int) % pixels, np.where(abs(order) <= pixels / 2, weight, 0)))
    # Each array is (orders along the axis, directions).
    (ix, weight_x), (iy, weight_y) = along
    ix, iy = np.broadcast_arrays(ix[None], iy[:, None])
    weights = (weight_x[None] * weight_y[:, None]).reshape(-1, x.size)
    return (iy.reshape(-1, x.size), ix.reshape(-1, x.size)), weights


def pictures(found: Sums) -> list[tuple[str, Image.Image]]:
    """Captions and pictures of the powers |P|² of the four parts and of the whole.

    Each picture has its own logarithmic scale.
    """
    figures = found.figures()
    captions = [f"n = {r}, {r + 4}, {r + 8} …\nfrom {figures['parts'][r]} terms on" for r in range(4)]
    captions.append(f"all n\nfrom {figures['whole']} terms on")
    drawn = []
    for caption, amplitude in zip(captions, found.limits):
        power = abs(amplitude.reshape(SIZE, SIZE)) ** 2
        # From 0 at the smallest power shown to 1 at the largest; pixels outside the disc are dark grey.
        grey = 1 + np.log10(np.maximum(power / np.nanmax(power), 10.0**-DECADES)) / DECADES
        grey = np.nan_to_num(grey, nan=0.1)
        drawn.append((caption, Image.fromarray(np.uint8(np.round(255 * grey))).convert("RGB")))
    return drawn


def plot(found: list[Sums], file: Path) -> None:
    """Draws for each surface the errors of the whole and its parts over the number of terms, and the bound."""
    with matplotlib.rc_context({"svg.fonttype": "none", "font.size": 9, "svg.hashsalt": file.stem}):
        figure, axes = plt.subplots(1, len(found), figsize=(3.1 * len(found), 3.2), sharey=True, squeeze=False)
        for each, axis in zip(found, axes[0]):
            n = np.arange(len(each.whole))
            for part, error in enumerate(each.parts):
                # The floor avoids the logarithm of zero after a part's last term.
                axis.semilogy(n, np.maximum(error, 1e-15), lw=1, label=f"n ≡ {part} (mod 4)")
            axis.semilogy(n, each.whole, "k", lw=1.6, label="all n")
            axis.semilogy(n, [each.bound(int(count)) for count in n], "k--", lw=1, label="xᴺ/N!")
            axis.axhline(CONVERGED, color="0.6", lw=0.8)
            axis.set(title=f"{each.name}\nx = {each.argument:.1f}", xlabel="terms N", ylim=(1e-6, 1e13))
        axes[0, 0].set_ylabel("error of the amplitude, relative")
        axes[0, -1].legend(fontsize=7)
        figure.tight_layout()
        figure.savefig(file, metadata={"Date": None})
    plt.close(figure)
