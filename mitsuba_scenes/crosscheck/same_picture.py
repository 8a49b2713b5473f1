"""Check (b): a picture by Mitsuba against the supersampled picture of the realtime renderer, by visible difference."""

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

# Largest accepted differences; an eye just notices a ΔE of 1. They cover Mitsuba's noise, and the speckle that the
# realtime renderer's rays miss. Measured are 1.4, 7 and 0.03 at most (docs/crosscheck.md).
DELTA_E_MEAN_LIMIT = 2.5
DELTA_E_P99_LIMIT = 15.0
FLIP_LIMIT = 0.05

# Fraction of the samples for negative controls, whose errors are far above the noise.
CONTROL_SHARE = 0.25


def check(case: Case, files: SnakeFiles, light: Light, view: View, spp: int, folder: Path) -> dict:
    """Differences of the pictures and of the negative controls."""
    ours = folder / f"picture-{case.name}-flss.exr"
    skin = {**case.skin, **SAME_MODEL}
    report = realtime.render(ours, "flss", files.mesh, skin, light, view, case.supersample)
    quadrature = Quadrature.of_report(report)

    def compared(bsdf: mi.BSDF, name: str, share: float = 1.0) -> dict:
        start = time.perf_counter()
        pixels = spectral.picture(bsdf, files, light, view, quadrature, round(share * spp))
        seconds = time.perf_counter() - start
        exr = folder / f"picture-{case.name}-{name}.exr"
        mi.Bitmap(pixels.astype(np.float32)).write(str(exr))
        picture.check(pixels, exr.name)
        found = realtime.compare(exr, ours, png=exr.with_suffix(".png"))
        return {**found, "holds": holds(found), "seconds": seconds}

    bsdf = plugin(case, **SAME_MODEL)
    found = compared(bsdf, "mitsuba")
    with turned(bsdf, CONTROL_ROTATION_DEG):
        rotated = compared(bsdf, "rotated", CONTROL_SHARE)
    flipped = compared(plugin(mirrored(case, folder), **SAME_MODEL), "mirrored", CONTROL_SHARE)
    return {
        "light": vars(light),
        "supersample": case.supersample,
        "spp": spp,
        "realtime_seconds": report["seconds"],
        **found,
        "controls": {"rotated": rotated, "sign of u": flipped},
    }


def holds(found: dict) -> bool:
    """Whether a comparison keeps all limits."""
    delta_e = found["delta_e_2000"]
    return (
        delta_e["mean"] < DELTA_E_MEAN_LIMIT
        and delta_e["p99"] < DELTA_E_P99_LIMIT
        and found["flip"]["mean"] < FLIP_LIMIT
    )


def text(found: dict) -> str:
    """A comparison as one line."""
    delta_e = found["delta_e_2000"]
    return f"ΔE mean {delta_e['mean']:.2f}, 99 % below {delta_e['p99']:.1f}, FLIP {found['flip']['mean']:.3f}"


def lines(found: dict) -> list[str]:
    """The result as lines of text."""
    controls = [f"  {name}: {text(of_control)}" for name, of_control in found["controls"].items()]
    return [f"  {text(found)}", *controls]


def failures(name: str, found: dict) -> list[str]:
    """Failures: pictures that differ, and controls that pass."""
    wrong = [] if found["holds"] else [f"{name}: the pictures differ, {text(found)}"]
    return wrong + [
        f"{name}: the control “{control}” was not noticed in the picture, {text(of_control)}"
        for control, of_control in found["controls"].items()
        if of_control["holds"]
    ]
