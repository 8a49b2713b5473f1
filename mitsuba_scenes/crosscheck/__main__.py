"""Compares the path tracer and the realtime renderer: values at points, pictures, and every realtime method."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..environment import DEFAULT_VARIANT, REPOSITORY, SetupError, use_variant
from ..outputs import output_folder
from ..picture import PictureError
from .cases import SCAN
from .run import Disagreement, crosscheck, insist


def main(words: list[str] | None = None) -> int:
    """Runs the command with the arguments `words`, by default those of the process.

    Returns the exit status: 0, 1 if the renderers disagree, or 2 after one line on stderr for another error. Wrong
    arguments end the process with status 2, by argparse, which also prints the usage.
    """
    parser = argparse.ArgumentParser(prog="python -m mitsuba_scenes.crosscheck", description=__doc__)
    # A string, since argparse applies `type` to no other defaults.
    folder = str(REPOSITORY / "out" / "crosscheck")
    parser.add_argument("-o", "--output", type=output_folder, default=folder, help="folder of the report and pictures")
    parser.add_argument("--variant", default=DEFAULT_VARIANT, help="variant of Mitsuba, a spectral one")
    parser.add_argument("--scan", type=Path, default=SCAN, help="a measured height field, skipped if it is missing")
    parser.add_argument("--short", action="store_true", help="two surfaces in one light, as in `make demo`")
    options = parser.parse_args(words)
    try:
        use_variant(options.variant)
        insist(crosscheck(options.output, options.scan, options.short))
    except Disagreement as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return 1
    # RuntimeError is Mitsuba's.
    except (SetupError, PictureError, ValueError, OSError, RuntimeError) as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
