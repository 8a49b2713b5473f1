"""Profiles of gratings as curves (x, z) with nodes for quadrature, lengths in µm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Order of the map that makes nodes denser towards corners, where fields are singular (`graded`). Chosen: higher orders
# resolve stronger singularities, and leave fewer nodes between the corners.
GRADING = 5


@dataclass(frozen=True)
class Nodes:
    """Points of one period of a curve for a quadrature, as (n,) arrays.

    `weight` is the arc length that a point stands for, and `(normal_x, normal_z)` the unit normal into the air.
    `curvature` in 1/µm is positive where the curve bends towards the normal.
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
        """Largest slope in degrees."""
        return float(np.degrees(np.arctan(np.pi * self.height / self.period)))

    def nodes(self, count: int) -> Nodes:
        """Nodes uniform in x, of spectral accuracy for smooth periodic profiles."""
        phase = 2 * np.pi * (np.arange(count) + 0.5) / count
        wave_number = 2 * np.pi / self.period
        slope = 0.5 * self.height * wave_number * np.cos(phase)
        second_derivative = -0.5 * self.height * wave_number**2 * np.sin(phase)
        length = np.hypot(1, slope)
        return Nodes(
            x=phase / wave_number,
            z=0.5 * self.height * (1 + np.sin(phase)),
            normal_x=-slope / length,
            normal_z=1 / length,
            curvature=second_derivative / length**3,
            weight=length * self.period / count,
        )


@dataclass(frozen=True)
class Polygon:
    """Straight edges through `corners` (x, z) in the order of x, so that the air is on their left.

    The first corner repeats after one period.
    """

    period: float
    corners: tuple[tuple[float, float], ...]

    def nodes(self, count: int) -> Nodes:
        """About `count` nodes, graded towards the corners; half are divided among the edges equally, half by length."""
        first_x, first_z = self.corners[0]
        vertices = np.array([*self.corners, (first_x + self.period, first_z)])
        edges = np.diff(vertices, axis=0)
        lengths = np.hypot(*edges.T)
        shares = 0.5 / len(edges) + 0.5 * lengths / lengths.sum()
        parts = []
        for start, edge, length, share in zip(vertices[:-1], edges, lengths, shares):
            # At least 8 nodes on an edge. Positions and weights are fractions of the edge's length.
            along, weight = graded(max(8, round(count * share)))
            ones = np.ones_like(along)
            normal = np.array([-edge[1], edge[0]]) / length
            part = Nodes(
                x=start[0] + edge[0] * along,
                z=start[1] + edge[1] * along,
                normal_x=normal[0] * ones,
                normal_z=normal[1] * ones,
                curvature=0 * ones,
                weight=length * weight,
            )
            parts.append(part)
        return Nodes(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])})


def blazed(period: float, height: float) -> Polygon:
    """A sawtooth that rises along +x from 0 to `height` and drops at the end of the period."""
    return Polygon(period, ((0.0, 0.0), (period, height)))


def echelette(period: float, slope_deg: float) -> Polygon:
    """A sawtooth with a right angle at its ridges, whose long facet rises along +x at `slope_deg` (below 45)."""
    slope = np.radians(slope_deg)
    length = period * np.cos(slope)
    return Polygon(period, ((0.0, 0.0), (length * np.cos(slope), length * np.sin(slope))))


def lamellar(period: float, height: float) -> Polygon:
    """Ridges of this height over the first half of the period, grooves over the second."""
    half = 0.5 * period
    return Polygon(period, ((0.0, height), (half, height), (half, 0.0), (period, 0.0)))


def graded(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes in (0, 1) and their weights: the midpoint rule after a map whose first derivatives vanish at both ends.

    The map is Kress's sigmoid v(s)^q / (v(s)^q + v(−s)^q) of order q = GRADING, with v(s) = (1/2 − 1/q) s³ + s/q + 1/2
    (Numer. Math. 58, 1990).
    """
    s = 2 * (np.arange(count) + 0.5) / count - 1
    cubic = 0.5 - 1 / GRADING
    # v(s) and v(−s), whose sum is 1.
    near, far = (sign * (cubic * s**3 + s / GRADING) + 0.5 for sign in (1, -1))
    total = near**GRADING + far**GRADING
    derivative = GRADING * (3 * cubic * s**2 + 1 / GRADING) * (near * far) ** (GRADING - 1) / total**2
    return near**GRADING / total, derivative * 2 / count
