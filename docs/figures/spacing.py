"""The spacing of a grating from the angles at which its colours are brightest, and pictures of the response."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

from mitsuba_scenes.tool import sunbeam

THETA_I_DEG = 75
# Free parameters: Single 2014's text gives no steps.
WAVELENGTH_STEP_NM, ANGLE_STEP_DEG = 1, 0.01
# A scan of 6.5 um has peaks of some degrees, and the direct sum takes long.
SCAN_WAVELENGTH_STEP_NM, SCAN_ANGLE_STEP_DEG = 5, 0.1
# Cells of a picture along wavelength and angle; each shows the largest value in it, so that narrow lines stay.
CELLS = (200, 250)


@dataclass(frozen=True)
class Relief:
    """A surface as words of the tool, and the angles of view in degrees among which its peaks are looked for."""

    name: str
    words: tuple
    angles_deg: tuple[float, float]
    # The spacing in nm that is known by construction, where there is one.
    exact_nm: float | None = None
    # The spacings in nm among which a scan's is looked for.
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
        """The same with the peaks looked for between two spacings, which leaves out the side lobes of order zero."""
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
    """What a method finds; `method` are the words of the tool that choose it."""
    low, high = relief.angles_deg
    words = ["evaluate", "--theta-i", THETA_I_DEG, f"--angles={low},{high}", *relief.words, *method]
    words += ["--wavelength-step", steps[0], "--angle-step", steps[1]]
    with TemporaryDirectory() as scratch:
        npy = Path(scratch) / "response.npy"
        return Found(json.loads(sunbeam(*words, "--response", npy)), np.load(npy))


def evaluate_scan(relief: Relief) -> Found:
    """What the direct sum finds of a scan that does not repeat: one window, in the middle of the scan."""
    words = ("--method", "exact", "--model", "patch", "--tiling", "aperiodic", "--no-cache")
    found = evaluate(relief, *words, steps=(SCAN_WAVELENGTH_STEP_NM, SCAN_ANGLE_STEP_DEG))
    return found.between(*relief.between_nm) if relief.between_nm else found


def rounding_nm2(found: Found) -> float:
    """The variance in nm² of the spacing that the rounding of angles to their grid makes by itself."""
    theta_i, theta_r = np.radians(THETA_I_DEG), np.radians(found.report["peaks_deg"])
    slope = found.report["wavelengths_nm"] * np.cos(theta_r) / (np.sin(theta_i) + np.sin(theta_r)) ** 2
    return float(np.mean(slope**2) * np.radians(found.report["angle_step_deg"]) ** 2 / 12)


def largest_in_cells(response: np.ndarray, cells: tuple[int, int]) -> np.ndarray:
    """The largest value in each of at most so many cells along both axes."""
    for axis, count in enumerate(cells):
        starts = np.unique(np.linspace(0, response.shape[axis], count, endpoint=False).astype(int))
        response = np.maximum.reduceat(response, starts, axis=axis)
    return response


def draw_panel(ax, title: str, relief: Relief, found: Found) -> None:
    """One response as Single 2014 draws it: green low, yellow high, the peaks red, the grating equation blue.

    Shown is the square root of the response, relative to its largest value: the root brings up the weak ridges.
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
    """Rows of panels, a place left empty where there is none."""
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
