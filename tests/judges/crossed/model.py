"""Powers of orders by the project's model, from `sunbeam eval`, for reliefs that repeat along x and y."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.judges.gratings.scalar import COHERENCE_LENGTH_UM, ask

from .relief import Relief

# Factor of finer sampling: the phase at 450 nm needs more samples than the heights.
FINER = 3


@dataclass(frozen=True)
class Form:
    """A form of the model, by options of the command."""

    name: str
    obliquity: str
    conserve_energy: bool
    shadowing: bool = False

    def words(self) -> tuple:
        flags = [str(flag).lower() for flag in (self.conserve_energy, self.shadowing)]
        return ("--obliquity", self.obliquity, "--conserve-energy", flags[0], "--shadowing", flags[1])


# The default of `auto` for dielectrics. Its albedo stays below one, so energy conservation would only cost time.
SMALL_SLOPE = Form("small_slope", "small_slope", False)
SMALL_SLOPE_LIMITED = Form("small_slope, limited", "small_slope", True)
# The default of `auto` for conductors.
STAM = Form("stam", "stam", True)
FORMS = (
    SMALL_SLOPE,
    STAM,
    Form("stam, shadowing", "stam", True, shadowing=True),
    Form("stam, not limited", "stam", False),
    Form("unit, not limited", "unit", False),
)


@dataclass(frozen=True)
class Light:
    """The incident light."""

    wavelength_nm: float
    theta_deg: float
    phi_deg: float

    @property
    def wi(self) -> np.ndarray:
        theta, phi = np.radians([self.theta_deg, self.phi_deg])
        return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def efficiencies(
    relief: Relief, index: complex, form: Form, lights: list[tuple[Light, np.ndarray, np.ndarray]]
) -> list:
    """Fraction of unpolarised light in every order, for each light with its orders jx and jy.

    Orders are far apart, so the value at the centre of an order is its fraction times K(0)/λ², with K(0) = 4πs²
    (docs/model.md#coherence).
    """
    ny, nx = relief.heights.shape
    fine = relief.sampled(FINER * nx, FINER * ny)
    questions = []
    for light, jx, jy in lights:
        x, y = (light.wavelength_nm * 1e-3 * j / length for j, length in zip((jx, jy), relief.period))
        x, y = x - light.wi[0], y - light.wi[1]
        wo = np.stack([x, y, np.sqrt(1 - x**2 - y**2)], axis=-1)
        wi = light.wi.tolist()
        questions += [{"wi": wi, "wo": out, "wavelength": light.wavelength_nm} for out in wo.tolist()]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "relief.npy"
        np.save(path, fine.heights)
        pixel = relief.period[0] / fine.heights.shape[1]
        if not np.isclose(pixel, relief.period[1] / fine.heights.shape[0]):
            raise ValueError("the pixels of a file are square")
        words = ["eval", "--method", "exact", "--height-field", path, "--pixel-size", pixel, "--level", "none"]
        words += ["--tiling", "periodic", "--coherence-length", COHERENCE_LENGTH_UM, "--eta", index.real, *form.words()]
        values = np.array(ask(words, questions))
    peak = 4 * np.pi * (COHERENCE_LENGTH_UM / 4) ** 2
    parts = np.split(values, np.cumsum([len(jx) for _, jx, _ in lights])[:-1])
    return [part * (light.wavelength_nm * 1e-3) ** 2 / peak for part, (light, _, _) in zip(parts, lights)]


def misplaced(found: np.ndarray, true: np.ndarray) -> float:
    """Fraction of the reflected power in wrong orders: half the sum of absolute differences over the power."""
    return float(0.5 * np.abs(found - true).sum() / true.sum())
