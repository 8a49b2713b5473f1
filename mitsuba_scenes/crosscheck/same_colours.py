"""Check (a) for a grating by Maxwell's equations: colours at the same points, in an RGB variant.

Both renderers read the same efficiencies. The plugin computes positions of orders in double precision, the GPU's
`table` in single.
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
    """Agreement for each direction of the light, with the negative controls."""
    bsdf = plugin(case)
    found = []
    for number, light in enumerate(lights, 1):
        exr = folder / f"colours-{case.name}-{number}-table.exr"
        report = realtime.render(exr, "table", files.mesh, case.skin, light, view)
        ours = np.array(mi.Bitmap(str(exr)), dtype=np.float64)[..., :3]
        at = points.points(mi.load_dict(bare_scene(bsdf, files, light, view, 1)), light, view)
        mirrored = points.mirrored(at, case.skin.get("rotation", 0.0))
        controls = {"sign of u": points.colours(bsdf, mirrored)}
        with turned(bsdf, CONTROL_ROTATION_DEG):
            controls["rotated"] = points.colours(bsdf, at)
        found.append(
            {
                "light": vars(light),
                "lit": int(at.lit.sum()),
                "compared": int(at.inside.sum()),
                **agreement(points.colours(bsdf, at), ours, at.inside).figures(),
                "controls": {name: agreement(made, ours, at.inside).figures() for name, made in controls.items()},
                "seconds": {"realtime": report["seconds"]},
            }
        )
    return found
