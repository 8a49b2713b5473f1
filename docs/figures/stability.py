"""Part `stability` of the documentation (page.py): errors for deep reliefs and grazing directions.

It also has random evaluations in Mitsuba, *questions* (questions.py).

- κ, H: the phase rate, the phase per height of the relief, and half the range of heights. κH is the largest phase in
  radians about the middle of the heights.
- S: the relief's power spectrum (docs/tables.md). Errors of S are relative.
- *Taylor*, *Chebyshev*: two series for the phase screen (docs/model.md#the-two-expansions). The error of a series is
  the largest absolute error of an order's amplitude.
- FLSS: a method that uses either series (docs/realtime.md).
- *Point* of the report of `sunbeam bench`: the errors at one κH, or at one angle of incidence. Points ascend in κH.
"""

from __future__ import annotations

import json
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from mitsuba_scenes.tool import sunbeam

from .page import images
from .questions import questions

PART = "stability"
# Number of random evaluations in Mitsuba, and number of random surfaces among which they are divided.
QUESTIONS = (10_000_000, 100)
# The numbers of QUESTIONS in a quick run, `--quick`.
QUICK_QUESTIONS = (20_000, 2)
# Value at which larger errors and overflows are drawn. Amplitudes are at most 1, so no digit is right at such an error.
LOST = 10.0
# Value at which smaller errors, such as 0, are drawn on the logarithmic axis of the plot over κH.
LEAST = 1e-17
# Value at which smaller errors of S are drawn in the plot over the angle of incidence.
LEAST_GRAZING = 1e-12
# Curves over κH: key in the report, label, colour and line style. "99 %" is the 99th percentile of the error.
SERIES = (
    ("taylor_f32", "Taylor, single precision", "tab:red", "-"),
    ("taylor_f64", "Taylor, double precision", "tab:red", "--"),
    ("chebyshev_f32", "Chebyshev, single precision", "tab:blue", "-"),
    ("chebyshev_f64", "Chebyshev, double precision", "tab:blue", "--"),
    ("flss_p99", "FLSS, Chebyshev (99 % of S)", "tab:green", "-"),
    ("flss_taylor_p99", "FLSS, Taylor (99 % of S)", "tab:orange", "-"),
    ("table_p99", "tables (99 % of S)", "tab:purple", "-"),
)


def figures(*arguments: str) -> dict:
    """All numbers of the part; draws the sweeps. `arguments` are further ones of `sunbeam bench`.

    The numbers are the command's report, and

    - `in_mitsuba`: the results of `questions`;
    - `deepest`: the point of the deepest relief;
    - `visible`: the first point at which Taylor's series in single precision is off by more than 1e-3;
    - `dead_f32`, `dead_f64`: the first points at which Taylor's series is off by more than 1, the largest amplitude, in
      single and in double precision;
    - `worst`: the largest value over all points of each of Chebyshev's errors, and of the tables' `table_p99`;
    - `flss_worst`: the largest value over all points of `flss_p99`;
    - `refused`: the first κH at which FLSS refuses Taylor's series, or `None`.
    """
    report = json.loads(sunbeam("bench", "--what", "stability", *arguments))
    folder = images(PART)
    draw_deep(report["deep_relief"], folder / "deep-relief.svg")
    draw_grazing(report["grazing"], folder / "grazing.svg")
    deep = report["deep_relief"]
    return {
        **report,
        "in_mitsuba": questions(*(QUICK_QUESTIONS if "--quick" in arguments else QUESTIONS)),
        "seconds": round(report["seconds"]),
        "deepest": deep[-1],
        "visible": first_above(deep, "taylor_f32", 1e-3),
        "dead_f32": first_above(deep, "taylor_f32", 1.0),
        "dead_f64": first_above(deep, "taylor_f64", 1.0),
        "worst": {key: max(point[key] for point in deep) for key in ("chebyshev_f32", "chebyshev_f64", "table_p99")},
        "flss_worst": max(point["flss_p99"] for point in deep),
        "refused": next((point["kappa_h"] for point in deep if point["flss_taylor_p99"] is None), None),
    }


def first_above(points: list[dict], key: str, limit: float) -> dict | None:
    """The first point at which the error `key` exceeds the limit, or `None` if it never does.

    An error that overflows is `None` in the report, and exceeds any limit.
    """
    return next((point for point in points if point[key] is None or point[key] > limit), None)


def draw_deep(points: list[dict], file: Path) -> None:
    """Draws the errors of deep reliefs against the phase range κH."""
    figure, axes = plt.subplots(figsize=(7.5, 4.6))
    for key, label, colour, line in SERIES:
        # `None` is a refusal of FLSS, which is not drawn, and for other series an overflow.
        drawn = [point for point in points if not (key.startswith("flss") and point[key] is None)]
        errors = [LOST if point[key] is None else min(max(point[key], LEAST), LOST) for point in drawn]
        axes.plot([point["kappa_h"] for point in drawn], errors, line, color=colour, marker=".", label=label)
    axes.set(xscale="log", yscale="log", xlabel="κH", ylabel="error")
    axes.axhline(1, color="grey", linewidth=0.6)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="upper left")
    save(figure, file)


def draw_grazing(surfaces: list[dict], file: Path) -> None:
    """Draws errors of S and albedos of each surface (three at most) against the angle from the horizon.

    Solid lines of albedos are with energy conservation, dashed ones without. Grey lines are the tables' tolerance and
    the albedo 1, the largest that conserves energy.
    """
    figure, axes = plt.subplots(1, 2, figsize=(9.5, 4))
    for surface, colour in zip(surfaces, ("tab:blue", "tab:orange", "tab:green")):
        points = surface["points"]
        angles_deg = [90 - point["theta_deg"] for point in points]
        errors = [max(point["error_p99"], LEAST_GRAZING) for point in points]
        scaled, unscaled = ([point[key] for point in points] for key in ("albedo", "albedo_unscaled"))
        axes[0].plot(angles_deg, errors, color=colour, marker=".", label=surface["name"])
        axes[1].plot(angles_deg, scaled, color=colour, marker=".", label=surface["name"])
        axes[1].plot(angles_deg, unscaled, "--", color=colour)
    axes[0].axhline(surfaces[0]["tolerance"], color="grey", linewidth=0.6)
    axes[1].axhline(1, color="grey", linewidth=0.6)
    axes[0].set(yscale="log", ylabel="error of S, 99 %")
    axes[1].set(yscale="log", ylabel="largest albedo (dashed: not scaled)")
    for each in axes:
        each.set(xscale="log", xlabel="90° − angle of incidence, in degrees")
        each.invert_xaxis()
        each.grid(alpha=0.3)
        each.legend(fontsize=8)
    save(figure, file)


def save(figure: plt.Figure, file: Path) -> None:
    """Writes an SVG that is identical for identical numbers."""
    figure.tight_layout()
    with matplotlib.rc_context({"svg.hashsalt": file.stem}):
        figure.savefig(file, metadata={"Date": None})
    plt.close(figure)
