"""Runs the checks (a) same points, (b) same picture and (c) methods in fixed views and lights.

They compare Mitsuba with the realtime renderer (__init__.py). (c) measures only; it cannot fail.
"""

from __future__ import annotations

import json
import time
from pathlib import Path

import mitsuba as mi

from ..environment import SetupError
from ..light import Light
from ..scene import View
from ..snake import snake_files
from . import methods, same_picture, same_points
from .cases import SCAN, cases, sun

# View of check (a): a few scales of the back, so close that the patch model's speckle, random bright and dark dots, is
# larger than a pixel.
CLOSE = View(96, 64, fov_deg=8.0)
# View of check (b): the middle of CLOSE with pixels of equal size. It has fewer pixels, since each takes hundreds of
# rays.
CLOSER = View(48, 32, fov_deg=4.0)
# View of check (c): the whole snake, as in the demo.
WHOLE = View(72, 48)
# Suns of check (a), by azimuth and elevation in degrees. Each shows an order of the blazed grating in CLOSE.
LIGHTS = tuple(sun(*angles) for angles in ((-180.0, 25.0), (-60.0, 40.0), (-30.0, 25.0)))
# The sun of check (b), and of the short form of check (a).
SINGLE_LIGHT = LIGHTS[1]
# Samples a pixel, a square number, of path-traced pictures of the patch model. Its speckle makes them noisy. More
# samples lower the noise and take longer.
SPP_PATCH = 2304
# Samples a pixel of path-traced pictures of the ensemble, which has no speckle and needs fewer.
SPP_ENSEMBLE = 1024
# Surfaces of check (c): a grating of few orders, and a skin.
METHODS_SURFACES = ("blazed", "xenopeltis")
# Number of surfaces of the short form: the scan and a grating, or without the scan a grating and a skin.
SHORT_SURFACES = 2


class Disagreement(Exception):
    """The renderers disagree, or a negative control passed; the message says where."""


def crosscheck(output: Path, scan: Path = SCAN, short: bool = False) -> dict:
    """Runs the checks in the selected variant, prints their results and returns the report.

    A check that fails is reported, and the others go on; `insist` raises an error of all failures.

    The report has the entries "points", "pictures" and "methods", each by the surfaces' names, and the messages of all
    failed checks as "failures". It is also written to `crosscheck.json` in `output`, beside the pictures.

    The `short` form has two surfaces in one light, and check (c) on the grating only. Raises SetupError in a variant
    without wavelengths.
    """
    if not mi.is_spectral:
        raise SetupError(f"the renderers are compared by wavelength: {mi.variant()} is not a spectral variant")
    output.mkdir(parents=True, exist_ok=True)
    start, files, failures = time.perf_counter(), snake_files(), []
    surfaces, lights, methods_surfaces = cases(scan), LIGHTS, METHODS_SURFACES
    if short:
        surfaces, lights, methods_surfaces = surfaces[:SHORT_SURFACES], (SINGLE_LIGHT,), METHODS_SURFACES[:1]
    report = {"views": {"points": vars(CLOSE), "pictures": vars(CLOSER)}, "points": {}, "pictures": {}, "methods": {}}
    for case in surfaces:
        print(f"{case.name}: the same points ...", flush=True)
        at_points = report["points"][case.name] = same_points.check(case, files, lights, CLOSE, output)
        failures += same_points.failures(case.name, at_points)
        print("\n".join(same_points.lines(at_points)), flush=True)
        print(f"{case.name}: the same picture ...", flush=True)
        in_picture = same_picture.check(case, files, SINGLE_LIGHT, CLOSER, SPP_PATCH, output)
        report["pictures"][case.name] = in_picture
        failures += same_picture.failures(case.name, in_picture)
        print("\n".join(same_picture.lines(in_picture)), flush=True)
    demo_sun = sun(Light.azimuth_deg, Light.elevation_deg)
    for case in surfaces:
        if case.name in methods_surfaces:
            print(f"{case.name}: every realtime method against the path-traced ensemble ...", flush=True)
            compared = report["methods"][case.name] = methods.check(case, files, demo_sun, WHOLE, SPP_ENSEMBLE, output)
            print("\n".join(methods.lines(compared)), flush=True)
    report["failures"] = failures
    report["seconds"] = time.perf_counter() - start
    (output / "crosscheck.json").write_text(json.dumps(report, indent=1) + "\n")
    print(f"crosscheck.json and pictures are in {output} ({report['seconds']:.0f} s)")
    return report


def insist(report: dict) -> None:
    """Raises Disagreement if a check in the report of `crosscheck` failed."""
    if report["failures"]:
        raise Disagreement("; ".join(report["failures"]))
