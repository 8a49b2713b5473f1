"""Measures the numbers and pictures of the documentation and writes them into its pages.

`python -m docs.figures [PART ...]` runs all parts unless some are named; `make figures PAGES=…` calls it.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from importlib import import_module

from mitsuba_scenes.environment import SetupError
from mitsuba_scenes.picture import PictureError

from .page import DOCS, write_part

# Parts in the order of measurement. A part is a generated region of a page (page.py). The module of the same name, with
# underscores for hyphens, measures the numbers. Its function `figures() -> dict | None` returns them; None leaves the
# page unchanged. The parts up to "renderings-methods", and "validity", "bodies-validity" and "skins-validity", also
# measure times, so the machine should be idle while they run.
PARTS = (
    "speed-error",
    "realtime",
    "tables",
    "sampling",
    "sizes-and-covers",
    "batch",
    "sweeps-scale",
    "renderings",
    "renderings-methods",
    "brdf-maps",
    "slits",
    "periodicity",
    "lab",
    "crosscheck",
    "gratings",
    "polarisation",
    "films",
    "validity",
    "covers-validity",
    "bodies-validity",
    "skins-validity",
    "stability",
    "instruments",
    "tour-scan",
    # Last, since it reads the data of other parts. Parts named on the command line run in the order given.
    "published-figures",
)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command with these arguments, or by default with those of the process.

    Exit status: 0, or 2 after one line on stderr that names the error.
    """
    parser = argparse.ArgumentParser(prog="python -m docs.figures", description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"one of {', '.join(PARTS)}; all by default")
    parser.add_argument("--from-data", action="store_true", help="measure nothing; write the pages from docs/data")
    options = parser.parse_args(arguments)
    try:
        if unknown := [part for part in options.parts if part not in PARTS]:
            raise SetupError(f"unknown part {unknown[0]!r}; available: {', '.join(PARTS)}")
        for part in options.parts or PARTS:
            start = time.perf_counter()
            if options.from_data:
                data = DOCS / "data" / f"{part}.json"
                if not data.exists():
                    raise SetupError(f"{data} is missing; measure {part} without --from-data")
                figures = json.loads(data.read_text(encoding="utf-8"))
            else:
                figures = import_module(f".{part.replace('-', '_')}", __package__).figures()
            if figures is None:
                # A requirement is missing, and the module has printed which.
                continue
            page = write_part(part, figures)
            print(f"{page} ({time.perf_counter() - start:.0f} s)", flush=True)
    except (SetupError, PictureError) as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
