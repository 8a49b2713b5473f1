"""Pictures of a height field and of the terms of its phase screen's Taylor expansion, with axes."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from mitsuba_scenes.crosscheck.realtime import surface_words
from mitsuba_scenes.tool import sunbeam

# Largest shown spatial frequency in cycles per µm: 2/λ at 380 nm.
REACH_PER_UM = 5.3
# Range of a term's grey scale in powers of ten.
DECADES = 5
# Side in µm of the part shown of larger fields, the extent of the scans.
CUT_UM = 6.5


@dataclass(frozen=True)
class Relief:
    """Heights in µm, rows upwards, and the extent of the field in µm along x and y."""

    heights_um: np.ndarray
    extent_um: tuple[float, float]


def relief(skin: dict) -> Relief:
    """The heights of a surface as methods read them: levelled, not turned."""
    with TemporaryDirectory() as folder:
        npy = Path(folder) / "heights.npy"
        report = json.loads(sunbeam("height-field", "-o", npy, *surface_words(_unturned(skin))))
        return Relief(np.load(npy), tuple(report["extent_um"]))


def term(skin: dict, n: int) -> np.ndarray:
    """|DFT((h/H)ⁿ)| of a surface, rows upwards, order 0 at half the sides."""
    with TemporaryDirectory() as folder:
        npy = Path(folder) / "term.npy"
        sunbeam("height-field", "--term", n, "-o", npy, *surface_words(_unturned(skin)))
        return np.load(npy)


def show_relief(axes: plt.Axes, shown: Relief, title: str) -> None:
    """Draws (a part of) the heights in grey, with axes in µm."""
    rows, columns = shown.heights_um.shape
    width_um, height_um = (min(extent, CUT_UM) for extent in shown.extent_um)
    part = shown.heights_um[: round(rows * height_um / shown.extent_um[1]), :][
        :, : round(columns * width_um / shown.extent_um[0])
    ]
    part = part - part.min()
    image = axes.imshow(part, cmap="gray", origin="lower", extent=(0, width_um, 0, height_um))
    axes.set(title=title, xlabel="x (µm)", ylabel="y (µm)")
    plt.colorbar(image, ax=axes, label="height (µm)", shrink=0.8)


def show_term(axes: plt.Axes, skin: dict, n: int, title: str) -> None:
    """Draws the logarithm of a term over the frequencies up to REACH_PER_UM."""
    magnitudes = term(skin, n)
    extent_um = relief(skin).extent_um
    # Order j lies at j/extent; a pixel is centred on its order.
    edges = []
    for count, length_um in zip(magnitudes.shape[::-1], extent_um):
        edges += [(-(count // 2) - 0.5) / length_um, (count - count // 2 - 0.5) / length_um]
    with np.errstate(divide="ignore"):
        decades = np.log10(magnitudes / magnitudes.max())
    image = axes.imshow(
        decades, cmap="magma", origin="lower", extent=edges, vmin=-DECADES, vmax=0, interpolation="nearest"
    )
    reach = [min(REACH_PER_UM, edges[1]), min(REACH_PER_UM, edges[3])]
    axes.set(title=title, xlabel="cycles per µm along x", ylabel="along y")
    axes.set(xlim=(-reach[0], reach[0]), ylim=(-reach[1], reach[1]))
    plt.colorbar(image, ax=axes, label="decades below the largest", shrink=0.8)


def _unturned(skin: dict) -> dict:
    """The parameters of the heights alone, without rotation and optics."""
    return {name: value for name, value in skin.items() if name not in ("rotation", "coherence_length", "tiling")}
