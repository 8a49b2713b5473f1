"""Powers of orders by the project's model, from `sunbeam eval`, for dielectric reliefs that repeat along x and y."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.judges.gratings.scalar import COHERENCE_LENGTH_UM, ask, power_of_value

from .relief import Relief
from .solver import direction

# Factor on the samples of a relief along each axis, chosen. The phase screen at 450 nm needs more samples than the
# heights.
FINER = 3


@dataclass(frozen=True)
class Form:
    """A form of the model: obliquity factor, energy conservation and shadowing (docs/model.md)."""

    name: str
    obliquity: str
    conserve_energy: bool
    shadowing: bool = False

    def words(self) -> tuple:
        """The arguments of `sunbeam eval` that select the form."""
        flags = [str(flag).lower() for flag in (self.conserve_energy, self.shadowing)]
        return ("--obliquity", self.obliquity, "--conserve-energy", flags[0], "--shadowing", flags[1])


# The plugin's default for dielectrics. Its albedo stays below 1, so energy conservation would only cost time.
SMALL_SLOPE = Form("small_slope", "small_slope", False)
# "limited" in a name means with energy conservation.
SMALL_SLOPE_LIMITED = Form("small_slope, limited", "small_slope", True)
# The plugin's default for conductors.
STAM = Form("stam", "stam", True)
# Forms that are compared with Maxwell's equations on all reliefs.
FORMS = (
    SMALL_SLOPE,
    STAM,
    Form("stam, shadowing", "stam", True, shadowing=True),
    Form("stam, not limited", "stam", False),
    Form("unit, not limited", "unit", False),
)


@dataclass(frozen=True)
class Light:
    """The incident light: wavelength, angle of incidence, and azimuth from +x."""

    wavelength_nm: float
    theta_deg: float
    phi_deg: float

    @property
    def wi(self) -> np.ndarray:
        """Unit vector to the light."""
        return direction(self.theta_deg, self.phi_deg)


def efficiencies(
    relief: Relief, index: complex, form: Form, lights: list[tuple[Light, np.ndarray, np.ndarray]]
) -> list:
    """Fractions of unpolarised light in orders: an array for each of `lights`, which are triples (light, jx, jy).

    `jx` and `jy` are arrays of the propagating orders' indices along x and y. `index` is that of the dielectric,
    with an imaginary part of 0.
    """
    ny, nx = relief.heights.shape
    fine = relief.sampled(FINER * nx, FINER * ny)
    questions = []
    for light, jx, jy in lights:
        wavelength_um = light.wavelength_nm * 1e-3
        # The grating equation: along each axis wi + wo = λj/period.
        x, y = (wavelength_um * j / period - wi for j, period, wi in zip((jx, jy), relief.period, light.wi))
        wo = np.stack([x, y, np.sqrt(1 - x**2 - y**2)], axis=-1)
        wi = light.wi.tolist()
        questions += [{"wi": wi, "wo": out, "wavelength": light.wavelength_nm} for out in wo.tolist()]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "relief.npy"
        np.save(path, fine.heights)
        pixel_um = relief.period[0] / fine.heights.shape[1]
        if not np.isclose(pixel_um, relief.period[1] / fine.heights.shape[0]):
            raise ValueError("the relief's pixels must be square")
        words = ["eval", "--method", "exact", "--height-field", path, "--pixel-size", pixel_um, "--level", "none"]
        words += ["--tiling", "periodic", "--coherence-length", COHERENCE_LENGTH_UM, "--eta", index.real, *form.words()]
        values = np.array(ask(words, questions))
    # Values of the BSDF in 1/sr at the orders' centres. Times `power_of_value`, in sr, they are the orders' powers.
    parts = np.split(values, np.cumsum([len(jx) for _, jx, _ in lights])[:-1])
    return [part * power_of_value(light.wavelength_nm) for part, (light, _, _) in zip(parts, lights)]


def misplaced(found: np.ndarray, true: np.ndarray) -> float:
    """Fraction of the reflected power in wrong orders: half the sum of absolute differences over the true power."""
    return float(0.5 * np.abs(found - true).sum() / true.sum())
