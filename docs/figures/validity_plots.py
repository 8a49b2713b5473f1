"""The plots of the documentation's part `validity`, as SVG.

- *Model*: scalar diffraction with the obliquity factor `stam` or `unit`; `stam, limited` conserves energy.
- *Efficiency*: the fraction of the incident light in an order. *Rigorous* ones are by Maxwell's equations.
- *Misplaced* power of a model: the fraction of the light that the model puts into wrong orders (validity_sweeps.py).
- Sweeps among the arguments are results of `validity.sweep`: "values" in degrees of slope or µm of period, "angles_deg"
  of incidence, and "misplaced" as [model][angle][value].
- `bound`: the misplaced power up to which a model is valid.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from tests.judges.gratings.scalar import MODELS, STAM, STAM_LIMITED, UNIT, Grating

from .svg import save
from .validity_sweeps import compared, sawtooth, sinusoid

# Line styles of the models.
STYLES = {STAM_LIMITED.name: "-", STAM.name: "--", UNIT.name: ":"}
# Colours of the angles of incidence, at most four, or of the orders.
COLOURS = ("tab:blue", "tab:green", "tab:orange", "tab:red")
# Angles of incidence of the plot `angles` in steps of 3°, shifted so that no order is at the horizon.
FINE_ANGLES_DEG = tuple(float(angle) for angle in np.arange(-83.3, 84, 3))
# Orders of the plot `angles`.
SHOWN_ORDERS = (0, -1, -2)
# Wavelength of the plot `angles`.
SHOWN_NM = 550.0


def angles(path: Path) -> None:
    """Draws efficiencies of orders against the angle of incidence: rigorous, `stam, limited` and `stam`."""
    cases = (
        ("sinusoid 2.5 µm, steepest slope 10°", sinusoid(2.5, 10.0)),
        ("sawtooth 2.5 µm, facets 5.7°", sawtooth(2.5, 5.71)),
        ("lamellar 2.5 µm, 0.125 µm deep", Grating("lamellar", 2.5, 0.125)),
    )
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.6), sharey=True)
    for ax, (title, grating) in zip(axes, cases):
        found = compared(grating, FINE_ANGLES_DEG, (SHOWN_NM,))
        for order, colour in zip(SHOWN_ORDERS, COLOURS):
            # Angle and the three efficiencies, at the angles where the order propagates.
            points = [
                (
                    each.light.theta_i_deg,
                    each.rigorous.unpolarised[i],
                    each.scalar[STAM_LIMITED.name][i],
                    each.scalar[STAM.name][i],
                )
                for each in found
                for i in np.flatnonzero(each.rigorous.orders == order)
            ]
            theta_i_deg, rigorous, limited, stam = zip(*points)
            ax.plot(theta_i_deg, rigorous, color=colour, lw=1.8, alpha=0.45)
            ax.plot(theta_i_deg, limited, color=colour, lw=1)
            ax.plot(theta_i_deg, stam, color=colour, lw=1, ls="--")
        ax.set(title=title, xlabel="θi in degrees", ylim=(0, 1.1), xlim=(-90, 90), xticks=range(-90, 91, 30))
    axes[0].set_ylabel(f"efficiency at {SHOWN_NM:.0f} nm, unpolarised")
    # Plots without points are entries of the legends.
    for order, colour in zip(SHOWN_ORDERS, COLOURS):
        axes[0].plot([], [], color=colour, label=f"order {order}")
    axes[1].plot([], [], "k", lw=1.8, alpha=0.45, label="rigorous")
    axes[1].plot([], [], "k", lw=1, label=STAM_LIMITED.name)
    axes[1].plot([], [], "k--", lw=1, label=STAM.name)
    for ax in axes[:2]:
        ax.legend(fontsize=8, frameon=False)
    save(figure, path)


def curves(ax, swept: dict, x, bound: float, **options) -> None:
    """Draws misplaced power of each model (line style) at each angle (colour) over `x`, and the bound.

    `x` are the values of the sweep, in any unit. `options` are further properties of the axes `ax`.
    """
    for model in MODELS:
        for errors, angle, colour in zip(swept["misplaced"][model.name], swept["angles_deg"], COLOURS):
            label = f"θi = {angle:.0f}°" if model is STAM_LIMITED else None
            ax.plot(x, 100 * np.array(errors), STYLES[model.name], color=colour, lw=1.2, label=label)
    ax.axhline(100 * bound, color="0.6", lw=0.8)
    ax.set(yscale="log", ylim=(0.05, 100), **options)
    ax.legend(fontsize=7, frameon=False, loc="lower right")


def models_legend(figure) -> None:
    """Adds a legend of the models' line styles above the plots."""
    lines = [plt.Line2D([], [], color="k", lw=1.2, ls=STYLES[model.name], label=model.name) for model in MODELS]
    figure.legend(handles=lines, loc="upper center", ncols=3, frameon=False, bbox_to_anchor=(0.5, 1.0))
    # An empty title keeps space for the legend.
    figure.suptitle(" ")


def slopes(path: Path, sinusoids: dict, away: dict, facing: dict, bound: float) -> None:
    """Draws misplaced power against the steepest slope, from the sweeps of each kind of grating."""
    figure, axes = plt.subplots(1, 3, figsize=(11, 4), sharey=True)
    panels = (
        (sinusoids, "sinusoid", "steepest slope in degrees"),
        (away, "sawtooth, facets turned away", "slope of the facets in degrees"),
        (facing, "sawtooth, facets facing the light", "slope of the facets in degrees"),
    )
    for ax, (swept, title, label) in zip(axes, panels):
        curves(ax, swept, swept["values"], bound, title=title, xlabel=label)
    axes[0].set_ylabel("misplaced power in %")
    models_legend(figure)
    save(figure, path)


def periods(path: Path, by_period: dict, mean_nm: float, bound: float) -> None:
    """Draws misplaced power against the period in mean wavelengths, from the sweeps `by_period` of each kind."""
    figure, axes = plt.subplots(1, 3, figsize=(11, 4), sharey=True)
    for ax, (kind, swept) in zip(axes, by_period.items()):
        x = np.array(swept["values"]) * 1e3 / mean_nm
        curves(ax, swept, x, bound, title=kind, xlabel="period in wavelengths", xscale="log")
        ax.set(xticks=[1, 2, 4, 8, 16], xticklabels=["1", "2", "4", "8", "16"])
        ax.minorticks_off()
    axes[0].set_ylabel("misplaced power in %")
    models_legend(figure)
    save(figure, path)
