"""What the `diffraction` BSDF costs beside Mitsuba's own: the same scene and samples, interleaved repetitions.

`python benches/mitsuba_cost.py` prints a table and writes JSON. The first render of a BSDF, which compiles the kernels,
is left out of the ratios and reported by itself, together with making the BSDF's tables.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import mitsuba as mi
import numpy as np

REPOSITORY = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(REPOSITORY))

from mitsuba_scenes.environment import SetupError, use_variant  # noqa: E402 (the line above makes it importable)
from mitsuba_scenes.light import Light  # noqa: E402
from mitsuba_scenes.scene import View, snake_scene  # noqa: E402
from mitsuba_scenes.skin import pigment_texture, preset_skin, skin_bsdf  # noqa: E402
from mitsuba_scenes.snake import snake_files  # noqa: E402

VARIANTS = ("llvm_ad_spectral", "scalar_spectral")
# The two that the diffraction is held against.
REFERENCES = ("roughconductor", "principled")
# Making the tables and the first render together, in seconds.
FIRST_RENDER_LIMIT_S = 10.0


def bsdfs(pigment: Path) -> dict:
    texture = pigment_texture(pigment)
    return {
        **{f"diffraction {name}": skin_bsdf(preset_skin(name), pigment) for name in ("blazed", "xenopeltis")},
        "roughconductor": {"type": "roughconductor", "material": "Al", "alpha": 0.2},
        "principled": {"type": "principled", "base_color": texture, "roughness": 0.3, "specular": 0.5},
    }


def measure(repetitions: int, view: View, spp: int, max_depth: int) -> dict:
    """Seconds per BSDF: of making it, of the first render, and of each later one, in turn with the others."""
    files = snake_files()
    scenes, result = {}, {}
    for name, bsdf in bsdfs(files.pigment).items():
        start = time.perf_counter()
        made = mi.load_dict(bsdf)
        tables = time.perf_counter() - start
        scenes[name] = mi.load_dict(snake_scene(made, files, Light(), view, spp, max_depth))
        start = time.perf_counter()
        np.array(mi.render(scenes[name], seed=0))
        result[name] = {"tables_s": tables, "first_render_s": time.perf_counter() - start, "renders_s": []}
    for repetition in range(repetitions):
        for name, scene in scenes.items():
            start = time.perf_counter()
            np.array(mi.render(scene, seed=repetition + 1))
            result[name]["renders_s"].append(time.perf_counter() - start)
    return result


def ratios(result: dict, reference: str) -> dict:
    """Median, least and greatest ratio of each BSDF's time to the reference's in the same repetition."""
    base = np.array(result[reference]["renders_s"])
    found = {}
    for name, times in result.items():
        ratio = np.array(times["renders_s"]) / base
        found[name] = {"median": float(np.median(ratio)), "min": float(ratio.min()), "max": float(ratio.max())}
    return found


def print_table(variant: str, result: dict) -> None:
    against = {reference: ratios(result, reference) for reference in REFERENCES}
    print(f"\n{variant}")
    heads = [f"{'/ ' + reference + ' (min-max)':>28}" for reference in REFERENCES]
    print(f"{'BSDF':24}{'tables s':>9}{'first s':>9}{'median s':>10}" + "".join(heads))
    for name, times in result.items():
        columns = ""
        for reference in REFERENCES:
            ratio = against[reference][name]
            columns += f"{ratio['median']:14.2f} ({ratio['min']:.2f}-{ratio['max']:.2f})".rjust(28)
        median = np.median(times["renders_s"])
        print(f"{name:24}{times['tables_s']:9.2f}{times['first_render_s']:9.2f}{median:10.3f}{columns}")
        if times["tables_s"] + times["first_render_s"] > FIRST_RENDER_LIMIT_S:
            print(f"{'':24}warning: more than {FIRST_RENDER_LIMIT_S:g} s until the first picture")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=7)
    parser.add_argument("--resolution", type=int, nargs=2, metavar=("W", "H"), default=(256, 256))
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--max-depth", type=int, default=6)
    parser.add_argument("--json", type=Path, default=REPOSITORY / "out" / "mitsuba-cost.json")
    options = parser.parse_args()
    view = View(*options.resolution)
    report = {"resolution": options.resolution, "spp": options.spp, "max_depth": options.max_depth, "variants": {}}
    for wanted in VARIANTS:
        try:
            use_variant(wanted, fall_back=False)
        except SetupError as error:
            print(f"skipping {wanted}: {error}", file=sys.stderr)
            continue
        print(f"{wanted}: {options.repetitions} repetitions ...", flush=True)
        result = measure(options.repetitions, view, options.spp, options.max_depth)
        print_table(wanted, result)
        report["variants"][wanted] = {
            "seconds": result,
            "ratios": {reference: ratios(result, reference) for reference in REFERENCES},
        }
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(report, indent=1) + "\n")
    print(f"\nwrote {options.json}")
    return 0 if report["variants"] else 2


if __name__ == "__main__":
    sys.exit(main())
