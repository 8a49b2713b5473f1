"""What the `diffraction` BSDF costs beside Mitsuba's own: the same scene and samples, interleaved repetitions.

`python benches/mitsuba_cost.py` prints a table and writes JSON. The first render of a BSDF, which compiles the kernels,
is left out of the ratios and reported by itself, together with making the BSDF's tables.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(REPOSITORY))

from mitsuba_scenes.environment import SetupError, use_variant  # noqa: E402 (the line above makes it importable)
from mitsuba_scenes.evaluation.cost import REFERENCES, VARIANTS, measure, ratios  # noqa: E402
from mitsuba_scenes.scene import View  # noqa: E402

# Making the tables and the first render together, in seconds.
FIRST_RENDER_LIMIT_S = 10.0


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
