"""Random gratings and lights, with stored answers of judges.

A *setting* is a grating with a light. An *answer* has the powers of the orders, as fractions of the incident power.
`python -m tests.judges.gratings.drawn` writes `answers/drawn.json`, for gratings in air, and `answers/covered.json`,
for gratings under a clear cover. The judges are

- for perfect conductors the boundary integral of this package, where light at an azimuth is light across the grooves of
  a longer wavelength;
- for sinusoids in other media the solver of `tests.judges.crossed`;
- for lamellar gratings in other media NIST's SCATMECH (`requirements-judges.lock`).

There is none for sawteeth in other media. Each judge solves at two resolutions; answers that have not converged are
left out. Under a cover the judges solve for light and orders in a medium of the cover's index, without its flat side.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.judges.crossed.relief import Relief
from tests.judges.crossed.solver import Resolution as CrossedResolution
from tests.judges.crossed.solver import direction
from tests.judges.crossed.solver import solve as crossed

from .boundary_integral import Resolution, solve
from .metals import index
from .profile import Sinusoid, blazed, lamellar
from .scatmech import lamellar as metal_lamellar

ANSWERS = Path(__file__).parent / "answers"
# Names of the files of answers: gratings in air, and under a cover.
BARE, COVERED = "drawn", "covered"
# Seed of the random settings, and number of settings for each medium and shape.
SEED, EACH = 18, 16
# Media, named as Mitsuba's `material`; "none" is a perfect conductor.
METALS = ("none", "Al", "Ag", "Au")
# Name of a dielectric below a cover, and its index, about that of titania.
DIELECTRIC, DIELECTRIC_ETA = "dielectric", 2.4
SHAPES = ("sinusoidal", "blazed", "lamellar")
# Range of the periods, range of the height over the period, largest angle of incidence.
PERIODS_UM, DEPTHS, THETA_MAX_DEG = (0.3, 4.0), (0.02, 0.4), 75.0
# Media and shapes under covers. A perfect conductor's judge has no s and p at an azimuth.
COVERED_MEDIA, COVERED_SHAPES = ("Al", "Ag", "Au", DIELECTRIC), ("sinusoidal", "lamellar")
# Ranges of the periods under covers, and of the covers' indices.
COVERED_PERIODS_UM, COVER_ETAS = (0.4, 4.0), (1.3, 1.8)
WAVELENGTHS_NM = (450.0, 650.0)
# Largest change of an order's power in unpolarised light between both resolutions of a converged answer.
SETTLED = 5e-4
PROFILES = {"sinusoidal": Sinusoid, "blazed": blazed, "lamellar": lamellar}
# Direction cosine along the grooves below which light counts as across them.
ACROSS = 1e-12
# Numbers of orders that SCATMECH keeps on either side. They are even, since odd ones have another error.
WAVES = (70, 140)
# A number between them. Under covers, where SCATMECH converges more slowly, it tells the error of the extrapolation.
WAVES_BETWEEN = 104
# Largest change of a power by the extrapolation at which it can be trusted. Corners of silver exceed it.
TRUSTED_CHANGE = 1e-3
# Number of samples of a sinusoid, which has one harmonic.
SAMPLES = 9


@dataclass(frozen=True)
class Setting:
    """A grating in a medium `metal`, one of METALS or DIELECTRIC, and a light of azimuth `phi_deg` from +x.

    A metal's index is that at the wavelength `index_nm`, by default the light's. `theta_deg` is measured in air, and
    `wavelength_nm` in vacuum. `cover_eta` is the index of a flat clear layer over the relief.
    """

    metal: str
    shape: str
    period_um: float
    height_um: float
    wavelength_nm: float
    theta_deg: float
    phi_deg: float
    index_nm: float | None = None
    cover_eta: float = 1.0

    @property
    def index(self) -> complex | None:
        """Refractive index η + ik of the medium; `None` for a perfect conductor."""
        if self.metal == DIELECTRIC:
            return complex(DIELECTRIC_ETA)
        return None if self.metal == "none" else index(self.metal, self.index_nm or self.wavelength_nm)

    @property
    def theta_inside_deg(self) -> float:
        """Angle of the light in the cover, by Snell's law."""
        return float(np.degrees(np.arcsin(np.sin(np.radians(self.theta_deg)) / self.cover_eta)))

    @property
    def wi(self) -> np.ndarray:
        """Unit vector to the light, in air."""
        return direction(self.theta_deg, self.phi_deg)

    def wo(self, orders: np.ndarray) -> np.ndarray:
        """Directions in air of some orders, `[order, 3]`; NaN along z for those that do not leave."""
        x = np.asarray(orders) * self.wavelength_nm * 1e-3 / self.period_um - self.wi[0]
        y = np.full_like(x, -self.wi[1])
        with np.errstate(invalid="ignore"):
            return np.stack([x, y, np.sqrt(1 - x**2 - y**2)], axis=-1)


class Answer(NamedTuple):
    """Orders that propagate, and their powers for unpolarised light. Under a cover powers are those inside it.

    `jones` has amplitudes of s and p as in `tests.judges.crossed.solver.Orders`, and `states` powers of s and p,
    `[order, out, in]`. Both are `None` where the judge does not give them.
    """

    orders: np.ndarray
    power: np.ndarray
    jones: np.ndarray | None
    states: np.ndarray | None


@dataclass(frozen=True)
class Judged:
    """A setting with the part of its judge's `Answer` for orders that leave into air.

    `unsettled` is the largest change of a power between the judge's resolutions.
    """

    setting: Setting
    orders: np.ndarray
    power: np.ndarray
    unsettled: float
    jones: np.ndarray | None
    states: np.ndarray | None = None


def drawn(rng: np.random.Generator, metal: str, shape: str, periods_um: tuple[float, float]) -> Setting:
    """A random setting; periods are uniform in their logarithm."""
    period = float(np.exp(rng.uniform(*np.log(periods_um))))
    numbers = (period, period * rng.uniform(*DEPTHS), rng.uniform(*WAVELENGTHS_NM))
    angles = (rng.uniform(0, THETA_MAX_DEG), rng.uniform(0, 360))
    return Setting(metal, shape, *(round(float(x), 4) for x in (*numbers, *angles)))


def settings() -> list[Setting]:
    """The settings in air."""
    rng = np.random.default_rng(SEED)
    made = [drawn(rng, metal, shape, PERIODS_UM) for metal in METALS for shape in SHAPES for _ in range(EACH)]
    return [setting for setting in made if setting.metal == "none" or setting.shape != "blazed"]


def covered_settings() -> list[Setting]:
    """The settings under covers."""
    rng = np.random.default_rng(SEED)
    return [
        replace(drawn(rng, medium, shape, COVERED_PERIODS_UM), cover_eta=round(float(rng.uniform(*COVER_ETAS)), 4))
        for medium in COVERED_MEDIA
        for shape in COVERED_SHAPES
        for _ in range(EACH)
    ]


def perfect(setting: Setting, resolution: Resolution) -> Answer:
    """The answer for a perfect conductor by the boundary integral, with `states` for light across the grooves alone.

    Fields proportional to exp(i ky y) obey the equations across the grooves with k² − ky² in place of k².
    """
    # Wave number across the grooves over that in air.
    across = np.sqrt(setting.cover_eta**2 - setting.wi[1] ** 2)
    theta_deg = float(np.degrees(np.arcsin(setting.wi[0] / across)))
    profile = PROFILES[setting.shape](setting.period_um, setting.height_um)
    found = solve(profile, setting.wavelength_nm / across, theta_deg, resolution)
    states = None
    if abs(setting.wi[1]) < ACROSS:
        # Across the grooves TE and TM are s and p, and the grating does not mix them: `[order, out, in]` is diagonal.
        states = np.stack([found.te, found.tm], axis=-1)[:, None] * np.eye(2)
    return Answer(found.orders, found.unpolarised, None, states)


def sinusoid(setting: Setting, factor: float) -> Answer:
    """The answer for a sinusoid by the solver of `tests.judges.crossed`, with a factor on its resolution."""
    above = setting.cover_eta
    relief, resolution = sinusoidal_relief(setting.period_um, setting.height_um, setting.wavelength_nm / above, factor)
    light = (setting.wavelength_nm, setting.theta_inside_deg, setting.phi_deg)
    found = crossed(relief, *light, setting.index, resolution, above)
    order = np.argsort(found.jx)
    jones = found.jones[order]
    return Answer(found.jx[order], found.unpolarised[order], jones, np.abs(jones) ** 2)


def sinusoidal_relief(
    period_um: float, height_um: float, wavelength_nm: float, factor: float
) -> tuple[Relief, CrossedResolution]:
    """A sinusoid and a resolution for the solver of `tests.judges.crossed`, with a factor on its resolution.

    `wavelength_nm` is that of the judged orders in their medium. The numbers below are chosen. Larger ones resolve more
    and take longer; two values of `factor` show whether they suffice.
    """
    x = np.arange(SAMPLES) / SAMPLES
    wave = 0.5 * height_um * np.sin(2 * np.pi * x)[None]
    slope = np.pi * height_um / period_um
    # Frequencies in cycles per µm: six times that of the waves, and harmonics of the grating, more for steeper slopes.
    cutoff = factor * (6e3 / wavelength_nm + (10 + 25 * slope) / period_um)
    # So short a period along y that the solver keeps harmonic 0 alone.
    period_y_um = 0.4 / cutoff
    resolution = CrossedResolution(cutoff, nodes=round(factor * 26), tolerance=1e-7, steps_max=300)
    return Relief(wave, (period_um, period_y_um)), resolution


def scatmech(setting: Setting, waves: int) -> Answer:
    """The answer for a lamellar grating by SCATMECH, with `waves` orders on either side."""
    light = (setting.wavelength_nm, setting.index, setting.theta_inside_deg, setting.phi_deg)
    found = metal_lamellar(setting.period_um, setting.height_um, *light, waves, setting.cover_eta)
    orders = np.array(sorted(found))
    states = np.array([found[order] for order in orders])
    return Answer(orders, 0.5 * states.sum(axis=(1, 2)), None, states)


def extrapolated(numbers: tuple[int, int], few: Answer, many: Answer) -> Answer:
    """The limit for infinitely many waves, from SCATMECH's answers with two numbers of waves.

    The error of an answer is taken as inversely proportional to its number of waves.
    """
    m, n = numbers

    def limit(of_few: np.ndarray, of_many: np.ndarray) -> np.ndarray:
        return (n * of_many - m * of_few) / (n - m)

    return Answer(many.orders, limit(few.power, many.power), None, limit(few.states, many.states))


def judged(setting: Setting) -> Judged:
    """The judge's answer at the finer of two resolutions; SCATMECH's is extrapolated from both.

    SCATMECH's `unsettled` is the change by the extrapolation. Under a cover, where this is too large for a converged
    answer but at most TRUSTED_CHANGE, it is the change between two extrapolations.
    """
    if setting.metal == "none":
        coarse, fine = (perfect(setting, Resolution().finer(factor)) for factor in (1.0, 2.0))
    elif setting.shape == "sinusoidal":
        coarse, fine = (sinusoid(setting, factor) for factor in (1.0, 1.4))
    else:
        few, many = (scatmech(setting, waves) for waves in WAVES)
        coarse, fine = many, extrapolated(WAVES, few, many)
        if setting.cover_eta > 1 and SETTLED < change(setting, coarse, fine) <= TRUSTED_CHANGE:
            coarse = extrapolated((WAVES_BETWEEN, WAVES[1]), scatmech(setting, WAVES_BETWEEN), many)
    return leaving(setting, fine, change(setting, coarse, fine))


def change(setting: Setting, coarse: Answer, fine: Answer) -> float:
    """Largest change, from one answer to the other, of the power of an order that leaves into air."""
    return float(np.abs(fine.power - coarse.power)[leaves(setting, fine.orders)].max())


def leaves(setting: Setting, orders: np.ndarray) -> np.ndarray:
    """Whether each order leaves into air."""
    return np.isfinite(setting.wo(orders)[:, 2])


def leaving(setting: Setting, answer: Answer, unsettled: float) -> Judged:
    """The part of a judge's answer for the orders that leave into air."""
    kept = leaves(setting, answer.orders)
    orders, power, jones, states = (None if part is None else part[kept] for part in answer)
    return Judged(setting, orders, power, unsettled, jones, states)


def load(name: str = BARE) -> list[Judged]:
    """The stored answers of a file; `name` is BARE or COVERED."""
    found = []
    for row in stored(name)["answers"]:
        jones, states = row["jones"], row.get("states")
        if jones is not None:
            parts = np.array(jones)
            jones = parts[..., 0] + 1j * parts[..., 1]
            states = np.abs(jones) ** 2
        elif states is not None:
            states = np.array(states)
        power = (np.array(row["orders"]), np.array(row["power"]))
        found.append(Judged(Setting(**row["setting"]), *power, row["unsettled"], jones, states))
    return found


def left_out(name: str = BARE) -> list[dict]:
    """Settings whose judge has not converged, with the change between resolutions."""
    return stored(name)["left_out"]


def stored(name: str) -> dict:
    """The contents of a file of answers."""
    return json.loads((ANSWERS / f"{name}.json").read_text(encoding="utf-8"))


def write(name: str, chosen: list[Setting]) -> None:
    """Solves the settings and writes the answers to the file `name`."""
    kept, unsettled = [], []
    for setting in chosen:
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
        row = {
            "setting": asdict(setting),
            "orders": answer.orders.tolist(),
            "power": np.round(answer.power, 7).tolist(),
            "unsettled": float(f"{answer.unsettled:.1e}"),
            "jones": None,
        }
        if answer.jones is not None:
            row["jones"] = np.round(np.stack([answer.jones.real, answer.jones.imag], axis=-1), 6).tolist()
        elif answer.states is not None:
            row["states"] = np.round(answer.states, 7).tolist()
        kept.append(row)
        print(setting, f"{answer.unsettled:.1e}", flush=True)
    ANSWERS.mkdir(exist_ok=True)
    rows = [",\n".join(json.dumps(row) for row in part) for part in (kept, unsettled)]
    text = f'{{"answers": [\n{rows[0]}\n],\n"left_out": [\n{rows[1]}\n]}}\n'
    (ANSWERS / f"{name}.json").write_text(text, encoding="utf-8")


def main() -> None:
    """Writes the files that are named on the command line, by default both."""
    parser = argparse.ArgumentParser(prog="python -m tests.judges.gratings.drawn", description=__doc__)
    # Without `choices`, since argparse of Python 3.11 compares an empty list with them, too.
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"{BARE} or {COVERED}")
    names = parser.parse_args().names
    files = {BARE: settings, COVERED: covered_settings}
    if unknown := [name for name in names if name not in files]:
        parser.error(f"unknown name {unknown[0]!r}; available: {', '.join(files)}")
    for name in names or files:
        write(name, files[name]())


if __name__ == "__main__":
    main()
