"""The first picture in a fresh process, with tables from the cache and without compiled kernels.

`python -m docs.figures.first_render VARIANT SURFACE` is that process and prints its times as JSON.
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

from .benchmark_scenes import REFERENCE, scenes
from .time_to_error import render

VARIANTS = ("llvm_ad_rgb", "llvm_ad_spectral")
SIZE = (24, 16)
ONLY_TABLES = "--only-tables"


def figures(variants: tuple = VARIANTS) -> list[dict]:
    """Rows of {variant, name, load_s, render_s, process_s} for the sphere's materials."""
    names = [*scenes()[0].surfaces, REFERENCE]
    return [
        {"variant": variant, "name": name, **in_fresh_process(variant, name)} for variant in variants for name in names
    ]


def in_fresh_process(variant: str, name: str) -> dict:
    """Seconds of creating the material, of the first render, and of the process including imports."""
    with TemporaryDirectory() as folder:
        # A first process puts the tables into the cache; its kernels go to another folder.
        child(variant, name, Path(folder) / "before", ONLY_TABLES)
        start = time.perf_counter()
        printed = child(variant, name, Path(folder) / "kernels")
        return {**json.loads(printed), "process_s": time.perf_counter() - start}


def child(variant: str, name: str, kernels: Path, *words: str) -> str:
    """The output of a process with its kernel cache in the folder `kernels`."""
    kernels.mkdir()
    done = subprocess.run(
        [sys.executable, "-m", __spec__.name if __name__ == "__main__" else __name__, variant, name, *words],
        env={**os.environ, "DRJIT_CACHE_DIR": str(kernels)},
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        raise SetupError(f"the first render of {name} in {variant} failed: {done.stderr.strip() or done.returncode}")
    return done.stdout.splitlines()[-1] if done.stdout else ""


def main(variant: str, name: str, *words: str) -> None:
    """The measured process: builds the tables of a material and renders once; prints seconds as JSON."""
    use_variant(variant, fall_back=False)
    sphere = scenes()[0]
    start = time.perf_counter()
    bsdf = mi.load_dict(sphere.bsdfs()[name])
    load_s = time.perf_counter() - start
    if ONLY_TABLES in words:
        return
    rendered = render(sphere.load(bsdf, SIZE), seed=0)
    print(json.dumps({"load_s": load_s, "render_s": rendered.seconds}))


if __name__ == "__main__":
    main(*sys.argv[1:])
