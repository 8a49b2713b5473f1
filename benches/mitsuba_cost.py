"""Cost of the `diffraction` BSDF in Mitsuba: `python benches/mitsuba_cost.py` prints tables and writes JSON.

It measures the time to a given error compared with `roughconductor`, the time of calls and of the first picture, and
the difference between RGB and spectral pictures. With `--plugin` it measures only the time to a given error, with
another build of the plugin.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(REPOSITORY))

from docs.figures import headline, rgb_against_spectral, time_to_error  # noqa: E402
from mitsuba_scenes import environment  # noqa: E402 (`sys.path` needs the repository first)
from mitsuba_scenes.environment import SetupError  # noqa: E402
from mitsuba_scenes.outputs import output_file  # noqa: E402


def main() -> int:
    """Runs the command; returns its exit status, 2 after one line on stderr for a missing requirement."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--cell-s",
        type=float,
        default=time_to_error.BUDGET_S,
        help="seconds for each cell, a scene in a variant of Mitsuba; more reduce noise (%(default)s)",
    )
    parser.add_argument(
        "--picture-s",
        type=float,
        default=rgb_against_spectral.BUDGET_S,
        help="seconds for each of two converged pictures, RGB and spectral; without --plugin (%(default)s)",
    )
    # argparse converts a default by `type` only if it is a string.
    default = str(REPOSITORY / "out" / "bench" / "mitsuba.json")
    parser.add_argument("--json", type=output_file(".json"), default=default, help="file for the figures (%(default)s)")
    parser.add_argument(
        "--plugin", type=Path, help="plugins/diffraction.so of another build, whose time to an error is measured"
    )
    parser.add_argument("--scenes", nargs="+", help="names of the scenes, all by default; with --plugin")
    options = parser.parse_args()
    if options.scenes and not options.plugin:
        parser.error("--scenes needs --plugin")
    if options.plugin and options.picture_s != rgb_against_spectral.BUDGET_S:
        parser.error("--picture-s has no effect with --plugin")
    try:
        if options.plugin:
            environment.use_plugin(options.plugin)
            measured = headline.cells_with_settings(options.cell_s, options.scenes)
            lines = headline.cell_lines(measured)
        else:
            measured = headline.figures(options.cell_s, options.picture_s)
            lines = headline.lines(measured)
    except SetupError as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return 2
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(measured, indent=1, allow_nan=False) + "\n")
    print("\n".join(lines))
    print(f"\nwrote {options.json}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
