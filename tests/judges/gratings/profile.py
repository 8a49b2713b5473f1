"""Profiles of gratings as curves with nodes for quadrature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Exponent of the grading of nodes towards a corner, where fields are singular.
GRADING = 5


@dataclass(frozen=True)
class Nodes:
    """Points of one period of a curve for a quadrature: (n,) arrays; lengths in um.

    `weight` is the element of arc; `(normal_x, normal_z)` points up, into the air; `curvature` is n·r''/|r'|² in 1/um.
    """

    x: np.ndarray
    z: np.ndarray
    normal_x: np.ndarray
    normal_z: np.ndarray
    curvature: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True)
class Sinusoid:
    """`height/2 · (1 + sin(2πx/period))`."""

    period: float
    height: float

    @property
    def slope_deg(self) -> float:
        """Steepest slope."""
        return float(np.degrees(np.arctan(np.pi * self.height / self.period)))

    def nodes(self, count: int) -> Nodes:
        """Nodes uniform in x, of spectral accuracy for smooth periodic profiles."""
        phase = 2 * np.pi * (np.arange(count) + 0.5) / count
        rate = 2 * np.pi / self.period
        slope = 0.5 * self.height * rate * np.cos(phase)
        bend = -0.5 * self.height * rate**2 * np.sin(phase)
        length = np.hypot(1, slope)
        return Nodes(
            x=phase / rate,
            z=0.5 * self.height * (1 + np.sin(phase)),
            normal_x=-slope / length,
            normal_z=1 / length,
            curvature=bend / length**3,
            weight=length * self.period / count,
        )


@dataclass(frozen=True)
class Polygon:
    """Straight edges through `corners` (x, z); the first corner repeats after one period."""

    period: float
    corners: tuple[tuple[float, float], ...]

    def nodes(self, count: int) -> Nodes:
        """Nodes graded towards the corners, divided among the edges by length, with a least number on each."""
        ends = np.array([*self.corners, (self.corners[0][0] + self.period, self.corners[0][1])])
        edges = np.diff(ends, axis=0)
        lengths = np.hypot(*edges.T)
        shares = 0.5 / len(edges) + 0.5 * lengths / lengths.sum()
        parts = []
        for start, edge, length, share in zip(ends, edges, lengths, shares):
            along, step = graded(max(8, round(count * share)))
            ones = np.ones_like(along)
            normal = np.array([-edge[1], edge[0]]) / length
            parts.append(
                (
                    start[0] + edge[0] * along,
                    start[1] + edge[1] * along,
                    normal[0] * ones,
                    normal[1] * ones,
                    0 * ones,
                    length * step,
                )
            )
        return Nodes(*(np.concatenate(column) for column in zip(*parts)))


def blazed(period: float, height: float) -> Polygon:
    """A sawtooth that rises along +x from 0 to `height` and drops at the end of the period."""
    return Polygon(period, ((0.0, 0.0), (period, height)))


def echelette(period: float, slope_deg: float) -> Polygon:
    """A sawtooth with a right angle at its ridges, whose long facet rises along +x."""
    slope = np.radians(slope_deg)
    length = period * np.cos(slope)
    return Polygon(period, ((0.0, 0.0), (length * np.cos(slope), length * np.sin(slope))))


def lamellar(period: float, height: float) -> Polygon:
    """`height` over the first half of the period, 0 over the second."""
    half = 0.5 * period
    return Polygon(period, ((0.0, height), (half, height), (half, 0.0), (period, 0.0)))


def graded(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes in (0, 1) and their weights: the midpoint rule after a map whose first derivatives vanish at both ends.

    The map is Kress's (Numer. Math. 58, 1990), a sigmoid of order `GRADING`.
    """
    s = 2 * (np.arange(count) + 0.5) / count - 1
    bend = 0.5 - 1 / GRADING
    near, far = (sign * (bend * s**3 + s / GRADING) + 0.5 for sign in (1, -1))
    total = near**GRADING + far**GRADING
    derivative = GRADING * (3 * bend * s**2 + 1 / GRADING) * (near * far) ** (GRADING - 1) / total**2
    return near**GRADING / total, derivative * 2 / count
