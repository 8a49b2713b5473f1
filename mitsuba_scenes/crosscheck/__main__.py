"""Holds the path tracer and the realtime renderer against each other: pixel by pixel, to the eye, method by method."""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

from ..environment import DEFAULT_VARIANT, REPOSITORY, SetupError, use_variant
from ..scene import View
from ..snake import snake_files
from . import methods, same_picture, same_points
from .cases import SCAN, cases, sun

# A few scales of the back, so close that the speckle of the patch model is no smaller than a pixel.
CLOSE = View(96, 64, fov_deg=8.0)
# The middle of it, pixel for pixel: a picture takes hundreds of rays a pixel.
CLOSER = View(48, 32, fov_deg=4.0)
# The whole snake, as in the demonstration.
WHOLE = View(96, 64)
# Azimuth and elevation in degrees; each of them lights an order of the blazed grating in the close view.
LIGHTS = ((-180.0, 25.0), (-90.0, 40.0), (-30.0, 25.0))


class Disagreement(Exception):
    """The renderers do not agree, or the check would not have noticed; the message says where."""


def crosscheck(output: Path, scan: Path = SCAN) -> dict:
    """Runs the checks in the variant that is set, writes `crosscheck.json` and the pictures, and returns the figures.

    Raises Disagreement after everything is written.
    """
    output.mkdir(parents=True, exist_ok=True)
    start, files, wrong = time.perf_counter(), snake_files(), []
    lights = [sun(*angles) for angles in LIGHTS]
    report = {"view": vars(CLOSE), "points": {}, "pictures": {}, "methods": {}}
    for case in cases(scan):
        print(f"{case.name}: the same points ...", end=" ", flush=True)
        found = report["points"][case.name] = same_points.check(case, files, lights, CLOSE, output)
        wrong += same_points.failures(case.name, found)
        print("; ".join(figures["text"] for figures in found), flush=True)

        print(f"{case.name}: the same picture ...", end=" ", flush=True)
        seen = same_picture.check(case, files, lights[1], CLOSER, spp=2304, folder=output)
        report["pictures"][case.name] = seen
        wrong += same_picture.failures(case.name, seen)
        print(same_picture.text(seen), flush=True)
    for case in cases(scan)[:3]:
        print(f"{case.name}: every method against the path-traced ensemble ...", flush=True)
        found = methods.check(case, files, sun(-150, 40), WHOLE, supersample=2, spp=256, folder=output)
        report["methods"][case.name] = found
        print("\n".join(methods.table(found)), flush=True)
    report["failures"] = wrong
    report["seconds"] = time.perf_counter() - start
    (output / "crosscheck.json").write_text(json.dumps(report, indent=1, default=str) + "\n")
    print(f"crosscheck.json and pictures are in {output} ({report['seconds']:.0f} s)")
    if wrong:
        raise Disagreement("; ".join(wrong))
    return report


def main(words: list[str] | None = None) -> int:
    """The command line; 0, 1 where the renderers disagree, or 2 with one line that says what is wrong."""
    parser = argparse.ArgumentParser(prog="python -m mitsuba_scenes.crosscheck", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=REPOSITORY / "out" / "crosscheck")
    parser.add_argument("--variant", default=DEFAULT_VARIANT, help="variant of Mitsuba, a spectral one")
    parser.add_argument("--scan", type=Path, default=SCAN, help="a measured height field")
    options = parser.parse_args(words)
    try:
        use_variant(options.variant)
        crosscheck(options.output, options.scan)
    except Disagreement as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return 1
    except (SetupError, ValueError) as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
