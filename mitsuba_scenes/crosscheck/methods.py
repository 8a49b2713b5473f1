"""Check (c) of the cross-check: time of each realtime method and its difference from path tracing, for one view.

The methods are different models of the same skin, so no limit applies: the check reports differences. Two models of
coherence (docs/model.md#coherence) are compared: `patch` is a single coherence window at a fixed position, `ensemble`
the mean over all positions. The reference is the path-traced ensemble with many samples a pixel.

A renderer with few rays a pixel misses some of a skin's glints. Each method is therefore also compared with the
ensemble evaluated along the renderer's own rays: the difference that remains is that of the models.
"""

from __future__ import annotations

import time
from dataclasses import replace
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

# Realtime methods (docs/realtime.md). Dhillon et al. 2014: FLSS sums uniform wavelengths, NMM the wavelengths of orders
# alone, PQ a tile that repeats P×Q times. The others are Stam's shader and the colour table.
METHODS = ("flss", "nmm", "pq", "stam", "table")
# Rays along each side of a pixel. Chosen: with fewer, the speckle of the patch model hides the methods' differences.
SUPERSAMPLE = 4
# The plugin's ensemble along the rays of the realtime renderer, without energy conservation.
SAME_RAYS = "ensemble, same rays"
# The plugin's ensemble along the same rays, with energy conservation (docs/model.md#energy), the plugin's default.
ENERGY_KEPT = "ensemble, energy kept"
# The realtime renderer's colour table with energy conservation.
TABLE_KEPT = "table, energy kept"
# Width in pixels of each of the three pictures (reference, method, difference) in a row of the contact sheet.
PANEL = 288
# Parameters of the reference skin. The published methods have no energy conservation, so the reference has none;
# ENERGY_KEPT and TABLE_KEPT show its effect.
REFERENCE = {"model": "ensemble", "obliquity": "stam", "conserve_energy": False, "eta": KERATIN}


def check(case: Case, files: SnakeFiles, light: Light, view: View, spp: int, folder: Path) -> dict:
    """Differences and times of each method, and differences of the ensemble along the same rays.

    Writes pictures into `folder`. `spp` is the number of the path tracer's samples per pixel.
    """

    def file(name: str) -> Path:
        return folder / f"methods-{case.name}-{name.replace(', ', '-').replace(' ', '-')}.exr"

    reports = {}
    for method in METHODS:
        # The published methods have the patch model only.
        skin = {**case.skin, **REFERENCE, "model": "ensemble" if method == "table" else "patch"}
        reports[method] = realtime.render(file(method), method, files.mesh, skin, light, view, SUPERSAMPLE)
    skin = {**case.skin, **REFERENCE, "conserve_energy": True}
    reports[TABLE_KEPT] = realtime.render(file(TABLE_KEPT), "table", files.mesh, skin, light, view, SUPERSAMPLE)
    # The path tracer sums over the same wavelengths, with the same weights, as the full-spectrum method.
    quadrature = Quadrature.of_report(reports["flss"])

    ensembles = {SAME_RAYS: plugin(case, **REFERENCE)}
    rays = points.points(
        mi.load_dict(bare_scene(ensembles[SAME_RAYS], files, light, view, 1)),
        light,
        replace(view, width=SUPERSAMPLE * view.width, height=SUPERSAMPLE * view.height),
    )
    start = time.perf_counter()
    pictures = {"reference": spectral.picture(ensembles[SAME_RAYS], files, light, view, quadrature, spp)}
    seconds = time.perf_counter() - start
    ensembles[ENERGY_KEPT] = plugin(case, **{**REFERENCE, "conserve_energy": True})
    for name, bsdf in ensembles.items():
        pictures[name] = _pixels(points.radiance(bsdf, rays, quadrature)).mean(axis=(1, 3))
    for name, pixels in pictures.items():
        picture.check(pixels, file(name).name)
        mi.Bitmap(pixels.astype(np.float32)).write(str(file(name)))
    # Pictures are compared at pixels whose rays all meet the skin.
    mask = file("mask").with_suffix(".png")
    seen = _pixels(rays.seen).all(axis=(1, 3))
    mi.Bitmap(np.where(seen, 255, 0).astype(np.uint8)).write(str(mask))

    found, rows = {}, []
    for name in (*METHODS, SAME_RAYS, ENERGY_KEPT, TABLE_KEPT):
        png = file(name).with_suffix(".png")
        found[name] = realtime.compare(file("reference"), file(name), mask=mask, png=png)
        found[name][SAME_RAYS] = realtime.compare(file(SAME_RAYS), file(name), mask=mask)
        if name in ("table", TABLE_KEPT):
            found[name][ENERGY_KEPT] = realtime.compare(file(ENERGY_KEPT), file(name), mask=mask)
        if name in reports:
            found[name]["gpu_ms"] = reports[name]["gpu_ms"]
            found[name]["build_s"] = reports[name]["build_seconds"]
        rows.append([(png, caption(name, found[name]))])
    contact_sheet(rows, folder / f"methods-{case.name}.png", 3 * PANEL)
    return {
        "light": vars(light),
        "view": vars(view),
        "supersample": SUPERSAMPLE,
        "spp": spp,
        "adapter": reports["flss"]["adapter"],
        "reference_seconds": seconds,
        "against_the_reference": found,
    }


def _pixels(rays: np.ndarray) -> np.ndarray:
    """Reshapes values of rays, (rows, columns, …), to (pixel rows, SUPERSAMPLE, pixel columns, SUPERSAMPLE, …)."""
    height, width, *rest = rays.shape
    return rays.reshape(height // SUPERSAMPLE, SUPERSAMPLE, width // SUPERSAMPLE, SUPERSAMPLE, *rest)


def caption(name: str, figures: dict) -> str:
    """The caption of one method's row on the contact sheet."""
    text = f"reference | {name} | FLIP {figures['flip']['mean']:.3f}, CIEDE2000 {figures['delta_e_2000']['mean']:.2f}"
    return text + (f", {figures['gpu_ms']:.0f} ms on the GPU" if "gpu_ms" in figures else "")


def lines(found: dict) -> list[str]:
    """The result of `check` as lines of a table: colour difference ΔE (CIEDE2000), FLIP and relative squared error."""
    table = [
        f"  times are those of {found['adapter']}; on the right against the ensemble along the same rays",
        f"{'':24}{'ΔE mean':>9}{'ΔE 99 %':>9}{'FLIP':>8}{'relMSE':>10}"
        f"{'GPU ms':>9}{'build s':>9}{'ΔE mean':>11}{'FLIP':>8}",
    ]
    for name, figures in found["against_the_reference"].items():
        delta_e, same = figures["delta_e_2000"], figures[SAME_RAYS]
        times = f"{figures['gpu_ms']:9.0f}{figures['build_s']:9.2f}" if "gpu_ms" in figures else f"{'–':>9}{'–':>9}"
        table.append(
            f"{name:24}{delta_e['mean']:9.2f}{delta_e['p99']:9.1f}{figures['flip']['mean']:8.3f}"
            f"{figures['relative_mse']:10.2g}{times}{same['delta_e_2000']['mean']:11.2f}{same['flip']['mean']:8.3f}"
        )
    for name in ("table", TABLE_KEPT):
        kept = found["against_the_reference"][name][ENERGY_KEPT]
        delta_e, flip = kept["delta_e_2000"]["mean"], kept["flip"]["mean"]
        table.append(f"  {name}, against {ENERGY_KEPT}: ΔE mean {delta_e:.2f}, FLIP {flip:.3f}")
    return table
