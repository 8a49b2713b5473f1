"""Colours at the same points in Mitsuba and on the GPU, for a grating with `theory = rigorous` (Maxwell's equations).

This is check (a) of __init__.py in an RGB variant; same_points.py is the check for scalar theory, in a spectral one.
Both renderers read equal tables of the orders' efficiencies. Their pictures differ by rounding: the plugin computes the
orders' directions in double precision, the GPU's method `table` in single precision. Tests and
docs/figures/crosscheck.py call this check; run.py compares scalar theory only.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import mitsuba as mi
import numpy as np

from ..light import Light
from ..scene import View
from ..snake import SnakeFiles
from . import points, realtime, same_points
from .cases import Case, bare_scene, plugin


def check(case: Case, files: SnakeFiles, lights: Iterable[Light], view: View, folder: Path) -> list[dict]:
    """For each light the entries of `same_points.compared`, with the light and the realtime renderer's `seconds`.

    The skin of `case` must have `theory = rigorous`, and Mitsuba's variant must be RGB. Writes the realtime renderer's
    pictures into `folder`.
    """
    bsdf = plugin(case)
    found = []
    for number, light in enumerate(lights, 1):
        exr = folder / f"colours-{case.name}-{number}-table.exr"
        report = realtime.render(exr, "table", files.mesh, case.skin, light, view)
        # Both pictures are linear sRGB, (height, width, 3).
        gpu = np.array(mi.Bitmap(str(exr)), dtype=np.float64)
        hits = points.trace_points(mi.load_dict(bare_scene(bsdf, files, light, view, spp=1)), light, view)
        mitsuba = points.colours(bsdf, hits)
        figures = same_points.compared(case, bsdf, hits, mitsuba, gpu, points.colours)
        found.append({"light": vars(light), **figures, "seconds": {"realtime": report["seconds"]}})
    return found
