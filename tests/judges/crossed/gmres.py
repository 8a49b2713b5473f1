"""Linear systems given by their product with a vector (GMRES)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def gmres(
    apply: Callable[[np.ndarray], np.ndarray], right: np.ndarray, tolerance: float, steps_max: int
) -> tuple[np.ndarray, float]:
    """The solution of `apply(x) = right` and its residual over the norm of `right`, without restarts.

    Saad and Schultz, SIAM J. Sci. Stat. Comput. 7, 1986.
    """
    size = np.linalg.norm(right)
    if size == 0:
        return np.zeros_like(right), 0.0
    basis = [right / size]
    hessenberg = np.zeros((steps_max + 1, steps_max), complex)
    for step in range(1, steps_max + 1):
        new = apply(basis[-1])
        # Orthogonalised twice, since rounding leaves errors after the first pass.
        for _ in range(2):
            for i, old in enumerate(basis):
                along = np.vdot(old, new)
                hessenberg[i, step - 1] += along
                new = new - along * old
        hessenberg[step, step - 1] = np.linalg.norm(new)
        target = np.zeros(step + 1, complex)
        target[0] = size
        part = hessenberg[: step + 1, :step]
        weights = np.linalg.lstsq(part, target, rcond=None)[0]
        residual = float(np.linalg.norm(part @ weights - target) / size)
        if residual < tolerance or abs(hessenberg[step, step - 1]) == 0:
            break
        basis.append(new / hessenberg[step, step - 1])
    return sum(weight * vector for weight, vector in zip(weights, basis)), residual
