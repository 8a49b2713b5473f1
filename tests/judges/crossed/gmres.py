"""GMRES, a solver of linear systems whose matrix is given by its product with a vector."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def gmres(
    apply: Callable[[np.ndarray], np.ndarray], right: np.ndarray, tolerance: float, steps_max: int
) -> tuple[np.ndarray, float]:
    """The solution of `apply(x) = right` and its residual over the norm of `right`, without restarts.

    It ends when the residual is below `tolerance`, or after `steps_max` products. `basis` is an orthonormal basis of
    the Krylov space, and `hessenberg` the matrix in it (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7, 1986).
    """
    norm = np.linalg.norm(right)
    if norm == 0:
        return np.zeros_like(right), 0.0
    basis = [right / norm]
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
        target[0] = norm
        part = hessenberg[: step + 1, :step]
        weights = np.linalg.lstsq(part, target, rcond=None)[0]
        residual = float(np.linalg.norm(part @ weights - target) / norm)
        if residual < tolerance or abs(hessenberg[step, step - 1]) == 0:
            break
        basis.append(new / hessenberg[step, step - 1])
    return sum(weight * vector for weight, vector in zip(weights, basis)), residual
