"""Figures 1.2, 1.3 and 1.7 of Single 2014 as drawings whose angles are computed: slits before a screen, the orders of a
reflecting grating, and the paths over two of its grooves.

Signs are those of docs/model.md: x is to the right, directions point away from the surface, and an angle in the plane
of x is positive on the side of +x. Rays that stand for a direction carry an id in the SVG, so that a test can measure
them.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Polygon, Rectangle

from .slits_intensity import Slits, colour_of_line, colour_weights, relative_intensity, sine_of
from .slits_patterns import save_svg, srgb

WAVELENGTH_NM = 550.0
# Spacings of the two gratings: slits that spread one order visibly, and the grooves of the blazed grating.
SLITS_NM, GROOVES_NM = 1250.0, 2500.0
# Incidence of figures 1.3 and 1.7.
ORDERS_THETA_I_DEG, PATHS_THETA_I_DEG = 30.0, 50.0
DRAWN_ORDERS = (-1, 0, 1, 2, 3)
# Orders 2 and 3 do not overlap from 450 to 650 nm.
FAN_NM = tuple(range(450, 651, 10))
LIGHT, WAY, SURFACE, MARK = "#c8781e", "#2a6f97", "#8a8f94", "#c1121f"
INK = {"color": "#1d2329"}
# White behind a text that lies on lines.
BEHIND = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}


def order_angle_deg(order: int, wavelength_nm: float, period_nm: float, theta_i_deg: float) -> float:
    """The angle in degrees at which an order leaves, by the grating equation: wo.x = jλ/d − sin θi."""
    return math.degrees(math.asin(order * wavelength_nm / period_nm - math.sin(math.radians(theta_i_deg))))


def signed(number: float, decimals: int = 0) -> str:
    """A number with a minus sign instead of a hyphen."""
    return f"{number:.{decimals}f}".replace("-", "−")


def toward(angle_deg: float) -> np.ndarray:
    """The unit vector at an angle with the normal, which is up."""
    return np.array([math.sin(math.radians(angle_deg)), math.cos(math.radians(angle_deg))])


def arrow(ax: Axes, start, end, colour: str, width: float = 1.4, name: str | None = None) -> None:
    """A ray from `start` to `end`, with its head at the end."""
    ax.plot(*np.transpose([start, end]), color=colour, lw=width, solid_capstyle="butt", gid=name)
    head = {"arrowstyle": "-|>", "color": colour, "lw": 0, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 8 + 4 * width}
    nearly = np.asarray(end) - 1e-3 * (np.asarray(end) - start)
    ax.annotate("", xy=end, xytext=nearly, arrowprops=head)


def angle_arc(
    ax: Axes, centre, radius: float, first_deg: float, last_deg: float, label: str, beyond: float = 0.09
) -> None:
    """An arc between two angles with the vertical, positive towards the right, and its label `beyond` the middle."""
    low, high = sorted((90 - first_deg, 90 - last_deg))
    ax.add_patch(Arc(centre, 2 * radius, 2 * radius, theta1=low, theta2=high, lw=0.9, **INK))
    place = np.asarray(centre) + (radius + beyond) * toward((first_deg + last_deg) / 2)
    ax.text(*place, label, ha="center", va="center", fontsize=11, **INK)


def measure(ax: Axes, start, end, label: str, offset) -> None:
    """A length between two points, with arrows at both ends."""
    ax.annotate(
        "", xy=end, xytext=start, arrowprops={"arrowstyle": "<->", "lw": 0.9, "shrinkA": 0, "shrinkB": 0, **INK}
    )
    ax.text(*((np.asarray(start) + end) / 2 + offset), label, ha="center", va="center", fontsize=11, **INK)


def plain(ax: Axes, xlim: tuple[float, float], ylim: tuple[float, float]) -> None:
    """A panel without axes in which both directions have one scale, so that angles are what they are said to be."""
    ax.set(xlim=xlim, ylim=ylim, aspect="equal")
    ax.axis("off")


def slits_and_screen(path: Path) -> dict:
    """Figure 1.2: a plane wave on slits before a screen, and the path difference of two of them. Returns the angle of
    the first order in degrees."""
    theta_deg = order_angle_deg(1, WAVELENGTH_NM, SLITS_NM, 0)
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    whole, near = figure.subplots(1, 2, width_ratios=(1.75, 1))
    _screen(whole, theta_deg)
    _path_difference(near, theta_deg)
    save_svg(figure, path)
    return {"first_deg": theta_deg, "period_nm": SLITS_NM}


def _screen(ax: Axes, theta_deg: float) -> None:
    """The whole set-up; the distance of the slits is drawn larger than it is."""
    slit, gap, distance, count = 0.03, 0.15, 1.15, 3
    half = math.tan(math.radians(theta_deg)) * distance
    for x in np.linspace(-0.36, -0.2, 3):
        ax.plot([x, x], [-0.36, 0.36], color=WAY, lw=1.2)
    for y in np.linspace(-0.28, 0.28, 5):
        arrow(ax, (-0.44, y), (-0.07, y), LIGHT, 1.0)
    edges = [-0.42, *(y for k in (-1, 0, 1) for y in (k * gap - slit / 2, k * gap + slit / 2)), 0.42]
    for low, high in zip(edges[::2], edges[1::2]):
        ax.add_patch(Rectangle((-0.025, low), 0.05, high - low, color=SURFACE, lw=0))
    ax.add_patch(Rectangle((distance, -0.78), 0.025, 1.56, color=SURFACE, lw=0))
    for order, y in ((-1, -half), (0, 0.0), (1, half)):
        for k in (-1, 0, 1):
            name = f"screen-order{order}" if k == 0 else None
            ax.plot([0, distance], [k * gap, y], color=WAY, lw=1.2 if k == 0 else 0.6, gid=name)
        ax.text(distance + 0.3, y, f"order {signed(order)}", va="center", fontsize=11, **INK)
    # The intensity that the screen shows, to the right of it.
    y = np.linspace(-0.75, 0.75, 1201)
    slits = Slits(count, SLITS_NM / 5e3, SLITS_NM / 1e3)
    seen = relative_intensity(slits, sine_of(y, distance), WAVELENGTH_NM)
    ax.fill_betweenx(y, distance + 0.03, distance + 0.03 + 0.22 * seen, color="#7cb518", lw=0)
    ax.add_patch(Arc((0, 0), 0.76, 0.76, theta1=0, theta2=theta_deg, lw=0.9, **INK))
    ax.text(0.4, 0.12, f"θ = {theta_deg:.1f}°", fontsize=11, va="center", bbox=BEHIND, **INK)
    measure(ax, (-0.055, -gap), (-0.055, 0), "d", (-0.04, 0))
    measure(ax, (0, -0.7), (distance, -0.7), "L ≫ d", (0, 0.06))
    ax.text(-0.3, 0.43, "plane wave", ha="center", fontsize=11, **INK)
    ax.text(0.0, 0.47, "slits", ha="center", fontsize=11, **INK)
    ax.text(distance, 0.83, "screen", ha="center", fontsize=11, **INK)
    plain(ax, (-0.47, 1.66), (-0.82, 0.92))


def _path_difference(ax: Axes, theta_deg: float) -> None:
    """Two slits a distance d apart, and the parallel rays to a far screen."""
    theta = math.radians(theta_deg)
    along = np.array([math.cos(theta), math.sin(theta)])
    upper, lower = np.array([0.0, 1.0]), np.zeros(2)
    foot = lower + math.sin(theta) * along
    for low, high in ((-0.42, -0.07), (0.07, 0.93), (1.07, 1.35)):
        ax.add_patch(Rectangle((-0.09, low), 0.09, high - low, color=SURFACE, lw=0))
    ax.add_patch(Polygon([upper, lower, foot], closed=True, color="#f6bd60", lw=0))
    for name, start in (("path-upper", upper), ("path-lower", lower)):
        arrow(ax, start, start + 1.25 * along, WAY, 1.4, name)
        ax.plot([start[0], 1.0], [start[1], start[1]], color=SURFACE, lw=0.8, ls="--")
    ax.plot(*np.transpose([upper, foot - 0.25 * (upper - foot)]), color=LIGHT, lw=1.2)
    ax.add_patch(Arc(upper, 0.7, 0.7, theta1=270, theta2=270 + theta_deg, lw=0.9, **INK))
    ax.text(0.1, 0.57, "θ", ha="center", fontsize=11, **INK)
    ax.add_patch(Arc(lower, 1.3, 1.3, theta1=0, theta2=theta_deg, lw=0.9, **INK))
    ax.text(0.72, 0.14, "θ", ha="center", va="center", fontsize=11, **INK)
    measure(ax, (-0.17, 0), (-0.17, 1), "d", (-0.08, 0))
    ax.text(0.5, -0.16, "e = d sin θ = λ", ha="center", fontsize=11, color=MARK)
    ax.plot(*np.transpose([lower, foot]), color=MARK, lw=2.6)
    plain(ax, (-0.35, 1.3), (-0.45, 1.6))


def reflected_orders(path: Path) -> list[dict]:
    """Figure 1.3: orders of white light that a grating reflects. Returns each order's range of angles in degrees."""
    weights = colour_weights()
    figure = Figure(figsize=(9.5, 5.4), layout="constrained")
    ax = figure.subplots()
    rows = []
    for order in DRAWN_ORDERS:
        angles = {nm: order_angle_deg(order, nm, GROOVES_NM, ORDERS_THETA_I_DEG) for nm in FAN_NM}
        middle = toward(np.mean([angles[FAN_NM[0]], angles[FAN_NM[-1]]]))
        if order:
            for nm, angle in angles.items():
                colour = srgb(colour_of_line(nm, weights))
                ray = np.array([[0.5], [1.25]]) * toward(angle)
                ax.plot(*ray.T, color=colour, lw=3.2, solid_capstyle="butt", gid=f"order{order}-{nm}nm")
            shown = f"{signed(angles[FAN_NM[0]], 1)}° to {signed(angles[FAN_NM[-1]], 1)}°"
        else:
            arrow(ax, (0, 0), 1.25 * middle, INK["color"], 2, "order0")
            shown = f"{signed(angles[FAN_NM[0]], 1)}°"
        # Labels of orders that are near each other would touch at one distance.
        place = {-1: 1.45, 0: 1.36, 1: 1.52, 2: 1.35, 3: 1.52}[order] * middle
        ax.text(*place, f"order {signed(order)}\n{shown}", ha="center", va="center", fontsize=10, **INK)
        rows.append({"order": order, "first_deg": angles[FAN_NM[0]], "last_deg": angles[FAN_NM[-1]]})
    light = 1.25 * toward(ORDERS_THETA_I_DEG)
    arrow(ax, light, (0, 0), LIGHT, 2.4, "light")
    ax.text(*(1.12 * light), f"white light, θi = {ORDERS_THETA_I_DEG:g}°", ha="left", va="center", fontsize=10, **INK)
    angle_arc(ax, (0, 0), 0.3, 0, ORDERS_THETA_I_DEG, "θi", beyond=0.07)
    angle_arc(ax, (0, 0), 0.3, -ORDERS_THETA_I_DEG, 0, "−θi", beyond=0.07)
    _surface(ax, 1.5)
    arrow(ax, (0, 0), (0, 0.48), INK["color"], 1)
    ax.text(0.03, 0.47, "n", ha="left", va="center", fontsize=11, **INK)
    plain(ax, (-1.55, 1.55), (-0.2, 1.65))
    save_svg(figure, path)
    return rows


def _surface(ax: Axes, half: float) -> None:
    """The surface seen from the side, with the direction of x."""
    ax.add_patch(Rectangle((-half, -0.07), 2 * half, 0.07, facecolor="#e4e6e8", edgecolor="none", hatch="////"))
    ax.plot([-half, half], [0, 0], lw=1.4, **INK)
    arrow(ax, (half - 0.35, -0.13), (half - 0.02, -0.13), INK["color"], 1)
    ax.text(half - 0.42, -0.13, "x", va="center", ha="center", fontsize=11, **INK)


def groove_paths(path: Path) -> dict:
    """Figure 1.7: what the paths over two grooves differ by, on the way to them and from them. Returns the angle of
    the first order in degrees and both parts of the difference in wavelengths."""
    theta_i = PATHS_THETA_I_DEG
    theta_r = order_angle_deg(1, WAVELENGTH_NM, GROOVES_NM, theta_i)
    a, b = np.zeros(2), np.array([1.0, 0.0])
    figure = Figure(figsize=(11, 4.4), layout="constrained")
    # Of a wavefront that has come to B, the part that goes to A still has `length` to go; what has left B has gone
    # `length` when it is level with what leaves A.
    parts = []
    for ax, angle, start, other, name, words in zip(
        figure.subplots(1, 2),
        (theta_i, theta_r),
        (a, b),
        (b, a),
        ("arriving", "leaving"),
        ("to B it is d sin θi = {} λ shorter", "from B it is −d sin θr = {} λ longer"),
    ):
        to = toward(angle)
        length = float(np.dot(other - start, to))
        foot = start + length * to
        ax.add_patch(Polygon([start, other, foot], closed=True, color="#f6bd60", lw=0))
        for point, letter in ((a, "A"), (b, "B")):
            far = point + 1.35 * to
            ends = (far, point) if name == "arriving" else (point, far)
            arrow(ax, *ends, LIGHT if name == "arriving" else WAY, 1.4, f"{name}-{letter}")
            ax.plot([point[0]] * 2, [0, 1.05], color=SURFACE, lw=0.8, ls="--")
            ax.plot(*point, "o", ms=6, **INK)
            ax.text(point[0], -0.15, letter, ha="center", va="center", fontsize=11, **INK)
        ax.plot(*np.transpose([start, foot]), color=MARK, lw=2.6)
        ax.plot(*np.transpose([other, foot]), color=INK["color"], lw=1, ls=":")
        symbol = "θi" if name == "arriving" else "θr"
        angle_arc(ax, other, 0.85, 0, angle, f"{symbol} = {signed(angle, 1)}°", beyond=0.13)
        waves = length * GROOVES_NM / WAVELENGTH_NM
        ax.set_title(f"{name}: {words.format(f'{waves:.2f}')}", fontsize=11, color=MARK)
        measure(ax, (0, -0.3), (1, -0.3), "d", (0, -0.08))
        _surface_between(ax)
        parts.append(waves)
    save_svg(figure, path)
    return {"theta_i_deg": theta_i, "theta_r_deg": theta_r, "saved_waves": parts[0], "lost_waves": parts[1]}


def _surface_between(ax: Axes) -> None:
    """The line of the surface of figure 1.7 with its x, in a panel of fixed extent."""
    ax.plot([-0.95, 2.15], [0, 0], lw=1.2, **INK)
    arrow(ax, (1.8, -0.15), (2.13, -0.15), INK["color"], 1)
    ax.text(1.72, -0.15, "x", va="center", ha="center", fontsize=11, **INK)
    plain(ax, (-1.0, 2.2), (-0.48, 1.2))
