"""Rendering times until a picture has a given error, and their ratios to those with Mitsuba's material REFERENCE.

A *cell* is a scene in a variant of Mitsuba, in which materials are compared. Its pictures are rendered in *rounds*, one
picture of each material per round, until the cell's time is over. Ratios compare times of the same round, so that other
programs on the machine affect both alike. A *kernel* is the machine code that Dr.Jit compiles for a scene and a picture
size. Pictures are linear sRGB, (rows, columns, 3).
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

# Variants of Mitsuba that are measured. Those with "llvm" compile kernels by Dr.Jit, those with "scalar" do not.
VARIANTS = ("llvm_ad_rgb", "llvm_ad_spectral", "scalar_rgb", "scalar_spectral")
# Relative rms error at which times are stated.
ERROR = 0.05
# Fraction of the mean brightness to which errors of darker pixels are relative. Smaller values let dark pixels dominate
# the error.
FLOOR = 0.1
# Picture sizes (width, height). A material gets the largest size at which ROUNDS_AIM rounds fit into the cell's time.
# The fixed cost of a render, some hundredths of a second with Dr.Jit, is then relatively small. Errors of all materials
# are measured at the smallest size: the noise of a pixel depends on the size, so errors at different sizes do not
# compare.
SIZES = ((24, 16), (48, 32), (96, 64), (192, 128))
# Number of pixels to which times are scaled, so that times of pictures of different sizes compare.
NOMINAL_PIXELS = 256 * 256
# Smallest number of rounds of a cell; the median of three ignores an outlier.
ROUNDS_MIN = 3
# Largest number of rounds of a cell.
ROUNDS_MAX = 25
# Number of rounds that should fit into a cell's time, by which picture sizes are chosen. Larger values give smaller
# pictures.
ROUNDS_AIM = 4
# Number of pictures of the smallest size for a material's error, if its rounds have another size. More make the error
# more certain.
NOISE_PICTURES = 8
# Default seconds of a cell, without building tables and compiling.
BUDGET_S = 6.0


def relative_deviation(image: np.ndarray, truth: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Relative deviations of `image` from `truth` at the pixels of a mask, (pixels in the mask, channels).

    Values below FLOOR of the mean are relative to that fraction of the mean.
    """
    floor = FLOOR * truth[mask].mean()
    return (image - truth)[mask] / np.maximum(np.abs(truth[mask]), floor)


def relative_error(image: np.ndarray, truth: np.ndarray, mask: np.ndarray) -> float:
    """Rms relative deviation over the pixels of a mask and the channels."""
    return float(np.sqrt(np.mean(relative_deviation(image, truth, mask) ** 2)))


def noise(images: np.ndarray) -> dict:
    """Relative rms error of one of n > 1 independent pictures of a scene, (n, rows, columns, 3).

    The reference is the mean of all pictures, at the pixels that are not black. The mean contains each picture, so
    deviations from it are too small by √(1 − 1/n), which is corrected. `error_std` is the standard error of `error`;
    `channel_errors` are the errors of red, green and blue.
    """
    n = len(images)
    truth = images.mean(axis=0)
    mask = truth.sum(axis=2) > 0
    # Mean squares over pixels, (n, channels), with the correction.
    channel_squares = [np.mean(relative_deviation(image, truth, mask) ** 2, axis=0) for image in images]
    channel_squares = np.array(channel_squares) * n / (n - 1)
    # Mean squares over pixels and channels, (n,).
    picture_squares = channel_squares.mean(axis=1)
    error = float(np.sqrt(picture_squares.mean()))
    # The standard error of a root √q is that of q over twice the root, since d√q = dq/(2√q).
    error_std = float(np.std(picture_squares, ddof=1) / math.sqrt(n) / (2 * error)) if error > 0 else 0.0
    channel_errors = np.sqrt(channel_squares.mean(axis=0)).tolist()
    return {"error": error, "error_std": error_std, "channel_errors": channel_errors}


def seconds_to_error(seconds: float, error: float, aim: float = ERROR) -> float:
    """Seconds to the error `aim` for a picture with `error` after `seconds`; the error falls as 1/√time."""
    return seconds * (error / aim) ** 2


def fitting_size(seconds_of: Callable[[tuple], float], limit_s: float, sizes: tuple = SIZES) -> tuple[int, int]:
    """The largest of the ascending `sizes` whose render takes at most `limit_s`; the smallest if none does.

    `seconds_of` renders a size and returns its time; the last size that it renders is the result. The search goes up
    from the smallest size. It predicts times of larger sizes as proportional to pixels. A fixed cost makes the
    prediction too large, which leads to more steps but never to too large a picture.
    """
    index = 0
    while True:
        seconds_per_pixel = seconds_of(sizes[index]) / pixel_count(sizes[index])
        fitting = [
            larger
            for larger in range(index + 1, len(sizes))
            if seconds_per_pixel * pixel_count(sizes[larger]) <= limit_s
        ]
        if not fitting:
            return sizes[index]
        index = max(fitting)


def pixel_count(size: tuple[int, int]) -> int:
    """Number of pixels of a picture of this width and height."""
    return size[0] * size[1]


@dataclass(frozen=True)
class Render:
    """A picture, with wall-clock seconds and CPU seconds of all threads."""

    image: np.ndarray
    seconds: float
    cpu_s: float


def render(scene: mi.Scene, seed: int) -> Render:
    """Renders one picture at the scene's own size and samples per pixel; the first render compiles the kernel."""
    start, cpu = time.perf_counter(), time.process_time()
    image = np.array(mi.render(scene, seed=seed), dtype=np.float64)[:, :, :3]
    return Render(image, time.perf_counter() - start, time.process_time() - cpu)


def resize(scene: mi.Scene, size: tuple[int, int]) -> None:
    """Sets another picture size (width, height) of a loaded scene; loading it again would compile all kernels again."""
    parameters = mi.traverse(scene)
    parameters["sensor.film.size"] = list(size)
    parameters["sensor.film.crop_size"] = list(size)
    parameters.update()


def measure(scene: BenchmarkScene, variant: str, budget_s: float = BUDGET_S) -> dict:
    """Measures a cell in about `budget_s` seconds; `ways` has the rows of its materials (`material_rows`).

    The order of the steps: BSDFs and scenes of all materials are loaded, the size of each material's pictures is
    chosen, rounds are timed, and materials with larger pictures are rendered at the smallest size for their errors.
    """
    use_variant(variant, fall_back=False)
    bsdfs = {name: mi.load_dict(bsdf) for name, bsdf in scene.bsdfs().items()}
    scenes = {name: scene.load(bsdf, SIZES[0]) for name, bsdf in bsdfs.items()}
    compiled = not variant.startswith("scalar")
    # Longest time of one picture at which ROUNDS_AIM rounds, each a picture per material, fit into the budget.
    limit_s = budget_s / len(scenes) / ROUNDS_AIM
    sizes = {
        name: fitting_size(lambda size, name=name: seconds_at(scenes[name], size, compiled), limit_s) for name in scenes
    }
    # Each scene keeps the size that was tried last, which is the chosen one.
    runs = timed_rounds(scenes, budget_s)
    pictures = {name: [run.image for run in renders] for name, renders in runs.items()}
    # Materials with larger pictures are rendered again at the smallest size, for their errors.
    for name, size in sizes.items():
        if size != SIZES[0]:
            resize(scenes[name], SIZES[0])
            pictures[name] = [render(scenes[name], seed=3 + i).image for i in range(NOISE_PICTURES)]
    # Kernels of Dr.Jit include every living BSDF of the variant, so those of this cell are freed before the next.
    scenes.clear()
    bsdfs.clear()
    gc.collect()
    return {
        "scene": scene.name,
        "title": scene.title,
        "variant": variant,
        "spp": scene.spp,
        "rounds": len(runs[REFERENCE]),
        "ways": material_rows(runs, pictures),
    }


def seconds_at(scene: mi.Scene, size: tuple[int, int], compiled: bool) -> float:
    """Seconds of a render of this size (width, height), which the scene keeps.

    `compiled` is whether the variant compiles kernels, as those of Dr.Jit do.
    """
    resize(scene, size)
    if compiled:
        # The first render compiles the kernel of this size.
        render(scene, seed=1)
    rendered = render(scene, seed=2)
    # On a busy machine short renders mostly wait, so the smaller of both times counts.
    return min(rendered.seconds, rendered.cpu_s)


def timed_rounds(scenes: dict[str, mi.Scene], budget_s: float) -> dict[str, list[Render]]:
    """Renders of each material's scene, one per round, for about `budget_s` seconds."""
    runs: dict[str, list[Render]] = {name: [] for name in scenes}
    start = time.perf_counter()
    for rounds in range(ROUNDS_MAX):
        # Time at the end of this round, from the mean time of the `rounds` so far. `max` avoids a division by 0 before
        # the first round.
        expected_s = (time.perf_counter() - start) * (rounds + 1) / max(rounds, 1)
        if rounds >= ROUNDS_MIN and expected_s >= budget_s:
            break
        for name, scene in scenes.items():
            # Seeds 1 and 2 are those of `seconds_at`.
            runs[name].append(render(scene, seed=3 + rounds))
    return runs


def material_rows(runs: dict[str, list[Render]], pictures: dict[str, list[np.ndarray]]) -> list[dict]:
    """A row for each material from its timed renders and its pictures of the smallest size, relative to REFERENCE.

    - `size`, `mean`: the size of the timed pictures, and the mean value of the pictures of the smallest size.
    - `error`, `error_std`, `channel_errors`: the results of `noise`, against the mean of the material's own pictures.
    - `rendered_s`: the median time of a render. `seconds` is that time scaled to NOMINAL_PIXELS.
    - `seconds_to_error`: the scaled time until the error is ERROR, and `error_time_ratio` its ratio to REFERENCE's.
    - `time_ratio`: median, minimum and maximum of the ratios of times within a round, at equal samples per pixel.
      `cpu_ratio` has those of CPU seconds, which other programs hardly affect.
    """
    # Times of each material's renders under the key that `ratios` reads.
    wall, cpu, found = {}, {}, []
    for name, renders in runs.items():
        height, width = renders[0].image.shape[:2]
        scale = NOMINAL_PIXELS / (width * height)
        wall[name] = {"renders_s": [run.seconds * scale for run in renders]}
        cpu[name] = {"renders_s": [run.cpu_s * scale for run in renders]}
        seconds = float(np.median(wall[name]["renders_s"]))
        errors = noise(np.array(pictures[name]))
        found.append(
            {
                "name": name,
                "size": [width, height],
                "rendered_s": seconds / scale,
                "seconds": seconds,
                **errors,
                "mean": float(np.mean(pictures[name])),
                "seconds_to_error": seconds_to_error(seconds, errors["error"]),
            }
        )
    wall_ratios, cpu_ratios = ratios(wall, REFERENCE), ratios(cpu, REFERENCE)
    base = next(row for row in found if row["name"] == REFERENCE)
    for row in found:
        row["time_ratio"], row["cpu_ratio"] = wall_ratios[row["name"]], cpu_ratios[row["name"]]
        row["error_time_ratio"] = row["seconds_to_error"] / base["seconds_to_error"]
    return found
