"""Gratings under a clear cover: powers of orders in air, from the judges' powers inside and by the project's theories.

The light comes from air and is unpolarised. A power is its fraction in one order that leaves into air. Light that the
cover's flat side reflects back to the grating is left out. The transmittances of the flat side multiply the powers
inside. A *state* is a polarisation, s or p.

`Judged.power` is by order, `Judged.states` the powers `[order, outgoing state, incident state]`; both are inside the
cover.
"""

from __future__ import annotations

import numpy as np

from .drawn import DIELECTRIC, Judged
from .scalar import COHERENCE_LENGTH_UM, ask, power_of_value
from .theories import EXACT, SCALAR, grating_arguments, medium_arguments


def transmittances(eta: float, cos: np.ndarray | float) -> np.ndarray:
    """Fresnel's transmittances of a cover's flat side in s and p, `[..., state]`, from its index and cosines in air."""
    cos = np.asarray(cos)
    # `eta` times the cosine of the refraction angle.
    inside = np.sqrt(eta**2 - 1 + cos**2)
    return np.stack(
        [4 * cos * inside / (cos + inside) ** 2, 4 * eta**2 * cos * inside / (eta**2 * cos + inside) ** 2], axis=-1
    )


def flat_sides(judged: Judged) -> tuple[np.ndarray, np.ndarray]:
    """Transmittances of the flat side for the light, `[state]`, and for the orders, `[order, state]`."""
    setting = judged.setting
    cos_o = setting.wo(judged.orders)[:, 2]
    return transmittances(setting.cover_eta, setting.wi[2]), transmittances(setting.cover_eta, cos_o)


def through_means(judged: Judged) -> np.ndarray:
    """The judge's powers times the transmittances' means over both states, as in the model (docs/model.md)."""
    arriving, leaving = flat_sides(judged)
    return judged.power * arriving.mean() * leaving.mean(axis=-1)


def through_states(judged: Judged) -> np.ndarray:
    """The judge's powers with each state's own transmittances; s and p stay incoherent."""
    arriving, leaving = flat_sides(judged)
    # Axes: m is the order, a the state of outgoing light, b that of incident light.
    return 0.5 * np.einsum("ma,mab,b->m", leaving, judged.states, arriving)


def powers(judged: Judged, theory: str, cover_eta: float | None = None) -> np.ndarray:
    """Powers of the judge's orders by SCALAR or EXACT (Maxwell's equations), from the BSDF of `sunbeam eval`.

    `--method exact` is the BSDF without tables, in either theory. `cover_eta` replaces the setting's index of
    the cover. SCALAR does not conserve energy; its obliquity factor is what the default `auto` chooses for the medium.
    """
    setting = judged.setting
    wi = setting.wi.tolist()
    questions = [{"wi": wi, "wo": wo, "wavelength": setting.wavelength_nm} for wo in setting.wo(judged.orders).tolist()]
    obliquity = "small_slope" if setting.metal == DIELECTRIC else "stam"
    more = {
        EXACT: ["--theory", "rigorous"],
        SCALAR: ["--theory", "scalar", "--obliquity", obliquity, "--conserve-energy", "false"],
    }[theory]
    surface = [*grating_arguments(setting), *medium_arguments(setting)]
    surface += ["--cover-eta", cover_eta or setting.cover_eta]
    asked = ["eval", "--method", "exact", *surface, "--coherence-length", COHERENCE_LENGTH_UM, *more]
    return np.array(ask(asked, questions)) * power_of_value(setting.wavelength_nm)
