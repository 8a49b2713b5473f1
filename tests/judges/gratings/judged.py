"""Writes reference tables for the rigorous solver in Rust: `python -m tests.judges.gratings.judged`.

`perfect.csv` has perfect conductors by `boundary_integral`, for TE and TM light incident perpendicular to the grooves.
`metals.csv` has lamellar gratings of aluminium, silver and gold in conical mounts by SCATMECH
(`requirements-judges.lock`). The powers of its orders for incident s and p are extrapolated from two truncations. Their
uncertainty `unsettled` is the larger difference from the finer truncation.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitsuba_scenes.environment import REPOSITORY

from .boundary_integral import Resolution, solve
from .profile import Sinusoid, blazed, lamellar
from .scatmech import lamellar as metal_lamellar

FOLDER = REPOSITORY / "crates" / "rigorous" / "tests" / "data"
# Rounded indices at 550 nm: Rakić 1998 (Al), Johnson & Christy 1972 (Ag, Au).
METALS = {"Al": 0.96 + 6.69j, "Ag": 0.06 + 3.59j, "Au": 0.42 + 2.35j}
# Lamellar gratings and lights at 550 nm: period and height in µm, angle of incidence and azimuth in degrees. At
# azimuth 0 the plane of incidence is perpendicular to the grooves.
LAMELLAR = [(1.6, 0.12, 40.0, 0.0), (1.6, 0.12, 25.0, 40.0), (0.8, 0.12, 40.0, 90.0), (0.8, 0.2, 60.0, 40.0)]
LAMELLAR += [(0.3, 0.08, 20.0, 0.0), (0.3, 0.08, 55.0, 40.0)]
PROFILES = {"sinusoid": Sinusoid, "blazed": blazed, "lamellar": lamellar}
# Perfect conductors: profile, period and height in µm, wavelength in nm, angle of incidence in degrees.
PERFECT = [
    ("sinusoid", 1.0, 0.3, 550.0, 20.0),
    ("sinusoid", 2.5, 0.25, 450.0, 60.0),
    ("sinusoid", 0.4, 0.15, 650.0, 35.0),
    ("blazed", 2.5, 0.25, 550.0, 30.0),
    ("blazed", 0.9, 0.3, 650.0, 70.0),
    ("lamellar", 1.6, 0.12, 550.0, 40.0),
    ("lamellar", 0.6, 0.2, 450.0, 10.0),
]
# Numbers of SCATMECH's waves to either side. With fewer the error of p in silver does not yet fall as 1/waves.
WAVES = (80, 160)


def write(path: Path, header: str, rows: list[str]) -> None:
    """Writes a file of comma-separated values, and creates its folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")


def perfect() -> list[str]:
    """The rows of `perfect.csv`."""
    rows = []
    for name, period, height, wavelength, theta in PERFECT:
        # Three times the default numbers of nodes and evanescent orders.
        found = solve(PROFILES[name](period, height), wavelength, theta, Resolution().finer(3.0))
        rows += [
            f"{name},{period},{height},{wavelength},{theta},{order},{te:.7f},{tm:.7f}"
            for order, te, tm in zip(found.orders, found.te, found.tm)
        ]
    return rows


def metals() -> list[str]:
    """The rows of `metals.csv`."""
    rows = []
    for metal, index in METALS.items():
        for period, height, theta, azimuth in LAMELLAR:
            coarse, fine = (metal_lamellar(period, height, 550.0, index, theta, azimuth, waves) for waves in WAVES)
            for order in fine:
                # Powers for incident s and p, summed over outgoing states. The error halves from the coarser to the
                # finer truncation, so the limit is as far from the finer as that is from the coarser.
                before, after = (powers[order].sum(axis=0) for powers in (coarse, fine))
                limit = 2 * after - before
                unsettled = np.abs(limit - after).max()
                setting = f"{metal},{index.real},{index.imag},{period},{height},{theta},{azimuth}"
                rows.append(f"{setting},{order},{limit[0]:.6f},{limit[1]:.6f},{unsettled:.6f}")
    return rows


def main() -> None:
    """Writes both files."""
    write(FOLDER / "perfect.csv", "profile,period_um,height_um,wavelength_nm,theta_deg,order,te,tm", perfect())
    header = "metal,eta,k,period_um,height_um,theta_deg,azimuth_deg,order,s,p,unsettled"
    write(FOLDER / "metals.csv", header, metals())


if __name__ == "__main__":
    main()
