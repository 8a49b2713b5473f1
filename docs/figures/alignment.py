"""Alignment of a surface's structures: lines of constant phase of its dominant period, and their deviation."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from mitsuba_scenes.crosscheck.realtime import surface_words
from mitsuba_scenes.tool import sunbeam

# Edge of a cut-out, that of the scans.
EDGE_UM = 6.5
# Standard deviation of the phase's averaging window, in periods.
WINDOW_PERIODS = 0.5
SCALE_UM = 1.0
# A black outline keeps white drawing visible on white.
OUTLINE = [withStroke(linewidth=3, foreground="black")]


@dataclass(frozen=True)
class CutOut:
    """Heights in µm, (rows, columns) with y = 0 first, and the phase of their waves along `axis`."""

    heights: np.ndarray
    pixel_um: float
    axis: str
    period_um: float
    # Shift in µm of the waves against the best-fitting plane wave, at each pixel.
    ahead_um: np.ndarray

    @property
    def wander_um(self) -> float:
        """Rms distance of lines of constant phase from straight ones, at least a period from the edges."""
        return float(np.sqrt(np.mean(self.ahead_um[inside(self.period_um, self.pixel_um)] ** 2)))


def cut_out(skin: dict, axis: str) -> CutOut:
    """The corner of a surface with the parameters `skin`, and the phase of its dominant period along `axis`."""
    with TemporaryDirectory() as scratch:
        npy = Path(scratch) / "heights.npy"
        words = surface_words({name: value for name, value in skin.items() if name != "rotation"})
        words += [] if "filename" in skin else ["--crop", f"0,0,{EDGE_UM},{EDGE_UM}", "--tiling", "aperiodic"]
        made = json.loads(sunbeam("height-field", *words, "-o", npy))
        heights = np.load(npy)
    period_um, pixel_um = made["periods"][axis]["period_um"], made["pixel_um"][0]
    return CutOut(heights, pixel_um, axis, period_um, ahead_um(heights, pixel_um, axis, period_um))


def ahead_um(heights: np.ndarray, pixel_um: float, axis: str, period_um: float) -> np.ndarray:
    """Shift in µm of the waves of this period along `axis` against the best-fitting plane wave.

    The phase is that of the heights times exp(−2πi x/period), averaged under a Gaussian; the plane that fits it best a
    period from the edges is subtracted.
    """
    across = heights if axis == "x" else heights.T
    x = np.arange(across.shape[1]) * pixel_um
    turned = (across - across.mean()) * np.exp(-2j * np.pi * x / period_um)
    deviation = WINDOW_PERIODS * period_um / pixel_um
    smooth = blurred(blurred(turned, deviation).T, deviation).T
    phase = np.unwrap(np.unwrap(np.angle(smooth), axis=0), axis=1)
    place = np.stack([np.ones(phase.shape), *np.indices(phase.shape)], axis=-1)
    fitted = inside(period_um, pixel_um)
    plane, *_ = np.linalg.lstsq(place[fitted].reshape(-1, 3), phase[fitted].ravel(), rcond=None)
    # h(x − s) has a phase smaller by 2πs/period.
    ahead = -(phase - place @ plane) * period_um / (2 * np.pi)
    return ahead if axis == "x" else ahead.T


def inside(period_um: float, pixel_um: float) -> tuple[slice, slice]:
    """Rows and columns at least a period from the edges, where the window is complete to two standard deviations."""
    edge = round(period_um / pixel_um)
    return slice(edge, -edge), slice(edge, -edge)


def blurred(values: np.ndarray, deviation: float) -> np.ndarray:
    """Averages along the last axis under a Gaussian with this standard deviation in pixels, truncated at the edges."""
    distance = np.subtract.outer(np.arange(values.shape[-1]), np.arange(values.shape[-1]))
    weights = np.exp(-0.5 * (distance / deviation) ** 2)
    return values @ (weights / weights.sum(axis=0))


def draw(cut_outs: dict[str, CutOut], file: Path) -> None:
    """Writes the cut-outs side by side, with red lines of constant phase and a scale bar."""
    figure = Figure(figsize=(2.6 * len(cut_outs), 2.9), layout="constrained")
    for axes, (title, cut) in zip(np.atleast_1d(figure.subplots(1, len(cut_outs))), cut_outs.items()):
        rows, columns = cut.heights.shape
        extent = (0, columns * cut.pixel_um, 0, rows * cut.pixel_um)
        axes.imshow(cut.heights, origin="lower", extent=extent, cmap="gray")
        along = (np.arange(rows if cut.axis == "x" else columns) + 0.5) * cut.pixel_um
        for place, ahead in lines(cut):
            axes.plot(
                *((place + ahead, along) if cut.axis == "x" else (along, place + ahead)), color="red", linewidth=1.4
            )
        axes.plot([0.3, 0.3 + SCALE_UM], [0.3, 0.3], color="white", linewidth=2, path_effects=OUTLINE)
        middle = 0.3 + 0.5 * SCALE_UM
        axes.text(middle, 0.45, f"{SCALE_UM:g} µm", color="white", ha="center", fontsize=8, path_effects=OUTLINE)
        axes.set(title=title, xlim=extent[:2], ylim=extent[2:], xticks=[], yticks=[])
        axes.title.set_fontsize(9)
    figure.savefig(file, dpi=110)


def lines(cut: CutOut) -> list[tuple[float, np.ndarray]]:
    """Two lines of constant phase, a period apart: mean position and shift along the line, in µm."""
    ahead = cut.ahead_um if cut.axis == "x" else cut.ahead_um.T
    found = []
    for place in (0.5 * EDGE_UM - 0.5 * cut.period_um, 0.5 * EDGE_UM + 0.5 * cut.period_um):
        found.append((place, ahead[:, round(place / cut.pixel_um)]))
    return found
