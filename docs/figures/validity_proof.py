"""Checks of the rigorous solver of the documentation's part `validity`, the boundary integral for perfect conductors.

Lengths of gratings are in µm. An *efficiency* is the fraction of the incident light in an order. Results are largest
differences of efficiencies in TE and TM, the polarisations with the electric and the magnetic field along the grooves.
The plane of incidence is across the grooves; at a negative angle light comes from the side of −x.
"""

from __future__ import annotations

import numpy as np

from tests.judges.gratings.boundary_integral import Efficiencies, Resolution, solve
from tests.judges.gratings.coupled_waves import lamellar as coupled_waves
from tests.judges.gratings.independent import lamellar_modes, sinusoid_rayleigh
from tests.judges.gratings.profile import Polygon, Sinusoid, blazed, echelette, lamellar

# Wavelengths of the checks.
WAVELENGTHS_NM = (450.0, 650.0)
# Angles of incidence of the checks.
ANGLES_DEG = (0.0, -60.0, 75.0)
# Profiles of the checks of resolution and reciprocity, by period and height.
PROFILES = (Sinusoid(2.5, 0.25), Sinusoid(2.5, 0.8), blazed(2.5, 0.25), blazed(2.5, 0.7), lamellar(2.5, 0.25))
# Period and height in µm of lamellar gratings.
LAMELLAR_UM = ((1.25, 0.3), (2.5, 0.125), (2.5, 0.25), (5.0, 0.125))
# Number of evanescent orders to either side in the modal method. More orders come nearer to its limit and take longer.
MODAL_EVANESCENT = 200
# Period and height in µm of sinusoids within the convergence of Rayleigh's expansion.
SHALLOW_UM = ((1.25, 0.1), (2.5, 0.14), (2.5, 0.3), (5.0, 0.25))
# Slope of the long facet of the echelette in the Littrow check.
LITTROW_SLOPE_DEG = 20.0
# Extinction of the metal and number of harmonics to either side in coupled-wave analysis. A larger extinction is nearer
# to a perfect conductor and needs more harmonics.
METALS = ((100.0, 80), (300.0, 160))
# Lamellar gratings and lights for coupled-wave analysis: period and height in µm, wavelength in nm, angle in degrees.
COUPLED_CASES = ((2.5, 0.125, 550.0, 30.0), (1.25, 0.3, 550.0, 60.0))


def lights() -> list[tuple[float, float]]:
    """Wavelength in nm and angle of incidence in degrees of each light of the checks."""
    return [(wavelength, angle) for wavelength in WAVELENGTHS_NM for angle in ANGLES_DEG]


def difference(a: Efficiencies, b: Efficiencies) -> float:
    """Largest difference of two solutions with the same orders."""
    return float(max(np.abs(a.te - b.te).max(), np.abs(a.tm - b.tm).max()))


def littrow(order: int) -> Efficiencies:
    """Efficiencies of an echelette lit along the normal of its long facets, where order −`order` returns to the light.

    In TM all light goes into this order (theorem of Maréchal and Stroke, 1959): the standing wave before the long
    facets also satisfies the boundary condition on the short ones.
    """
    profile = echelette(2.5, LITTROW_SLOPE_DEG)
    # 2 d sin θi = `order` λ, with d in µm.
    wavelength_nm = 2e3 * profile.period * np.sin(np.radians(LITTROW_SLOPE_DEG)) / order
    return solve(profile, wavelength_nm, -LITTROW_SLOPE_DEG)


def reciprocity(profile: Sinusoid | Polygon) -> float:
    """Largest change of efficiency when light returns along an order: for each light, the strongest order except 0."""
    largest = 0.0
    for wavelength_nm, theta_i_deg in lights():
        there = solve(profile, wavelength_nm, theta_i_deg)
        # Sines of the orders' directions, by the grating equation.
        sines = there.orders * wavelength_nm / 1e3 / profile.period - np.sin(np.radians(theta_i_deg))
        i = int(np.argmax(there.unpolarised * (there.orders != 0)))
        # Light that arrives along an order returns to the source in the order of the same index.
        back = solve(profile, wavelength_nm, float(np.degrees(np.arcsin(sines[i]))))
        returned = back.orders == there.orders[i]
        differences = [abs(getattr(back, state)[returned][0] - getattr(there, state)[i]) for state in ("te", "tm")]
        largest = max(largest, *differences)
    return float(largest)


def coupled(period: float, height: float, wavelength_nm: float, theta_i_deg: float, metal: tuple[float, int]) -> dict:
    """Largest differences of a lamellar grating from coupled-wave analysis with one of METALS, in TE and TM."""
    extinction, harmonics = metal
    own = solve(lamellar(period, height), wavelength_nm, theta_i_deg)
    te, tm = coupled_waves(period, height, wavelength_nm, theta_i_deg, extinction, harmonics)
    # Indices of the propagating orders. Coupled-wave analysis returns all orders from −harmonics on, so order m has the
    # index harmonics + m.
    indices = harmonics + own.orders
    return {
        "period_um": period,
        "height_um": height,
        "theta_i_deg": theta_i_deg,
        "extinction": extinction,
        "harmonics": harmonics,
        "te": float(np.abs(te[indices] - own.te).max()),
        "tm": float(np.abs(tm[indices] - own.tm).max()),
    }


def proof() -> dict:
    """Largest differences by check.

    - `refined`: from the solver with twice as many nodes and evanescent orders.
    - `modal`: from the modal method for lamellar gratings.
    - `rayleigh`: from Rayleigh's expansion for sinusoids, up to the slope `rayleigh_slope_deg`.
    - `littrow`: the power missing from the strongest order of `littrow` in TM.
    - `reciprocity`, `coupled`: the results of the functions of these names.
    """
    finer = Resolution().finer(2)
    return {
        "refined": max(
            difference(solve(profile, *light), solve(profile, *light, finer))
            for profile in PROFILES
            for light in lights()
        ),
        "modal": max(
            difference(solve(lamellar(*size), *light), lamellar_modes(*size, *light, evanescent=MODAL_EVANESCENT))
            for size in LAMELLAR_UM
            for light in lights()
        ),
        "rayleigh": max(
            difference(solve(Sinusoid(*size), *light), sinusoid_rayleigh(Sinusoid(*size), *light))
            for size in SHALLOW_UM
            for light in lights()
        ),
        "rayleigh_slope_deg": max(Sinusoid(*size).slope_deg for size in SHALLOW_UM),
        "littrow": max(abs(1 - float(littrow(order).tm.max())) for order in (1, 2, 3)),
        "reciprocity": max(reciprocity(profile) for profile in PROFILES),
        "coupled": [coupled(*case, metal) for case in COUPLED_CASES for metal in METALS],
    }
