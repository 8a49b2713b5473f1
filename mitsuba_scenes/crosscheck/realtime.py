"""Runs the realtime renderer (`sunbeam render`) and the comparison of pictures (`sunbeam compare`)."""

from __future__ import annotations

import json
from pathlib import Path

from ..light import Light
from ..scene import View
from ..tool import sunbeam


def render(
    output: Path, method: str, mesh: Path, skin: dict, light: Light, view: View, supersample: int = 1, **options
) -> dict:
    """Draws the snake on the GPU, without pigment (`--blend none`) and ground, into the EXR `output`, in linear sRGB.

    `mesh` is a PLY, `skin` has the plugin's parameters, `supersample` is the number of rays along each side of a pixel.
    Only the direction of `light` is used: the sun is directional, and there is no sky. `options` are further options of
    `sunbeam render`. Returns the command's report, with `quadrature` (its wavelengths and weights: quadrature.py), the
    time of the frame `gpu_ms`, the time `build_seconds` of the method's data, and the GPU's name `adapter`.
    """
    words = ["render", "-o", output, "--method", method, "--mesh", mesh, "--blend", "none", "--ground", "false"]
    words += ["--size", f"{view.width}x{view.height}", "--supersample", supersample, "--fov", view.fov_deg]
    for name, position in (("origin", view.origin_cm), ("target", view.target_cm)):
        words += [f"--camera-{name}", ",".join(f"{x:.9g}" for x in position)]
    words += ["--light-azimuth", light.azimuth_deg, "--light-elevation", light.elevation_deg]
    return json.loads(sunbeam(*words, *surface_words(skin), *_named(options)))


def compare(a: Path, b: Path, **options) -> dict:
    """Compares the EXR `b` with the reference `a`. Returns the JSON report of `sunbeam compare`.

    The report has `flip` and `delta_e_2000` (CIEDE2000), each with `mean` and the 99th percentile `p99`, and
    `relative_mse`. `options` are the command's, such as `mask` and `png`.
    """
    return json.loads(sunbeam("compare", a, b, *_named(options)))


def surface_words(skin: dict) -> list:
    """Arguments of `sunbeam` for the plugin's parameters `skin`. The command calls `filename` `--height-field`."""
    return _named({"height-field" if name == "filename" else name: value for name, value in skin.items()})


def _named(options: dict) -> list:
    """Command-line options from their Python names: `max_height=2` gives `--max-height`, `2`."""
    words = []
    for name, value in options.items():
        words += [f"--{name.replace('_', '-')}", str(value).lower() if isinstance(value, bool) else value]
    return words
