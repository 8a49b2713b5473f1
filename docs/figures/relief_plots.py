"""Plots of a relief and of the terms of its phase screen's Taylor series (docs/model.md#the-two-expansions).

Term n is proportional to the discrete Fourier transform (DFT) of the n-th power of the heights. λ is the wavelength.
"""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from mitsuba_scenes.crosscheck.realtime import surface_words

from .heights import height_field

# Largest shown spatial frequency in cycles per µm, the largest that diffracts visible light: 2/λ at 380 nm, rounded up.
REACH_PER_UM = 5.3
# Range of a term's colour scale in powers of ten. A larger one shows fainter orders.
DECADES = 5
# Largest side of the shown part of a relief, equal to the extent of the scans.
SHOWN_UM = 6.5


@dataclass(frozen=True)
class Relief:
    """Heights, indexed [iy, ix] with y = 0 first, and the extent along x and y."""

    heights_um: np.ndarray
    extent_um: tuple[float, float]


def relief(skin: dict) -> Relief:
    """The heights of a surface with the plugin's parameters `skin`, levelled and not rotated."""
    heights_um, report = height_field(*surface_words(_heights_alone(skin)))
    return Relief(heights_um, tuple(report["extent_um"]))


def term(skin: dict, n: int) -> np.ndarray:
    """|DFT((h/H)ⁿ)| over the number of pixels; h is the height above the middle of its range, H half the range.

    Rows are orders along y and columns orders along x, in ascending order; order 0 has the index size//2.
    """
    return height_field("--term", n, *surface_words(_heights_alone(skin)))[0]


def show_relief(axes: plt.Axes, shown: Relief, title: str) -> None:
    """Draws the heights above the lowest shown point in grey.

    Of a relief larger than SHOWN_UM the corner at x = y = 0 is shown.
    """
    rows, columns = shown.heights_um.shape
    x_um, y_um = (min(extent_um, SHOWN_UM) for extent_um in shown.extent_um)
    part = shown.heights_um[: round(rows * y_um / shown.extent_um[1]), : round(columns * x_um / shown.extent_um[0])]
    part = part - part.min()
    image = axes.imshow(part, cmap="gray", origin="lower", extent=(0, x_um, 0, y_um))
    axes.set(title=title, xlabel="x (µm)", ylabel="y (µm)")
    plt.colorbar(image, ax=axes, label="height (µm)", shrink=0.8)


def show_term(axes: plt.Axes, skin: dict, n: int, title: str) -> None:
    """Draws the logarithm of a term, relative to its largest value, over spatial frequencies up to REACH_PER_UM."""
    magnitudes = term(skin, n)
    # The picture's edges in cycles per µm, (left, right, lower, upper). Order j is at the frequency j/extent, and a
    # pixel is centred on its order.
    edges = []
    for count, extent_um in zip(magnitudes.shape[::-1], relief(skin).extent_um):
        edges += [(-(count // 2) - 0.5) / extent_um, (count - count // 2 - 0.5) / extent_um]
    # Magnitudes of 0 become −∞, below the colour scale.
    with np.errstate(divide="ignore"):
        decades = np.log10(magnitudes / magnitudes.max())
    image = axes.imshow(
        decades, cmap="magma", origin="lower", extent=edges, vmin=-DECADES, vmax=0, interpolation="nearest"
    )
    x_reach, y_reach = min(REACH_PER_UM, edges[1]), min(REACH_PER_UM, edges[3])
    axes.set(title=title, xlabel="cycles per µm along x", ylabel="along y")
    axes.set(xlim=(-x_reach, x_reach), ylim=(-y_reach, y_reach))
    plt.colorbar(image, ax=axes, label="decades below the largest", shrink=0.8)


def _heights_alone(skin: dict) -> dict:
    """The parameters that define the heights, without those of orientation and coherence."""
    return {name: value for name, value in skin.items() if name not in ("rotation", "coherence_length", "tiling")}
