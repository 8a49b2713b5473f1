"""One picture of the whole scene, with pigment and ground, drawn by Mitsuba and by the realtime renderer."""

from __future__ import annotations

import json
from pathlib import Path

from . import picture
from .contact_sheet import contact_sheet
from .crosscheck import realtime
from .light import Light
from .render import EXPOSURE_STOPS
from .scene import View
from .skin import preset_skin, skin_bsdf
from .snake import SnakeFiles
from .tool import sunbeam

# Skin of both pictures.
PRESET = "xenopeltis"
# Rays along each side of a pixel in the realtime picture.
SUPERSAMPLE = 4
# Smallest number of Mitsuba's passes (picture.py). The first pass includes the compilation of kernels. The caption's
# time is therefore the time of a later pass, times the number of passes.
PASSES = 2


def side_by_side(files: SnakeFiles, view: View, spp: int, output: Path) -> dict:
    """Writes both pictures, their difference, and `both-renderers.png` into `output`; returns comparison and times.

    The light is a directional sun without sky. Neither renderer conserves energy here (docs/model.md#energy). The
    realtime renderer uses its method `table`, the colour table (docs/realtime.md). `view` sets the resolution; its
    camera must be the default one. `spp` is the number of Mitsuba's samples per pixel, before `picture.render` rounds
    it up; the caption has the rounded number.

    Result: `mitsuba_seconds`, the `seconds` of `picture.render` by stage; `realtime`, the report of `sunbeam render`;
    and `compared`, the report of `realtime.compare`.
    """
    light = Light(sun="directional", sky_radiance=0)
    skin = preset_skin(PRESET)
    bsdf = skin_bsdf({**skin, "conserve_energy": False}, files.pigment)
    # `picture.render` splits the samples in the same way. The caption and the time need the numbers.
    passes, spp_per_pass = picture.split(view.width, view.height, spp, PASSES)
    traced = picture.render(bsdf, files, light, view, spp, passes=passes)
    mitsuba_exr, realtime_exr = output / "both-mitsuba.exr", output / "both-realtime.exr"
    mitsuba_png, realtime_png = picture.write(traced.pixels, mitsuba_exr, EXPOSURE_STOPS), output / "both-realtime.png"
    # The command's defaults have the same camera, pigment and ground, and no energy conservation.
    arguments = ["render", "-o", realtime_exr, "--png", realtime_png, "--method", "table"]
    arguments += ["--mesh", files.mesh, "--supersample", SUPERSAMPLE, "--size", f"{view.width}x{view.height}"]
    arguments += ["--light-azimuth", light.azimuth_deg, "--light-elevation", light.elevation_deg]
    arguments += ["--exposure", EXPOSURE_STOPS]
    drawn = json.loads(sunbeam(*arguments, *realtime.surface_words(skin)))
    compared = realtime.compare(mitsuba_exr, realtime_exr, png=output / "both-difference.png")
    # The adapter's name without the driver's version.
    adapter = drawn["adapter"].split(" (")[0]
    all_passes_s = passes * traced.seconds["later_pass"]
    row = [
        (mitsuba_png, f"Mitsuba 3, {passes * spp_per_pass} paths a pixel: {all_passes_s:.1f} s"),
        (
            realtime_png,
            f"realtime, {SUPERSAMPLE**2} rays a pixel, method table: {drawn['gpu_ms'] / 1e3:.2g} s on {adapter}",
        ),
    ]
    contact_sheet([row], output / "both-renderers.png", view.width)
    return {"mitsuba_seconds": traced.seconds, "realtime": drawn, "compared": compared}
