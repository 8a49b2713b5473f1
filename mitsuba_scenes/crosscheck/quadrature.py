"""Wavelengths and weights of the sum over the visible spectrum, shared by both renderers.

The linear sRGB colour of a reflectance R(λ) under D65 is Σ R(λᵢ) weights[i]; R = 1 gives white, (1, 1, 1). Single
weights may be negative.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Quadrature:
    """Equidistant ascending `wavelengths_nm`, (n,) with n ≥ 2, and their `weights` in linear sRGB, (n, 3)."""

    wavelengths_nm: np.ndarray
    weights: np.ndarray

    @staticmethod
    def of_report(report: dict) -> Quadrature:
        """The quadrature in a report of `sunbeam render`. Raises ValueError unless its weights sum to white."""
        found = report["quadrature"]
        quadrature = Quadrature(np.array(found["wavelengths_nm"]), np.array(found["weights"]))
        count = len(quadrature.wavelengths_nm)
        if quadrature.weights.shape != (count, 3) or not np.allclose(quadrature.weights.sum(axis=0), 1, atol=1e-5):
            raise ValueError(f"the report's {count} wavelengths do not have weights that sum to white")
        return quadrature

    @property
    def step_nm(self) -> float:
        """Distance between neighbouring wavelengths."""
        return float(self.wavelengths_nm[1] - self.wavelengths_nm[0])
