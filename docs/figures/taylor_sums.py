"""Terms of the phase screen's Taylor series in double precision: its bound, its sum, and four partial sums.

`P = Σ_n (iκ)ⁿ/n! · F{hⁿ}` with the heights h above the lowest height (docs/model.md), at 380 nm and normal incidence,
over the map's directions: the series of Single 2014 without the rounding of single precision. The parts are by iⁿ.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, lgamma, log, pi
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from .map_surfaces import Surface

WAVELENGTH_UM = 0.38
# Side of the map in pixels.
SIZE = 100
# Number of orders summed to either side of a direction; beyond them the window's transform is below 1e-6.
REACH = 3
# Error of a converged amplitude, relative to the rms of the amplitudes over the map.
CONVERGED = 1e-2
DECADES = 6


@dataclass
class Sums:
    """Partial sums of a surface's series and their errors."""

    name: str
    # Largest argument κh.
    argument: float
    # Error of the sum of the first n terms, by n.
    whole: np.ndarray
    # Error of the sum of the first n terms, by n, for the four parts of the series.
    parts: np.ndarray
    # The four parts and the whole over the map, complex, NaN outside the disc.
    limits: np.ndarray

    def bound(self, terms: int) -> float:
        """Lagrange's bound of the remainder after N terms: `xᴺ/N!`, as no derivative of e^(ix) exceeds 1."""
        return float(np.exp(min(terms * log(self.argument) - lgamma(terms + 1), 300.0)))

    def bound_of_the_source(self, terms: int) -> float:
        """The bound of Single 2014's appendix, larger by e^x, as for a real exponent."""
        return float(np.exp(min(self.argument, 300.0))) * self.bound(terms)

    def figures(self) -> dict:
        """The number of terms at which each sum has converged."""

        def least(error) -> int:
            return next(n for n in range(len(self.whole) - 1, -1, -1) if error(n) > CONVERGED) + 1

        return {
            "surface": self.name,
            "argument": self.argument,
            "bound": least(self.bound),
            "bound_of_the_source": least(self.bound_of_the_source),
            "whole": least(lambda n: self.whole[n]),
            "parts": [least(lambda n, part=part: part[n]) for part in self.parts],
            "part_over_whole": float(
                np.sqrt(np.nanmean(abs(self.limits[0]) ** 2) / np.nanmean(abs(self.limits[4]) ** 2))
            ),
        }


def sums(surface: Surface) -> Sums:
    """The sums over the map of a surface."""
    heights = surface.heights_um - surface.heights_um.min()
    top_um = heights.max()
    argument = float(4 * pi * top_um / WAVELENGTH_UM)
    # The number of terms beyond which each is below 1e-12.
    count = ceil(argument)
    while count * log(argument) - lgamma(count + 1) > log(1e-12):
        count += 1
    place = (np.arange(SIZE) + 0.5) * 2 / SIZE - 1
    x, y = (axis.ravel() for axis in np.meshgrid(place, -place))
    inside = np.hypot(x, y) < 1
    x, y = x[inside], y[inside]
    kappa_top = 2 * pi * (1 + np.sqrt(1 - x * x - y * y)) / WAVELENGTH_UM * top_um
    bins, window = neighbours(surface, x, y)
    added, power = np.zeros((count, len(x)), complex), np.ones_like(heights)
    coefficient = np.ones(len(x), complex)
    for n in range(count):
        # `ifft` has the sign of the exponent and takes the mean.
        terms = np.fft.ifft2(power)
        added[n] = coefficient * (terms[bins] * window).sum(axis=0)
        coefficient *= 1j * kappa_top / (n + 1)
        power *= heights / top_um
    parts = [np.where(np.arange(count)[:, None] % 4 == part, added, 0) for part in range(4)]
    limits = np.full((5, SIZE * SIZE), np.nan, complex)
    limits[:, inside] = [each.sum(axis=0) for each in (*parts, added)]
    scale = np.sqrt(np.nanmean(abs(limits[4]) ** 2))

    def errors(terms: np.ndarray) -> np.ndarray:
        left = np.cumsum(terms[::-1], axis=0)[::-1]
        return np.sqrt((abs(left) ** 2).mean(axis=1)) / scale

    return Sums(surface.name, argument, errors(added), np.array([errors(part) for part in parts]), limits)


def neighbours(surface: Surface, x: np.ndarray, y: np.ndarray) -> tuple[tuple, np.ndarray]:
    """Bins of the orders about each direction, and the coherence window's weights."""
    s_um = surface.coherence_um / 4
    found = []
    for direction, extent_um, pixels in zip((x, y), surface.extent_um, surface.heights_um.shape[::-1]):
        reach = REACH if pixels > 1 else 0
        at = direction * extent_um / WAVELENGTH_UM
        order = (np.rint(at) if pixels > 1 else np.zeros_like(at)) + np.arange(-reach, reach + 1)[:, None]
        weight = np.exp(-2 * (pi * s_um * (at - order) / extent_um) ** 2)
        # Orders beyond the Nyquist limit have no weight.
        found.append((order.astype(int) % pixels, np.where(abs(order) <= pixels / 2, weight, 0)))
    (jx, gx), (jy, gy) = found
    jx, jy = np.broadcast_arrays(jx[None], jy[:, None])
    return (jy.reshape(-1, x.size), jx.reshape(-1, x.size)), (gx[None] * gy[:, None]).reshape(-1, x.size)


def pictures(found: Sums) -> list[tuple[str, Image.Image]]:
    """Pictures of the power of the four parts and of the whole, each on a separate logarithmic scale, with captions."""
    parts = found.figures()["parts"]
    captions = [f"n = {r}, {r + 4}, {r + 8} …\nfrom {parts[r]} terms on" for r in range(4)]
    made = []
    for caption, amplitude in zip([*captions, f"all n\nfrom {found.figures()['whole']} terms on"], found.limits):
        power = abs(amplitude.reshape(SIZE, SIZE)) ** 2
        grey = 1 + np.log10(np.maximum(power / np.nanmax(power), 10.0**-DECADES)) / DECADES
        made.append((caption, Image.fromarray(np.uint8(np.round(255 * np.nan_to_num(grey, nan=0.1)))).convert("RGB")))
    return made


def plot(found: list[Sums], file: Path) -> None:
    """Draws the error of the sum and its parts over the number of terms, and the bound."""
    with matplotlib.rc_context({"svg.fonttype": "none", "font.size": 9, "svg.hashsalt": file.stem}):
        figure, axes = plt.subplots(1, len(found), figsize=(3.1 * len(found), 3.2), sharey=True, squeeze=False)
        for each, axis in zip(found, axes[0]):
            n = np.arange(len(each.whole))
            for part, error in enumerate(each.parts):
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
