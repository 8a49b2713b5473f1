"""The project's powers of a grating's orders by theory, from `sunbeam orders` and `sunbeam eval`.

A *judge* is an independent solver; `Judged` has its result for one grating and incidence.
SCALAR is the phase screen times Fresnel's reflectance, with the obliquity factor `stam`, without energy conservation.
FRESNEL is a perfect conductor by Maxwell's equations times Fresnel's reflectance. EXACT is Maxwell's equations with the
index of the medium.
"""

from __future__ import annotations

import json

import numpy as np

from mitsuba_scenes.tool import sunbeam

from .drawn import Judged, Setting
from .scalar import COHERENCE_LENGTH_UM, ask, power_of_value

SCALAR, FRESNEL, EXACT = "scalar", "perfect × Fresnel", "exact"


def grating_arguments(setting: Setting) -> list:
    """The arguments of `sunbeam` for the grating."""
    return ["--preset", setting.shape, "--period", setting.period_um, "--height", setting.height_um]


def medium_arguments(setting: Setting) -> list:
    """The arguments of `sunbeam` for the medium; none for a perfect conductor."""
    n = setting.index
    return [] if n is None else ["--eta", n.real, "--k", n.imag]


def orders(setting: Setting, *more) -> dict:
    """The entries that `sunbeam orders --json` prints, by order m; `more` are arguments besides grating and light."""
    light = ["--theta-i", setting.theta_deg, "--phi-i", setting.phi_deg, "--wavelength", setting.wavelength_nm]
    report = json.loads(sunbeam("orders", "--json", *grating_arguments(setting), *light, *more))
    return {order["order"]: order for order in report["orders"]}


def fresnel(n: complex | None, wi, wo) -> np.ndarray:
    """Reflectance of unpolarised light at the half vector of two directions; 1 for a perfect conductor."""
    if n is None:
        return np.ones(np.shape(wo)[:-1])
    # Cosine of the angle between either direction and the half vector.
    cos = np.sqrt(0.5 * (1 + (np.asarray(wi) * wo).sum(axis=-1)))
    # n times the cosine of the refracted light.
    inside = np.sqrt(n * n - 1 + cos**2 + 0j)
    s, p = (cos - inside) / (cos + inside), (n * n * cos - inside) / (n * n * cos + inside)
    return 0.5 * (np.abs(s) ** 2 + np.abs(p) ** 2)


def powers(judged: Judged) -> dict[str, np.ndarray]:
    """Fractions of unpolarised light in the judge's orders, by theory.

    The key `mean` of an order is the mean of both polarisation states.
    """
    setting = judged.setting
    medium = medium_arguments(setting)
    found = {
        SCALAR: orders(setting, "--theory", "scalar", "--obliquity", "stam", *medium),
        FRESNEL: orders(setting, "--theory", "rigorous"),
        EXACT: orders(setting, "--theory", "rigorous", *medium),
    }
    numbers = judged.orders.tolist()
    by_theory = {name: np.array([entries[order]["mean"] for order in numbers]) for name, entries in found.items()}
    directions = np.array([found[EXACT][order]["direction"] for order in numbers])
    by_theory[FRESNEL] = by_theory[FRESNEL] * fresnel(setting.index, setting.wi, directions)
    return by_theory


def tabulated(settings: list[Setting]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Fractions of unpolarised light in the orders from the table of a grating, and the same by the solver.

    Both are lists over `settings`, which have one grating and medium: the table is that of the first setting.
    """
    questions, solved = [], []
    for setting in settings:
        entries = orders(setting, "--theory", "rigorous", *medium_arguments(setting)).values()
        solved.append(np.array([order["mean"] for order in entries]))
        wi = setting.wi.tolist()
        questions += [{"wi": wi, "wo": order["direction"], "wavelength": setting.wavelength_nm} for order in entries]
    first = settings[0]
    asked = ["eval", "--method", "table", "--theory", "rigorous", *grating_arguments(first), *medium_arguments(first)]
    # The BSDF in 1/sr at the centre of each order, of all settings in turn; `power_of_value` makes powers of it.
    values = np.array(ask([*asked, "--coherence-length", COHERENCE_LENGTH_UM], questions))
    parts = np.split(values, np.cumsum([len(part) for part in solved])[:-1])
    return [part * power_of_value(setting.wavelength_nm) for part, setting in zip(parts, settings)], solved


def transverse_basis(d: np.ndarray) -> np.ndarray:
    """Unit vectors of E in the states of `sunbeam orders`, first Hy = 0, then Ey = 0.

    The wave travels along the unit vector `d`, which is not ±y.
    """
    across = np.hypot(d[0], d[2])
    return np.array([[-d[1] * d[0] / across, across, -d[1] * d[2] / across], [d[2] / across, 0, -d[0] / across]])


def s_and_p(d: np.ndarray) -> np.ndarray:
    """Unit vectors of E in the states s and p of `tests.judges.crossed`, for a wave along `d`, which is not ±z."""
    s = np.array([-d[1], d[0], 0]) / np.hypot(d[0], d[1])
    return np.array([s, np.cross(d, s)])


def mueller(jones: np.ndarray) -> np.ndarray:
    """Mueller matrices M_ij = ½ tr(σ_i J σ_j J†) of Jones matrices J (..., out, in) of s and p.

    σ are Pauli's matrices in the order 1, σ_z, σ_x and −σ_y.
    """
    pauli = np.array([[[1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, 1j], [-1j, 0]]])
    return 0.5 * np.einsum("iab,...bc,jcd,...ad->...ij", pauli, jones, pauli, jones.conj()).real


def mueller_errors(judged: Judged) -> np.ndarray:
    """Differences of all elements of the orders' Mueller matrices from the judge's, relative to its largest m00."""
    setting = judged.setting
    found = orders(setting, "--theory", "rigorous", *medium_arguments(setting))
    # Matrices that turn Jones vectors between the states of `sunbeam orders` and s and p.
    arriving = -setting.wi
    turn_in = transverse_basis(arriving) @ s_and_p(arriving).T
    made = []
    for order in judged.orders.tolist():
        # Real and imaginary parts, (out, in, 2).
        parts = np.array(found[order]["jones"])
        direction = np.array(found[order]["direction"])
        turn_out = s_and_p(direction) @ transverse_basis(direction).T
        made.append(mueller(turn_out @ (parts[..., 0] + 1j * parts[..., 1]) @ turn_in))
    expected = mueller(judged.jones)
    return (np.array(made) - expected).ravel() / expected[:, 0, 0].max()
