"""Check (a): colours at the same points in both renderers, with negative controls (comparisons that must fail)."""

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

# Relative tolerance of the plugin's tables and the GPU's series. Chosen below the error of the realtime renderer's sums
# in single precision, so that it does not contribute.
TOLERANCE = 1e-5
# Rotation of the relief in the negative control.
CONTROL_ROTATION_DEG = 1.0


def check(case: Case, files: SnakeFiles, lights: Iterable[Light], view: View, folder: Path) -> list[dict]:
    """Agreement for each light, with the negative controls: mirrored points and a relief rotated by 1°."""
    skin = {**case.skin, **SAME_MODEL}
    bsdf = plugin(case, **SAME_MODEL, tolerance=TOLERANCE)
    found = []
    for number, light in enumerate(lights, 1):
        exr = folder / f"points-{case.name}-{number}-flss.exr"
        report = realtime.render(exr, "flss", files.mesh, {**skin, "tolerance": TOLERANCE}, light, view)
        gpu = np.array(mi.Bitmap(str(exr)), dtype=np.float64)[..., :3]
        quadrature = Quadrature.of_report(report)

        start = time.perf_counter()
        hits = points.points(mi.load_dict(bare_scene(bsdf, files, light, view, 1)), light, view)
        mitsuba = points.radiance(bsdf, hits, quadrature)
        seconds = time.perf_counter() - start
        mi.Bitmap(mitsuba.astype(np.float32)).write(str(exr.with_name(f"points-{case.name}-{number}-mitsuba.exr")))
        mirrored = points.mirrored(hits, case.skin.get("rotation", 0.0))
        controls = {"sign of u": points.radiance(bsdf, mirrored, quadrature)}
        with turned(bsdf, CONTROL_ROTATION_DEG):
            controls["rotated"] = points.radiance(bsdf, hits, quadrature)
        found.append(
            {
                "light": vars(light),
                "lit": int(hits.lit.sum()),
                "compared": int(hits.inside.sum()),
                **agreement(mitsuba, gpu, hits.inside).figures(),
                "controls": {
                    name: agreement(control, gpu, hits.inside).figures() for name, control in controls.items()
                },
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
    """Messages of failures: points that differ, and negative controls whose error was not noticed."""
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
