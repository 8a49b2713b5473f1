"""The part `crosscheck`: both renderers compared, and the realtime methods with the path-traced ensemble."""

from __future__ import annotations

import json
from pathlib import Path

from mitsuba_scenes.crosscheck import same_colours, same_points
from mitsuba_scenes.crosscheck.cases import Case
from mitsuba_scenes.crosscheck.run import CLOSE, LIGHTS, Disagreement, crosscheck, insist
from mitsuba_scenes.environment import REPOSITORY, use_variant
from mitsuba_scenes.snake import snake_files

from .speed_error import processor

SAME_RAYS = "ensemble, same rays"
# A blazed grating in aluminium at 570 nm, not its own mirror image, so that the sign of u matters. Its orders are wide
# enough that some pixels see each light.
BLAZED = {"preset": "blazed", "theory": "rigorous", "eta": 1.0, "k": 6.9, "coherence_length": 20.0}
GRATINGS = [
    Case("blazed, 2.5 µm", BLAZED, supersample=1),
    Case("blazed, 0.9 µm", {**BLAZED, "period": 0.9, "height": 0.15}, supersample=1),
]
COLOURS = "llvm_ad_rgb"


def figures() -> dict:
    """The figures of `make crosscheck`."""
    folder = REPOSITORY / "out" / "crosscheck"
    variant = use_variant(fall_back=False)
    report = crosscheck(folder)
    insist(report)
    report = json.loads(json.dumps(report, default=str))
    points = {name: [point_figures(found) for found in each] for name, each in report["points"].items()}
    everywhere = [found for each in points.values() for found in each]
    return {
        "cpu": processor(),
        "variant": variant,
        "points": points,
        "median": [min(found["median"] for found in everywhere), max(found["median"] for found in everywhere)],
        "p99": max(found["p99"] for found in everywhere),
        "pictures": {name: picture_figures(found) for name, found in report["pictures"].items()},
        "methods": {name: method_figures(compared) for name, compared in report["methods"].items()},
        "gratings": gratings(folder),
        "gratings_variant": COLOURS,
    }


def gratings(folder: Path) -> dict:
    """Agreement of both renderers at the same points on gratings by Maxwell's equations."""
    use_variant(COLOURS, fall_back=False)
    files, found = snake_files(), {}
    for case in GRATINGS:
        checked = same_colours.check(case, files, LIGHTS, CLOSE, folder)
        if failures := same_points.failures(case.name, checked):
            raise Disagreement("; ".join(failures))
        found[case.name] = [point_figures(each) for each in checked]
    return found


def point_figures(found: dict) -> dict:
    kept = {key: found[key] for key in ("pixels", "median", "p99", "largest")}
    controls = {name: control["median"] for name, control in found["controls"].items()}
    return {"azimuth_deg": found["light"]["azimuth_deg"], **kept, "controls": controls}


def picture_figures(found: dict) -> dict:
    kept = {key: found[key] for key in ("pixels", "delta_e_2000", "flip")}
    controls = {name: control["delta_e_2000"]["mean"] for name, control in found["controls"].items()}
    return {**kept, "controls": controls}


def method_figures(compared: dict) -> list[dict]:
    """A row for each method: differences from the ensemble as rendered, and along the same rays."""
    rows = []
    for name, row in compared["against_the_reference"].items():
        same = row.get(SAME_RAYS)
        rows.append(
            {
                "name": name,
                "delta_e": row["delta_e_2000"]["mean"],
                "flip": row["flip"]["mean"],
                "same_rays": same and {"delta_e": same["delta_e_2000"]["mean"], "flip": same["flip"]["mean"]},
            }
        )
    return rows
