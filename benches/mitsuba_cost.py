"""What the `diffraction` BSDF costs in Mitsuba: time to an error beside `roughconductor`, calls, the first picture, and
how far RGB is from spectral. `python benches/mitsuba_cost.py` prints tables and writes JSON. With `--plugin` it
measures the time to an error of another build, such as an earlier version's."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(REPOSITORY))

from docs.figures import headline, rgb_against_spectral, time_to_error  # noqa: E402
from mitsuba_scenes import environment  # noqa: E402 (the line above makes it importable)
from mitsuba_scenes.environment import SetupError  # noqa: E402
from mitsuba_scenes.outputs import output_file  # noqa: E402


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cell-s", type=float, default=time_to_error.BUDGET_S, help="seconds a scene in a variant")
    parser.add_argument("--picture-s", type=float, default=rgb_against_spectral.BUDGET_S, help="a converged picture")
    default = str(REPOSITORY / "out" / "bench" / "mitsuba.json")
    parser.add_argument("--json", type=output_file(".json"), default=default)
    parser.add_argument(
        "--plugin", type=Path, help="another build's plugins/diffraction.so: its time to an error alone"
    )
    parser.add_argument("--scenes", nargs="+", help="of these scenes alone; with --plugin")
    options = parser.parse_args()
    if options.scenes and not options.plugin:
        parser.error("--scenes goes with --plugin")
    try:
        if options.plugin:
            environment.use_plugin(options.plugin)
            made = headline.of_cells(options.cell_s, options.scenes)
            lines = headline.lines_of_cells(made)
        else:
            made = headline.figures(options.cell_s, options.picture_s)
            lines = headline.lines(made)
    except SetupError as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return 2
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(made, indent=1, allow_nan=False) + "\n")
    print("\n".join(lines))
    print(f"\nwrote {options.json}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
