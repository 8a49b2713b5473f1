"""Finds a grating's spacing from the peak angles that `sunbeam evaluate` reports, and draws the response.

- λ: the wavelength.
- θi, θr: the angles of incidence and of view with the normal, positive on the side of the light.
- Response: S/λ² in 1/sr, with the relief's power spectrum S in µm² (docs/model.md). It is the reflectance without the
  Fresnel and obliquity factors.
- Peak angle of a wavelength: the θr of the largest response.
- Spacing: λ/(sin θi + sin θr) at the peak angle, by the grating equation of order 1.
- Single 2014: a thesis by M. Single (docs/model.md#sources), whose figures are repeated.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

from mitsuba_scenes.tool import sunbeam

# Angle of incidence of all evaluations, that of Single 2014.
THETA_I_DEG = 75
# Step between wavelengths, which Single 2014 does not give. A finer one averages the spacing over more wavelengths.
WAVELENGTH_STEP_NM = 1
# Step between angles of view, which Single 2014 does not give. Rounding the peak angle to this step adds a variance to
# the spacing that grows as step² (`rounding_nm2`). A finer step takes longer.
ANGLE_STEP_DEG = 0.01
# Step between wavelengths for scans, whose direct sum is slow.
SCAN_WAVELENGTH_STEP_NM = 5
# Step between angles of view for scans, whose peaks are some degrees wide.
SCAN_ANGLE_STEP_DEG = 0.1
# Largest numbers of cells of a picture along wavelength and angle of view. A cell is a block of the response that is
# drawn as its largest value, which keeps narrow lines visible.
CELLS = (200, 250)


@dataclass(frozen=True)
class Relief:
    """A surface: its name, the arguments of `sunbeam` that select it, and the searched range of angles of view."""

    name: str
    arguments: tuple
    angles_deg: tuple[float, float]
    # The spacing by construction; `None` if it is not known.
    exact_nm: float | None = None
    # The searched range of spacings; `None` searches all. `evaluate_scan` obeys it, `evaluate` does not.
    between_nm: tuple[float, float] | None = None


@dataclass(frozen=True)
class Evaluation:
    """The report of `sunbeam evaluate`, and the response, an array (wavelengths, angles of view).

    - `wavelengths_nm`, `peaks_deg`: the wavelengths in equal steps, and the peak angle of each.
    - `mean_nm`, `variance_nm2`: mean and variance of the spacing over the wavelengths.
    - `angles_deg`, `angle_step_deg`: the range of the angles of view, without its end, and their step.
    """

    report: dict
    response: np.ndarray

    @property
    def spacings_nm(self) -> np.ndarray:
        """The spacing at each wavelength."""
        return spacing_nm(np.asarray(self.report["wavelengths_nm"]), np.asarray(self.report["peaks_deg"]))

    def within(self, low_nm: float, high_nm: float) -> Evaluation:
        """A copy whose peaks are searched among spacings from `low_nm` to `high_nm` alone.

        Such a range excludes side lobes of order 0. Raises ValueError if no angle of view has such a spacing at some
        wavelength.
        """
        nm = np.asarray(self.report["wavelengths_nm"])
        angles_deg = self.report["angles_deg"][0] + self.report["angle_step_deg"] * np.arange(self.response.shape[1])
        spacings_nm = spacing_nm(nm[:, None], angles_deg)
        inside = (spacings_nm >= low_nm) & (spacings_nm <= high_nm)
        if not inside.any(axis=1).all():
            raise ValueError(f"no angle of view has a spacing of {low_nm} to {high_nm} nm at some wavelength")
        # Responses are not negative, so angles with the response −1 are never the largest.
        peaks = np.argmax(np.where(inside, self.response, -1), axis=1)
        at_peaks = spacings_nm[np.arange(len(nm)), peaks]
        found = {"mean_nm": at_peaks.mean(), "variance_nm2": at_peaks.var(), "peaks_deg": angles_deg[peaks]}
        return Evaluation({**self.report, **{name: value.tolist() for name, value in found.items()}}, self.response)

    def row(self) -> dict:
        """Mean and variance of the spacing over the wavelengths, in nm and nm²."""
        return {name: self.report[name] for name in ("mean_nm", "variance_nm2")}


def spacing_nm(wavelength_nm: np.ndarray, theta_r_deg: np.ndarray) -> np.ndarray:
    """The spacing λ/(sin θi + sin θr) for θr above −θi; arguments broadcast."""
    return wavelength_nm / (np.sin(np.radians(THETA_I_DEG)) + np.sin(np.radians(theta_r_deg)))


def evaluate(
    relief: Relief,
    *method: str | float,
    wavelength_step_nm: float = WAVELENGTH_STEP_NM,
    angle_step_deg: float = ANGLE_STEP_DEG,
) -> Evaluation:
    """Evaluates a surface by a method; `method` are the arguments of `sunbeam evaluate` that select the method."""
    low, high = relief.angles_deg
    arguments = ["evaluate", "--theta-i", THETA_I_DEG, f"--angles={low},{high}", *relief.arguments, *method]
    arguments += ["--wavelength-step", wavelength_step_nm, "--angle-step", angle_step_deg]
    with TemporaryDirectory() as scratch:
        npy = Path(scratch) / "response.npy"
        return Evaluation(json.loads(sunbeam(*arguments, "--response", npy)), np.load(npy))


def evaluate_scan(relief: Relief) -> Evaluation:
    """Evaluates a scan that does not repeat, by the direct sum with one coherence window in its middle."""
    # Each scan or part of one is evaluated once, so the cache would only grow.
    arguments = ("--method", "exact", "--model", "patch", "--tiling", "aperiodic", "--no-cache")
    found = evaluate(relief, *arguments, wavelength_step_nm=SCAN_WAVELENGTH_STEP_NM, angle_step_deg=SCAN_ANGLE_STEP_DEG)
    return found.within(*relief.between_nm) if relief.between_nm else found


def rounding_nm2(found: Evaluation) -> float:
    """Variance in nm² of the spacing that rounding the peak angles to the grid of angles of view alone causes.

    Rounding errors are uniform over a step, with a variance of step²/12.
    """
    theta_i, theta_r = np.radians(THETA_I_DEG), np.radians(found.report["peaks_deg"])
    # Derivative of the spacing by θr, without its sign.
    slope = np.asarray(found.report["wavelengths_nm"]) * np.cos(theta_r) / (np.sin(theta_i) + np.sin(theta_r)) ** 2
    return float(np.mean(slope**2) * np.radians(found.report["angle_step_deg"]) ** 2 / 12)


def largest_in_cells(response: np.ndarray, cells: tuple[int, int]) -> np.ndarray:
    """The largest value in each cell of a grid with at most `cells` cells along the axes.

    Cells along an axis differ by at most one element of the response in size; pictures draw them equally wide.
    """
    for axis, count in enumerate(cells):
        starts = np.unique(np.linspace(0, response.shape[axis], count, endpoint=False).astype(int))
        response = np.maximum.reduceat(response, starts, axis=axis)
    return response


def draw_panel(ax, title: str, relief: Relief, found: Evaluation) -> None:
    """Draws a response as in Single 2014: green low, yellow high, peaks red, the grating equation blue.

    The square root of the response, relative to its largest value, makes weak ridges visible. The grating equation is
    that of the spacing by construction, or else of the mean spacing.
    """
    nm, (low, high) = np.asarray(found.report["wavelengths_nm"]), found.report["angles_deg"]
    shown = np.sqrt(largest_in_cells(found.response / found.response.max(), CELLS))
    # A value is drawn from its wavelength to the next one, and from its angle of view to the next one. The range of
    # angles has a step beyond the last one already.
    step = nm[1] - nm[0]
    extent = (nm[0], nm[-1] + step, low, high)
    ax.imshow(shown.T, origin="lower", aspect="auto", extent=extent, cmap="summer", vmin=0, vmax=1)
    ax.plot(nm, found.report["peaks_deg"], color="red", linewidth=1.2, label="peaks")
    expected_nm = relief.exact_nm or found.report["mean_nm"]
    # sin θr by the grating equation, within ±1 for spacings longer than the wavelengths.
    sines = nm / expected_nm - np.sin(np.radians(THETA_I_DEG))
    label = f"grating equation, {expected_nm:.0f} nm"
    ax.plot(nm, np.degrees(np.arcsin(sines)), color="blue", linewidth=0.9, linestyle=(0, (5, 4)), label=label)
    ax.set_title(title, fontsize="medium")
    ax.set_ylim(low, high)
    ax.legend(fontsize="x-small", loc="upper left", framealpha=0.8)


def draw(path: Path, panels: list[list[tuple[str, Relief, Evaluation] | None]]) -> None:
    """Draws rows of equally many panels (title, relief, evaluation) into the file `path`; `None` leaves one empty."""
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
