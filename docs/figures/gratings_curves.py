"""Efficiencies by `sunbeam orders` for the part `gratings`: in Littrow mounts, and over the angle of incidence.

Symbols: d is the period, λ the wavelength and θi the angle of incidence. In a Littrow mount in order 1 the diffracted
light returns along the incident light, sin θi = λ/(2d). TE and TM are the polarisations with the electric and the
magnetic field along the grooves. An efficiency is the fraction of the incident power of a polarisation in an order.
Metals are named as Mitsuba's `material`, such as `Al`; a perfect conductor is `None`.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mitsuba_scenes.tool import sunbeam
from tests.judges.gratings.metals import index


@dataclass(frozen=True)
class Relief:
    """A grating: its period, and the `arguments` of `sunbeam` that select it."""

    arguments: tuple
    period_um: float


def preset(name: str, period_um: float, height_um: float | None = None) -> Relief:
    """A preset of `sunbeam` with this period and peak-to-valley height.

    Without a height, the relief is for sweeps over the height (`littrow_against_height`).
    """
    height_arguments = () if height_um is None else ("--height", height_um)
    return Relief(("--preset", name, "--period", period_um, *height_arguments), period_um)


def echelette(period_um: float, samples: tuple[int, int], path: Path) -> Relief:
    """A sawtooth with a right angle at its ridges, whose long facet rises along +x; writes its heights to `path`.

    `samples` are the numbers of samples of the short facet and of the period. They determine the slope b of the long
    facet: the facets are the legs of a right triangle whose hypotenuse is the period. The short leg has the length
    d sin b, and covers d sin²b of the period. Ridge and groove lie on samples.
    """
    short, count = samples
    slope = np.radians(blaze_angle_deg(samples))
    step_um = period_um / count
    i = np.arange(count)
    # The long facet rises with the slope b, and the short one falls with the slope 90° − b.
    heights_um = np.where(i <= count - short, i * step_um * np.tan(slope), (count - i) * step_um / np.tan(slope))
    # A file of heights is two-dimensional; this one has a single row.
    np.save(path, heights_um[None])
    # By default `sunbeam` subtracts a plane from files, which would tilt the facets.
    arguments = ("--height-field", path, "--pixel-size", step_um, "--level", "none", "--tiling", "periodic")
    return Relief(arguments, period_um)


def blaze_angle_deg(samples: tuple[int, int]) -> float:
    """Slope b of the long facet of the `echelette` with these samples, from sin²b = short / period."""
    return float(np.degrees(np.arcsin(np.sqrt(samples[0] / samples[1]))))


def material_arguments(metal: str | None, wavelength_nm: float) -> tuple:
    """Arguments of `sunbeam orders` for a metal with its index at this wavelength; none for a perfect conductor."""
    if metal is None:
        return ()
    n = index(metal, wavelength_nm)
    return ("--eta", n.real, "--k", n.imag)


def solved(relief: Relief, *arguments) -> dict:
    """The report of `sunbeam orders` by Maxwell's equations for the relief, with further `arguments`."""
    return json.loads(sunbeam("orders", "--theory", "rigorous", "--json", *relief.arguments, *arguments))


def littrow(relief: Relief, ratio: float, metal: str | None) -> dict:
    """Efficiencies `te` and `tm` of the returning order at λ/d = `ratio`, and `balance`, the error of the total power.

    Light comes from −x at sin θi = ratio/2. The long facets of `echelette` face this side. The order that returns has
    the number −1 there.
    """
    wavelength_nm = 1e3 * relief.period_um * ratio
    report = solved(relief, *littrow_arguments(relief.period_um, ratio), *material_arguments(metal, wavelength_nm))
    order = efficiencies(report, -1)
    return {"te": order["te"], "tm": order["tm"], "balance": report["balance_error"]}


def littrow_arguments(period_um: float, ratio: float) -> tuple:
    """Arguments of `sunbeam orders` for light in the Littrow mount at λ/d = `ratio`."""
    theta_deg = float(np.degrees(np.arcsin(0.5 * ratio)))
    return ("--theta-i", theta_deg, "--phi-i", 180, "--wavelength", 1e3 * period_um * ratio)


def efficiencies(report: dict, order: int) -> dict:
    """The entry of one order in a report of `sunbeam orders`, or in one of the points of its sweep."""
    return next(entry for entry in report["orders"] if entry["order"] == order)


def littrow_curve(relief: Relief, ratios, metal: str | None) -> dict:
    """The curve over λ/d: lists `ratio`, and `te` and `tm` of `littrow`, and the largest error `balance`."""
    points = [littrow(relief, float(ratio), metal) for ratio in ratios]
    return {
        "ratio": [float(ratio) for ratio in ratios],
        "te": [point["te"] for point in points],
        "tm": [point["tm"] for point in points],
        "balance": max(point["balance"] for point in points),
    }


def littrow_against_height(name: str, period_um: float, ratio: float, heights_um: tuple[float, float, int]) -> dict:
    """Lists `height_um`, `te` and `tm`: the returning order of a preset in a perfect conductor over its height.

    `heights_um` are the first height, the last, and their number.
    """
    over = ("--over", "height", "--range", ",".join(map(str, heights_um)))
    points = solved(preset(name, period_um), *littrow_arguments(period_um, ratio), *over)["points"]
    orders = [efficiencies(point, -1) for point in points]
    return {
        "height_um": [point["at"] for point in points],
        "te": [order["te"] for order in orders],
        "tm": [order["tm"] for order in orders],
    }


def mirror_curve(relief: Relief, metal: str, wavelength_nm: float, angles_deg: tuple[float, float, int]) -> dict:
    """Lists `theta_deg` and `tm`: the TM efficiency of order 0, the mirror reflection, over the angle of incidence.

    `angles_deg` are the first angle, the last, and their number.
    """
    over = ("--over", "theta-i", "--range", ",".join(map(str, angles_deg)))
    arguments = ("--wavelength", wavelength_nm, *over, *material_arguments(metal, wavelength_nm))
    points = solved(relief, *arguments)["points"]
    return {
        "theta_deg": [point["at"] for point in points],
        "tm": [efficiencies(point, 0)["tm"] for point in points],
    }


def vertex(x, y) -> tuple[float, float]:
    """Position and value of the maximum of y over equidistant x, by a parabola at the largest y and its neighbours.

    Raises ValueError if the largest value is at an end.
    """
    i = int(np.argmax(y))
    if not 0 < i < len(y) - 1:
        raise ValueError("the largest value lies at an end of the curve")
    before, at, after = y[i - 1 : i + 2]
    # Offset of the parabola's maximum from x[i] in steps of x. The divisor is not 0: `argmax` takes the first of equal
    # values, so `at` exceeds `before`.
    shift = 0.5 * (before - after) / (before - 2 * at + after)
    return float(x[i] + shift * (x[i + 1] - x[i])), float(at - 0.25 * (before - after) * shift)
