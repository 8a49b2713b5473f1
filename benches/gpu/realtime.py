"""Times of the realtime renderer's frames on the card, for each method."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from mitsuba_scenes.crosscheck.realtime import surface_words
from mitsuba_scenes.tool import sunbeam

from .parts import Check
from .plan import Plan

# Target time of a frame in ms, by method and (width, height): about a quarter of the 16.7 ms at 60 Hz. A slower frame
# does not fail.
AIM_MS = {("table", (1920, 1080)): 4.0}


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """One timing per method and size."""
    for method in plan.methods:
        for size in plan.frame_sizes:
            yield f"{method}, {size[0]} x {size[1]}", partial(frame, plan, folder, method, size)


def frame(plan: Plan, folder: Path, method: str, size: tuple[int, int]) -> dict:
    """Draws `plan.frames` frames of the snake and returns their times in ms.

    `stages_ms` has the median time of each stage of a frame, `ms` is their sum, and `clock` the source of the times.
    `lit_pixels` is the number of pixels that show sunlit skin, and `submissions` the number of GPU submissions that
    shade them. `data_mb` is the size of the method's data. `reached` tells whether `ms` is at most AIM_MS. `passed`
    needs a time above 0, measured on the software adapter in a dry run and on a GPU otherwise.
    """
    picture = folder / "frame.exr"
    arguments = ["render", "-o", picture, "--adapter", plan.adapter, "--method", method]
    arguments += [*surface_words(plan.skin), "--resolution", plan.mesh_resolution]
    found = json.loads(sunbeam(*arguments, "--size", f"{size[0]}x{size[1]}", "--repeat", plan.frames))
    # Only the times are of interest, and the picture has 100 MB at 3840 x 2160.
    picture.unlink()
    aim = AIM_MS.get((method, size))
    return {
        "method": method,
        "size": list(size),
        "adapter": found["adapter"],
        "clock": found["gpu_clock"],
        "ms": found["gpu_ms"],
        "stages_ms": found["gpu_stages_ms"],
        "lit_pixels": found["answered"],
        "submissions": found["submissions"],
        "data_mb": found["method_bytes"] / 1e6,
        **({"aim_ms": aim, "reached": found["gpu_ms"] <= aim} if aim else {}),
        "passed": found["software"] == plan.dry and found["gpu_ms"] > 0,
    }
