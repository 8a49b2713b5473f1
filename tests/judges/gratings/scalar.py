"""Order efficiencies of the scalar model: from `sunbeam eval`, and in closed form.

c_j is the amplitude of order j of the phase screen, and O the obliquity factor (docs/model.md).
"""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass

import numpy as np

from mitsuba_scenes.environment import SetupError
from mitsuba_scenes.tool import TOOL

# Coherence length, the plugin's default. With periods of up to 10 µm orders are at least 14 standard deviations apart,
# so the value at the centre of an order is that of the order alone.
COHERENCE_LENGTH_UM = 65.0
# Number of points of the mean in `bessel`, whose integrand is smooth and periodic.
BESSEL_POINTS = 256


@dataclass(frozen=True)
class Model:
    """The model `ensemble` with an obliquity factor, with or without energy conservation."""

    obliquity: str
    conserve_energy: bool

    @property
    def name(self) -> str:
        """The model's name on pages; "limited" stands for energy conservation."""
        return f"{self.obliquity}, limited" if self.conserve_energy else self.obliquity


STAM, STAM_LIMITED, UNIT = Model("stam", False), Model("stam", True), Model("unit", False)
MODELS = (STAM_LIMITED, STAM, UNIT)


@dataclass(frozen=True)
class Grating:
    """A preset of `sunbeam`: `sinusoidal`, `blazed` or `lamellar`, with its period and height in µm."""

    preset: str
    period: float
    height: float


@dataclass(frozen=True)
class Light:
    """The incident light; `theta_i_deg` is its angle with the normal, negative from the side of −x."""

    wavelength_nm: float
    theta_i_deg: float


def propagating(period: float, light: Light) -> tuple[np.ndarray, np.ndarray]:
    """The orders above the horizon and their `wo.x`, for a period in µm, by the grating equation."""
    # λ/d.
    ratio = light.wavelength_nm / 1e3 / period
    sine = np.sin(np.radians(light.theta_i_deg))
    # One order more at either end; the comparison with 1 removes it.
    orders = np.arange(int(-(1 - sine) / ratio) - 1, int((1 + sine) / ratio) + 2)
    towards = orders * ratio - sine
    return orders[np.abs(towards) < 1], towards[np.abs(towards) < 1]


def surface_words(grating: Grating, model: Model, coherence_length_um: float, cover_eta: float | None = None) -> list:
    """The arguments of `sunbeam eval` for a grating, a model, and the index of a cover."""
    words = ["--preset", grating.preset, "--period", grating.period, "--height", grating.height]
    words += ["--coherence-length", coherence_length_um, "--obliquity", model.obliquity]
    words += [] if cover_eta is None else ["--cover-eta", cover_eta]
    return [*words, "--conserve-energy", str(model.conserve_energy).lower()]


def efficiencies(
    grating: Grating,
    model: Model,
    lights: list[Light],
    coherence_length_um: float = COHERENCE_LENGTH_UM,
    cover_eta: float | None = None,
) -> list[np.ndarray]:
    """Fractions of the power in the propagating orders for each light, by `sunbeam eval --method exact`.

    `cover_eta` is the index of a cover, or `None` without one.
    """
    questions, sizes = [], []
    for light in lights:
        sine = np.sin(np.radians(light.theta_i_deg))
        _, towards = propagating(grating.period, light)
        sizes.append(len(towards))
        wi = [sine, 0, np.sqrt(1 - sine**2)]
        questions += [{"wi": wi, "wo": [x, 0, np.sqrt(1 - x * x)], "wavelength": light.wavelength_nm} for x in towards]
    words = surface_words(grating, model, coherence_length_um, cover_eta)
    values = ask(["eval", "--method", "exact", *words], questions)
    parts = np.split(np.array(values), np.cumsum(sizes)[:-1])
    return [part * power_of_value(light.wavelength_nm, coherence_length_um) for part, light in zip(parts, lights)]


def power_of_value(wavelength_nm: float, coherence_length_um: float = COHERENCE_LENGTH_UM) -> float:
    """Ratio λ²/K(0) of an order's power to the BSDF at its centre, in sr, if other orders are far from it.

    K(0) = 4πs² is the window's power spectrum at its centre, and s a quarter of the coherence length
    (docs/model.md#coherence). λ is the wavelength in air, under a cover too.
    """
    return (wavelength_nm * 1e-3) ** 2 / (4 * np.pi * (coherence_length_um / 4) ** 2)


def integrated(grating: Grating, model: Model, light: Light, order: int, points: int = 31) -> float:
    """Power of an order: the BSDF's integral over wo.x and wo.y, to six standard deviations around its centre.

    The solid angle times the cosine of wo is dwo.x dwo.y. `points` is the number of directions along either axis.
    """
    sine = np.sin(np.radians(light.theta_i_deg))
    orders, towards = propagating(grating.period, light)
    centre = towards[orders == order][0]
    # The BSDF falls as exp(−4π²s²u²/λ²) with the distance u from the centre, so u has this standard deviation.
    deviation = light.wavelength_nm / 1e3 / (2 * np.sqrt(2) * np.pi * COHERENCE_LENGTH_UM / 4)
    steps = np.linspace(-6, 6, points) * deviation
    lobe = [(centre + u, v) for u in steps for v in steps]
    wi = [sine, 0, np.sqrt(1 - sine**2)]
    questions = [
        {"wi": wi, "wo": [x, y, np.sqrt(1 - x * x - y * y)], "wavelength": light.wavelength_nm}
        for x, y in lobe
        if x * x + y * y < 1
    ]
    words = surface_words(grating, model, COHERENCE_LENGTH_UM)
    return float(np.sum(ask(["eval", "--method", "exact", *words], questions)) * (steps[1] - steps[0]) ** 2)


def ask(words: list, questions: list[dict]) -> list[float]:
    """The BSDF in 1/sr for each question, by `sunbeam` with the arguments `words`, which begin with "eval".

    A question is {"wi": [x, y, z], "wo": [x, y, z], "wavelength": nm}. Raises SetupError if one cannot be answered.
    """
    if not TOOL.exists():
        raise SetupError(f"the command line tool {TOOL} is missing: run `make tool`")
    lines = "".join(json.dumps(question) + "\n" for question in questions)
    done = subprocess.run([str(TOOL), *map(str, words)], input=lines, capture_output=True, text=True)
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    if done.returncode != 0 or len(answers) != len(questions) or any("error" in answer for answer in answers):
        wrong = next((answer["error"] for answer in answers if "error" in answer), done.stderr.strip())
        raise SetupError(f"`sunbeam {words[0]}` failed: {wrong or done.returncode}")
    return [answer["f"] for answer in answers]


def closed_form(grating: Grating, obliquity: str, light: Light) -> np.ndarray:
    """Efficiencies O |c_j|² without energy conservation; `obliquity` is "unit" or "stam"."""
    orders, towards = propagating(grating.period, light)
    sine = np.sin(np.radians(light.theta_i_deg))
    cos_i, cos_o = np.sqrt(1 - sine**2), np.sqrt(1 - towards**2)
    w = cos_i + cos_o
    phase = 2e3 * np.pi * w / light.wavelength_nm * grating.height
    power = screen_powers(grating.preset, orders, phase)
    if obliquity == "unit":
        return power
    return power * (1 + sine * towards + cos_i * cos_o) ** 2 / (cos_i * cos_o * w**2)


def screen_powers(preset: str, orders: np.ndarray, phase: np.ndarray) -> np.ndarray:
    """|c_j|² of the orders j of a preset. `phase` is κ times its height from valley to peak, in radians, by order."""
    if preset == "sinusoidal":
        return np.array([bessel(order, 0.5 * p) ** 2 for order, p in zip(orders, phase)])
    if preset == "blazed":
        # NumPy's sinc(x) is sin(πx)/(πx).
        return np.sinc(phase / (2 * np.pi) + orders) ** 2
    # Lamellar; orders that are even but not 0 vanish. The inner choice avoids a division by 0.
    odd = np.where(orders % 2 == 1, np.sin(0.5 * phase) / (0.5 * np.pi * np.where(orders == 0, 1, orders)), 0)
    return np.where(orders == 0, np.cos(0.5 * phase), odd) ** 2


def bessel(order: int, argument: float) -> float:
    """J_order(argument), the mean of cos(order τ − argument sin τ)."""
    tau = 2 * np.pi * (np.arange(BESSEL_POINTS) + 0.5) / BESSEL_POINTS
    return float(np.mean(np.cos(order * tau - argument * np.sin(tau))))


def misplaced(found: np.ndarray, true: np.ndarray) -> float:
    """Power in wrong orders: half the sum of absolute differences."""
    return float(0.5 * np.abs(found - true).sum())
