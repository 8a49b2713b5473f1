"""Times of the first picture in a fresh process, with tables from the plugin's cache and without compiled kernels.

`python -m docs.figures.first_render VARIANT MATERIAL` is such a process; it prints its times as JSON. A *table* holds
precomputed values of a material's diffraction, which the plugin caches on disk. A *kernel* is the machine code that
Dr.Jit compiles for a picture and also caches on disk.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import mitsuba as mi

from mitsuba_scenes.environment import REPOSITORY, SetupError, use_variant

from .benchmark_scenes import REFERENCE, BenchmarkScene, scenes
from .time_to_error import render

# Measured variants of Mitsuba.
VARIANTS = ("llvm_ad_rgb", "llvm_ad_spectral")
# Width and height of the picture in pixels. It is small, so that compilation outweighs the rendering itself.
SIZE = (24, 16)
# Argument of a process that only puts the tables into the cache.
ONLY_TABLES = "--only-tables"


def sphere() -> BenchmarkScene:
    """The benchmark scene with a sphere (benchmark_scenes.py), whose materials are measured."""
    return next(scene for scene in scenes() if scene.name == "sphere")


def figures(variants: tuple = VARIANTS) -> list[dict]:
    """A row for each variant and material: `variant`, `name` of the material, and the times of `in_fresh_process`.

    Materials are the plugin's, named by the reliefs of the sphere, and REFERENCE, Mitsuba's own.
    """
    names = [*sphere().surfaces, REFERENCE]
    return [
        {"variant": variant, "name": name, **in_fresh_process(variant, name)} for variant in variants for name in names
    ]


def in_fresh_process(variant: str, name: str) -> dict:
    """Seconds to create the material, `load_s`, of the first render, `render_s`, and of the whole process, `process_s`.

    `render_s` includes the compilation of kernels. `process_s` also includes the start of Python and its imports.
    """
    with TemporaryDirectory() as folder:
        # An earlier process puts the tables into the plugin's cache. Its kernels go to another folder, so the measured
        # process has to compile.
        child(variant, name, Path(folder) / "before", ONLY_TABLES)
        start = time.perf_counter()
        printed = child(variant, name, Path(folder) / "kernels")
        return {**json.loads(printed), "process_s": time.perf_counter() - start}


def child(variant: str, name: str, kernels: Path, *options: str) -> str:
    """Runs `main` with these arguments in a process with its kernel cache in the new folder `kernels`.

    `kernels` must not exist. Returns the last line that the process printed, empty if there is none. Raises SetupError
    if the process fails.
    """
    kernels.mkdir()
    done = subprocess.run(
        [sys.executable, "-m", __name__, variant, name, *options],
        env={**os.environ, "DRJIT_CACHE_DIR": str(kernels)},
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        raise SetupError(f"the first render of {name} in {variant} failed: {done.stderr.strip() or done.returncode}")
    return done.stdout.splitlines()[-1] if done.stdout else ""


def main(variant: str, name: str, *options: str) -> None:
    """The measured process: creates the material `name`, renders once, and prints seconds as JSON.

    With the option ONLY_TABLES it creates the material and prints nothing.
    """
    use_variant(variant, fall_back=False)
    scene = sphere()
    start = time.perf_counter()
    bsdf = mi.load_dict(scene.bsdfs()[name])
    load_s = time.perf_counter() - start
    if ONLY_TABLES in options:
        return
    rendered = render(scene.load(bsdf, SIZE), seed=0)
    print(json.dumps({"load_s": load_s, "render_s": rendered.seconds}))


if __name__ == "__main__":
    main(*sys.argv[1:])
