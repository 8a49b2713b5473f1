"""Figures 1.6 and 2.1 of Single 2014 as drawings: the plane of incidence over a grating, and the coordinates of a map
of the outgoing hemisphere.

Space is drawn in cabinet projection: x to the right and z up are as they are, so that angles in the plane of incidence
are true; y, which goes to the back, is shortened.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from .slits_drawings import (
    GROOVES_NM,
    INK,
    LIGHT,
    MARK,
    SURFACE,
    WAVELENGTH_NM,
    angle_arc,
    arrow,
    measure,
    order_angle_deg,
    plain,
    signed,
    toward,
)
from .slits_patterns import save_svg

# How a length along y is drawn.
BACKWARD = np.array([0.42, 0.3])
# The incidence of the evaluation, and of the map.
EVALUATED_THETA_I_DEG, MAP_THETA_I_DEG = 75.0, 30.0
# The direction of view that the map's drawing explains.
THETA_V_DEG, PHI_V_DEG = 50.0, 40.0
MAP_ORDERS = (-2, -1, 0, 1, 2, 3, 4, 5, 6)


def flat(points) -> np.ndarray:
    """Points in space, (…, 3), as they are drawn."""
    points = np.asarray(points, dtype=float)
    return points[..., [0, 2]] + points[..., [1]] * BACKWARD


def direction(theta_deg: float, phi_deg: float) -> np.ndarray:
    """The unit vector at an angle from the normal and an azimuth from +x."""
    theta, phi = math.radians(theta_deg), math.radians(phi_deg)
    return np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])


def curve(ax: Axes, points, **style) -> None:
    """A line through points in space."""
    ax.plot(*flat(points).T, **style)


def incident_plane(path: Path) -> dict:
    """Figure 1.6: light and view in the plane of incidence, across the grooves. Returns both angles in degrees."""
    theta_i, half, deep, high = EVALUATED_THETA_I_DEG, 1.45, 1.0, 1.2
    theta_r = order_angle_deg(1, WAVELENGTH_NM, GROOVES_NM, theta_i)
    figure = Figure(figsize=(9.5, 5.2), layout="constrained")
    ax = figure.subplots()

    def plane(corners, colour: str) -> None:
        ax.add_patch(Polygon(flat(corners), closed=True, facecolor=colour, edgecolor="#1d2329", lw=0.8, alpha=0.8))

    plane([(-half, -deep, 0), (half, -deep, 0), (half, deep, 0), (-half, deep, 0)], "#f7e1a0")
    step = 0.29
    for x in np.arange(-4, 5) * step:
        curve(ax, [(x, -deep, 0), (x, deep, 0)], color="#9a7b1f", lw=0.9)
    # From the back to the front.
    plane([(0, 0, 0), (0, deep, 0), (0, deep, high), (0, 0, high)], "#a9cbe8")
    plane([(-half, 0, 0), (half, 0, 0), (half, 0, high), (-half, 0, high)], "#b7dfb0")
    plane([(0, -deep, 0), (0, 0, 0), (0, 0, high), (0, -deep, high)], "#a9cbe8")
    arrow(ax, (0, 0), (0, 1.5), INK["color"], 1.4)
    ax.text(0.06, 1.5, "n", fontsize=12, va="center", **INK)
    arrow(ax, 1.42 * toward(theta_i), (0, 0), LIGHT, 2, "incident-light")
    arrow(ax, (0, 0), 1.42 * toward(theta_r), MARK, 2, "incident-view")
    ax.text(*(1.3 * toward(theta_i) + (0, 0.09)), "L", fontsize=12, ha="center", va="center", color=LIGHT)
    ax.text(*(1.52 * toward(theta_r)), "V", fontsize=12, ha="center", va="center", color=MARK)
    angle_arc(ax, (0, 0), 0.62, 0, theta_i, f"θi = {theta_i:g}°", beyond=0.2)
    angle_arc(ax, (0, 0), 0.85, theta_r, 0, "")
    ax.text(-0.7, 0.86, f"θr = {signed(theta_r, 1)}°", fontsize=11, ha="center", va="center", **INK)
    for k in (1, 2, 3):
        ends = flat([(k * step, -deep, 0), ((k + 1) * step, -deep, 0)]) - (0, 0.05)
        measure(ax, *ends, "d", (0, -0.08))
    ax.text(*flat((-half + 0.13, -0.85 * deep, 0)), "surface", fontsize=11, **INK)
    ax.text(half - 0.05, 1.1, "plane of incidence", fontsize=11, ha="right", **INK)
    plain(ax, (-2.0, 2.0), (-0.55, 1.62))
    save_svg(figure, path)
    return {"theta_i_deg": theta_i, "theta_r_deg": theta_r}


def map_coordinates(path: Path) -> list[dict]:
    """Figure 2.1: a map of the outgoing hemisphere, and the directions it shows in space. Returns the orders that are
    marked on it, and their places."""
    figure = Figure(figsize=(11, 5.6), layout="constrained")
    disc, space = figure.subplots(1, 2)
    orders = _disc(disc)
    _hemisphere(space)
    save_svg(figure, path)
    return orders


def _disc(ax: Axes) -> list[dict]:
    """The map: each direction at the x and y of its unit vector."""
    ax.add_patch(Circle((0, 0), 1, facecolor="#20242a", edgecolor="none"))
    for theta_deg in (30, 60, 90):
        radius = math.sin(math.radians(theta_deg))
        ax.add_patch(Circle((0, 0), radius, facecolor="none", edgecolor="#8d99a6", lw=0.8))
        place = (radius - 0.02) * np.array([-0.71, 0.71])
        ax.text(*place, f"{theta_deg}°", color="#c9d1d9", fontsize=9, ha="left", va="top")
    ax.plot([-1, 1], [0, 0], [0, 0], [-1, 1], color="#8d99a6", lw=0.8)
    view = direction(THETA_V_DEG, PHI_V_DEG)[:2]
    ax.plot(*np.transpose([[0, 0], view]), color="#ffb703", lw=2, gid="map-view")
    ax.plot(*view, "o", ms=8, color="#ffb703")
    ax.text(*(0.5 * view + (-0.09, 0.07)), "sin θv", color="#ffb703", fontsize=12, ha="center", rotation=PHI_V_DEG)
    turn = np.radians(np.linspace(0, PHI_V_DEG, 40))
    ax.plot(0.3 * np.cos(turn), 0.3 * np.sin(turn), color="#ffb703", lw=1.2)
    ax.text(0.37, 0.12, "φv", color="#ffb703", fontsize=12, ha="center", va="center")
    rows = []
    for order in MAP_ORDERS:
        x = math.sin(math.radians(order_angle_deg(order, WAVELENGTH_NM, GROOVES_NM, MAP_THETA_I_DEG)))
        ax.plot(x, 0, "o", ms=5, color="#90e0a0", gid=f"map-order{order}")
        ax.text(x, -0.1, signed(order), color="#90e0a0", fontsize=10, ha="center", va="center")
        rows.append({"order": order, "x": x})
    ax.plot(math.sin(math.radians(MAP_THETA_I_DEG)), 0, "o", ms=9, mfc="none", mec="#ff6b6b", mew=1.6)
    ax.text(
        math.sin(math.radians(MAP_THETA_I_DEG)), -0.22, "ωi", color="#ff6b6b", fontsize=12, ha="center", va="center"
    )
    ax.text(-0.04, -0.3, "orders j", color="#90e0a0", fontsize=10, ha="right", va="center")
    ax.text(1.06, 0, "x", fontsize=12, va="center", **INK)
    ax.text(0, 1.06, "y", fontsize=12, ha="center", va="center", **INK)
    plain(ax, (-1.15, 1.15), (-1.15, 1.15))
    return rows


def _hemisphere(ax: Axes) -> None:
    """The directions in space; the map is what is seen of the hemisphere from above."""
    turn = np.radians(np.linspace(0, 360, 181))
    circle = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)
    ax.add_patch(Polygon(flat(circle), closed=True, facecolor="#e9ecef", edgecolor=SURFACE, lw=1))
    for phi_deg in (0, 90):
        curve(ax, [direction(t, phi_deg) for t in np.linspace(-90, 90, 91)], color=SURFACE, lw=0.8, ls="--")
    for end, label in (((1.3, 0, 0), "x"), ((0, 1.55, 0), "y"), ((0, 0, 1.25), "n")):
        arrow(ax, flat((0, 0, 0)), flat(end), INK["color"], 1)
        ax.text(*(flat(end) * 1.07), label, fontsize=12, ha="center", va="center", **INK)
    for name, angle, theta, phi, radius, colour in (
        ("ωi", "θi", MAP_THETA_I_DEG, 0.0, 0.45, "#d62828"),
        ("ωo", "θv", THETA_V_DEG, PHI_V_DEG, 0.7, "#b97a00"),
    ):
        tip = direction(theta, phi)
        below = tip * (1, 1, 0)
        arrow(ax, flat((0, 0, 0)), flat(tip), colour, 2)
        curve(ax, [tip, below], color=colour, lw=1, ls=":")
        ax.plot(*flat(below), "o", ms=5, color=colour)
        ax.text(*(flat(tip) * 1.09), name, color=colour, fontsize=12, ha="center", va="center")
        curve(ax, [radius * direction(t, phi) for t in np.linspace(0, theta, 31)], color=colour, lw=1)
        label = flat((radius + 0.09) * direction(0.35 * theta, phi))
        ax.text(*label, angle, color=colour, fontsize=11, ha="center", va="center")
    tip = direction(THETA_V_DEG, PHI_V_DEG) * (1, 1, 0)
    curve(ax, [(0, 0, 0), tip], color="#b97a00", lw=1.6)
    curve(ax, [0.4 * direction(90, p) for p in np.linspace(0, PHI_V_DEG, 31)], color="#b97a00", lw=1)
    ax.text(*flat(0.72 * direction(90, 0.45 * PHI_V_DEG)), "φv", color="#b97a00", fontsize=11, ha="center", va="center")
    plain(ax, (-1.45, 1.5), (-0.55, 1.4))
