"""Gratings of a dielectric: powers of transmitted orders by a judge, by the project's theories and by a phase screen.

A power is the fraction of unpolarised light from air in an order. `python -m tests.judges.gratings.transmitted` writes
the judges' powers to `answers/transmitted.json`. The judges are the solver of `tests.judges.crossed` for sinusoids, and
NIST's SCATMECH for the others (`requirements-judges.lock`), which cuts sawteeth into layers.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass

import numpy as np

from tests.judges.crossed.solver import Problem, direction, flux

from .drawn import ANSWERS, sinusoidal_relief
from .scalar import COHERENCE_LENGTH_UM, Grating, ask, power_of_value, screen_powers
from .scatmech import TRANSMITTED, grating_model, lamellae

FILE = ANSWERS / "transmitted.json"
# Refractive index of the gratings, and wavelengths of the lights.
ETA, WAVELENGTHS_NM = 1.5, (450.0, 550.0, 650.0)
# Names of the sawteeth on the page. Their facets are turned away from light of azimuth 0.
SAWTOOTH, FACING = "sawtooth, turned away", "sawtooth, facing the light"
# Name on the page, and grating: preset, period and height in µm.
GRATINGS = (
    ("sinusoid", Grating("sinusoidal", 2.0, 0.3)),
    ("sinusoid", Grating("sinusoidal", 2.0, 0.6)),
    ("sinusoid", Grating("sinusoidal", 1.0, 0.3)),
    ("lamellar", Grating("lamellar", 2.0, 0.3)),
    (SAWTOOTH, Grating("blazed", 3.33, 0.4)),
    (FACING, Grating("blazed", 3.33, 0.4)),
)
# Angle of incidence and azimuth in degrees.
LIGHTS_DEG = ((0.0, 0.0), (30.0, 0.0), (60.0, 0.0), (30.0, 45.0))
# Factors on the resolution of sinusoids, for the coarser and the finer answer.
FACTORS = (0.7, 1.0)
# SCATMECH's number of orders kept on either side and number of layers, for the coarser and the finer answer, by preset.
KEPT = {"lamellar": ((60, 1), (120, 1)), "blazed": ((32, 30), (44, 60))}


@dataclass(frozen=True)
class Setting:
    """A grating with its name on the page, and a light from air."""

    name: str
    grating: Grating
    wavelength_nm: float
    theta_deg: float
    azimuth_deg: float

    @property
    def phi_deg(self) -> float:
        """Azimuth of the light from +x. Light on FACING is mirrored in x, unless it comes along the normal."""
        return 180.0 - self.azimuth_deg if self.name == FACING and self.theta_deg > 0 else self.azimuth_deg

    @property
    def wi(self) -> np.ndarray:
        """Unit vector to the light."""
        return direction(self.theta_deg, self.phi_deg)

    def tangential(self, orders: np.ndarray) -> np.ndarray:
        """Tangential wave vectors of orders, `[order, 2]`, in units of the wave number in air."""
        return np.stack([orders * self.wavelength_nm * 1e-3 / self.grating.period, 0.0 * orders], -1) - self.wi[:2]

    @property
    def orders(self) -> np.ndarray:
        """The orders that propagate in the medium."""
        # Exceeds |m| of every order m that propagates.
        reach = int((ETA + 1) * 1e3 * self.grating.period / self.wavelength_nm) + 1
        orders = np.arange(-reach, reach + 1)
        return orders[np.linalg.norm(self.tangential(orders), axis=-1) < ETA]


def settings() -> list[Setting]:
    """All settings, in the order of gratings, lights and wavelengths."""
    return [Setting(*grating, nm, *light) for grating in GRATINGS for light in LIGHTS_DEG for nm in WAVELENGTHS_NM]


def small_slope(setting: Setting, limited: bool = False, eta: float = ETA) -> np.ndarray:
    """`powers` by the small-slope theory, with energy conservation if `limited`."""
    return powers(setting, ["--theory", "scalar", "--conserve-energy", str(limited).lower()], eta)


def rigorous(setting: Setting) -> np.ndarray:
    """`powers` by the project's solution of Maxwell's equations."""
    return powers(setting, ["--theory", "rigorous"], ETA)


def powers(setting: Setting, theory: list, eta: float) -> np.ndarray:
    """Powers of the transmitted orders by `sunbeam eval --method exact`, with its arguments `theory`.

    `eta` is at least ETA, for which the orders propagate. In a medium of index `eta` the BSDF is larger by `eta`² than
    in air (docs/model.md#bodies-that-transmit), which the power is not.
    """
    directions = setting.tangential(setting.orders) / eta
    down = -np.sqrt(1 - (directions**2).sum(axis=-1))
    questions = [
        {"wi": setting.wi.tolist(), "wo": [x, y, z], "wavelength": setting.wavelength_nm}
        for (x, y), z in zip(directions.tolist(), down.tolist())
    ]
    grating = setting.grating
    words = ["--preset", grating.preset, "--period", grating.period, "--height", grating.height, "--eta", eta]
    words += ["--transmission", "interface", "--coherence-length", COHERENCE_LENGTH_UM, *theory]
    values = np.array(ask(["eval", "--method", "exact", *words], questions))
    return values * power_of_value(setting.wavelength_nm) / eta**2


def phase_screen(setting: Setting) -> np.ndarray:
    """Powers by Fresnel's transmittance of the flat surface times the orders of a thin phase screen."""
    # Normal components of wave vectors over the wave number in air: of the light in air, of the refracted light in the
    # medium, and of the orders.
    normal = setting.wi[2]
    normal_refracted = np.sqrt(ETA**2 - 1 + normal**2)
    normal_orders = np.sqrt(ETA**2 - (setting.tangential(setting.orders) ** 2).sum(axis=-1))
    # Mean of the transmittances of s and of p, which have the factor 4·normal·normal_refracted.
    s, p = 1 / (normal + normal_refracted) ** 2, (ETA / (ETA**2 * normal + normal_refracted)) ** 2
    fresnel = 2 * normal * normal_refracted * (s + p)
    # Phase in rad of the highest point against the lowest, for each order.
    phase = 2e3 * np.pi * setting.grating.height / setting.wavelength_nm * (normal - normal_orders)
    return fresnel * screen_powers(setting.grating.preset, setting.orders, phase)


def misplaced(found: np.ndarray, true: np.ndarray) -> float:
    """Power in wrong orders, half the sum of absolute differences, as a fraction of the transmitted light."""
    return float(0.5 * np.abs(found - true).sum() / true.sum())


def stored() -> list[dict]:
    """The rows of the file as JSON objects."""
    return json.loads(FILE.read_text(encoding="utf-8"))["answers"]


def load() -> dict[Setting, np.ndarray]:
    """The stored powers of each setting's `orders`."""
    made = {}
    for row in stored():
        fields = row["setting"]
        made[Setting(**{**fields, "grating": Grating(**fields["grating"])})] = np.array(row["power"])
    return made


def unsettled(preset: str, theta_min_deg: float = 0.0) -> float:
    """Largest change of an order's power between the judge's two resolutions, from `theta_min_deg` of incidence on."""
    rows = [row for row in stored() if row["setting"]["theta_deg"] >= theta_min_deg]
    return max(row["unsettled"] for row in rows if row["setting"]["grating"]["preset"] == preset)


def change_of_coordinates(setting: Setting, factor: float) -> np.ndarray:
    """Powers of a sinusoid's orders by the solver of `tests.judges.crossed`, with a factor on its resolution."""
    grating, nm = setting.grating, setting.wavelength_nm
    relief, resolution = sinusoidal_relief(grating.period, grating.height, nm / ETA, factor)
    problem = Problem(relief, nm, setting.theta_deg, setting.phi_deg, complex(ETA), resolution, 1.0)
    # Downward power in the medium over that of the incident light, `[state][order]`.
    below = [-flux(problem.solve(state)[1]) / abs(flux(problem.incident(state)[None])[0]) for state in "sp"]
    by_order = dict(zip(problem.jx.tolist(), np.mean(below, axis=0)))
    return np.array([by_order[order] for order in setting.orders.tolist()])


def scatmech(setting: Setting, waves: int, levels: int) -> np.ndarray:
    """Powers of orders by SCATMECH, with `waves` orders kept on either side, and `levels` layers."""
    grating = setting.grating
    triangle = {None: "Triangular_Grating", "amplitude": repr(grating.height), "aspect": "0"}
    profile = triangle if grating.preset == "blazed" else lamellae(grating.period, grating.height)
    light = (setting.theta_deg, setting.phi_deg)
    medium = (grating.period, setting.wavelength_nm, complex(ETA))
    model = grating_model({**profile, "nlevels": str(levels)}, *medium, *light, waves, side=TRANSMITTED)
    # Element 0, 0 of an order's Mueller matrix is its power in unpolarised light.
    return np.array([np.array(model.DiffractionEfficiency(order))[0, 0] for order in setting.orders.tolist()])


def judged(setting: Setting) -> tuple[np.ndarray, float]:
    """The judge's powers at the finer of two resolutions, and the largest change between both."""
    if setting.grating.preset == "sinusoidal":
        coarse, fine = (change_of_coordinates(setting, factor) for factor in FACTORS)
    else:
        coarse, fine = (scatmech(setting, *kept) for kept in KEPT[setting.grating.preset])
    return fine, float(np.abs(fine - coarse).max())


def main() -> None:
    """Solves all settings and writes the file."""
    rows = []
    for setting in settings():
        power, unsettled = judged(setting)
        rows.append({"setting": asdict(setting), "unsettled": float(f"{unsettled:.1e}")})
        rows[-1]["power"] = np.round(power, 6).tolist()
        print(setting, f"{unsettled:.1e}", flush=True)
    resolutions = json.dumps({"sinusoidal": FACTORS, **KEPT})
    answers = ",\n".join(json.dumps(row) for row in rows)
    FILE.write_text(f'{{"eta": {ETA}, "resolutions": {resolutions},\n"answers": [\n{answers}\n]}}\n', encoding="utf-8")


if __name__ == "__main__":
    main()
