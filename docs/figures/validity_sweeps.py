"""Gratings and lights of the documentation's part `validity`, and errors of scalar models on them.

Gratings are in a perfect conductor. Their lengths are in µm; a height is from valley to peak. The plane of incidence is
across the grooves; at a negative angle light comes from the side of −x.

- *Model*: scalar diffraction, the phase screen, with an obliquity factor, with or without energy conservation
  (tests/judges/gratings/scalar.py).
- *Efficiency*: the fraction of the incident light in an order. The rigorous solver gives the true efficiencies.
- *Misplaced* power: the fraction of the light that a model puts into wrong orders. It is half the sum of the absolute
  differences of all orders' efficiencies.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from tests.judges.gratings.boundary_integral import Efficiencies, solve
from tests.judges.gratings.profile import Polygon, Sinusoid, blazed, lamellar
from tests.judges.gratings.scalar import (
    MODELS,
    Grating,
    Light,
    Model,
    closed_form,
    efficiencies,
    misplaced,
    propagating,
)

# More values in the following lists would sample the sweeps more finely, and take longer.
#
# Wavelengths over which errors are averaged.
WAVELENGTHS_NM = (450.0, 520.0, 580.0, 650.0)
# Angles of incidence from the side of +x.
ANGLES_DEG = (0.0, 30.0, 60.0, 75.0)
# Period of the gratings in the sweep over slopes.
PERIOD_UM = 2.5
# Largest slopes of the sinusoids in the sweep over slopes.
SLOPES_DEG = (2.5, 5.0, 7.5, 10.0, 12.5, 15.0, 20.0, 25.0, 30.0, 45.0)
# Slopes of the sawteeth's facets in the sweep over slopes. At 5.71° the height is a tenth of the period.
FACETS_DEG = (1.0, 2.0, 3.0, 5.71, 7.5, 10.0, 15.0, 20.0, 30.0)
# Periods of the sweep over periods.
PERIODS_UM = (0.8, 1.25, 1.75, 2.5, 3.5, 5.0, 10.0)
# Largest slope of the sinusoid in the sweep over periods.
SWEPT_SLOPE_DEG = 10.0
# Slope of the sawtooth's facets in the sweep over periods.
SWEPT_FACET_DEG = 5.71
# Height of the lamellar grating in the sweep over periods.
SWEPT_HEIGHT_UM = 0.125


def sinusoid(period_um: float, slope_deg: float) -> Grating:
    """The sinusoid with the largest slope `slope_deg`, an angle whose tangent is π·height/period."""
    return Grating("sinusoidal", period_um, period_um * np.tan(np.radians(slope_deg)) / np.pi)


def sawtooth(period_um: float, facet_deg: float) -> Grating:
    """The sawtooth whose facets rise along +x with the slope `facet_deg`."""
    return Grating("blazed", period_um, period_um * np.tan(np.radians(facet_deg)))


def profile(grating: Grating) -> Sinusoid | Polygon:
    """The grating's profile for the rigorous solver."""
    make = {"sinusoidal": Sinusoid, "blazed": blazed, "lamellar": lamellar}[grating.preset]
    return make(grating.period, grating.height)


@dataclass(frozen=True)
class Comparison:
    """Efficiencies of a grating's propagating orders under one light."""

    light: Light
    rigorous: Efficiencies
    # Efficiencies by the name of the model, in the order of `rigorous.orders`.
    scalar: dict[str, np.ndarray]

    def misplaced(self, model: Model, polarisation: str = "unpolarised") -> float:
        """Misplaced power of a model in a polarisation: "unpolarised", "te" or "tm"."""
        return misplaced(self.scalar[model.name], getattr(self.rigorous, polarisation))


@cache
def compared(grating: Grating, angles_deg: tuple, wavelengths_nm: tuple = WAVELENGTHS_NM) -> list[Comparison]:
    """Comparisons at all angles and wavelengths, angle by angle.

    Models with energy conservation, which have no closed form, are computed by `sunbeam eval`.
    """
    lights = [Light(wavelength, angle) for angle in angles_deg for wavelength in wavelengths_nm]
    scalar = {
        model.name: efficiencies(grating, model, lights)
        if model.conserve_energy
        else [closed_form(grating, model.obliquity, light) for light in lights]
        for model in MODELS
    }
    found = []
    for i, light in enumerate(lights):
        rigorous = solve(profile(grating), light.wavelength_nm, light.theta_i_deg)
        assert np.array_equal(rigorous.orders, propagating(grating.period, light)[0])
        found.append(Comparison(light, rigorous, {name: values[i] for name, values in scalar.items()}))
    return found


def angles_of(grating: Grating) -> tuple:
    """ANGLES_DEG, and for a sawtooth, which is not symmetric, also their negatives.

    At positive angles its facets face away from the light.
    """
    return ANGLES_DEG + (tuple(-angle for angle in ANGLES_DEG[1:]) if grating.preset == "blazed" else ())


def at_angle(grating: Grating, angle_deg: float) -> list[Comparison]:
    """Comparisons at all wavelengths and one of the angles of `angles_of`."""
    return [each for each in compared(grating, angles_of(grating)) if each.light.theta_i_deg == angle_deg]


def mean_error(grating: Grating, model: Model, angle_deg: float, polarisation: str = "unpolarised") -> float:
    """Misplaced power at an angle of `angles_of`, mean over the wavelengths."""
    return float(np.mean([each.misplaced(model, polarisation) for each in at_angle(grating, angle_deg)]))


def mean_sum(grating: Grating, model: Model, angle_deg: float) -> float:
    """Sum of the model's efficiencies over the orders at an angle of `angles_of`, mean over the wavelengths."""
    return float(np.mean([each.scalar[model.name].sum() for each in at_angle(grating, angle_deg)]))


def rms_per_order(gratings: list[Grating], model: Model, polarisation: str = "unpolarised") -> float:
    """Rms error of an order's efficiency over all orders, lights and gratings.

    The polarisation is "unpolarised", "te" or "tm".
    """
    errors = [
        each.scalar[model.name] - getattr(each.rigorous, polarisation)
        for grating in gratings
        for each in compared(grating, angles_of(grating))
    ]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def crossing(x: list[float], errors: list[float], bound: float, falling: bool = False) -> float | None:
    """The x at which the error first exceeds `bound`, linearly interpolated, as x grows from its smallest value.

    With `falling` x falls from its largest value instead. `None` if the first error exceeds the bound; the last x if no
    error does.
    """
    x, errors = (list(reversed(values)) if falling else list(values) for values in (x, errors))
    for i, error in enumerate(errors):
        if error > bound:
            if i == 0:
                return None
            return float(x[i - 1] + (x[i] - x[i - 1]) * (bound - errors[i - 1]) / (error - errors[i - 1]))
    return float(x[-1])
