"""Check (b) of __init__.py: Mitsuba's picture looks like the supersampled picture of the realtime renderer."""

from __future__ import annotations

import time
from pathlib import Path

import mitsuba as mi
import numpy as np

from .. import picture
from ..light import Light
from ..scene import View
from ..snake import SnakeFiles
from . import realtime, spectral
from .cases import SAME_MODEL, Case, mirrored, plugin, turned
from .quadrature import Quadrature
from .same_points import CONTROL_ROTATION_DEG

# The limits below cover Mitsuba's noise and the speckle that the realtime renderer's rays miss. Each comment gives the
# largest measured value; docs/crosscheck.md has all of them. Larger limits would miss smaller errors.

# Largest accepted mean of the colour difference ΔE (CIEDE2000); an eye just notices 1. The largest measured is 1.4.
DELTA_E_MEAN_LIMIT = 2.5
# Largest accepted 99th percentile of ΔE. The largest measured is 7.
DELTA_E_P99_LIMIT = 15.0
# Largest accepted mean of FLIP, a perceived difference of pixels in [0, 1]. The largest measured is 0.03.
FLIP_LIMIT = 0.05

# Samples per pixel of the negative controls, as a fraction of the comparison's. Fewer samples are faster, and the
# controls' errors are far above the noise.
CONTROL_SPP_FRACTION = 0.25


def check(case: Case, files: SnakeFiles, light: Light, view: View, spp: int, folder: Path) -> dict:
    """Differences of the realtime picture from Mitsuba's, as from `realtime.compare`, and whether they keep the limits.

    Entry "controls" has the differences of the negative controls: a relief rotated by CONTROL_ROTATION_DEG ("rotated"),
    and one mirrored ("sign of u"). `spp` is the number of Mitsuba's samples per pixel. Writes the pictures into
    `folder`.
    """
    gpu_exr = folder / f"picture-{case.name}-flss.exr"
    # Both renderers use the model of the realtime method FLSS.
    skin = {**case.skin, **SAME_MODEL}
    report = realtime.render(gpu_exr, "flss", files.mesh, skin, light, view, case.supersample)
    # Wavelengths and colour weights of the realtime picture, with which Mitsuba's spectra become a colour, too.
    quadrature = Quadrature.of_report(report)

    def compared(bsdf: mi.BSDF, name: str, spp_fraction: float = 1.0) -> dict:
        """Renders `bsdf` in Mitsuba and compares the picture with the realtime renderer's."""
        start = time.perf_counter()
        pixels = spectral.picture(bsdf, files, light, view, quadrature, round(spp_fraction * spp))
        seconds = time.perf_counter() - start
        exr = folder / f"picture-{case.name}-{name}.exr"
        mi.Bitmap(pixels.astype(np.float32)).write(str(exr))
        # Raises for values that are not finite and for a black picture.
        picture.check(pixels, exr.name)
        found = realtime.compare(exr, gpu_exr, png=exr.with_suffix(".png"))
        return {**found, "holds": holds(found), "seconds": seconds}

    bsdf = plugin(case, **SAME_MODEL)
    found = compared(bsdf, "mitsuba")
    with turned(bsdf, CONTROL_ROTATION_DEG):
        rotated = compared(bsdf, "rotated", CONTROL_SPP_FRACTION)
    flipped = compared(plugin(mirrored(case, folder), **SAME_MODEL), "mirrored", CONTROL_SPP_FRACTION)
    return {
        "light": vars(light),
        "supersample": case.supersample,
        "spp": spp,
        "realtime_seconds": report["seconds"],
        **found,
        "controls": {"rotated": rotated, "sign of u": flipped},
    }


def holds(found: dict) -> bool:
    """Whether a report of `realtime.compare` keeps all limits."""
    delta_e = found["delta_e_2000"]
    return (
        delta_e["mean"] < DELTA_E_MEAN_LIMIT
        and delta_e["p99"] < DELTA_E_P99_LIMIT
        and found["flip"]["mean"] < FLIP_LIMIT
    )


def text(found: dict) -> str:
    """A report of `realtime.compare` as one line of text."""
    delta_e = found["delta_e_2000"]
    return f"ΔE mean {delta_e['mean']:.2f}, 99 % below {delta_e['p99']:.1f}, FLIP {found['flip']['mean']:.3f}"


def lines(found: dict) -> list[str]:
    """The result of `check` as lines of text: the comparison, then its negative controls."""
    controls = [f"  {name}: {text(control)}" for name, control in found["controls"].items()]
    return [f"  {text(found)}", *controls]


def failures(name: str, found: dict) -> list[str]:
    """Messages about failures in the result of `check` for the surface `name`.

    Pictures must not differ, and the error of a negative control must be noticed.
    """
    wrong = [] if found["holds"] else [f"{name}: the pictures differ, {text(found)}"]
    return wrong + [
        f"{name}: the control “{control_name}” was not noticed in the picture, {text(control)}"
        for control_name, control in found["controls"].items()
        if control["holds"]
    ]
