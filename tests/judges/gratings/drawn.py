"""Random gratings and lights, with answers of judges other than the solver in Rust.

`python -m tests.judges.gratings.drawn` writes `answers/drawn.json`. The judges are

- for perfect conductors the boundary integral of this package, where light at an azimuth is light across the grooves of
  a longer wavelength;
- for sinusoids in metals the solver of `tests.judges.crossed`;
- for lamellar gratings in metals NIST's SCATMECH (`requirements-judges.lock`).

There is none for sawteeth in metals. Each judge solves at two resolutions; answers that have not converged are left
out.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from tests.judges.crossed.relief import Relief
from tests.judges.crossed.solver import Resolution as CrossedResolution
from tests.judges.crossed.solver import solve as crossed

from .boundary_integral import Resolution, solve
from .metals import index
from .profile import Sinusoid, blazed, lamellar
from .scatmech import lamellar as metal_lamellar

ANSWERS = Path(__file__).parent / "answers" / "drawn.json"
SEED, EACH = 18, 16
METALS = ("none", "Al", "Ag", "Au")
SHAPES = ("sinusoidal", "blazed", "lamellar")
PERIODS_UM, DEPTH_MAX, THETA_MAX_DEG = (0.3, 4.0), 0.4, 75.0
WAVELENGTHS_NM = (450.0, 650.0)
# Largest change of an order's power in unpolarised light between both resolutions of a converged answer.
SETTLED = 5e-4
PROFILES = {"sinusoidal": Sinusoid, "blazed": blazed, "lamellar": lamellar}
# Orders that SCATMECH keeps on either side.
WAVES = (70, 140)
# Samples of a sinusoid, which has one harmonic.
SAMPLES = 9


@dataclass(frozen=True)
class Setting:
    """A grating and a light; `metal` is `none` for a perfect conductor. The light is turned by `phi_deg` from +x.

    The metal's index is that at the light's wavelength, unless another is named.
    """

    metal: str
    shape: str
    period_um: float
    height_um: float
    wavelength_nm: float
    theta_deg: float
    phi_deg: float
    index_nm: float | None = None

    @property
    def index(self) -> complex | None:
        return None if self.metal == "none" else index(self.metal, self.index_nm or self.wavelength_nm)

    @property
    def wi(self) -> np.ndarray:
        theta, phi = np.radians([self.theta_deg, self.phi_deg])
        return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


@dataclass(frozen=True)
class Judged:
    """A setting and its judge's answer: orders, their power in unpolarised light, and the change between resolutions.

    `jones` holds amplitudes of s and p as in `tests.judges.crossed.solver.Orders`, where the judge gives them.
    """

    setting: Setting
    orders: np.ndarray
    power: np.ndarray
    unsettled: float
    jones: np.ndarray | None


def settings() -> list[Setting]:
    rng = np.random.default_rng(SEED)
    drawn = []
    for metal in METALS:
        for shape in SHAPES:
            for _ in range(EACH):
                period = float(np.exp(rng.uniform(*np.log(PERIODS_UM))))
                numbers = (period, period * rng.uniform(0.02, DEPTH_MAX), rng.uniform(*WAVELENGTHS_NM))
                angles = (rng.uniform(0, THETA_MAX_DEG), rng.uniform(0, 360))
                drawn.append(Setting(metal, shape, *(round(float(x), 4) for x in (*numbers, *angles))))
    return [setting for setting in drawn if setting.metal == "none" or setting.shape != "blazed"]


def perfect(setting: Setting, resolution: Resolution) -> tuple:
    """Fields proportional to exp(i ky y) obey the equations across the grooves with κ² = k² − ky² for k²."""
    across = np.sqrt(1 - setting.wi[1] ** 2)
    theta_deg = float(np.degrees(np.arcsin(setting.wi[0] / across)))
    profile = PROFILES[setting.shape](setting.period_um, setting.height_um)
    found = solve(profile, setting.wavelength_nm / across, theta_deg, resolution)
    return found.orders, found.unpolarised, None


def sinusoid(setting: Setting, factor: float) -> tuple:
    """The period along y is so short that harmonic 0 alone is kept."""
    x = np.arange(SAMPLES) / SAMPLES
    wave = 0.5 * setting.height_um * np.sin(2 * np.pi * x)[None]
    slope = np.pi * setting.height_um / setting.period_um
    # Harmonics of the field: those of the waves, twice for the slopes.
    cutoff = factor * (6e3 / setting.wavelength_nm + (10 + 25 * slope) / setting.period_um)
    resolution = CrossedResolution(cutoff, round(factor * 26), 1e-7, 300)
    relief = Relief(wave, (setting.period_um, 0.4 / cutoff))
    found = crossed(relief, setting.wavelength_nm, setting.theta_deg, setting.phi_deg, setting.index, resolution)
    order = np.argsort(found.jx)
    return found.jx[order], found.unpolarised[order], found.jones[order]


def scatmech(setting: Setting, waves: int) -> tuple:
    found = metal_lamellar(
        setting.period_um,
        setting.height_um,
        setting.wavelength_nm,
        setting.index,
        setting.theta_deg,
        setting.phi_deg,
        waves,
    )
    orders = np.array(sorted(found))
    return orders, np.array([0.5 * sum(found[order]) for order in orders]), None


def judged(setting: Setting) -> Judged:
    """The judge's answer at the finer of two resolutions.

    SCATMECH's error is inverse to the number of orders; its answers are extrapolated.
    """
    if setting.metal == "none":
        (_, before, _), (orders, power, jones) = (perfect(setting, Resolution().finer(f)) for f in (1.0, 2.0))
    elif setting.shape == "sinusoidal":
        (_, before, _), (orders, power, jones) = (sinusoid(setting, factor) for factor in (1.0, 1.4))
    else:
        (_, before, _), (orders, power, jones) = (scatmech(setting, waves) for waves in WAVES)
        before, power = power, 2 * power - before
    return Judged(setting, orders, power, float(np.abs(power - before).max()), jones)


def load() -> list[Judged]:
    """The stored answers that have converged."""
    found = []
    for row in json.loads(ANSWERS.read_text(encoding="utf-8"))["answers"]:
        jones = row["jones"]
        if jones is not None:
            parts = np.array(jones)
            jones = parts[..., 0] + 1j * parts[..., 1]
        setting = Setting(**row["setting"])
        found.append(Judged(setting, np.array(row["orders"]), np.array(row["power"]), row["unsettled"], jones))
    return found


def left_out() -> list[dict]:
    """Settings whose judge has not converged, with the change between resolutions."""
    return json.loads(ANSWERS.read_text(encoding="utf-8"))["left_out"]


def main() -> None:
    kept, unsettled = [], []
    for setting in settings():
        try:
            answer = judged(setting)
        except ValueError as error:
            # The judge has no answer where an order grazes the surface.
            unsettled.append({"setting": asdict(setting), "unsettled": None, "why": str(error)})
            continue
        if answer.unsettled > SETTLED:
            row = {"setting": asdict(setting), "unsettled": float(f"{answer.unsettled:.1e}")}
            unsettled.append({**row, "why": "two resolutions differ"})
            continue
        jones = answer.jones
        if jones is not None:
            jones = np.round(np.stack([jones.real, jones.imag], axis=-1), 6).tolist()
        row = {
            "setting": asdict(setting),
            "orders": answer.orders.tolist(),
            "power": np.round(answer.power, 7).tolist(),
        }
        kept.append({**row, "unsettled": float(f"{answer.unsettled:.1e}"), "jones": jones})
        print(setting, f"{answer.unsettled:.1e}", flush=True)
    ANSWERS.parent.mkdir(exist_ok=True)
    rows = [",\n".join(json.dumps(row) for row in part) for part in (kept, unsettled)]
    ANSWERS.write_text(f'{{"answers": [\n{rows[0]}\n],\n"left_out": [\n{rows[1]}\n]}}\n', encoding="utf-8")


if __name__ == "__main__":
    main()
