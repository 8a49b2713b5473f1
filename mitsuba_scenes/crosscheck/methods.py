"""Check (c) of the cross-check: time of each realtime method and its difference from path tracing, for one view.

The methods are different models of the same skin, so no limit applies: the check reports differences. Two models of
coherence (docs/model.md#coherence) are compared: `patch` is a single coherence window at a fixed position, `ensemble`
the mean over all positions. The reference is the path-traced ensemble with many samples a pixel.

A renderer with few rays a pixel misses some of a skin's glints. Each method is therefore also compared with the
plugin's ensemble evaluated along the realtime renderer's own rays: the remaining difference is that of the models.
"""

from __future__ import annotations

import time
from collections.abc import Callable
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

# Realtime methods (docs/realtime.md). The first three are those of Dhillon et al. 2014: FLSS (full lambda spectral
# sampling) sums at equal steps of the wavelength, NMM only at the wavelengths of which a diffraction order leaves
# towards the camera, and PQ over P × Q repeats of the tile, the rectangle of relief. Then follow Stam's shader
# ("stam") and the project's own colour table ("table").
METHODS = ("flss", "nmm", "pq", "stam", "table")
# Rays along each side of a pixel. With fewer, the patch model's speckle, random bright and dark dots, would hide the
# methods' differences. More take longer.
SUPERSAMPLE = 4
# Name of the plugin's ensemble along the rays of the realtime renderer, without energy conservation.
SAME_RAYS = "ensemble, same rays"
# Name of the plugin's ensemble along the same rays, with energy conservation (docs/model.md#energy), its default.
ENERGY_KEPT = "ensemble, energy kept"
# Name of the realtime renderer's colour table with energy conservation.
TABLE_KEPT = "table, energy kept"
# Width in pixels of each of the three pictures (reference, method, difference) in a row of the contact sheet.
PANEL = 288
# Parameters of the reference skin. The published methods have no energy conservation, so the reference has none;
# ENERGY_KEPT and TABLE_KEPT show its effect.
REFERENCE = {"model": "ensemble", "obliquity": "stam", "conserve_energy": False, "eta": KERATIN}


def check(case: Case, files: SnakeFiles, light: Light, view: View, spp: int, folder: Path) -> dict:
    """Differences and times of each method, and differences of the ensemble along the same rays.

    `spp` is the number of the path tracer's samples per pixel. Writes the pictures and a contact sheet into `folder`.

    The report's entry "against_the_reference" has an entry for each picture: METHODS, SAME_RAYS, ENERGY_KEPT and
    TABLE_KEPT. The entry of a picture is the report of `realtime.compare` against the reference, with further keys:

    - SAME_RAYS: the report against the ensemble along the same rays;
    - ENERGY_KEPT, for "table" and TABLE_KEPT: the report against that ensemble with energy conservation;
    - `gpu_ms` and `build_s`, for realtime pictures: milliseconds on the GPU, and seconds to build the tables.
    """

    def exr(name: str) -> Path:
        """File of the picture `name` in the folder."""
        return folder / f"methods-{case.name}-{name.replace(', ', '-').replace(' ', '-')}.exr"

    reports = {}
    for name in (*METHODS, TABLE_KEPT):
        method = "table" if name == TABLE_KEPT else name
        skin = {**case.skin, **_realtime_parameters(name)}
        reports[name] = realtime.render(exr(name), method, files.mesh, skin, light, view, SUPERSAMPLE)
    # The path tracer sums over the same wavelengths with the same weights as FLSS.
    quadrature = Quadrature.of_report(reports["flss"])

    same_rays = plugin(case, **REFERENCE)
    # A view whose pixel centres are on the realtime renderer's rays. The rays are traced one by one, so the scene's
    # number of samples does not matter.
    ray_view = replace(view, width=SUPERSAMPLE * view.width, height=SUPERSAMPLE * view.height)
    rays = points.trace_points(mi.load_dict(bare_scene(same_rays, files, light, view, spp=1)), light, ray_view)
    start = time.perf_counter()
    pictures = {"reference": spectral.picture(same_rays, files, light, view, quadrature, spp)}
    reference_seconds = time.perf_counter() - start
    # Created after the timed rendering, whose kernel contains every existing BSDF and would be larger.
    energy_kept = plugin(case, **{**REFERENCE, "conserve_energy": True})
    # The mean over the rays of each pixel.
    for name, bsdf in ((SAME_RAYS, same_rays), (ENERGY_KEPT, energy_kept)):
        pictures[name] = _by_pixel(points.radiance(bsdf, rays, quadrature)).mean(axis=(1, 3))
    for name, pixels in pictures.items():
        picture.check(pixels, exr(name).name)
        mi.Bitmap(pixels.astype(np.float32)).write(str(exr(name)))
    # Only pixels whose rays all hit the skin are compared.
    mask = exr("mask").with_suffix(".png")
    is_skin = _by_pixel(rays.seen).all(axis=(1, 3))
    mi.Bitmap(np.where(is_skin, 255, 0).astype(np.uint8)).write(str(mask))

    compared = {name: _compared(name, exr, mask, reports) for name in (*METHODS, SAME_RAYS, ENERGY_KEPT, TABLE_KEPT)}
    rows = [[(exr(name).with_suffix(".png"), caption(name, figures))] for name, figures in compared.items()]
    contact_sheet(rows, folder / f"methods-{case.name}.png", 3 * PANEL)
    return {
        "light": vars(light),
        "view": vars(view),
        "supersample": SUPERSAMPLE,
        "spp": spp,
        "adapter": reports["flss"]["adapter"],
        "reference_seconds": reference_seconds,
        "against_the_reference": compared,
    }


def _realtime_parameters(name: str) -> dict:
    """Parameters of the skin for the realtime picture `name`, one of METHODS or TABLE_KEPT."""
    # The published methods have the patch model only.
    model = "ensemble" if name in ("table", TABLE_KEPT) else "patch"
    return {**REFERENCE, "model": model, "conserve_energy": name == TABLE_KEPT}


def _compared(name: str, exr: Callable[[str], Path], mask: Path, reports: dict) -> dict:
    """The entry of the picture `name` in the report of `check`; writes a PNG of reference, picture and difference.

    `exr` gives the file of each picture, and `reports` has the reports of the realtime pictures.
    """
    png = exr(name).with_suffix(".png")
    figures = realtime.compare(exr("reference"), exr(name), mask=mask, png=png)
    figures[SAME_RAYS] = realtime.compare(exr(SAME_RAYS), exr(name), mask=mask)
    if name in ("table", TABLE_KEPT):
        figures[ENERGY_KEPT] = realtime.compare(exr(ENERGY_KEPT), exr(name), mask=mask)
    if name in reports:
        figures["gpu_ms"] = reports[name]["gpu_ms"]
        figures["build_s"] = reports[name]["build_seconds"]
    return figures


def _by_pixel(rays: np.ndarray) -> np.ndarray:
    """Reshapes values of rays, (rows, columns, …), to (pixel rows, SUPERSAMPLE, pixel columns, SUPERSAMPLE, …)."""
    height, width, *rest = rays.shape
    return rays.reshape(height // SUPERSAMPLE, SUPERSAMPLE, width // SUPERSAMPLE, SUPERSAMPLE, *rest)


def caption(name: str, figures: dict) -> str:
    """The caption of one method's row on the contact sheet."""
    text = f"reference | {name} | FLIP {figures['flip']['mean']:.3f}, CIEDE2000 {figures['delta_e_2000']['mean']:.2f}"
    return text + (f", {figures['gpu_ms']:.0f} ms on the GPU" if "gpu_ms" in figures else "")


def lines(found: dict) -> list[str]:
    """The result of `check` as lines of a table with a row per method.

    ΔE is the colour difference CIEDE2000 (mean and 99th percentile), FLIP the mean of NVIDIA's perceptual difference,
    relMSE the relative mean squared error. The last two columns compare with the ensemble along the same rays, the
    others with the reference.
    """
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
        figures = found["against_the_reference"][name][ENERGY_KEPT]
        delta_e, flip = figures["delta_e_2000"]["mean"], figures["flip"]["mean"]
        table.append(f"  {name}, against {ENERGY_KEPT}: ΔE mean {delta_e:.2f}, FLIP {flip:.3f}")
    return table
