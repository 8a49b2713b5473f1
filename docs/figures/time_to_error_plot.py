"""The plot of rendering times until a picture has a given error, from the results of time_to_error.py.

A *cell* is such a result: a scene in a variant of Mitsuba. Its list `ways` has an entry for each material, with the
material's name and `seconds_to_error`. One material is REFERENCE, Mitsuba's own. The others are the plugin's, which
diffract, and are named by their reliefs.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt

from .benchmark_scenes import REFERENCE
from .svg import save
from .time_to_error import VARIANTS

# Colours by variant.
COLOURS = dict(zip(VARIANTS, ("tab:blue", "tab:orange", "tab:cyan", "tab:red")))


def draw(cells: list[dict], aim: float, side: int, path: Path) -> None:
    """Draws the cells' `seconds_to_error` on a logarithmic axis, with a row for each scene and relief.

    Filled marks are the plugin's materials, hollow ones Mitsuba's; each variant has a colour. `aim` is the relative
    error that pictures have after these times, and `side` the edge in pixels of the square pictures to which the times
    are scaled.
    """
    pairs = [(cell["scene"], way["name"]) for cell in cells for way in cell["ways"] if way["name"] != REFERENCE]
    rows = list(dict.fromkeys(pairs))
    figure, ax = plt.subplots(figsize=(8, 0.7 * len(rows) + 1.4))
    for cell in cells:
        by_name = {way["name"]: way["seconds_to_error"] for way in cell["ways"]}
        colour = COLOURS[cell["variant"]]
        # The variants' lines are 0.18 apart about the middle of the row, which is 1 high.
        offset = 0.18 * (VARIANTS.index(cell["variant"]) - 0.5 * (len(VARIANTS) - 1))
        for name, seconds in by_name.items():
            if name == REFERENCE:
                continue
            y = rows.index((cell["scene"], name)) + offset
            ax.plot([by_name[REFERENCE], seconds], [y, y], color=colour, lw=1, alpha=0.5)
            ax.plot(by_name[REFERENCE], y, "o", color=colour, markerfacecolor="white", ms=5)
            ax.plot(seconds, y, "o", color=colour, ms=5)
    # Plots without points are entries of the legend.
    for variant, colour in COLOURS.items():
        ax.plot([], [], "o", color=colour, label=variant)
    ax.plot([], [], "o", color="grey", markerfacecolor="white", label=REFERENCE)
    ax.set(xscale="log", xlabel=f"seconds to {aim:.0%} of noise, {side} × {side} pixels", ylim=(len(rows) - 0.5, -0.5))
    # A scene with the name of its relief is named once.
    ax.set_yticks(range(len(rows)), [f"{scene}, {name}" if scene != name else scene for scene, name in rows])
    ax.grid(axis="x", alpha=0.3)
    ax.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))
    save(figure, path)
