"""Times of the benchmark scenes compared with `roughconductor`: the first render with compilation, and later ones."""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

from docs.figures.benchmark_scenes import REFERENCE, BenchmarkScene, scenes

from .parts import Check
from .plan import Plan
from .variants import use

# Target ratio of a render's time to that of `roughconductor` in the same scene, by kind of variant. Chosen; a larger
# ratio does not fail.
AIM = {"rgb": 2.0, "spectral": 3.0}


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """One timing per kind of variant, such as `rgb`, and scene."""
    for kind in plan.kinds:
        for name in plan.scenes:
            yield f"{plan.variant(kind)}, {name}", partial(timed, plan, kind, name)


def timed(plan: Plan, kind: str, name: str) -> dict:
    """Results of `material_times` by material, and their ratios to those of REFERENCE, `roughconductor`.

    `ratio` has the ratio of `later_s` as `wall` and that of `kernels_s` as `kernels`. `reached` tells whether all
    ratios of wall-clock times meet AIM. The check passes if the pictures are finite and not black.
    """
    use(plan.variant(kind))
    scene = next(scene for scene in scenes() if scene.name == name)
    # The start of the backend is in `load_s` or `first_s` of the first material, which the ratios leave out.
    seconds = {material: material_times(plan, scene, bsdf) for material, bsdf in scene.bsdfs().items()}
    base = seconds[REFERENCE]
    ratios = {
        material: {"wall": each["later_s"] / base["later_s"], "kernels": each["kernels_s"] / base["kernels_s"]}
        for material, each in seconds.items()
        if material != REFERENCE
    }
    return {
        "kind": kind,
        "scene": name,
        "size": list(plan.render_size),
        "spp": plan.render_spp,
        "materials": seconds,
        "ratio": ratios,
        "aim": AIM[kind],
        "reached": max(each["wall"] for each in ratios.values()) <= AIM[kind],
        "passed": all(np.isfinite(each["mean"]) and each["mean"] > 0 for each in seconds.values()),
    }


def material_times(plan: Plan, scene: BenchmarkScene, bsdf: dict) -> dict:
    """Seconds `load_s` to load material and scene, `first_s` of the first render, and medians of the later ones.

    The first render includes the compilation. `later_s` is wall-clock time; `kernels_s` is the time in kernels by
    Dr.Jit's clock, without tracing. `mean` is the mean of the last picture. The BSDF is freed at the end, because
    kernels include every BSDF that is alive.
    """
    start = time.perf_counter()
    material = mi.load_dict(bsdf)
    loaded = scene.load(material, plan.render_size, plan.render_spp)
    load_s = time.perf_counter() - start
    wall_s, kernels_s, means = zip(*[rendered(loaded, seed) for seed in range(plan.renders + 1)])
    del loaded, material
    gc.collect()
    return {
        "load_s": load_s,
        "first_s": wall_s[0],
        "later_s": float(np.median(wall_s[1:])),
        "kernels_s": float(np.median(kernels_s[1:])),
        "mean": means[-1],
    }


def rendered(scene: mi.Scene, seed: int) -> tuple[float, float, float]:
    """Renders a picture. Returns wall-clock seconds, seconds in kernels, and the picture's mean."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        start = time.perf_counter()
        image = mi.render(scene, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        wall_s = time.perf_counter() - start
        # Dr.Jit's times are in ms.
        kernels_s = sum(kernel["execution_time"] for kernel in dr.kernel_history()) / 1e3
    return wall_s, kernels_s, float(np.mean(np.array(image)))
