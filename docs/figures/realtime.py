"""The part `realtime`: shading time of each method, and the stages of a frame."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

from mitsuba_scenes.crosscheck.cases import SCANS
from mitsuba_scenes.tool import sunbeam

from .speed_error import processor

PRESETS = ("blazed", "elaphe", "xenopeltis")
METHODS = ("flss", "nmm", "pq", "stam", "table")
# Size of the pictures for shading times.
SHADED = "192x128"
# Size of a frame as in a window.
FRAME = "512x512"
# Number of pictures of a slow method, whose median is reported.
SLOW_REPEATS = 3
# Number of pictures of a fast method, whose median is reported.
REPEATS = 25
# Shading time of the frame in ms by variants of `table`'s reads, measured together; only the first shader was kept.
TRIED_MS = {"as it is": 9.1, "constants": 3.5, "texture": 10.6, "four words at a time": 11.5}


def figures() -> dict:
    """Measures all numbers of the part by `sunbeam render`."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        coarse, fine = folder / "coarse.ply", folder / "fine.ply"
        sunbeam("snake", "-o", coarse)
        sunbeam("snake", "-o", fine, "--resolution", "4")
        shading = {
            name: {method: shaded(folder, coarse, surface, method) for method in METHODS}
            for name, surface in surfaces().items()
        }
        frames = [frame(folder, mesh) for mesh in (coarse, fine)]
    return {
        "cpu": processor(),
        "adapter": frames[0]["adapter"],
        "size": SHADED.split("x"),
        "shading": shading,
        "times_flss": {name: by["flss"]["us"] / by["table"]["us"] for name, by in shading.items()},
        "frame_size": FRAME.split("x"),
        "frames": frames,
        "tried_ms": TRIED_MS,
    }


def surfaces() -> dict[str, tuple]:
    """The scans that are present and the presets, as arguments of `sunbeam render`."""
    # Repeated, since all methods but `table` need a tile.
    scans = {
        f"scan of {species}": ("--height-field", path, "--tiling", "periodic")
        for species, path in SCANS.items()
        if path.exists()
    }
    return scans | {preset: ("--preset", preset) for preset in PRESETS}


def render(folder: Path, *words) -> dict:
    return json.loads(sunbeam("render", "-o", folder / "picture.exr", *words))


def shaded(folder: Path, mesh: Path, surface: tuple, method: str) -> dict:
    """Microseconds of shading a lit pixel, and megabytes and build seconds of the method's data."""
    repeats = REPEATS if method in ("stam", "table") else SLOW_REPEATS
    made = render(folder, "--mesh", mesh, *surface, "--method", method, "--size", SHADED, "--repeat", repeats)
    return {
        "us": 1e3 * made["gpu_stages_ms"]["shade"] / made["answered"],
        "answered": made["answered"],
        "mb": made["method_bytes"] / 1e6,
        "build_s": made["build_seconds"],
    }


def frame(folder: Path, mesh: Path) -> dict:
    """Stages of a frame of the snake in milliseconds."""
    made = render(folder, "--mesh", mesh, "--preset", "xenopeltis", "--size", FRAME, "--repeat", REPEATS)
    stages = made["gpu_stages_ms"]
    return {
        "adapter": made["adapter"],
        "triangles": made["triangles"],
        "answered": made["answered"],
        "ms": made["gpu_ms"],
        "stages_ms": stages,
    }
