"""Check (a): colours at the same points in both renderers, with negative controls."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path

import mitsuba as mi
import numpy as np

from ..light import Light
from ..scene import View
from ..snake import SnakeFiles
from . import points, realtime
from .agreement import agreement
from .cases import SAME_MODEL, Case, bare_scene, plugin, turned
from .quadrature import Quadrature

# Tolerance of tables and series, below the single precision of the realtime renderer's sums.
TOLERANCE = 1e-5
# Rotation of the relief in the negative control.
CONTROL_ROTATION_DEG = 1.0


def check(case: Case, files: SnakeFiles, lights: Iterable[Light], view: View, folder: Path) -> list[dict]:
    """Agreement for each direction of the light, with the negative controls."""
    skin = {**case.skin, **SAME_MODEL}
    bsdf = plugin(case, **SAME_MODEL, tolerance=TOLERANCE)
    found = []
    for number, light in enumerate(lights, 1):
        exr = folder / f"points-{case.name}-{number}-flss.exr"
        report = realtime.render(exr, "flss", files.mesh, {**skin, "tolerance": TOLERANCE}, light, view)
        ours = np.array(mi.Bitmap(str(exr)), dtype=np.float64)[..., :3]
        quadrature = Quadrature.of_report(report)

        start = time.perf_counter()
        at = points.points(mi.load_dict(bare_scene(bsdf, files, light, view, 1)), light, view)
        theirs = points.radiance(bsdf, at, quadrature)
        seconds = time.perf_counter() - start
        mi.Bitmap(theirs.astype(np.float32)).write(str(exr.with_name(f"points-{case.name}-{number}-mitsuba.exr")))
        mirrored = points.mirrored(at, case.skin.get("rotation", 0.0))
        controls = {"sign of u": points.radiance(bsdf, mirrored, quadrature)}
        with turned(bsdf, CONTROL_ROTATION_DEG):
            controls["rotated"] = points.radiance(bsdf, at, quadrature)
        found.append(
            {
                "light": vars(light),
                "lit": int(at.lit.sum()),
                "compared": int(at.inside.sum()),
                **agreement(theirs, ours, at.inside).figures(),
                "controls": {name: agreement(made, ours, at.inside).figures() for name, made in controls.items()},
                "seconds": {"mitsuba": seconds, "realtime": report["seconds"]},
            }
        )
    return found


def lines(found: list[dict]) -> list[str]:
    """The result as lines of text."""
    printed = []
    for figures in found:
        controls = ", ".join(f"{name} {of_control['median']:.1e}" for name, of_control in figures["controls"].items())
        printed.append(f"  sun at {figures['light']['azimuth_deg']:g}°: {figures['text']}; medians of {controls}")
    return printed


def failures(name: str, found: list[dict]) -> list[str]:
    """Failures: points that differ, and controls that pass."""
    wrong = []
    for figures in found:
        light = f"the sun at azimuth {figures['light']['azimuth_deg']:g}°"
        if not figures["holds"]:
            wrong.append(f"{name}, {light}: the same points differ, {figures['text']}")
        wrong += [
            f"{name}, {light}: the control “{control}” was not noticed, {of_control['text']}"
            for control, of_control in figures["controls"].items()
            if of_control["holds"]
        ]
    return wrong
