"""Checks of the rigorous solver of the part `validity`."""

from __future__ import annotations

import numpy as np

from tests.judges.gratings.boundary_integral import Efficiencies, Resolution, solve
from tests.judges.gratings.coupled_waves import lamellar as coupled_waves
from tests.judges.gratings.independent import lamellar_modes, sinusoid_rayleigh
from tests.judges.gratings.profile import Sinusoid, blazed, echelette, lamellar

WAVELENGTHS_NM = (450.0, 650.0)
ANGLES_DEG = (0.0, -60.0, 75.0)
PROFILES = (Sinusoid(2.5, 0.25), Sinusoid(2.5, 0.8), blazed(2.5, 0.25), blazed(2.5, 0.7), lamellar(2.5, 0.25))
# Period and height in µm of lamellar gratings.
LAMELLAR_UM = ((1.25, 0.3), (2.5, 0.125), (2.5, 0.25), (5.0, 0.125))
# Period and height in µm of sinusoids within the convergence of Rayleigh's expansion.
SHALLOW_UM = ((1.25, 0.1), (2.5, 0.14), (2.5, 0.3), (5.0, 0.25))
# Slope of the facets of the echelette in the Littrow check.
LITTROW_SLOPE_DEG = 20.0
# Extinction of the metal and harmonics of the coupled waves, refined together.
METALS = ((100.0, 80), (300.0, 160))
COUPLED_CASES = ((2.5, 0.125, 550.0, 30.0), (1.25, 0.3, 550.0, 60.0))


def lights():
    return [(wavelength, angle) for wavelength in WAVELENGTHS_NM for angle in ANGLES_DEG]


def difference(a: Efficiencies, b: Efficiencies) -> float:
    """Largest difference of an order in either polarisation."""
    return float(max(np.abs(a.te - b.te).max(), np.abs(a.tm - b.tm).max()))


def littrow(order: int) -> Efficiencies:
    """An echelette lit along the normal of its facets, at the wavelength whose −order is retroreflected.

    In TM all light goes into that order (theorem of Maréchal and Stroke, 1959): the standing wave before the facets
    also satisfies the boundary condition on the walls between them.
    """
    profile = echelette(2.5, LITTROW_SLOPE_DEG)
    wavelength_nm = 2e3 * profile.period * np.sin(np.radians(LITTROW_SLOPE_DEG)) / order
    return solve(profile, wavelength_nm, -LITTROW_SLOPE_DEG)


def reciprocity(profile) -> float:
    """Largest difference of an order's power when light returns along it."""
    worst = 0.0
    for wavelength_nm, angle in lights():
        there = solve(profile, wavelength_nm, angle)
        towards = there.orders * wavelength_nm / 1e3 / profile.period - np.sin(np.radians(angle))
        order = int(np.argmax(there.unpolarised * (there.orders != 0)))
        back = solve(profile, wavelength_nm, float(np.degrees(np.arcsin(towards[order]))))
        again = back.orders == there.orders[order]
        worst = max(worst, abs(back.te[again][0] - there.te[order]), abs(back.tm[again][0] - there.tm[order]))
    return float(worst)


def coupled(period: float, height: float, wavelength_nm: float, angle: float, metal: tuple) -> dict:
    """Largest difference of an order from coupled-wave analysis, for TE and TM."""
    own = solve(lamellar(period, height), wavelength_nm, angle)
    te, tm = coupled_waves(period, height, wavelength_nm, angle, *metal)
    at = metal[1] + own.orders
    return {
        "period_um": period,
        "height_um": height,
        "theta_i_deg": angle,
        "extinction": metal[0],
        "harmonics": metal[1],
        "te": float(np.abs(te[at] - own.te).max()),
        "tm": float(np.abs(tm[at] - own.tm).max()),
    }


def proof() -> dict:
    """Largest differences of an efficiency, by check."""
    finer = Resolution().finer(2)
    return {
        "refined": max(difference(solve(p, *at), solve(p, *at, finer)) for p in PROFILES for at in lights()),
        "modal": max(
            difference(solve(lamellar(*size), *at), lamellar_modes(*size, *at, evanescent=200))
            for size in LAMELLAR_UM
            for at in lights()
        ),
        "rayleigh": max(
            difference(solve(Sinusoid(*size), *at), sinusoid_rayleigh(Sinusoid(*size), *at))
            for size in SHALLOW_UM
            for at in lights()
        ),
        "rayleigh_slope_deg": max(Sinusoid(*size).slope_deg for size in SHALLOW_UM),
        "littrow": max(abs(1 - float(littrow(order).tm.max())) for order in (1, 2, 3)),
        "reciprocity": max(reciprocity(profile) for profile in PROFILES),
        "coupled": [coupled(*case, metal) for case in COUPLED_CASES for metal in METALS],
    }
