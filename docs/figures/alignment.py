"""Straightness of a surface's structures: lines of constant phase of its dominant period, against straight lines.

Symbols: h(x, y) is the relief, and p its dominant period along x. The waves of this period are compared with the plane
wave that fits them best; s(x, y) is their local shift along x from it.

h·exp(−2πi x/p) is averaged under a Gaussian. The phase of the average is −2πs/p plus a linear function of x and y,
which is the phase of the plane wave. For a period along y, x and y are exchanged.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from mitsuba_scenes.crosscheck.realtime import surface_words

from .heights import height_field

# Edge of a cut-out, equal to that of the scans.
EDGE_UM = 6.5
# Standard deviation of the averaging Gaussian in periods. A wider one smooths the lines, a narrower one lets other
# periods through.
WINDOW_PERIODS = 0.5
# Length of the scale bar.
BAR_UM = 1.0
# Distance of the scale bar's left end from the picture's left and lower edges.
BAR_MARGIN_UM = 0.3
# Black outline that keeps the white scale bar visible on white.
OUTLINE = [withStroke(linewidth=3, foreground="black")]


@dataclass(frozen=True)
class CutOut:
    """A square part of a surface, and the shift s of the waves of its dominant period along `axis`, "x" or "y".

    `heights_um` and `shift_um` are (rows, columns) with y = 0 first. Pixels are squares with the edge `pixel_um`.
    """

    heights_um: np.ndarray
    pixel_um: float
    axis: str
    period_um: float
    shift_um: np.ndarray

    @property
    def wander_um(self) -> float:
        """Rms of the shift, the distance of lines of constant phase from straight ones, over the pixels of `inside`."""
        return float(np.sqrt(np.mean(self.shift_um[inside(self.period_um, self.pixel_um)] ** 2)))


def cut_out(surface: dict, axis: str) -> CutOut:
    """The cut-out of a surface, with the waves of its dominant period along `axis`, "x" or "y".

    `surface` has parameters of the plugin `diffraction`. Its rotation is ignored, since axes are those of the relief. A
    scan is used as a whole, a preset is cropped to a square at its origin with the edge EDGE_UM.
    """
    arguments = surface_words({name: value for name, value in surface.items() if name != "rotation"})
    is_scan = "filename" in surface
    if not is_scan:
        arguments += ["--crop", f"0,0,{EDGE_UM},{EDGE_UM}", "--tiling", "aperiodic"]
    heights_um, report = height_field(*arguments)
    period_um, pixel_um = report["periods"][axis]["period_um"], report["pixel_um"][0]
    return CutOut(heights_um, pixel_um, axis, period_um, wave_shift_um(heights_um, pixel_um, axis, period_um))


def wave_shift_um(heights_um: np.ndarray, pixel_um: float, axis: str, period_um: float) -> np.ndarray:
    """Shift s in µm of the waves of this period along `axis`, in the shape of the heights.

    The plane wave is fitted to the pixels at least a period from the edges.
    """
    # Rows and columns are exchanged for a period along y, so that the period is along the array's second axis.
    relief = heights_um if axis == "x" else heights_um.T
    x_um = np.arange(relief.shape[1]) * pixel_um
    # h·exp(−2πi x/p), without the mean height.
    demodulated = (relief - relief.mean()) * np.exp(-2j * np.pi * x_um / period_um)
    deviation = WINDOW_PERIODS * period_um / pixel_um
    smooth = blurred(blurred(demodulated, deviation).T, deviation).T
    phase = np.unwrap(np.unwrap(np.angle(smooth), axis=0), axis=1)
    # The phase of the plane wave, by linear least squares in 1, row and column.
    basis = np.stack([np.ones(phase.shape), *np.indices(phase.shape)], axis=-1)
    fitted = inside(period_um, pixel_um)
    plane, *_ = np.linalg.lstsq(basis[fitted].reshape(-1, 3), phase[fitted].ravel(), rcond=None)
    # The phase is −2πs/p plus the plane wave's phase.
    shift_um = -(phase - basis @ plane) * period_um / (2 * np.pi)
    return shift_um if axis == "x" else shift_um.T


def inside(period_um: float, pixel_um: float) -> tuple[slice, slice]:
    """Rows and columns at least a period from the edges, where the Gaussian is complete to two standard deviations.

    The period is at least a pixel.
    """
    edge = round(period_um / pixel_um)
    return slice(edge, -edge), slice(edge, -edge)


def blurred(values: np.ndarray, deviation: float) -> np.ndarray:
    """Averages along the last axis under a Gaussian with the standard deviation `deviation` in pixels.

    The Gaussian is truncated at the array's edges, and its weights sum to 1.
    """
    distance = np.subtract.outer(np.arange(values.shape[-1]), np.arange(values.shape[-1]))
    weights = np.exp(-0.5 * (distance / deviation) ** 2)
    return values @ (weights / weights.sum(axis=0))


def draw(cut_outs: dict[str, CutOut], file: Path) -> None:
    """Writes the cut-outs side by side under their titles, with red lines of constant phase and a scale bar."""
    figure = Figure(figsize=(2.6 * len(cut_outs), 2.9), layout="constrained")
    for axes, (title, cut) in zip(np.atleast_1d(figure.subplots(1, len(cut_outs))), cut_outs.items()):
        rows, columns = cut.heights_um.shape
        extent = (0, columns * cut.pixel_um, 0, rows * cut.pixel_um)
        axes.imshow(cut.heights_um, origin="lower", extent=extent, cmap="gray")
        for x_um, y_um in constant_phase_lines(cut):
            axes.plot(x_um, y_um, color="red", linewidth=1.4)
        bar_um = [BAR_MARGIN_UM, BAR_MARGIN_UM + BAR_UM]
        axes.plot(bar_um, [BAR_MARGIN_UM, BAR_MARGIN_UM], color="white", linewidth=2, path_effects=OUTLINE)
        # Position of the bar's label, above its middle.
        text_um = (BAR_MARGIN_UM + 0.5 * BAR_UM, 1.5 * BAR_MARGIN_UM)
        axes.text(*text_um, f"{BAR_UM:g} µm", color="white", ha="center", fontsize=8, path_effects=OUTLINE)
        axes.set(title=title, xlim=extent[:2], ylim=extent[2:], xticks=[], yticks=[])
        axes.title.set_fontsize(9)
    figure.savefig(file, dpi=110)


def constant_phase_lines(cut: CutOut) -> list[tuple[np.ndarray, np.ndarray]]:
    """Two lines of constant phase, half a period to either side of the middle of a cut-out with the edge EDGE_UM.

    The tilt of the fitted plane wave is left out: the lines bend about lines perpendicular to `axis`. A line is a pair
    of arrays, x and y in µm, with an entry for each pixel along the line.
    """
    # Rows along the lines and columns along the period.
    shift_um = cut.shift_um if cut.axis == "x" else cut.shift_um.T
    along_um = (np.arange(len(shift_um)) + 0.5) * cut.pixel_um
    lines = []
    for straight_um in (0.5 * EDGE_UM - 0.5 * cut.period_um, 0.5 * EDGE_UM + 0.5 * cut.period_um):
        # The shift at the straight line approximates that at the line itself.
        bent_um = straight_um + shift_um[:, round(straight_um / cut.pixel_um)]
        lines.append((bent_um, along_um) if cut.axis == "x" else (along_um, bent_um))
    return lines
