"""The spacing of a grating from its peak angles by `sunbeam evaluate`, and pictures of the response."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

from mitsuba_scenes.tool import sunbeam

THETA_I_DEG = 75
# Step between wavelengths. Chosen; Single 2014 gives none.
WAVELENGTH_STEP_NM = 1
# Step between angles of view. Chosen; Single 2014 gives none.
ANGLE_STEP_DEG = 0.01
# Step between wavelengths for scans, whose direct sum is slow.
SCAN_WAVELENGTH_STEP_NM = 5
# Step between angles for scans, whose peaks are some degrees wide.
SCAN_ANGLE_STEP_DEG = 0.1
# Cells of a picture along wavelength and angle; each shows its largest value, which keeps narrow lines visible.
CELLS = (200, 250)


@dataclass(frozen=True)
class Relief:
    """A surface as arguments of the command, and the range of angles of view in degrees for its peaks."""

    name: str
    words: tuple
    angles_deg: tuple[float, float]
    # The spacing in nm by construction, if known.
    exact_nm: float | None = None
    # The search range of a scan's spacing in nm.
    between_nm: tuple[float, float] | None = None


@dataclass(frozen=True)
class Found:
    """The report of `sunbeam evaluate`, and its response [wavelength, angle] in 1/sr."""

    report: dict
    response: np.ndarray

    @property
    def spacings_nm(self) -> np.ndarray:
        """The spacing in nm at each wavelength."""
        sines = np.sin(np.radians(THETA_I_DEG)) + np.sin(np.radians(self.report["peaks_deg"]))
        return np.asarray(self.report["wavelengths_nm"]) / sines

    def between(self, least_nm: float, greatest_nm: float) -> Found:
        """A copy with peaks between two spacings alone, which excludes side lobes of order 0."""
        nm = np.asarray(self.report["wavelengths_nm"])
        angles_deg = self.report["angles_deg"][0] + self.report["angle_step_deg"] * np.arange(self.response.shape[1])
        spacings = nm[:, None] / (np.sin(np.radians(THETA_I_DEG)) + np.sin(np.radians(angles_deg)))
        inside = (spacings >= least_nm) & (spacings <= greatest_nm)
        peaks = np.argmax(np.where(inside, self.response, -1), axis=1)
        means = spacings[np.arange(len(nm)), peaks]
        found = {"mean_nm": means.mean(), "variance_nm2": means.var(), "peaks_deg": angles_deg[peaks]}
        return Found({**self.report, **{name: value.tolist() for name, value in found.items()}}, self.response)

    def row(self) -> dict:
        """Mean and variance of the spacing in nm and nm²."""
        return {name: self.report[name] for name in ("mean_nm", "variance_nm2")}


def evaluate(relief: Relief, *method: str | float, steps=(WAVELENGTH_STEP_NM, ANGLE_STEP_DEG)) -> Found:
    """Evaluates a method, given by the command's arguments for it."""
    low, high = relief.angles_deg
    words = ["evaluate", "--theta-i", THETA_I_DEG, f"--angles={low},{high}", *relief.words, *method]
    words += ["--wavelength-step", steps[0], "--angle-step", steps[1]]
    with TemporaryDirectory() as scratch:
        npy = Path(scratch) / "response.npy"
        return Found(json.loads(sunbeam(*words, "--response", npy)), np.load(npy))


def evaluate_scan(relief: Relief) -> Found:
    """Evaluates the direct sum on a scan that does not repeat, with one window in its middle."""
    words = ("--method", "exact", "--model", "patch", "--tiling", "aperiodic", "--no-cache")
    found = evaluate(relief, *words, steps=(SCAN_WAVELENGTH_STEP_NM, SCAN_ANGLE_STEP_DEG))
    return found.between(*relief.between_nm) if relief.between_nm else found


def rounding_nm2(found: Found) -> float:
    """Variance in nm² of the spacing by rounding of angles to their grid alone."""
    theta_i, theta_r = np.radians(THETA_I_DEG), np.radians(found.report["peaks_deg"])
    slope = found.report["wavelengths_nm"] * np.cos(theta_r) / (np.sin(theta_i) + np.sin(theta_r)) ** 2
    return float(np.mean(slope**2) * np.radians(found.report["angle_step_deg"]) ** 2 / 12)


def largest_in_cells(response: np.ndarray, cells: tuple[int, int]) -> np.ndarray:
    """The largest value in each of at most `cells` cells along both axes."""
    for axis, count in enumerate(cells):
        starts = np.unique(np.linspace(0, response.shape[axis], count, endpoint=False).astype(int))
        response = np.maximum.reduceat(response, starts, axis=axis)
    return response


def draw_panel(ax, title: str, relief: Relief, found: Found) -> None:
    """Draws a response as in Single 2014: green low, yellow high, peaks red, the grating equation blue.

    The square root of the response, relative to its largest value, makes weak ridges visible.
    """
    nm, (low, high) = np.asarray(found.report["wavelengths_nm"]), found.report["angles_deg"]
    shown = np.sqrt(largest_in_cells(found.response / found.response.max(), CELLS))
    step = nm[1] - nm[0]
    extent = (nm[0], nm[-1] + step, low, high)
    ax.imshow(shown.T, origin="lower", aspect="auto", extent=extent, cmap="summer", vmin=0, vmax=1)
    ax.plot(nm, found.report["peaks_deg"], color="red", linewidth=1.2, label="peaks")
    spacing_nm = relief.exact_nm or found.report["mean_nm"]
    sines = nm / spacing_nm - np.sin(np.radians(THETA_I_DEG))
    label = f"grating equation, {spacing_nm:.0f} nm"
    ax.plot(nm, np.degrees(np.arcsin(sines)), color="blue", linewidth=0.9, linestyle=(0, (5, 4)), label=label)
    ax.set_title(title, fontsize="medium")
    ax.set_ylim(low, high)
    ax.legend(fontsize="x-small", loc="upper left", framealpha=0.8)


def draw(path: Path, panels: list[list[tuple[str, Relief, Found] | None]]) -> None:
    """Draws rows of panels; `None` leaves a panel empty."""
    rows, columns = len(panels), len(panels[0])
    figure = Figure(figsize=(3.9 * columns, 3.3 * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    for ax, panel in zip(axes.flat, (panel for row in panels for panel in row)):
        if panel is None:
            ax.set_axis_off()
            continue
        draw_panel(ax, *panel)
        ax.set_xlabel("wavelength / nm")
        ax.set_ylabel("viewing angle / degrees")
    figure.savefig(path, dpi=80)
