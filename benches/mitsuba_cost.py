"""What the `diffraction` BSDF costs in Mitsuba: time to an error beside `roughconductor`, calls, the first picture, and
how far RGB is from spectral. `python benches/mitsuba_cost.py` prints tables and writes JSON."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(REPOSITORY))

from mitsuba_scenes.environment import SetupError  # noqa: E402 (the line above makes it importable)
from mitsuba_scenes.evaluation import headline, rgb_against_spectral, time_to_error  # noqa: E402


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cell-s", type=float, default=time_to_error.BUDGET_S, help="seconds a scene in a variant")
    parser.add_argument("--picture-s", type=float, default=rgb_against_spectral.BUDGET_S, help="a converged picture")
    parser.add_argument("--json", type=Path, default=REPOSITORY / "out" / "bench" / "mitsuba.json")
    options = parser.parse_args()
    try:
        made = headline.figures(options.cell_s, options.picture_s)
    except SetupError as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return 2
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(made, indent=1, allow_nan=False) + "\n")
    print("\n".join(headline.lines(made)))
    print(f"\nwrote {options.json}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
