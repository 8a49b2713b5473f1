"""The page `slits`: gratings of N slits, and the drawings that explain angles, orders and maps."""

from __future__ import annotations

import numpy as np

from mitsuba_scenes.picture import PictureError

from . import slits_drawings, slits_space
from .page import images
from .slits_intensity import (
    SAMPLES,
    Slits,
    direct_amplitude,
    first_order_sine,
    first_zero_sine,
    full_width_sine,
    limit_of_width,
    on_bare_screen,
    place_mm,
    relative_intensity,
    sine_of,
)
from .slits_patterns import (
    CLOSE_MM,
    COLOURED_MM,
    COLOURED_NM,
    COUNTS,
    DISTANCE_MM,
    PLOTTED_NM,
    THEIRS_PLOTTED,
    WIDE_MM,
    coloured,
    plotted,
)

PAGE = "slits"
# From how many slits on the width should go as 1/N, how far the exponent may be off, and the last width in its limit.
FITTED_FROM, EXPONENT_OFF, WIDTH_OFF = 5, 0.02, 1e-3
# How far a bare screen may stray from the far field where the page says that it hardly does, and how far it must where
# the page says that it does.
NEAR, FAR = 0.05, 0.1
# Places within WIDE_MM at which intensities are compared.
PLACES = 2001
# How far the division of the slits into parts may move a relative intensity.
SAMPLED_TO = 1 / (3 * SAMPLES**2)


def figures() -> dict:
    """Draws the figures; returns the angles of the drawings, and what was measured on the intensities by count."""
    folder = images(PAGE)
    drawn = {
        "screen": slits_drawings.slits_and_screen(folder / "slits-and-screen.svg"),
        "orders": slits_drawings.reflected_orders(folder / "orders.svg"),
        "paths": slits_drawings.groove_paths(folder / "groove-paths.svg"),
        "plane": slits_space.incident_plane(folder / "incident-plane.svg"),
        "map_orders": slits_space.map_coordinates(folder / "map-coordinates.svg"),
    }
    plotted(folder / "intensity.svg")
    centre = coloured(folder / "patterns.png")
    rows = [measured(Slits(count)) for count in COUNTS]
    exponent = fitted_exponent(rows)
    check(rows, exponent)
    return {
        "drawings": drawn,
        "drawn_nm": slits_drawings.WAVELENGTH_NM,
        "fan_nm": [slits_drawings.FAN_NM[0], slits_drawings.FAN_NM[-1]],
        "slits_nm": slits_drawings.SLITS_NM,
        "grooves_nm": slits_drawings.GROOVES_NM,
        "orders_theta_i_deg": slits_drawings.ORDERS_THETA_I_DEG,
        "map_theta_i_deg": slits_space.MAP_THETA_I_DEG,
        "width_um": Slits(1).width_um,
        "spacing_um": Slits(1).spacing_um,
        "distance_mm": DISTANCE_MM,
        "plotted_nm": PLOTTED_NM,
        "coloured_nm": COLOURED_NM,
        "coloured_mm": COLOURED_MM,
        "close_mm": CLOSE_MM,
        "wide_mm": WIDE_MM,
        "samples": SAMPLES,
        "sampled_to": SAMPLED_TO,
        "rows": rows,
        "fitted_from": FITTED_FROM,
        "exponent": exponent,
        "limit": limit_of_width(),
        "centre_rgb": centre,
    }


def measured(slits: Slits) -> dict:
    """What is told of so many slits: zeros and widths in mm on the screen, and differences of relative intensity."""
    x_mm = np.linspace(-WIDE_MM, WIDE_MM, PLACES)
    closed = relative_intensity(slits, sine_of(x_mm, DISTANCE_MM), PLOTTED_NM)
    direct = np.abs(direct_amplitude(slits, sine_of(x_mm, DISTANCE_MM), PLOTTED_NM)) ** 2
    width = full_width_sine(slits, PLOTTED_NM)
    unit = slits.zero_sine(PLOTTED_NM)
    order_mm = place_mm(PLOTTED_NM / 1e3 / slits.spacing_um, DISTANCE_MM)
    return {
        "count": slits.count,
        "direct_difference": float(np.abs(closed - direct).max()),
        "expected_zero_mm": place_mm(unit, DISTANCE_MM),
        "zero_mm": place_mm(first_zero_sine(slits, PLOTTED_NM), DISTANCE_MM),
        "width_mm": 2 * place_mm(width / 2, DISTANCE_MM),
        "width_in_zeros": width / unit,
        "first_order_off_mm": place_mm(first_order_sine(slits, PLOTTED_NM), DISTANCE_MM) - order_mm,
        "far_field_mm": slits.far_field_mm(PLOTTED_NM),
        "bare_difference": float(np.abs(closed - on_bare_screen(slits, x_mm, DISTANCE_MM, PLOTTED_NM)).max()),
    }


def fitted_exponent(rows: list[dict]) -> float:
    """The power of N that the widths go as, from `FITTED_FROM` slits on."""
    kept = [row for row in rows if row["count"] >= FITTED_FROM]
    counts, widths = [row["count"] for row in kept], [row["width_mm"] for row in kept]
    return float(np.polyfit(np.log(counts), np.log(widths), 1)[0])


def check(rows: list[dict], exponent: float) -> None:
    """Fails where a sentence of the page would be untrue of its numbers."""
    for row in rows:
        if row["direct_difference"] > 1.1 * SAMPLED_TO:
            raise PictureError(f"{row['count']} slits: the closed form is off by {row['direct_difference']:.1e}")
        if abs(row["zero_mm"] / row["expected_zero_mm"] - 1) > 1e-6:
            raise PictureError(f"{row['count']} slits: the first zero is at {row['zero_mm']} mm")
    if abs(exponent + 1) > EXPONENT_OFF:
        raise PictureError(f"widths go as N to the power {exponent}")
    if abs(rows[-1]["width_in_zeros"] / limit_of_width() - 1) > WIDTH_OFF:
        raise PictureError(f"the width of {rows[-1]['count']} slits is {rows[-1]['width_in_zeros']} zeros")
    for row in rows:
        few, strays = row["count"] in THEIRS_PLOTTED, row["bare_difference"]
        if strays > NEAR if few else strays < FAR:
            raise PictureError(f"{row['count']} slits: a bare screen strays by {strays}")
