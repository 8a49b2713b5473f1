"""Part `slits` of the documentation (page.py): intensity and colours behind N equal slits.

Draws the plots of figures 1.4 and 1.5 of M. Single's thesis, called Single 2014, from the formula below.

Symbols: N is the number of slits, a their width, d the distance of their centres, and λ the wavelength. Light arrives
at normal incidence; `sine` is the sine of the diffracted light's angle to the grating's normal. The relative intensity
in the far field, 1 where all waves are in phase, is

    I = (sin Nx / (N sin x))² · (sin β / β)²,   x = π d·sine/λ,   β = π a·sine/λ.

The first factor is the array factor; order 0 has its first zero at sine = λ/(Nd).

The drawings of figures 1.2, 1.3, 1.6, 1.7 and 2.1 in docs/images/slits are not generated here; tests/test_slits.py
checks their angles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import mitsuba as mi
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from .page import images, insist

PART = "slits"
# Numbers of slits in the wide graph, those of Single 2014's figure 1.5.
WIDE_COUNTS = (1, 2, 3)
# Numbers of slits in the close graph, in the colour strips and in the table.
COUNTS = (1, 2, 3, 5, 7, 10, 50)
# Distance of the screen, given with figure 1.5.
DISTANCE_MM = 500.0
# Wavelength of figure 1.5.
PLOTTED_NM = 500.0
# Wavelength of the green strips of figure 1.4; Single 2014 gives none.
COLOURED_NM = 550.0
# Half width of the shown part of the screen in the colour strips.
COLOURED_MM = 6.5
# Half width of the shown part of the screen in the wide graph.
WIDE_MM = 30.0
# Half width of the shown part of the screen in the close graph.
CLOSE_MM = 2.0
# Pixels of a colour strip along the screen. With this number a peak of 50 slits is three pixels wide.
COLUMNS = 1300
# Number of positions in a pixel whose intensities are averaged. With fewer, narrow peaks fall between positions.
PER_COLUMN = 4
# Wavelength step of the sum over the visible spectrum. At a point of order m, N slits let peaks pass that are about
# λ/(mN) wide. For 50 slits and 380 nm these are 1.5 nm wide at the ends of the strips, where m is 5. Larger steps would
# show as lines.
COLOUR_STEP_NM = 1.0
# Smallest number of slits in the fit of width ∝ N^exponent. With fewer slits, peaks are so wide that N·sin x of the
# array factor differs from N·x; a single slit has no array factor.
FITTED_FROM = 5
# Largest accepted difference of the fitted exponent from −1.
EXPONENT_TOLERANCE = 0.02


@dataclass(frozen=True)
class Slits:
    """N = `count` slits of width a, with centres d = `spacing_um` apart; figure 1.5 gives the defaults."""

    count: int
    width_um: float = 30.0
    spacing_um: float = 150.0

    @property
    def extent_um(self) -> float:
        """Nd, the extent of all slits; for a single slit its width."""
        return self.count * self.spacing_um if self.count > 1 else self.width_um


def relative_intensity(slits: Slits, sine, wavelength_nm) -> np.ndarray:
    """I of the module's formula; `sine` and `wavelength_nm` broadcast."""
    # d·sine/λ, a whole number at orders.
    order = slits.spacing_um * np.asarray(sine) / (np.asarray(wavelength_nm) / 1e3)
    # The square of the array factor has the period 1 in `order`. So x is measured from the nearest order, since sin Nx
    # has smaller rounding errors at small x.
    x = np.pi * (order - np.round(order))
    array_factor = np.ones_like(x)
    between_orders = np.abs(x) > 1e-9
    x = x[between_orders]
    array_factor[between_orders] = np.sin(slits.count * x) / (slits.count * np.sin(x))
    # NumPy's sinc(t) is sin πt / πt.
    return (array_factor * np.sinc(order * slits.width_um / slits.spacing_um)) ** 2


def full_width(slits: Slits, wavelength_nm: float) -> float:
    """Full width at half maximum of order 0 in `sine`, in units of λ/(Nd), or of λ/a for one slit."""
    first_zero = wavelength_nm / 1e3 / slits.extent_um
    return width_at_half(lambda t: float(relative_intensity(slits, np.array([t * first_zero]), wavelength_nm)[0]))


def limit_of_width() -> float:
    """Full width at half maximum of (sin πt / πt)², to which `full_width` tends for many slits."""
    return width_at_half(lambda t: float(np.sinc(t)) ** 2)


def width_at_half(peak: Callable[[float], float]) -> float:
    """Full width at half maximum of an even function that falls monotonically from 1 at 0 to 0 at 1, by bisection."""
    low, high = 0.0, 1.0
    # Fifty halvings reach double precision.
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if peak(middle) > 0.5 else (low, middle)
    # Half the width is the middle of `low` and `high`, so the width is their sum.
    return low + high


def colour_weights() -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths in nm, (W,), and weights, (W, 3).

    The weights turn relative intensities of D65 into linear sRGB; their columns sum to 1.
    """
    # Mitsuba's colour functions need a selected variant. The one that was selected before is restored.
    before = mi.variant()
    mi.set_variant("scalar_rgb")
    try:
        # From 380 nm to 780 nm, both included.
        wavelengths_nm = np.arange(380.0, 780.0 + COLOUR_STEP_NM, COLOUR_STEP_NM)
        weights = np.array(
            [np.array(mi.xyz_to_srgb(mi.cie1931_xyz(nm) * mi.cie_d65(nm))) for nm in map(float, wavelengths_nm)],
            dtype=np.float64,
        )
    finally:
        if before:
            mi.set_variant(before)
    return wavelengths_nm, weights / weights.sum(axis=0)


def white_light(slits: Slits, sine, weights: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Linear sRGB of light of D65 behind the slits, (len(sine), 3), with the `weights` of `colour_weights`.

    The slits pass the same fraction of the power at all wavelengths. They spread it over a width in proportion to λ, so
    the intensity has a factor 1/λ, which is normalised to 1 at COLOURED_NM.
    """
    wavelengths_nm, rgb = weights
    intensity = relative_intensity(slits, np.asarray(sine)[:, None], wavelengths_nm)
    return (intensity * (COLOURED_NM / wavelengths_nm)) @ rgb


def figures() -> dict:
    """Draws both figures; returns sizes, a row for each number of slits, and white light's colour in the centre.

    `exponent` is fitted to the widths of order 0 as width ∝ N^exponent. `limit` is the limit of the width in λ/(Nd).
    Raises SetupError unless the exponent is about −1.
    """
    folder = images(PART)
    draw_intensity(folder / "intensity.svg")
    centre = draw_colours(folder / "patterns.png")
    rows = [table_row(Slits(count)) for count in COUNTS]
    fitted = [row for row in rows if row["count"] >= FITTED_FROM]
    log_count, log_width = (np.log([row[key] for row in fitted]) for key in ("count", "width_mm"))
    exponent = float(np.polyfit(log_count, log_width, 1)[0])
    insist(PART, abs(exponent + 1) < EXPONENT_TOLERANCE, "widths go as 1/N")
    return {
        "width_um": Slits(1).width_um,
        "spacing_um": Slits(1).spacing_um,
        "distance_mm": DISTANCE_MM,
        "plotted_nm": PLOTTED_NM,
        "coloured_nm": COLOURED_NM,
        "rows": rows,
        "fitted_from": FITTED_FROM,
        "exponent": exponent,
        "limit": limit_of_width(),
        "centre_rgb": centre,
    }


def table_row(slits: Slits) -> dict:
    """A row of the table, at PLOTTED_NM.

    - `zero_mm`: the position of the first zero of order 0 on the screen.
    - `width_mm`, `width_in_zeros`: the width of order 0, in mm on the screen, and in sine over that of its first zero.
    - `far_field_mm`: (Nd)²/λ, or a²/λ for one slit. The far field is at distances large against it.
    """
    width = full_width(slits, PLOTTED_NM)
    # Sine of the angle of the first zero. A place on the screen is DISTANCE_MM times the tangent, which is exact in
    # `zero_mm`. In `width_mm` the sine stands for the tangent, since the angle is small.
    zero_sine = PLOTTED_NM / 1e3 / slits.extent_um
    return {
        "count": slits.count,
        "zero_mm": DISTANCE_MM * zero_sine / np.sqrt(1 - zero_sine**2),
        "width_mm": DISTANCE_MM * width * zero_sine,
        "width_in_zeros": width,
        # µm²/nm = 1e-12 m²/1e-9 m is mm.
        "far_field_mm": slits.extent_um**2 / PLOTTED_NM,
    }


def sine_of(x_mm) -> np.ndarray:
    """Sine of the angle at which a point of the screen is seen from the middle of the grating."""
    return np.asarray(x_mm) / np.hypot(x_mm, DISTANCE_MM)


def draw_intensity(path: Path) -> None:
    """Draws figure 1.5: relative intensity over position.

    WIDE_COUNTS are drawn over a wide range, and COUNTS about order 0.
    """
    figure = Figure(figsize=(11, 7.2), layout="constrained")
    wide, close = figure.subplots(2, 1)
    colours = ("0.4", "tab:blue", "tab:green", "tab:olive", "tab:orange", "tab:red", "black")
    for ax, counts, half_mm in ((wide, WIDE_COUNTS, WIDE_MM), (close, COUNTS, CLOSE_MM)):
        x_mm = np.linspace(-half_mm, half_mm, 2401)
        for count, colour in zip(counts, colours):
            intensity = relative_intensity(Slits(count), sine_of(x_mm), PLOTTED_NM)
            ax.plot(x_mm, intensity, label=f"N = {count}", color=colour, lw=1.1, ls="--" if count == 1 else "-")
        ax.set(xlim=(-half_mm, half_mm), ylim=(0, 1.03), ylabel="relative intensity")
        ax.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    wide.xaxis.set_major_locator(MultipleLocator(5))
    close.set_xlabel(f"position on the screen / mm, {DISTANCE_MM:g} mm away")
    # Text becomes outlines, and equal numbers give identical files.
    with matplotlib.rc_context({"svg.fonttype": "path", "svg.hashsalt": "sunbeam"}):
        figure.savefig(path, metadata={"Date": None})


def draw_colours(path: Path) -> list[float]:
    """Draws figure 1.4: strips of green (above) and of white light (below) for each number of slits.

    Returns linear sRGB of white light behind one slit in the centre of the screen.
    """
    weights = colour_weights()
    wavelengths_nm, rgb = weights
    # Colour of light of COLOURED_NM alone. It is outside sRGB, so its negative components become 0.
    green_rgb = np.maximum(rgb[np.abs(wavelengths_nm - COLOURED_NM).argmin()], 0)
    # Positions on the screen in equal steps, PER_COLUMN of them in each pixel of a strip.
    positions = COLUMNS * PER_COLUMN
    x_mm = ((np.arange(positions) + 0.5) / positions * 2 - 1) * COLOURED_MM
    sine = sine_of(x_mm).reshape(COLUMNS, PER_COLUMN)
    # White light in the centre, where the relative intensity of any number of slits has its maximum, 1.
    centre_rgb = white_light(Slits(1), [0.0], weights)[0]
    figure = Figure(figsize=(10, 8.4), layout="constrained")
    panels = figure.subplots(len(COUNTS), 1, sharex=True)
    for ax, count in zip(panels, COUNTS):
        # Strips of linear sRGB, (COLUMNS, 3). The largest channel in the centre is 1.
        intensity = relative_intensity(Slits(count), sine, COLOURED_NM).mean(axis=1)
        green = intensity[:, None] * green_rgb / green_rgb.max()
        # Mean over the positions in a pixel. `sines` has one position in every pixel, (COLUMNS,).
        white = np.mean([white_light(Slits(count), sines, weights) for sines in sine.T], axis=0) / centre_rgb.max()
        # The panel's axis y runs from −1 to 1: green from 0.04 to 1, white from −1 to −0.04.
        for strip, (low, high) in ((green, (0.04, 1)), (white, (-1, -0.04))):
            extent = (-COLOURED_MM, COLOURED_MM, low, high)
            ax.imshow(srgb(strip)[None], extent=extent, aspect="auto", interpolation="nearest")
        ax.set(facecolor="black", ylim=(-1, 1), yticks=[])
        ax.set_ylabel(f"N = {count}", rotation=0, ha="right", va="center", fontsize=11)
    panels[-1].set_xlabel(f"position on the screen / mm, {DISTANCE_MM:g} mm away")
    figure.savefig(path, dpi=150, metadata={"Software": None})
    return [float(value) for value in centre_rgb]


def srgb(linear: np.ndarray) -> np.ndarray:
    """Linear sRGB clipped to [0, 1] and gamma-encoded, in [0, 1]."""
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
