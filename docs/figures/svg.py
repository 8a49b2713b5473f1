"""Plots as SVG with text instead of outlines; equal numbers give identical files.

The import of this module configures Matplotlib.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

plt.rcParams.update({"svg.fonttype": "none", "font.size": 9, "svg.hashsalt": "sunbeam"})


def save(figure: plt.Figure, path: Path) -> None:
    """Writes a figure to `path`, which ends in .svg, and closes it."""
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
