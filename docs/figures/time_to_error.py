"""How long a picture takes to come down to an error, and what it costs beside Mitsuba's own material.

A cell is a scene in a variant. Its pictures are rendered in turn, one of each material a round, until the cell's time
is spent; ratios are of times in the same round, so that whatever else the machine does falls on both.
"""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant

from .benchmark_scenes import REFERENCE, BenchmarkScene
from .cost import ratios

VARIANTS = ("llvm_ad_rgb", "llvm_ad_spectral", "scalar_rgb", "scalar_spectral")
# The error to which times are given.
ERROR = 0.05
# Share of the mean below which a pixel is no longer judged relative to itself.
FLOOR = 0.1
# Sizes that each material of a cell chooses from: the largest of which it can render enough. A fast one takes a larger
# picture, so that the fixed cost of a render, some hundredths of a second with Dr.Jit, is small beside the rest of it.
# Times are given for a picture of NOMINAL_PIXELS. Errors are all found at the smallest size: pixels that see more of
# the scene are noisier.
SIZES = ((24, 16), (48, 32), (96, 64), (192, 128))
NOMINAL_PIXELS = 256 * 256
# Rounds of a cell. The least number has a median and some idea of the noise; a cell that has fewer says so by `rounds`.
ROUNDS_MIN, ROUNDS_MAX = 3, 25
# Rounds that the size is chosen for.
ROUNDS_AIM = 4
# Pictures of the smallest size out of which a material's error is found whose rounds are of another.
NOISE_PICTURES = 8
# Seconds a cell may take when nobody says, without making tables and compiling.
BUDGET_S = 6.0


def relative_deviation(image: np.ndarray, truth: np.ndarray, judged: np.ndarray) -> np.ndarray:
    """Deviations (judged pixels, channels) over the truth, or over a tenth of its mean where it is darker."""
    floor = FLOOR * truth[judged].mean()
    return (image - truth)[judged] / np.maximum(np.abs(truth[judged]), floor)


def relative_error(image: np.ndarray, truth: np.ndarray, judged: np.ndarray) -> float:
    """Root of the mean over judged pixels and channels of the squared deviation."""
    return float(np.sqrt(np.mean(relative_deviation(image, truth, judged) ** 2)))


def noise(images: np.ndarray) -> dict:
    """Relative error of one of so many independent pictures (n, rows, columns, 3) of the same thing, n > 1.

    The converged picture is the mean of all. It has 1/n of a picture's variance, and each picture is in it, so that
    deviations from it are too small by √(1 − 1/n), which is put right. `error_std` is the standard error of the result,
    `channel_errors` are those of red, green and blue.
    """
    n = len(images)
    truth = images.mean(axis=0)
    judged = truth.sum(axis=2) > 0
    of_channels = [np.mean(relative_deviation(image, truth, judged) ** 2, axis=0) for image in images]
    of_channels = np.array(of_channels) * n / (n - 1)
    squares = of_channels.mean(axis=1)
    error = float(np.sqrt(squares.mean()))
    spread = float(np.std(squares, ddof=1) / math.sqrt(n) / (2 * error)) if error > 0 else 0.0
    channels = np.sqrt(of_channels.mean(axis=0)).tolist()
    return {"error": error, "error_std": spread, "channel_errors": channels}


def seconds_to_error(seconds: float, error: float, aim: float = ERROR) -> float:
    """When a picture is down to the error `aim` that has `error` after `seconds`: as the root of the time."""
    return seconds * (error / aim) ** 2


def settled(seconds_of: Callable[[tuple], float], limit_s: float, sizes: tuple = SIZES) -> tuple[int, int]:
    """A size that takes no longer than the limit, climbed to from the smallest in as long strides as it can.

    A step is only taken where it fits even if all of the time were in proportion to pixels, so that a fixed cost makes
    for more steps, and never for too large a picture.
    """
    place = 0
    while True:
        seconds = seconds_of(sizes[place])
        fitting = [
            further
            for further in range(place + 1, len(sizes))
            if seconds * pixels(sizes[further]) / pixels(sizes[place]) <= limit_s
        ]
        if not fitting:
            return sizes[place]
        place = max(fitting)


def pixels(size: tuple[int, int]) -> int:
    return size[0] * size[1]


@dataclass(frozen=True)
class Render:
    """Linear sRGB (rows, columns, 3), and what it took: by the clock, and of all threads' work."""

    image: np.ndarray
    seconds: float
    cpu_s: float


def render(scene: mi.Scene, seed: int) -> Render:
    """One picture; the first of a kernel compiles it."""
    start, cpu = time.perf_counter(), time.process_time()
    image = np.array(mi.render(scene, seed=seed), dtype=np.float64)[:, :, :3]
    return Render(image, time.perf_counter() - start, time.process_time() - cpu)


def resize(scene: mi.Scene, size: tuple[int, int]) -> None:
    """Another size of the picture. A scene that is loaded anew would have everybody's kernels compiled anew: they list
    whatever there is."""
    parameters = mi.traverse(scene)
    parameters["sensor.film.size"] = list(size)
    parameters["sensor.film.crop_size"] = list(size)
    parameters.update()


def measure(scene: BenchmarkScene, variant: str, budget_s: float = BUDGET_S) -> dict:
    """Times, errors and ratios of a cell."""
    use_variant(variant, fall_back=False)
    bsdfs = {name: mi.load_dict(bsdf) for name, bsdf in scene.bsdfs().items()}
    scenes = {name: scene.load(bsdf, SIZES[0]) for name, bsdf in bsdfs.items()}

    def seconds(name: str, size: tuple[int, int]) -> float:
        resize(scenes[name], size)
        if not variant.startswith("scalar"):
            # Compiles the kernel, which has the size in it.
            render(scenes[name], seed=1)
        rendered = render(scenes[name], seed=2)
        # On a busy machine a short render is mostly waiting, which says nothing of a longer one.
        return min(rendered.seconds, rendered.cpu_s)

    limit_s = budget_s / len(scenes) / ROUNDS_AIM
    sizes = {name: settled(lambda size, name=name: seconds(name, size), limit_s) for name in scenes}
    runs: dict[str, list[Render]] = {name: [] for name in scenes}
    start = time.perf_counter()
    while (rounds := len(runs[REFERENCE])) < ROUNDS_MAX and (
        rounds < ROUNDS_MIN or (time.perf_counter() - start) * (rounds + 1) / rounds < budget_s
    ):
        for name in scenes:
            runs[name].append(render(scenes[name], seed=3 + rounds))
    pictures = {name: [each.image for each in made] for name, made in runs.items()}
    for name, size in sizes.items():
        if size != SIZES[0]:
            resize(scenes[name], SIZES[0])
            pictures[name] = [render(scenes[name], seed=3 + i).image for i in range(NOISE_PICTURES)]
    # What is not collected is still listed in the kernels of the next cell.
    scenes.clear()
    bsdfs.clear()
    gc.collect()
    return {
        "scene": scene.name,
        "title": scene.title,
        "variant": variant,
        "spp": scene.spp,
        "rounds": len(runs[REFERENCE]),
        "ways": ways(runs, pictures),
    }


def ways(runs: dict[str, list[Render]], pictures: dict[str, list[np.ndarray]]) -> list[dict]:
    """The figures of each material out of its renders, held against REFERENCE; errors are those of its pictures, which
    have one size for all.

    All times are those of a picture of NOMINAL_PIXELS, in proportion to the pixels. `time_ratio` is at equal samples a
    pixel, and of the same round; `cpu_ratio` is the same of the work of all threads, which other programs on the
    machine hardly change. `error_time_ratio` is of the times to equal relative error, each against its own converged
    picture.
    """
    times, cpu, found = {}, {}, []
    for name, made in runs.items():
        height, width = made[0].image.shape[:2]
        scale = NOMINAL_PIXELS / (width * height)
        times[name] = {"renders_s": [each.seconds * scale for each in made]}
        cpu[name] = {"renders_s": [each.cpu_s * scale for each in made]}
        seconds = float(np.median(times[name]["renders_s"]))
        judged = noise(np.array(pictures[name]))
        found.append(
            {
                "name": name,
                "size": [width, height],
                "rendered_s": seconds / scale,
                "seconds": seconds,
                **judged,
                "mean": float(np.mean(pictures[name])),
                "seconds_to_error": seconds_to_error(seconds, judged["error"]),
            }
        )
    of_times, of_cpu = ratios(times, REFERENCE), ratios(cpu, REFERENCE)
    base = next(way for way in found if way["name"] == REFERENCE)
    for way in found:
        way["time_ratio"], way["cpu_ratio"] = of_times[way["name"]], of_cpu[way["name"]]
        way["error_time_ratio"] = way["seconds_to_error"] / base["seconds_to_error"]
    return found
