"""Figures 1.4 and 1.5 of Single 2014, computed: what is seen behind N slits, and its intensity."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from .slits_intensity import (
    MIDDLE_NM,
    Slits,
    colour_of_line,
    colour_weights,
    relative_intensity,
    sine_of,
    white_light,
)

# Slits of figure 1.5. Figure 1.4 has one and seven; both are shown here with more beside them.
THEIRS_PLOTTED = (1, 2, 3)
COUNTS = (1, 2, 3, 5, 7, 10, 50)
DISTANCE_MM = 500.0
# Figure 1.5 gives its wavelength, figure 1.4 none.
PLOTTED_NM, COLOURED_NM = 500.0, MIDDLE_NM
# Half of what is seen of the screen: three orders of the line, and the three maxima of the single slit of figure 1.5.
COLOURED_MM, WIDE_MM, CLOSE_MM = 6.5, 30.0, 2.0
# Columns of a picture, and places averaged over in each: the peaks of 50 slits are three columns wide.
COLUMNS, PER_COLUMN = 1300, 4
# Text as outlines, and the same file from the same figure.
SVG = {"svg.fonttype": "path", "svg.hashsalt": "sunbeam"}


def save_svg(figure: Figure, path: Path) -> None:
    """Writes the figure so that it is the same file each time, and looks alike wherever it is shown."""
    with matplotlib.rc_context(SVG):
        figure.savefig(path, metadata={"Date": None})


def srgb(linear: np.ndarray) -> np.ndarray:
    """Linear sRGB encoded for the screen, clipped to 0 … 1."""
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def columns_mm(half_width_mm: float) -> np.ndarray:
    """Places on the screen in mm over which the columns of a picture are averaged, (COLUMNS, PER_COLUMN)."""
    count = COLUMNS * PER_COLUMN
    return (((np.arange(count) + 0.5) / count * 2 - 1) * half_width_mm).reshape(COLUMNS, PER_COLUMN)


def coloured(path: Path) -> list[float]:
    """Draws the patterns in a line of light (above) and in white light (below). Returns the colour of white light's
    centre in linear sRGB."""
    weights = colour_weights()
    sine = sine_of(columns_mm(COLOURED_MM), DISTANCE_MM)
    line = colour_of_line(COLOURED_NM, weights)
    centre = white_light(Slits(1), [0.0], weights)[0]
    figure = Figure(figsize=(10, 8.4), layout="constrained")
    panels = figure.subplots(len(COUNTS), 1, sharex=True)
    for ax, count in zip(panels, COUNTS):
        slits = Slits(count)
        one = relative_intensity(slits, sine, COLOURED_NM).mean(axis=1)[:, None] * line
        # One column's places at a time would be slow, all of them at once large.
        white = np.mean([white_light(slits, places, weights) for places in sine.T], axis=0) / centre.max()
        rows = srgb(np.stack([one, white]))
        for strip, (low, high) in zip(rows, ((0.04, 1), (-1, -0.04))):
            ax.imshow(
                strip[None], extent=(-COLOURED_MM, COLOURED_MM, low, high), aspect="auto", interpolation="nearest"
            )
        ax.set(facecolor="black", ylim=(-1, 1), yticks=[])
        ax.set_ylabel(f"N = {count}", rotation=0, ha="right", va="center", fontsize=11)
    panels[-1].set_xlabel(f"place on the screen / mm, {DISTANCE_MM:g} mm away")
    figure.savefig(path, dpi=150, metadata={"Software": None})
    return [float(value) for value in centre]


def plotted(path: Path) -> None:
    """Draws relative intensity against the place: three counts over a wide range, all of them about order 0."""
    figure = Figure(figsize=(11, 7.2), layout="constrained")
    wide, close = figure.subplots(2, 1)
    colours = ("0.4", "tab:blue", "tab:green", "tab:olive", "tab:orange", "tab:red", "black")
    styles = {count: {"color": colour, "lw": 1.1} for count, colour in zip(COUNTS, colours)}
    styles[1]["ls"] = "--"
    for ax, counts, half_mm, places in (
        (wide, THEIRS_PLOTTED, WIDE_MM, 2401),
        (close, COUNTS, CLOSE_MM, 2001),
    ):
        x_mm = np.linspace(-half_mm, half_mm, places)
        for count in counts:
            seen = relative_intensity(Slits(count), sine_of(x_mm, DISTANCE_MM), PLOTTED_NM)
            ax.plot(x_mm, seen, label=f"N = {count}", **styles[count])
        ax.set(xlim=(-half_mm, half_mm), ylim=(0, 1.03), ylabel="relative intensity")
        ax.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    wide.xaxis.set_major_locator(MultipleLocator(5))
    close.set_xlabel(f"place on the screen / mm, {DISTANCE_MM:g} mm away")
    save_svg(figure, path)
