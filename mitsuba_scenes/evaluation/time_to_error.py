"""How long a picture takes to come down to an error, and what it costs beside Mitsuba's own material.

A cell is a scene in a variant. Its pictures are rendered in turn, one of each material a round, until the cell's time
is spent; ratios are of times in the same round, so that whatever else the machine does falls on both.
"""

from __future__ import annotations

import gc
import math
import time

import mitsuba as mi
import numpy as np

from ..environment import use_variant
from .benchmark_scenes import REFERENCE, BenchmarkScene
from .cost import ratios

VARIANTS = ("llvm_ad_rgb", "llvm_ad_spectral", "scalar_rgb", "scalar_spectral")
# The error to which times are given.
ERROR = 0.05
# Share of the mean below which a pixel is no longer judged relative to itself.
FLOOR = 0.1
# Sizes that each material of a cell chooses from: the largest of which it can render enough. A fast one takes a larger
# picture, so that the fixed cost of a render, some hundredths of a second with Dr.Jit, is small beside the rest of it.
# Times are given for a picture of NOMINAL_PIXELS.
SIZES = ((12, 8), (24, 16), (48, 32), (96, 64), (192, 128))
NOMINAL_PIXELS = 256 * 256
# Rounds of a cell. The least number has a median and some idea of the noise; a cell that has fewer says so by `rounds`.
ROUNDS_MIN, ROUNDS_MAX = 3, 25
# Rounds that the size is chosen for.
ROUNDS_AIM = 6
# Seconds a cell may take when nobody says, without making tables and compiling.
BUDGET_S = 8.0


def relative_error(image: np.ndarray, truth: np.ndarray, judged: np.ndarray) -> float:
    """Root of the mean over judged pixels and channels of the squared deviation over the truth's square, or that of a
    tenth of its mean where it is darker."""
    floor = FLOOR * truth[judged].mean()
    deviation = (image - truth)[judged] / np.maximum(np.abs(truth[judged]), floor)
    return float(np.sqrt(np.mean(deviation**2)))


def noise(images: np.ndarray) -> dict:
    """Relative error of one of so many independent pictures (n, rows, columns, 3) of the same thing, n > 1.

    The converged picture is the mean of all. It has 1/n of a picture's variance, and each picture is in it, so that
    deviations from it are too small by √(1 − 1/n), which is put right. `error_std` is the standard error of the result.
    """
    n = len(images)
    truth = images.mean(axis=0)
    judged = truth.sum(axis=2) > 0
    squares = np.array([relative_error(image, truth, judged) ** 2 for image in images]) * n / (n - 1)
    error = float(np.sqrt(squares.mean()))
    spread = float(np.std(squares, ddof=1) / math.sqrt(n) / (2 * error)) if error > 0 else 0.0
    return {"error": error, "error_std": spread}


def seconds_to_error(seconds: float, error: float, aim: float = ERROR) -> float:
    """When a picture is down to the error `aim` that has `error` after `seconds`: as the root of the time."""
    return seconds * (error / aim) ** 2


def fitting_size(seconds_at_smallest: float, budget_s: float, sizes: tuple = SIZES) -> tuple[int, int]:
    """The largest size of which ROUNDS_AIM rounds fit into the budget; the smallest where none do."""
    smallest = pixels(sizes[0])
    fitting = [size for size in sizes if ROUNDS_AIM * seconds_at_smallest * pixels(size) / smallest <= budget_s]
    return max(fitting, key=pixels, default=sizes[0])


def pixels(size: tuple[int, int]) -> int:
    return size[0] * size[1]


def render(scene: mi.Scene, seed: int) -> tuple[np.ndarray, float]:
    """Linear sRGB, and seconds."""
    start = time.perf_counter()
    image = np.array(mi.render(scene, seed=seed), dtype=np.float64)[:, :, :3]
    return image, time.perf_counter() - start


def warm_up(scenes: dict[str, mi.Scene], compiled: bool) -> None:
    """Compiles the kernels, where the variant has any: once, and once more when the seed first changes."""
    for seed in (0, 1) if compiled else ():
        for scene in scenes.values():
            render(scene, seed)


def measure(scene: BenchmarkScene, variant: str, budget_s: float = BUDGET_S) -> dict:
    """Times, errors and ratios of a cell."""
    use_variant(variant, fall_back=False)
    compiled = not variant.startswith("scalar")
    bsdfs = {name: mi.load_dict(bsdf) for name, bsdf in scene.bsdfs().items()}
    scenes = {name: scene.load(bsdf, SIZES[0]) for name, bsdf in bsdfs.items()}
    warm_up(scenes, compiled)
    pilots = {name: render(each, seed=2)[1] for name, each in scenes.items()}
    sizes = {name: fitting_size(pilot, budget_s / len(pilots)) for name, pilot in pilots.items()}
    grown = {name: scene.load(bsdfs[name], size) for name, size in sizes.items() if size != SIZES[0]}
    warm_up(grown, compiled)
    scenes |= grown
    runs: dict[str, list] = {name: [] for name in scenes}
    start = time.perf_counter()
    while (rounds := len(runs[REFERENCE])) < ROUNDS_MAX and (
        rounds < ROUNDS_MIN or (time.perf_counter() - start) * (rounds + 1) / rounds < budget_s
    ):
        for name, each in scenes.items():
            runs[name].append(render(each, seed=3 + rounds))
    # What is not collected is still listed in the kernels of the next cell.
    del scenes, grown, bsdfs
    gc.collect()
    return {
        "scene": scene.name,
        "title": scene.title,
        "variant": variant,
        "spp": scene.spp,
        "rounds": len(runs[REFERENCE]),
        "ways": ways(runs),
    }


def ways(runs: dict[str, list[tuple[np.ndarray, float]]]) -> list[dict]:
    """The figures of each material out of its pictures and their seconds, held against REFERENCE.

    All times are those of a picture of NOMINAL_PIXELS, in proportion to the pixels. `time_ratio` is at equal samples a
    pixel, and of the same round. `error_time_ratio` is of the times to equal relative error, each against its own
    converged picture.
    """
    times, found = {}, []
    for name, made in runs.items():
        height, width = made[0][0].shape[:2]
        scale = NOMINAL_PIXELS / (width * height)
        times[name] = {"renders_s": [seconds * scale for _, seconds in made]}
        seconds = float(np.median(times[name]["renders_s"]))
        judged = noise(np.array([image for image, _ in made]))
        found.append(
            {
                "name": name,
                "size": [width, height],
                "rendered_s": seconds / scale,
                "seconds": seconds,
                **judged,
                "mean": float(np.mean([image.mean() for image, _ in made])),
                "seconds_to_error": seconds_to_error(seconds, judged["error"]),
            }
        )
    against = ratios(times, REFERENCE)
    base = next(way for way in found if way["name"] == REFERENCE)
    for way in found:
        way["time_ratio"] = against[way["name"]]
        way["error_time_ratio"] = way["seconds_to_error"] / base["seconds_to_error"]
    return found
