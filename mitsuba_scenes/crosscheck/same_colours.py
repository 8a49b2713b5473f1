"""Check (a) for a grating with `theory = rigorous` (docs/model.md#gratings-by-maxwells-equations), in an RGB variant.

Both renderers read the same tabulated efficiencies of the orders. The plugin computes the orders' directions in double
precision, the GPU's method `table` in single precision. Called by the tests; `run.py` compares scalar theory only.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import mitsuba as mi
import numpy as np

from ..light import Light
from ..scene import View
from ..snake import SnakeFiles
from . import points, realtime
from .agreement import agreement
from .cases import Case, bare_scene, plugin, turned
from .same_points import CONTROL_ROTATION_DEG


def check(case: Case, files: SnakeFiles, lights: Iterable[Light], view: View, folder: Path) -> list[dict]:
    """Agreement for each light, with the negative controls: mirrored points and a relief rotated by 1°."""
    bsdf = plugin(case)
    found = []
    for number, light in enumerate(lights, 1):
        exr = folder / f"colours-{case.name}-{number}-table.exr"
        report = realtime.render(exr, "table", files.mesh, case.skin, light, view)
        gpu = np.array(mi.Bitmap(str(exr)), dtype=np.float64)[..., :3]
        hits = points.points(mi.load_dict(bare_scene(bsdf, files, light, view, 1)), light, view)
        mirrored = points.mirrored(hits, case.skin.get("rotation", 0.0))
        controls = {"sign of u": points.colours(bsdf, mirrored)}
        with turned(bsdf, CONTROL_ROTATION_DEG):
            controls["rotated"] = points.colours(bsdf, hits)
        found.append(
            {
                "light": vars(light),
                "lit": int(hits.lit.sum()),
                "compared": int(hits.inside.sum()),
                **agreement(points.colours(bsdf, hits), gpu, hits.inside).figures(),
                "controls": {
                    name: agreement(control, gpu, hits.inside).figures() for name, control in controls.items()
                },
                "seconds": {"realtime": report["seconds"]},
            }
        )
    return found
