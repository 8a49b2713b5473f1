"""Table 1.1 of Single 2014: the spacing of a grating, found from the angles at which its colours are brightest."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

from ..tool import sunbeam
from .page import images

PAGE = "periodicity"
METHODS = ("flss", "nmm", "pq")
THETA_I_DEG = 75
# Single 2014's grids: first, last and step; and the step between angles.
WAVELENGTHS_NM, ANGLE_STEP_DEG = (380, 780, 1), 0.01
# Of the blazed tile, which is one period; 26 of them are 65 um.
REPEATS = (2, 3, 5, 10, 26)


@dataclass(frozen=True)
class Grating:
    """A surface, the angles that Single 2014 searched in degrees, their mean and variance in nm and nm² by method."""

    preset: str
    angles_deg: tuple[float, float]
    theirs: dict[str, tuple[float, float]]


GRATINGS = (
    Grating("blazed", (-55, -40), {"flss": (2499.997, 0.377), "nmm": (2499.997, 0.377), "pq": (2491.861, 248.044)}),
    Grating("elaphe", (-40, -15), {"flss": (1144.262, 0.401), "nmm": (1144.179, 0.677), "pq": (1052.308, 49.678)}),
    Grating("xenopeltis", (-50, -25), {"flss": (1552.27, 0.45)}),
)


def figures() -> dict:
    """Mean and variance of the spacing by grating and method, and a plot of each response."""
    folder = images(PAGE)
    rows = []
    for grating in GRATINGS:
        drawn = Figure(figsize=(11, 3.4), layout="constrained")
        axes = drawn.subplots(1, len(METHODS), sharey=True)
        for method, ax in zip(METHODS, axes):
            with TemporaryDirectory() as scratch:
                npy = Path(scratch) / "response.npy"
                found = evaluate(grating, method, response=npy)
                plot(ax, found, np.load(npy))
            theirs = grating.theirs.get(method)
            rows.append(
                {
                    "grating": grating.preset,
                    "method": method,
                    "angles_deg": grating.angles_deg,
                    "period_nm": found["period_nm"],
                    "mean_nm": found["mean_nm"],
                    "variance_nm2": found["variance_nm2"],
                    "rounding_nm2": rounding(found),
                    "theirs": {"mean_nm": theirs[0], "variance_nm2": theirs[1]} if theirs else None,
                }
            )
            print(f"{grating.preset} {method}: {found['mean_nm']:.2f} nm", flush=True)
        axes[0].set_ylabel("angle of view / degrees")
        drawn.savefig(folder / f"{grating.preset}.png", dpi=90)
    sweep = repeats()
    theirs = np.log(GRATINGS[0].theirs["pq"][1])
    nearest = min(sweep, key=lambda row: abs(np.log(row["variance_nm2"]) - theirs))
    return {
        "theta_i_deg": THETA_I_DEG,
        "wavelengths_nm": WAVELENGTHS_NM,
        "angle_step_deg": ANGLE_STEP_DEG,
        "rows": rows,
        "gratings": [grating.preset for grating in GRATINGS],
        "repeats": sweep,
        "nearest_repeats": nearest["repeats"],
    }


def evaluate(grating: Grating, method: str, **options) -> dict:
    """The report of `sunbeam evaluate` on Single 2014's grid."""
    words = ["evaluate", "--preset", grating.preset, "--method", method, "--theta-i", THETA_I_DEG]
    words += [f"--angles={grating.angles_deg[0]},{grating.angles_deg[1]}", "--angle-step", ANGLE_STEP_DEG]
    words += ["--wavelength-step", WAVELENGTHS_NM[2]]
    for name, value in options.items():
        words += [f"--{name.replace('_', '-')}", value]
    return json.loads(sunbeam(*words))


def plot(ax, found: dict, response: np.ndarray) -> None:
    """The response over wavelength and angle in decibels below its maximum, the peaks, and the grating equation."""
    nm, (low, high) = found["wavelengths_nm"], found["angles_deg"]
    decibels = 10 * np.log10(np.maximum(response / response.max(), 1e-6))
    extent = (nm[0], nm[-1], low, high)
    ax.imshow(decibels.T, origin="lower", aspect="auto", extent=extent, cmap="gray", vmin=-60, vmax=0)
    ax.plot(nm, found["peaks_deg"], color="tab:red", linewidth=2, label="maximum")
    ax.plot(nm, found["grating_deg"], color="white", linewidth=1, linestyle="--", label="grating equation")
    ax.set_title(f"{found['method']}: {found['mean_nm']:.1f} nm")
    ax.set_xlabel("wavelength / nm")
    ax.legend(fontsize="small")


def rounding(found: dict) -> float:
    """The variance in nm² that the rounding of angles to their grid makes by itself."""
    theta_i = np.radians(found["theta_i_deg"])
    theta_r = np.radians(found["peaks_deg"])
    slope = found["wavelengths_nm"] * np.cos(theta_r) / (np.sin(theta_i) + np.sin(theta_r)) ** 2
    return float(np.mean(slope**2) * np.radians(found["angle_step_deg"]) ** 2 / 12)


def repeats() -> list[dict]:
    """PQ on the blazed grating by the repeats of its tile: the fewer, the wider are its peaks."""
    rows = []
    for count in REPEATS:
        found = evaluate(GRATINGS[0], "pq", repeats=f"{count},1")
        rows.append({"repeats": count, "mean_nm": found["mean_nm"], "variance_nm2": found["variance_nm2"]})
    return rows
