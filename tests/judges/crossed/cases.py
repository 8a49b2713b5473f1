"""Cases on which this folder's solver of Maxwell's equations was run, and its stored answers in `answers/`.

A *case* is a relief of a medium below air. An *answer* has the powers of its reflected orders for one light, as
fractions of the incident power. Scans and heights derived from them are not part of the project, so answers have no
heights.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .crops import CROPS, Crop
from .model import Light
from .solver import Orders

ANSWERS = Path(__file__).parent / "answers"
# Unit of stored powers, which are whole numbers: this fraction of the incident power.
UNIT = 1e-7
# Refractive index of keratin (docs/height-fields.md).
KERATIN = 1.56
# Standard deviation in pixels of the Gaussian that smooths crops, by default.
SMOOTHING = 1.0
# Wavelengths, angles of incidence and azimuths from +x of the lights on crops, chosen.
WAVELENGTHS_NM = (450.0, 550.0, 650.0)
ANGLES_DEG = (0.0, 30.0, 60.0, 75.0)
AZIMUTHS_DEG = (0.0, 90.0)


@dataclass(frozen=True)
class Case:
    """A crop of a skin's scan with a smoothing in pixels, a factor on its heights, and its medium's index `eta`."""

    crop: Crop
    smoothing: float = SMOOTHING
    factor: float = 1.0
    eta: float = KERATIN

    @property
    def key(self) -> str:
        """The case's name in the files of `answers/`."""
        return f"{self.crop.skin} {self.crop.name}, {self.smoothing} px, height × {self.factor}, η {self.eta}"


LIGHTS = [Light(nm, theta, phi) for nm in WAVELENGTHS_NM for theta in ANGLES_DEG for phi in AZIMUTHS_DEG]
# Lights on the cases VARIED.
FEWER_LIGHTS = [light for light in LIGHTS if light.wavelength_nm == 550.0]
# All crops, with the default smoothing, height and index.
BASE = [Case(crop) for crop in CROPS]
# Crop A of each skin, with another smoothing, height or index.
VARIED = [
    Case(crop, **change)
    for crop in CROPS
    if crop.name == "A"
    for change in ({"smoothing": 0.5}, {"smoothing": 2.0}, {"factor": 0.5}, {"eta": 1.33}, {"eta": 2.0})
]
# Lights on the synthetic relief `relief.synthetic`. At normal incidence the azimuth only turns the polarisation.
SYNTHETIC_LIGHTS = [
    Light(nm, theta, phi)
    for nm in (450.0, 650.0)
    for theta in (0.0, 40.0, 70.0)
    for phi in ((0.0, 35.0) if theta else (0.0,))
]


def answer_row(light: Light, orders: Orders) -> dict:
    """The answer for one light as a row of the files of `answers/`."""
    return {
        "light": [light.wavelength_nm, light.theta_deg, light.phi_deg],
        "balance": float(f"{orders.balance:.1e}"),
        "residual": float(f"{orders.residual:.1e}"),
        "jx": orders.jx.tolist(),
        "jy": orders.jy.tolist(),
        "s": np.rint(orders.s / UNIT).astype(int).tolist(),
        "p": np.rint(orders.p / UNIT).astype(int).tolist(),
    }


@dataclass(frozen=True)
class Answer:
    """A stored answer: powers of the reflected orders (jx, jy), and the solver's accuracy.

    `s` and `p` are the powers for incident light of that polarisation, as fractions of the incident power. `balance` is
    the deviation of the reflected and transmitted power from 1, and `residual` that of GMRES. Both are the larger value
    of s and p.
    """

    light: Light
    jx: np.ndarray
    jy: np.ndarray
    s: np.ndarray
    p: np.ndarray
    balance: float
    residual: float

    @property
    def unpolarised(self) -> np.ndarray:
        """Powers for unpolarised light."""
        return 0.5 * (self.s + self.p)


def answers(name: str) -> dict[str, list[Answer]]:
    """The stored answers of `name`.json, a list over lights by `Case.key` ("synthetic" for the synthetic relief)."""
    found = {}
    for key, rows in json.loads((ANSWERS / f"{name}.json").read_text(encoding="utf-8")).items():
        found[key] = [
            Answer(
                Light(*row["light"]),
                *(np.array(row[axis]) for axis in ("jx", "jy")),
                *(np.array(row[state]) * UNIT for state in "sp"),
                row["balance"],
                row["residual"],
            )
            for row in rows
        ]
    return found


def write(name: str, cases: dict[str, list[dict]]) -> None:
    """Writes the rows of `answer_row` by case as `name`.json, with one line for each light, for readable diffs."""
    blocks = []
    for key, rows in cases.items():
        lines = ",\n".join(json.dumps(row, separators=(",", ":")) for row in rows)
        blocks.append(f"{json.dumps(key, ensure_ascii=False)}: [\n{lines}\n]")
    ANSWERS.mkdir(exist_ok=True)
    (ANSWERS / f"{name}.json").write_text("{\n" + ",\n".join(blocks) + "\n}\n", encoding="utf-8")
