"""Render times of the snake with the plugin's BSDF `diffraction` and with Mitsuba's own, at equal samples per pixel."""

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

# Measured variants of Mitsuba.
VARIANTS = ("llvm_ad_spectral", "scalar_spectral")
# Names of the BSDFs of `bsdfs` that are Mitsuba's own, to which ratios refer.
REFERENCES = ("roughconductor", "principled")


def bsdfs(pigment: Path) -> dict:
    """Dictionaries of the BSDFs by name; `pigment` is the picture of the diffuse reflectance."""
    texture = pigment_texture(pigment)
    return {
        **{f"diffraction {name}": skin_bsdf(preset_skin(name), pigment) for name in ("blazed", "xenopeltis")},
        "roughconductor": {"type": "roughconductor", "material": "Al", "alpha": 0.2},
        "principled": {"type": "principled", "base_color": texture, "roughness": 0.3, "specular": 0.5},
    }


def measure(repetitions: int, view: View, spp: int, max_depth: int) -> dict:
    """Seconds of each BSDF: creation, first render, and `repetitions` later renders in turn with the other BSDFs.

    The caller has selected a variant of VARIANTS. Returns {name: {tables_s, first_render_s, renders_s}}; `renders_s` is
    a list. `tables_s` is the time of creation, which builds all tables, since the cache is off. Only `first_render_s`
    includes the compilation of kernels, Dr.Jit's machine code.
    """
    files = snake_files()
    scenes, result = {}, {}
    for name, bsdf in bsdfs(files.pigment).items():
        start = time.perf_counter()
        with cache_off():
            loaded = mi.load_dict(bsdf)
        tables_s = time.perf_counter() - start
        scenes[name] = mi.load_dict(snake_scene(loaded, files, Light(), view, spp, max_depth))
        start = time.perf_counter()
        # The conversion to an array waits for the end of the render.
        np.array(mi.render(scenes[name], seed=0))
        result[name] = {"tables_s": tables_s, "first_render_s": time.perf_counter() - start, "renders_s": []}
    # Untimed renders. Kernels contain all BSDFs that exist, so Dr.Jit compiles them again after BSDFs are created. It
    # also does so when the seed first changes.
    for scene in scenes.values():
        np.array(mi.render(scene, seed=1))
    for repetition in range(repetitions):
        for name, scene in scenes.items():
            start = time.perf_counter()
            np.array(mi.render(scene, seed=repetition + 2))
            result[name]["renders_s"].append(time.perf_counter() - start)
    return result


def ratios(result: dict, reference: str) -> dict:
    """Ratios of each BSDF's render time to the reference's in the same repetition: {name: {median, min, max}}.

    `result` is that of `measure`; `reference` is a name in it.
    """
    base_s = np.array(result[reference]["renders_s"])
    found = {}
    for name, times in result.items():
        ratio = np.array(times["renders_s"]) / base_s
        found[name] = {"median": float(np.median(ratio)), "min": float(ratio.min()), "max": float(ratio.max())}
    return found
