"""Render times of `diffraction` and of Mitsuba's BSDFs in one scene with equal samples, in turn."""

from __future__ import annotations

import time
from pathlib import Path

import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import cache_off
from mitsuba_scenes.light import Light
from mitsuba_scenes.scene import View, snake_scene
from mitsuba_scenes.skin import pigment_texture, preset_skin, skin_bsdf
from mitsuba_scenes.snake import snake_files

VARIANTS = ("llvm_ad_spectral", "scalar_spectral")
# BSDFs of Mitsuba for comparison.
REFERENCES = ("roughconductor", "principled")


def bsdfs(pigment: Path) -> dict:
    texture = pigment_texture(pigment)
    return {
        **{f"diffraction {name}": skin_bsdf(preset_skin(name), pigment) for name in ("blazed", "xenopeltis")},
        "roughconductor": {"type": "roughconductor", "material": "Al", "alpha": 0.2},
        "principled": {"type": "principled", "base_color": texture, "roughness": 0.3, "specular": 0.5},
    }


def measure(repetitions: int, view: View, spp: int, max_depth: int) -> dict:
    """Seconds of each BSDF: creation, first render, and later renders in turn with the other BSDFs."""
    files = snake_files()
    scenes, result = {}, {}
    for name, bsdf in bsdfs(files.pigment).items():
        start = time.perf_counter()
        with cache_off():
            made = mi.load_dict(bsdf)
        tables = time.perf_counter() - start
        scenes[name] = mi.load_dict(snake_scene(made, files, Light(), view, spp, max_depth))
        start = time.perf_counter()
        np.array(mi.render(scenes[name], seed=0))
        result[name] = {"tables_s": tables, "first_render_s": time.perf_counter() - start, "renders_s": []}
    # Kernels list all BSDFs, so they are compiled again after others were created, and when the seed first changes.
    for scene in scenes.values():
        np.array(mi.render(scene, seed=1))
    for repetition in range(repetitions):
        for name, scene in scenes.items():
            start = time.perf_counter()
            np.array(mi.render(scene, seed=repetition + 2))
            result[name]["renders_s"].append(time.perf_counter() - start)
    return result


def ratios(result: dict, reference: str) -> dict:
    """Median, smallest and largest ratio of each BSDF's time to the reference's in the same repetition."""
    base = np.array(result[reference]["renders_s"])
    found = {}
    for name, times in result.items():
        ratio = np.array(times["renders_s"]) / base
        found[name] = {"median": float(np.median(ratio)), "min": float(ratio.min()), "max": float(ratio.max())}
    return found
