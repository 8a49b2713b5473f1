"""Maps of one coherent patch by two programs, and their difference."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LogNorm

from .peer_sums import hemisphere

# What is shown of a map: so many decades below its largest value.
DECADES = 4


def draw_maps(theirs: np.ndarray, ours: np.ndarray, size: int, file: Path) -> None:
    """Writes both maps on one logarithmic scale, and theirs minus ours in percent of the largest value."""
    _, lit = hemisphere(size)

    def picture(values: np.ndarray) -> np.ndarray:
        pixels = np.full(lit.shape, np.nan)
        pixels[lit] = values
        return pixels

    largest = float(ours.max())
    apart = 100 * (theirs - ours) / largest
    limit = float(np.abs(apart).max())
    scale = LogNorm(largest * 10.0**-DECADES, largest, clip=True)
    place = {"origin": "lower", "extent": (-1, 1, -1, 1), "interpolation": "nearest"}
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 3.7), sharey=True, layout="constrained")
    for panel, title, values in zip(axes, ("WaveOpticsBrdf", "sunbeam, exact"), (theirs, ours)):
        shown = panel.imshow(picture(values), cmap="magma", norm=scale, **place)
        panel.set_title(title)
    figure.colorbar(shown, ax=axes[:2], label="$f_r$ in 1/sr", shrink=0.85)
    shown = axes[2].imshow(picture(apart), cmap="RdBu_r", vmin=-limit, vmax=limit, **place)
    axes[2].set_title("difference")
    figure.colorbar(shown, ax=axes[2], label="% of the largest $f_r$", shrink=0.85)
    for panel in axes:
        panel.set_xlabel("$\\omega_{o,x}$")
    axes[0].set_ylabel("$\\omega_{o,y}$")
    figure.savefig(file, dpi=90, metadata={"Software": None})
    plt.close(figure)
