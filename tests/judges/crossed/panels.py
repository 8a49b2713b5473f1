"""Vertical discretisation of the solver (solver.py): polynomials over two panels, collocated at Gauss points.

The solver's vertical coordinate s, upwards in µm, is 0 on the relief; one panel lies in each medium.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss


@dataclass(frozen=True)
class Panels:
    """The lower panel [−below, 0] and the upper [0, above], lengths in µm.

    Each panel has `nodes` (≥ 2) nodes at the extrema of a Chebyshev polynomial, which include its ends, and `nodes − 1`
    Gauss points. Both have a node at 0, where the solver equates their values. Nodes and `points` ascend from the lower
    panel to the upper. The matrices `value` and `slope`, `[point, node]`, map values at all nodes to values and slopes
    (per µm) at all points.
    """

    below: float
    above: float
    nodes: int
    points: np.ndarray
    value: np.ndarray
    slope: np.ndarray

    @property
    def count(self) -> int:
        """Number of points of both panels."""
        return len(self.points)

    @property
    def upper(self) -> np.ndarray:
        """Whether each point lies in the upper panel."""
        return self.points > 0


def panels(below: float, above: float, nodes: int) -> Panels:
    """Panels with the heights `below` and `above` in µm."""
    # Nodes and Gauss points of a panel, scaled to [−1, 1].
    extrema = -np.cos(np.pi * np.arange(nodes) / (nodes - 1))
    gauss, _ = leggauss(nodes - 1)
    value, slope = lagrange(extrema, gauss)
    zero = np.zeros_like(value)
    points = np.concatenate([below * (gauss - 1) / 2, above * (gauss + 1) / 2])
    return Panels(
        below,
        above,
        nodes,
        points,
        np.block([[value, zero], [zero, value]]),
        np.block([[slope * 2 / below, zero], [zero, slope * 2 / above]]),
    )


def lagrange(nodes: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values and derivatives at `x` of the polynomials that are 1 at one node and 0 at the others, `[x, node]`.

    They are found by barycentric weights (Berrut and Trefethen, SIAM Review 46, 2004); no `x` may be a node.
    """
    between_nodes = nodes[:, None] - nodes[None, :]
    np.fill_diagonal(between_nodes, 1.0)
    weights = 1 / between_nodes.prod(axis=1)
    from_node = x[:, None] - nodes[None, :]
    terms = weights / from_node
    total = terms.sum(axis=1, keepdims=True)
    value = terms / total
    # Derivative of the quotient w/(x − node) / Σ w/(x − node).
    slope = value * ((terms / from_node).sum(axis=1, keepdims=True) / total - 1 / from_node)
    return value, slope
