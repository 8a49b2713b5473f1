"""Runs the independent Maxwell solver of this folder on skins and stores its powers of orders in `answers/`.

`python -m tests.judges.crossed.judged` writes the files; `cases.py` describes cases and answers.

The files `skins.json` and `convergence.json` need the scans of both skins, and some minutes each. Without scans they
are left as they are, after a line that says so.
"""

from __future__ import annotations

import argparse
import json
import time

import numpy as np

from docs.figures.skin_scans import scans_present

from .cases import ANSWERS, BASE, FEWER_LIGHTS, KERATIN, LIGHTS, SYNTHETIC_LIGHTS, VARIED, Case, answer_row, write
from .crops import cropped, scanned
from .model import Light, misplaced
from .relief import Relief, synthetic
from .solver import Resolution, solve

# Names of the files in `answers/`.
FILES = ("synthetic", "skins", "convergence")
# Resolution at which powers on the smooth synthetic relief have converged to their stored digits: the largest frequency
# of harmonics, and the number of nodes in the layer on either side of the relief (solver.py).
SYNTHETIC = Resolution(cutoff_per_um=10.0, nodes=12)
# Resolution of the answers on skins.
SKINS = Resolution(cutoff_per_um=8.0, nodes=10)
# Finest resolution, and those compared with it: three with fewer harmonics, one with fewer nodes, and SKINS.
FINE = Resolution(cutoff_per_um=11.0, nodes=12)
COARSER = (Resolution(6.0, 12), Resolution(8.0, 12), Resolution(9.5, 12), Resolution(11.0, 10), SKINS)
# Light whose powers converge most slowly with the resolution.
HARD = Light(wavelength_nm=450.0, theta_deg=60.0, phi_deg=90.0)


def judged(relief: Relief, eta: float, lights: list[Light], resolution: Resolution) -> list[dict]:
    """The answers on a relief for each light, in the form of the files."""
    return [
        answer_row(light, solve(relief, light.wavelength_nm, light.theta_deg, light.phi_deg, eta, resolution))
        for light in lights
    ]


def relief_of(case: Case, scans: dict) -> Relief:
    """The relief of a case; `scans` has the results of `scanned` by skin."""
    return cropped(*scans[case.crop.skin], case.crop, case.smoothing).scaled(case.factor)


def skins() -> dict[str, list[dict]]:
    """The answers of all cases by `Case.key`."""
    # BASE has both skins.
    scans = {case.crop.skin: scanned(case.crop.skin) for case in BASE}
    answers = {}
    for case in [*BASE, *VARIED]:
        start = time.perf_counter()
        answers[case.key] = judged(relief_of(case, scans), case.eta, LIGHTS if case in BASE else FEWER_LIGHTS, SKINS)
        print(f"{case.key}: {time.perf_counter() - start:.0f} s", flush=True)
    return answers


def convergence() -> list[dict]:
    """Fractions of power that COARSER put in other orders than FINE (`misplaced`), in the light HARD.

    Cases are crop A of each skin with the default or less smoothing, and the default height and index.
    """
    rows = []
    for case in [*BASE, *VARIED]:
        # Attributes of the class are the defaults.
        is_default = (case.factor, case.eta) == (Case.factor, Case.eta)
        if case.crop.name != "A" or case.smoothing > Case.smoothing or not is_default:
            continue
        relief = relief_of(case, {case.crop.skin: scanned(case.crop.skin)})

        def powers(resolution: Resolution, relief: Relief = relief) -> np.ndarray:
            return solve(relief, HARD.wavelength_nm, HARD.theta_deg, HARD.phi_deg, KERATIN, resolution).unpolarised

        fine = powers(FINE)
        for coarse in COARSER:
            fraction = misplaced(powers(coarse), fine)
            row = {"skin": case.crop.skin, "smoothing": case.smoothing, "cutoff_per_um": coarse.cutoff_per_um}
            rows.append({**row, "nodes": coarse.nodes, "misplaced": float(f"{fraction:.1e}")})
    return rows


def main() -> None:
    """Writes the files that are named on the command line, by default all."""
    parser = argparse.ArgumentParser(prog="python -m tests.judges.crossed.judged", description=__doc__)
    # Without `choices`, since argparse of Python 3.11 compares an empty list with them, too.
    parser.add_argument("what", nargs="*", metavar="FILE", help=f"one of {', '.join(FILES)}; all by default")
    what = parser.parse_args().what or FILES
    if unknown := set(what) - set(FILES):
        parser.error(f"unknown file {', '.join(sorted(unknown))}")
    if "synthetic" in what:
        write("synthetic", {"synthetic": judged(synthetic(), KERATIN, SYNTHETIC_LIGHTS, SYNTHETIC)})
    if "skins" in what and scans_present():
        write("skins", skins())
    if "convergence" in what and scans_present():
        rows = ",\n".join(json.dumps(row) for row in convergence())
        (ANSWERS / "convergence.json").write_text(f"[\n{rows}\n]\n", encoding="utf-8")


if __name__ == "__main__":
    main()
