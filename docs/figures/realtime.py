"""Part `realtime` of the documentation (page.py): shading times of the realtime methods, and the stages of a frame.

`sunbeam render` measures the times. A *frame* is one picture of the snake. A *stage* is a step of a frame (`StageTimes`
of crates/realtime/src/renderer.rs), such as the shading. Shading alone is timed for each method and surface, a whole
frame for the default method. A *lit* pixel shows the mesh in sunlight.
"""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

from mitsuba_scenes.crosscheck.cases import SCANS
from mitsuba_scenes.tool import sunbeam

from .speed_error import processor

# Measured presets, besides the scans.
PRESETS = ("blazed", "elaphe", "xenopeltis")
# Measured methods (docs/realtime.md).
METHODS = ("flss", "nmm", "pq", "stam", "table")
# Methods fast enough for REPEATS pictures.
FAST_METHODS = ("stam", "table")
# Size of the pictures for shading times, in pixels; smaller than a frame, since some methods are slow.
SHADED = "192x128"
# Size of a frame as in a window, in pixels.
FRAME = "512x512"
# Number of pictures by a slow method; the median time of each stage is reported.
SLOW_REPEATS = 3
# Number of pictures by a fast method.
REPEATS = 25
# Factor on the cells of the snake's default mesh along each direction, for the finer mesh.
FINE_RESOLUTION = 4
# Shading times in ms of one frame by the method `table` and by three experimental shaders, which are not in the
# repository. The times are from a single measurement, and show that reads of the table dominate. One experiment
# replaced the reads by constants, one read from a texture, and one read four machine words at a time.
TRIED_MS = {"as it is": 9.1, "constants": 3.5, "texture": 10.6, "four words at a time": 11.5}


def figures() -> dict:
    """All numbers of the part: measured by `sunbeam render`, except for TRIED_MS.

    - `shading`: the results of `shaded` by surface and method, on the default mesh.
    - `flss_over_table`: by surface, the shading time of FLSS over that of the table.
    - `frames`: the results of `frame` on the default and on the finer mesh.
    - `size`, `frame_size`: width and height in pixels, as text.
    """
    with TemporaryDirectory() as scratch:
        folder = Path(scratch)
        coarse, fine = folder / "coarse.ply", folder / "fine.ply"
        sunbeam("snake", "-o", coarse)
        sunbeam("snake", "-o", fine, "--resolution", FINE_RESOLUTION)
        shading = {
            name: {method: shaded(folder, coarse, arguments, method) for method in METHODS}
            for name, arguments in surfaces().items()
        }
        frames = [frame(folder, mesh) for mesh in (coarse, fine)]
    return {
        "cpu": processor(),
        "adapter": frames[0]["adapter"],
        "size": SHADED.split("x"),
        "shading": shading,
        "flss_over_table": {
            name: by_method["flss"]["us"] / by_method["table"]["us"] for name, by_method in shading.items()
        },
        "frame_size": FRAME.split("x"),
        "frames": frames,
        "tried_ms": TRIED_MS,
    }


def surfaces() -> dict[str, tuple]:
    """Arguments of `sunbeam render` for the scans that are present and for the presets, by name."""
    # Scans are repeated as tiles, since all methods but `table` need a periodic relief.
    scans = {
        f"scan of {species}": ("--height-field", path, "--tiling", "periodic")
        for species, path in SCANS.items()
        if path.exists()
    }
    return scans | {preset: ("--preset", preset) for preset in PRESETS}


def render(folder: Path, *arguments) -> dict:
    """The report of `sunbeam render` with these `arguments`; the picture goes into `folder`."""
    return json.loads(sunbeam("render", "-o", folder / "picture.exr", *arguments))


def shaded(folder: Path, mesh: Path, surface: tuple, method: str) -> dict:
    """Microseconds of shading per lit pixel, `us`, and the method's data: their size in MB and build time in seconds.

    `surface` has arguments of `sunbeam render`. Lit pixels are the sunlit ones of the mesh, the report's `answered`.
    """
    repeats = REPEATS if method in FAST_METHODS else SLOW_REPEATS
    report = render(folder, "--mesh", mesh, *surface, "--method", method, "--size", SHADED, "--repeat", repeats)
    return {
        "us": 1e3 * report["gpu_stages_ms"]["shade"] / report["answered"],
        "lit_pixels": report["answered"],
        "mb": report["method_bytes"] / 1e6,
        "build_s": report["build_seconds"],
    }


def frame(folder: Path, mesh: Path) -> dict:
    """Milliseconds of each stage of a frame, `stages_ms`, and their sum, `ms`.

    The result also has the GPU's name, and the numbers of triangles and of lit pixels. The frame is the snake with
    `xenopeltis` by the default method, `table`.
    """
    report = render(folder, "--mesh", mesh, "--preset", "xenopeltis", "--size", FRAME, "--repeat", REPEATS)
    return {
        "adapter": report["adapter"],
        "triangles": report["triangles"],
        "lit_pixels": report["answered"],
        "ms": report["gpu_ms"],
        "stages_ms": report["gpu_stages_ms"],
    }
