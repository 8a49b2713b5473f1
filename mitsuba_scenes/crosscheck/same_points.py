"""Check (a) of the cross-check (__init__.py): colours at the same points in both renderers.

Negative controls are comparisons that must fail. The realtime method `flss`, full lambda spectral sampling, sums
diffraction orders at equal steps of the wavelength.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import mitsuba as mi
import numpy as np

from ..light import Light
from ..scene import View
from ..snake import SnakeFiles
from . import points, realtime
from .agreement import agreement
from .cases import SAME_MODEL, Case, bare_scene, plugin, turned
from .points import Points
from .quadrature import Quadrature

# Relative tolerance of the plugin's tables and of the GPU's series. It is below the rounding error of the realtime
# renderer's sums in single precision, so rounding dominates the difference. A smaller tolerance takes longer to build.
TOLERANCE = 1e-5
# Rotation of the relief in the negative control. A smaller angle would test more strictly whether errors are noticed.
CONTROL_ROTATION_DEG = 1.0


def check(case: Case, files: SnakeFiles, lights: Iterable[Light], view: View, folder: Path) -> list[dict]:
    """Agreement for each light and its negative controls (`compared`), with the light and times in seconds.

    Writes the pictures of both renderers into `folder`.
    """
    # Both renderers use the model of `flss`.
    skin = {**case.skin, **SAME_MODEL, "tolerance": TOLERANCE}
    bsdf = plugin(case, **SAME_MODEL, tolerance=TOLERANCE)
    found = []
    for number, light in enumerate(lights, 1):
        exr = folder / f"points-{case.name}-{number}-flss.exr"
        report = realtime.render(exr, "flss", files.mesh, skin, light, view)
        gpu = np.array(mi.Bitmap(str(exr)), dtype=np.float64)
        # Both renderers sum over the same wavelengths.
        quadrature = Quadrature.of_report(report)

        start = time.perf_counter()
        hits = points.trace_points(mi.load_dict(bare_scene(bsdf, files, light, view, spp=1)), light, view)
        mitsuba = points.radiance(bsdf, hits, quadrature)
        seconds = time.perf_counter() - start
        mi.Bitmap(mitsuba.astype(np.float32)).write(str(folder / f"points-{case.name}-{number}-mitsuba.exr"))
        figures = compared(case, bsdf, hits, mitsuba, gpu, partial(points.radiance, quadrature=quadrature))
        times = {"mitsuba": seconds, "realtime": report["seconds"]}
        found.append({"light": vars(light), **figures, "seconds": times})
    return found


def compared(
    case: Case,
    bsdf: mi.BSDF,
    hits: Points,
    mitsuba: np.ndarray,
    gpu: np.ndarray,
    evaluate: Callable[[mi.BSDF, Points], np.ndarray],
) -> dict:
    """Agreement of the plugin's picture `mitsuba` with the realtime renderer's `gpu`, and of the negative controls.

    Pictures are linear sRGB, (height, width, 3). `mitsuba` is `evaluate(bsdf, hits)`, which also evaluates the negative
    controls: mirrored points ("sign of u", where u is the x component of wi + wo) and a relief rotated by
    CONTROL_ROTATION_DEG ("rotated"). `lit` and `compared` are numbers of pixels; compared pixels are lit and away from
    edges (`Points.comparable`). The other entries are the figures of `Agreement`.
    """
    controls = {"sign of u": evaluate(bsdf, points.mirrored(hits, case.skin.get("rotation", 0.0)))}
    with turned(bsdf, CONTROL_ROTATION_DEG):
        controls["rotated"] = evaluate(bsdf, hits)
    return {
        "lit": int(hits.lit.sum()),
        "compared": int(hits.comparable.sum()),
        **agreement(mitsuba, gpu, hits.comparable).figures(),
        "controls": {name: agreement(control, gpu, hits.comparable).figures() for name, control in controls.items()},
    }


def lines(found: list[dict]) -> list[str]:
    """The result of `check`, one line of text for each light."""
    printed = []
    for figures in found:
        controls = ", ".join(f"{name} {control['median']:.1e}" for name, control in figures["controls"].items())
        printed.append(f"  sun at {figures['light']['azimuth_deg']:g}°: {figures['text']}; medians of {controls}")
    return printed


def failures(name: str, found: list[dict]) -> list[str]:
    """Messages about failures in the result of `check` for the surface `name`.

    Points must not differ, and the error of a negative control must be noticed.
    """
    wrong = []
    for figures in found:
        light = f"the sun at azimuth {figures['light']['azimuth_deg']:g}°"
        if not figures["holds"]:
            wrong.append(f"{name}, {light}: the same points differ, {figures['text']}")
        wrong += [
            f"{name}, {light}: the control “{control_name}” was not noticed, {control['text']}"
            for control_name, control in figures["controls"].items()
            if control["holds"]
        ]
    return wrong
