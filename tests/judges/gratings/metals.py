"""Refractive indices of metals, from Mitsuba's data files."""

from __future__ import annotations

from functools import cache
from importlib.metadata import distribution
from pathlib import Path

import numpy as np


@cache
def _spectrum(metal: str, part: str) -> np.ndarray:
    """Rows (wavelength in nm, value) of Mitsuba's file of a metal; `part` is "eta" or "k"."""
    folder = Path(distribution("mitsuba").locate_file("mitsuba/data/ior"))
    return np.loadtxt(folder / f"{metal}.{part}.spd", comments="#")


def index(metal: str, wavelength_nm: float) -> complex:
    """η + ik of a metal, named as Mitsuba's `material`, linearly interpolated between the wavelengths of the file.

    Raises ValueError beyond these wavelengths.
    """
    parts = []
    for name in ("eta", "k"):
        table = _spectrum(metal, name)
        if not table[0, 0] <= wavelength_nm <= table[-1, 0]:
            raise ValueError(
                f"{metal} is known from {table[0, 0]:.0f} to {table[-1, 0]:.0f} nm, not at {wavelength_nm}"
            )
        parts.append(np.interp(wavelength_nm, table[:, 0], table[:, 1]))
    return complex(*parts)


def surface_plasmon(metal_index: complex) -> float:
    """Wave number along a flat metal in air of the surface plasmon, in units of 2π/λ: Re √(ε/(1 + ε)).

    Raether, *Surface Plasmons on Smooth and Rough Surfaces and on Gratings* (1988), ch. 2.
    """
    permittivity = metal_index**2
    return float(np.sqrt(permittivity / (1 + permittivity)).real)
