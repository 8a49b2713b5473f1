"""Part `crosscheck` of the documentation (page.py): the path tracer against the realtime renderer.

The measurements are those of `python -m mitsuba_scenes.crosscheck`, and a comparison of gratings with `theory =
rigorous`, which that command leaves to the tests. A *control* is a comparison with a deliberate error, which must fail.
*Points* are comparisons of values at the same points of the surface in both renderers. Differences of pictures are
ΔE₂₀₀₀, the colour difference CIEDE2000, and FLIP, a difference as perceived when pictures are flipped.
"""

from __future__ import annotations

from pathlib import Path

from mitsuba_scenes.crosscheck import same_colours, same_points
from mitsuba_scenes.crosscheck.cases import Case
from mitsuba_scenes.crosscheck.methods import SAME_RAYS
from mitsuba_scenes.crosscheck.run import CLOSE, LIGHTS, Disagreement, crosscheck, insist
from mitsuba_scenes.environment import REPOSITORY, use_variant
from mitsuba_scenes.snake import snake_files

from .speed_error import processor

# Parameters of the plugin: a blazed grating in aluminium, with the metal's index at 570 nm. The grating differs from
# its mirror image, so a wrong sign along x would show. The short coherence length, in µm, makes orders wide, so that
# some pixels see an order of each light.
BLAZED = {"preset": "blazed", "theory": "rigorous", "eta": 1.0, "k": 6.9, "coherence_length": 20.0}
# The compared gratings, named by their periods: the preset's, and one close to the wavelength. `Case` requires
# `supersample`, which comparisons at points do not read.
GRATINGS = [
    Case("blazed, 2.5 µm", BLAZED, supersample=1),
    Case("blazed, 0.9 µm", {**BLAZED, "period": 0.9, "height": 0.15}, supersample=1),
]
# Mitsuba's variant in the comparison of gratings, which compares colours.
COLOURS_VARIANT = "llvm_ad_rgb"


def figures() -> dict:
    """All numbers of the part. Raises `Disagreement` if the renderers disagree or a negative control passes.

    - `points`, `gratings`: the `point_figures` of each light, by surface.
    - `median`, `p99`: the range of the medians of the relative errors in `points`, and their largest 99th percentile.
    - `pictures`, `methods`: the results of `picture_figures` and `method_figures`, by surface.
    - `variant`, `gratings_variant`: Mitsuba's variants of the comparisons.
    """
    folder = REPOSITORY / "out" / "crosscheck"
    variant = use_variant(fall_back=False)
    report = crosscheck(folder)
    insist(report)
    points = {name: [point_figures(found) for found in by_light] for name, by_light in report["points"].items()}
    everywhere = [found for by_light in points.values() for found in by_light]
    return {
        "cpu": processor(),
        "variant": variant,
        "points": points,
        "median": [min(found["median"] for found in everywhere), max(found["median"] for found in everywhere)],
        "p99": max(found["p99"] for found in everywhere),
        "pictures": {name: picture_figures(found) for name, found in report["pictures"].items()},
        "methods": {name: method_figures(compared) for name, compared in report["methods"].items()},
        "gratings": gratings(folder),
        "gratings_variant": COLOURS_VARIANT,
    }


def gratings(folder: Path) -> dict:
    """The `point_figures` of each light on each of GRATINGS, whose orders are solved by Maxwell's equations.

    `folder` gets the pictures. Selects COLOURS_VARIANT.
    """
    use_variant(COLOURS_VARIANT, fall_back=False)
    files, found = snake_files(), {}
    for case in GRATINGS:
        checked = same_colours.check(case, files, LIGHTS, CLOSE, folder)
        if failures := same_points.failures(case.name, checked):
            raise Disagreement("; ".join(failures))
        found[case.name] = [point_figures(of_light) for of_light in checked]
    return found


def point_figures(found: dict) -> dict:
    """The page's numbers of one light at points: the sun's azimuth, the relative errors, and the controls' medians."""
    kept = {key: found[key] for key in ("pixels", "median", "p99", "largest")}
    controls = {name: control["median"] for name, control in found["controls"].items()}
    return {"azimuth_deg": found["light"]["azimuth_deg"], **kept, "controls": controls}


def picture_figures(found: dict) -> dict:
    """The page's numbers of one surface's pictures: the differences ΔE₂₀₀₀ and FLIP, and the controls' mean ΔE₂₀₀₀."""
    kept = {key: found[key] for key in ("pixels", "delta_e_2000", "flip")}
    controls = {name: control["delta_e_2000"]["mean"] for name, control in found["controls"].items()}
    return {**kept, "controls": controls}


def method_figures(compared: dict) -> list[dict]:
    """A row for each picture of mitsuba_scenes/crosscheck/methods.py: mean differences from the path-traced reference.

    The reference is the model `ensemble` (docs/model.md#coherence). `same_rays` has the differences from an ensemble
    picture along the rays of the realtime renderer. Rows are named by the methods of the pictures.
    """
    rows = []
    for name, row in compared["against_the_reference"].items():
        same = row[SAME_RAYS]
        rows.append(
            {
                "name": name,
                "delta_e": row["delta_e_2000"]["mean"],
                "flip": row["flip"]["mean"],
                "same_rays": {"delta_e": same["delta_e_2000"]["mean"], "flip": same["flip"]["mean"]},
            }
        )
    return rows
