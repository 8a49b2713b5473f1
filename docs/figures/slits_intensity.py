"""What N equal slits send into the far field: in closed form, by a direct sum of waves, and in colours.

Everything is in the plane across the slits, and each slit is lit with the same phase. `sine` is the sine of the angle
with the grating's normal. Intensities are relative: 1 where all waves are in phase.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import mitsuba as mi
import numpy as np

# Waves that a slit is divided into for a direct sum, and for the screen near by, whose phases vary less.
SAMPLES, SCREEN_SAMPLES = 200, 40
# Largest array of waves that is held at a time.
WAVES_AT_A_TIME = 1 << 22
# Colours are summed from 380 to 780 nm in this step; order 3 of 50 slits is 4 nm wide.
COLOUR_STEP_NM = 1.0
# The line that is shown beside white light, and the wavelength whose spread is the unit of white light's.
MIDDLE_NM = 550.0
# Halvings of an interval in which a curve crosses a value.
HALVINGS = 50


@dataclass(frozen=True)
class Slits:
    """So many slits of a width in µm, their centres `spacing_um` apart."""

    count: int
    width_um: float = 30.0
    spacing_um: float = 150.0

    def places_um(self, samples: int) -> np.ndarray:
        """Midpoints in µm of the parts into which the slits are divided, from the middle of the grating."""
        centres = (np.arange(self.count) - (self.count - 1) / 2) * self.spacing_um
        within = ((np.arange(samples) + 0.5) / samples - 0.5) * self.width_um
        return (centres[:, None] + within).ravel()

    @property
    def across_um(self) -> float:
        """N d, or the width of a single slit, in µm."""
        return self.count * self.spacing_um if self.count > 1 else self.width_um

    def zero_sine(self, wavelength_nm: float) -> float:
        """The sine at which the maximum of order zero should end: λ/(N d), or λ/a behind a single slit of width a."""
        return wavelength_nm / 1e3 / self.across_um

    def far_field_mm(self, wavelength_nm: float) -> float:
        """(N d)²/λ in mm, of which a bare screen's distance must be a multiple to show the far field."""
        return self.across_um**2 / wavelength_nm


def relative_intensity(slits: Slits, sine, wavelength_nm) -> np.ndarray:
    """sin²(N x)/(N sin x)² · sin²β/β² with x = π d·sine/λ and β = π a·sine/λ."""
    turns = slits.spacing_um * np.asarray(sine) / (np.asarray(wavelength_nm) / 1e3)
    # The array factor repeats with every order; near x = 0 it keeps its digits.
    x = np.pi * (turns - np.round(turns))
    array = np.ones_like(x)
    beside = np.abs(x) > 1e-9
    array[beside] = np.sin(slits.count * x[beside]) / (slits.count * np.sin(x[beside]))
    return (array * np.sinc(turns * slits.width_um / slits.spacing_um)) ** 2


def direct_amplitude(slits: Slits, sine, wavelength_nm: float, samples: int = SAMPLES) -> np.ndarray:
    """The mean of the waves of all parts of all slits, each with the phase of its own path; complex.

    Its square differs from the closed form by at most 1/(3 samples²).
    """
    return _mean_wave(slits.places_um(samples), np.asarray(sine), lambda place, to: -place * to, wavelength_nm)


def on_bare_screen(slits: Slits, x_mm, distance_mm: float, wavelength_nm: float) -> np.ndarray:
    """The relative intensity at places on a screen at this distance with no lens before it, from exact path lengths."""

    def path_um(place, x):
        # √(L² + Δ²) − L without the loss of digits.
        across = 1e3 * x - place
        return across**2 / (np.hypot(1e3 * distance_mm, across) + 1e3 * distance_mm)

    return np.abs(_mean_wave(slits.places_um(SCREEN_SAMPLES), np.asarray(x_mm), path_um, wavelength_nm)) ** 2


def _mean_wave(places_um: np.ndarray, targets: np.ndarray, path_um: Callable, wavelength_nm: float) -> np.ndarray:
    """The mean over places of exp(2πi path/λ) for each target."""
    parts = max(1, math.ceil(places_um.size * targets.size / WAVES_AT_A_TIME))
    waves = [
        np.exp(2j * np.pi * 1e3 / wavelength_nm * path_um(places_um, part[:, None])).mean(axis=1)
        for part in np.array_split(np.atleast_1d(targets), parts)
    ]
    return np.concatenate(waves)


def sine_of(x_mm, distance_mm: float) -> np.ndarray:
    """The sine of the angle at which a place on a screen is seen from the grating's middle."""
    return np.asarray(x_mm) / np.hypot(x_mm, distance_mm)


def place_mm(sine: float, distance_mm: float) -> float:
    """Where a direction meets a screen at this distance, in mm from the grating's middle."""
    return distance_mm * sine / math.sqrt(1 - sine**2)


def first_zero_sine(slits: Slits, wavelength_nm: float) -> float:
    """Where the amplitude of the direct sum first changes sign beside order zero, which small steps find."""

    def amplitude(sine: float) -> float:
        return float(direct_amplitude(slits, [sine], wavelength_nm, samples=100)[0].real)

    step = slits.zero_sine(wavelength_nm) / 20.5
    sine = step
    while amplitude(sine) > 0:
        sine += step
    return crossing(amplitude, sine - step, sine)


def full_width_sine(slits: Slits, wavelength_nm: float) -> float:
    """The full width at half maximum of order zero, as a difference of sines."""

    def above_half(sine: float) -> float:
        return float(relative_intensity(slits, np.array([sine]), wavelength_nm)[0]) - 0.5

    return 2 * crossing(above_half, 0.0, slits.zero_sine(wavelength_nm))


def first_order_sine(slits: Slits, wavelength_nm: float) -> float:
    """The sine at which the maximum of order one is highest, to 1e-4 of λ/(N d)."""
    unit = slits.zero_sine(wavelength_nm)
    sines = wavelength_nm / 1e3 / slits.spacing_um + unit * np.linspace(-0.5, 0.5, 10001)
    return float(sines[relative_intensity(slits, sines, wavelength_nm).argmax()])


def limit_of_width() -> float:
    """The full width at half maximum of (sin πt / πt)², which that of N slits tends to in units of λ/(N d)."""
    return 2 * crossing(lambda t: float(np.sinc(t)) ** 2 - 0.5, 0.0, 1.0)


def crossing(falling: Callable[[float], float], low: float, high: float) -> float:
    """Where a function that is positive at `low` and negative at `high` is zero."""
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if falling(middle) > 0 else (low, middle)
    return (low + high) / 2


def colour_weights() -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths in nm, and weights that turn intensities there in the light D65 into linear sRGB for the CIE 1931
    observer, from Mitsuba's tables; the weights sum to (1, 1, 1)."""
    before = mi.variant()
    mi.set_variant("scalar_rgb")
    try:
        wavelengths_nm = np.arange(380.0, 780.0 + COLOUR_STEP_NM, COLOUR_STEP_NM)
        weights = np.array(
            [np.array(mi.xyz_to_srgb(mi.cie1931_xyz(nm) * mi.cie_d65(nm))) for nm in map(float, wavelengths_nm)],
            dtype=np.float64,
        )
    finally:
        if before:
            mi.set_variant(before)
    return wavelengths_nm, weights / weights.sum(axis=0)


def white_light(slits: Slits, sine, weights: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Linear sRGB of D65 behind the slits, (len(sine), 3).

    All wavelengths pass the slits alike and spread over widths that grow as λ, so that intensities fall as 1/λ: blue
    leads in the middle, and the light of an order zero as a whole is white. The unit is the maximum of a light that is
    white and spreads as 550 nm does.
    """
    wavelengths_nm, rgb = weights
    seen = relative_intensity(slits, np.asarray(sine)[:, None], wavelengths_nm)
    return (seen * (MIDDLE_NM / wavelengths_nm)) @ rgb


def colour_of_line(wavelength_nm: float, weights: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Linear sRGB of light of one wavelength, brought into what a screen can show, its largest component 1."""
    wavelengths_nm, rgb = weights
    nearest = np.maximum(rgb[np.abs(wavelengths_nm - wavelength_nm).argmin()], 0)
    return nearest / nearest.max()
