"""Efficiencies by `sunbeam orders` for the part `gratings`: in Littrow mounts, and against angles."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mitsuba_scenes.tool import sunbeam
from tests.judges.gratings.metals import index


@dataclass(frozen=True)
class Relief:
    """A grating: arguments of the command, and the period in µm."""

    words: tuple
    period_um: float


def preset(name: str, period_um: float, height_um: float) -> Relief:
    return Relief(("--preset", name, "--period", period_um, "--height", height_um), period_um)


def echelette(period_um: float, samples: tuple[int, int], path: Path) -> Relief:
    """A sawtooth with a right angle at its ridges, whose long facet rises along +x, as a file of heights.

    `samples` counts those of the short facet and of the period. With b the slope of the long facet the short one takes
    sin²b of the period, so that both corners lie on samples.
    """
    short, count = samples
    slope = np.radians(blaze_angle_deg(samples))
    step = period_um / count
    i = np.arange(count)
    heights = np.where(i <= count - short, i * step * np.tan(slope), (count - i) * step / np.tan(slope))
    np.save(path, heights[None])
    words = ("--height-field", path, "--pixel-size", step, "--level", "none", "--tiling", "periodic")
    return Relief(words, period_um)


def blaze_angle_deg(samples: tuple[int, int]) -> float:
    return float(np.degrees(np.arcsin(np.sqrt(samples[0] / samples[1]))))


def material(metal: str | None, wavelength_nm: float) -> tuple:
    """Arguments of the command for a metal at one wavelength; none for a perfect conductor."""
    if metal is None:
        return ()
    n = index(metal, wavelength_nm)
    return ("--eta", n.real, "--k", n.imag)


def asked(relief: Relief, *words) -> dict:
    """The output of `sunbeam orders --json`."""
    return json.loads(sunbeam("orders", "--theory", "rigorous", "--json", *relief.words, *words))


def littrow(relief: Relief, ratio: float, metal: str | None) -> dict:
    """TE and TM efficiencies of the retroreflected order at λ/period = `ratio`.

    Light comes from −x, the side that a blaze's long facets face, at sin θ = ratio/2; the order is −1.
    """
    wavelength_nm = 1e3 * relief.period_um * ratio
    theta_deg = float(np.degrees(np.arcsin(0.5 * ratio)))
    light = ("--theta-i", theta_deg, "--phi-i", 180, "--wavelength", wavelength_nm)
    solved = asked(relief, *light, *material(metal, wavelength_nm))
    order = next(order for order in solved["orders"] if order["order"] == -1)
    return {"te": order["te"], "tm": order["tm"], "balance": solved["balance_error"]}


def littrow_curve(relief: Relief, ratios, metal: str | None) -> dict:
    """The curve over λ/period: lists of TE and TM, and the largest error of the power balance."""
    points = [littrow(relief, float(ratio), metal) for ratio in ratios]
    return {
        "ratio": [float(ratio) for ratio in ratios],
        "te": [point["te"] for point in points],
        "tm": [point["tm"] for point in points],
        "balance": max(point["balance"] for point in points),
    }


def littrow_against_height(name: str, period_um: float, ratio: float, heights_um: tuple[float, float, int]) -> dict:
    """The curve of a preset in a perfect conductor over its height in µm (from, to, count)."""
    theta_deg = float(np.degrees(np.arcsin(0.5 * ratio)))
    light = ("--theta-i", theta_deg, "--phi-i", 180, "--wavelength", 1e3 * period_um * ratio)
    over = ("--over", "height", "--range", ",".join(map(str, heights_um)))
    points = asked(preset(name, period_um, heights_um[0]), *light, *over)["points"]
    orders = [next(order for order in point["orders"] if order["order"] == -1) for point in points]
    return {
        "height_um": [point["at"] for point in points],
        "te": [order["te"] for order in orders],
        "tm": [order["tm"] for order in orders],
    }


def mirror_curve(relief: Relief, metal: str, wavelength_nm: float, angles_deg: tuple[float, float, int]) -> dict:
    """TM efficiency of order 0 over the angle of incidence in degrees (from, to, count)."""
    over = ("--over", "theta-i", "--range", ",".join(map(str, angles_deg)))
    points = asked(relief, "--wavelength", wavelength_nm, *over, *material(metal, wavelength_nm))["points"]
    mirrored = [next(order["tm"] for order in point["orders"] if order["order"] == 0) for point in points]
    return {"theta_deg": [point["at"] for point in points], "tm": mirrored}


def vertex(x, y) -> tuple[float, float]:
    """Position and value of the maximum of y, by a parabola through three equidistant points."""
    i = int(np.argmax(y))
    if not 0 < i < len(y) - 1:
        raise ValueError("the largest value lies at an end of the curve")
    before, at, after = y[i - 1 : i + 2]
    shift = 0.5 * (before - after) / (before - 2 * at + after)
    return float(x[i] + shift * (x[i + 1] - x[i])), float(at - 0.25 * (before - after) * shift)
