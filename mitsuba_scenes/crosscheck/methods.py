"""Check (c): what each realtime method costs and how far it is from the path-traced ensemble, for one view.

Nothing has to hold here: the methods are different models of the same skin, and the table says how different.
"""

from __future__ import annotations

import time
from pathlib import Path

import mitsuba as mi
import numpy as np

from .. import picture
from ..contact_sheet import contact_sheet
from ..light import Light
from ..scene import View
from ..skin import KERATIN
from ..snake import SnakeFiles
from . import points, realtime, spectral
from .cases import Case, bare_scene, plugin
from .quadrature import Quadrature

METHODS = ("flss", "nmm", "pq", "stam", "table")
# Rays along each side of a pixel: with fewer, the speckle of the patch model hides what the methods differ by.
SUPERSAMPLE = 4
# The path tracer's default.
ENERGY_KEPT = "ensemble, energy kept"
# Pixels across each of the three pictures on the sheet.
PANEL = 288
# The realtime methods have no energy scaling, so the reference has none either; what it changes is told beside them.
REFERENCE = {"model": "ensemble", "obliquity": "stam", "conserve_energy": False, "eta": KERATIN}


def check(case: Case, files: SnakeFiles, light: Light, view: View, spp: int, folder: Path) -> dict:
    """Errors and times of each method, and of the reference with its energy kept."""
    pictures, reports = {}, {}
    for method in METHODS:
        pictures[method] = folder / f"methods-{case.name}-{method}.exr"
        # The sources' methods know no ensemble.
        skin = {**case.skin, **REFERENCE, "model": "ensemble" if method == "table" else "patch"}
        reports[method] = realtime.render(pictures[method], method, files.mesh, skin, light, view, SUPERSAMPLE)
    # The sum over wavelengths is that of the full-spectrum method.
    quadrature = Quadrature.of_report(reports["flss"])

    seconds = {}
    for name, conserve_energy in (("reference", False), (ENERGY_KEPT, True)):
        start = time.perf_counter()
        bsdf = plugin(case, **{**REFERENCE, "conserve_energy": conserve_energy})
        built = time.perf_counter()
        pixels = spectral.picture(bsdf, files, light, view, quadrature, spp)
        seconds[name] = {"build": built - start, "render": time.perf_counter() - built}
        pictures[name] = folder / f"methods-{case.name}-{name.replace(', ', '-').replace(' ', '-')}.exr"
        mi.Bitmap(pixels.astype(np.float32)).write(str(pictures[name]))
        picture.check(pixels, pictures[name].name)
    seen = points.points(mi.load_dict(bare_scene(bsdf, files, light, view, 1)), light, view).seen
    mask = folder / f"methods-{case.name}-mask.png"
    mi.Bitmap(np.where(seen, 255, 0).astype(np.uint8)).write(str(mask))

    reference = pictures.pop("reference")
    found = {
        name: realtime.compare(reference, path, mask=mask, png=path.with_suffix(".png"))
        for name, path in pictures.items()
    }
    for method, report in reports.items():
        found[method]["gpu_ms"] = report["gpu_ms"]
        found[method]["build_s"] = report["build_seconds"]
    rows = [[(pictures[name].with_suffix(".png"), caption(name, found[name]))] for name in pictures]
    contact_sheet(rows, folder / f"methods-{case.name}.png", 3 * PANEL)
    return {
        "light": vars(light),
        "view": vars(view),
        "supersample": SUPERSAMPLE,
        "spp": spp,
        "adapter": reports["flss"]["adapter"],
        "mitsuba_seconds": seconds,
        "against_the_reference": found,
    }


def caption(name: str, figures: dict) -> str:
    text = f"reference | {name} | FLIP {figures['flip']['mean']:.3f}, CIEDE2000 {figures['delta_e_2000']['mean']:.2f}"
    return text + (f", {figures['gpu_ms']:.0f} ms on the GPU" if "gpu_ms" in figures else "")


def lines(found: dict) -> list[str]:
    """A table to print."""
    table = [
        f"  times are those of {found['adapter']}",
        f"{'':24}{'ΔE mean':>9}{'ΔE 99 %':>9}{'FLIP':>8}{'relMSE':>10}{'GPU ms':>9}{'build s':>9}",
    ]
    for name, figures in found["against_the_reference"].items():
        delta_e, relative = figures["delta_e_2000"], figures["relative_mse"]
        times = f"{figures['gpu_ms']:9.0f}{figures['build_s']:9.2f}" if "gpu_ms" in figures else f"{'–':>9}{'–':>9}"
        table.append(
            f"{name:24}{delta_e['mean']:9.2f}{delta_e['p99']:9.1f}{figures['flip']['mean']:8.3f}{relative:10.2g}{times}"
        )
    return table
