"""Plots of the part `gratings`: one SVG each for the numbers of `blazed`, `sinusoidal`, `lamellar` and `plasmons`.

The argument `made` has the numbers, from the function of the same name in gratings.py. `passing_off` are the λ/d at
which orders reach the horizon, where efficiencies have anomalies; they are drawn as grey lines. Symbols: d is the
period, h the height, λ the wavelength, and b the slope of the long facets of an echelette, a blazed grating. Perfect
means a perfect conductor.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt

from .svg import save

# Key in the data, colour and label of each polarisation: the electric (TE) or the magnetic field (TM) is along the
# grooves.
POLARISATIONS = (("te", "tab:blue", "TE"), ("tm", "tab:red", "TM"))
# Label of efficiencies in a Littrow mount, where the diffracted light returns along the incident light.
LITTROW_LABEL = "efficiency of the order that goes back"


def littrow(ax, curves: dict, passing_off: tuple, title: str) -> None:
    """Draws TE and TM efficiencies of the returning order over λ/d: aluminium as lines, the perfect conductor dotted.

    `curves` has {ratio, te, tm} by the material's name, "Al" or "perfect".
    """
    for key, colour, name in POLARISATIONS:
        ax.plot(curves["Al"]["ratio"], curves["Al"][key], color=colour, lw=1.4, label=f"{name}, aluminium")
        ax.plot(curves["perfect"]["ratio"], curves["perfect"][key], ":", color=colour, lw=1.2, label=f"{name}, perfect")
    for ratio in passing_off:
        ax.axvline(ratio, color="0.7", lw=0.8, zorder=0)
    ax.set(title=title, xlabel="λ/d", ylim=(0, 1.03), xlim=(0.3, 1.9))


def blazed(path: Path, made: dict, passing_off: tuple) -> None:
    """Plots efficiencies of the echelette, and its blaze as a dashed line."""
    figure, ax = plt.subplots(figsize=(7, 3.8))
    littrow(ax, made["curves"], passing_off, f"echelette of {made['slope_deg']:.1f}°, Littrow")
    ax.axvline(made["blaze_ratio"], color="0.3", lw=0.8, ls="--", zorder=0, label="blaze, λ/d = 2 sin b")
    ax.set_ylabel(LITTROW_LABEL)
    ax.legend(fontsize=8, frameon=False, loc="lower right")
    save(figure, path)


def sinusoidal(path: Path, made: dict, passing_off: tuple) -> None:
    """Plots efficiencies of holographic gratings: the shallow one with its phase screen, then each depth h/d.

    The phase screen of a sinusoid has the efficiency J₁², a squared Bessel function, in order 1.
    """
    depths = made["depths"]
    figure, axes = plt.subplots(1, len(depths) + 1, figsize=(13, 3.6), sharey=True)
    shallow = made["shallow"]
    for key, colour, name in POLARISATIONS:
        axes[0].plot(shallow["ratio"], shallow[key], ":", color=colour, lw=1.4, label=f"{name}, perfect")
    axes[0].plot(shallow["ratio"], shallow["screen"], color="k", lw=1, label="phase screen, J₁²")
    axes[0].set(title=f"h/d = {depths[0]}", xlabel="λ/d", ylim=(0, 1.03), ylabel=LITTROW_LABEL)
    for ax, depth in zip(axes[1:], depths):
        littrow(ax, made["curves"][str(depth)], passing_off, f"h/d = {depth}")
    for ax in axes[:2]:
        ax.legend(fontsize=8, frameon=False)
    save(figure, path)


def lamellar(path: Path, made: dict, passing_off: tuple) -> None:
    """Plots efficiencies of lamellar gratings over λ/d and over h/d, and beside a sinusoid of equal first harmonic."""
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.6), sharey=True)
    littrow(axes[0], made["curves"], passing_off, f"lamellar, h/d = {made['depth']}")
    over_height = made["against_height"]
    pair = made["equivalent"]["curves"]
    for key, colour, name in POLARISATIONS:
        axes[1].plot(over_height["height_ratio"], over_height[key], ":", color=colour, lw=1.4, label=f"{name}, perfect")
        axes[2].plot(
            pair["lamellar"]["ratio"], pair["lamellar"][key], ":", color=colour, lw=1.4, label=f"{name}, lamellar"
        )
        axes[2].plot(
            pair["sinusoidal"]["ratio"], pair["sinusoidal"][key], color=colour, lw=0.8, label=f"{name}, sinusoidal"
        )
    axes[1].set(title=f"lamellar, λ/d = {made['ratio']}", xlabel="h/d")
    axes[2].set(title="the same first harmonic, perfect", xlabel="λ/d")
    axes[0].set_ylabel(LITTROW_LABEL)
    for ax in axes:
        ax.legend(fontsize=7, frameon=False)
    save(figure, path)


def plasmons(path: Path, made: dict) -> None:
    """Plots curves of silver gratings over the angle of incidence, and the angles of their first dips over the height.

    At a dip the light excites a surface plasmon. `curves` are by the height in µm, as text. `expected_deg` has the
    angles of dips by the closed form for shallow gratings; the key of the first dip is "1".
    """
    figure, axes = plt.subplots(1, 2, figsize=(10, 3.6), width_ratios=(2, 1))
    shades = plt.colormaps["viridis"]
    count = len(made["curves"])
    for i, (height, curve) in enumerate(made["curves"].items()):
        label = f"{1e3 * float(height):.0f} nm"
        axes[0].plot(curve["theta_deg"], curve["tm"], color=shades(i / count), lw=1.2, label=label)
    for angle in made["expected_deg"].values():
        axes[0].axvline(angle, color="0.6", lw=0.8, zorder=0)
    axes[0].set(xlabel="angle of incidence in degrees", ylabel="TM efficiency of order 0", ylim=(0, 1.03), xlim=(0, 45))
    axes[0].legend(fontsize=8, frameon=False, loc="lower right", title="height")
    heights = [1e3 * row["height_um"] for row in made["dips"]]
    axes[1].plot(heights, [row["theta_deg"] for row in made["dips"]], "ko-", lw=1, ms=3)
    axes[1].axhline(made["expected_deg"]["1"], color="0.6", lw=0.8)
    axes[1].set(xlabel="height in nm", ylabel="angle of the first dip in degrees", xlim=(0, None))
    save(figure, path)
