"""GMRES, a solver of linear systems whose matrix is given by its product with a vector."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def gmres(
    apply: Callable[[np.ndarray], np.ndarray], right: np.ndarray, tolerance: float, steps_max: int
) -> tuple[np.ndarray, float]:
    """The solution x of `apply(x) = right`, and the norm of its residual over that of `right`, without restarts.

    `apply` is linear and takes complex vectors of the shape (n,) of `right`; `steps_max` is at least 1.

    The iteration ends when this residual is below `tolerance`, or after `steps_max` products. `basis` is an orthonormal
    basis of the Krylov space. `hessenberg` has the products of its vectors in this basis: `apply(basis[j])` is
    Σ_i hessenberg[i, j] basis[i] (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7, 1986).
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
        # Weights of the basis vectors in the x of least residual. In the basis, `right` is (norm, 0, …).
        right_in_basis = np.zeros(step + 1, complex)
        right_in_basis[0] = norm
        filled = hessenberg[: step + 1, :step]
        weights = np.linalg.lstsq(filled, right_in_basis, rcond=None)[0]
        residual = float(np.linalg.norm(filled @ weights - right_in_basis) / norm)
        # A product within the space spanned so far means that x is exact.
        if residual < tolerance or abs(hessenberg[step, step - 1]) == 0:
            break
        basis.append(new / hessenberg[step, step - 1])
    # After the last step `basis` may have one vector more than `weights`, which `zip` leaves out.
    return sum(weight * vector for weight, vector in zip(weights, basis)), residual
