"""Makes pages of figures: `python -m docs.figures [PAGE ...]`, all of them unless some are named."""

from __future__ import annotations

import argparse
import json
import sys
import time
from importlib import import_module

from mitsuba_scenes.environment import SetupError
from mitsuba_scenes.picture import PictureError

from .page import DOCS, write_page

# Each is a module of this package with a function `figures() -> dict`, and a template of the same name in
# docs/templates, with hyphens; where they are `None`, the page is left as it is. Those that measure times come first:
# the machine need be left alone for no longer.
PAGES = (
    "speed-error",
    "realtime",
    "tables",
    "sampling",
    "batch",
    "sweeps-scale",
    "renderings",
    "renderings-methods",
    "snake-mesh",
    "brdf-maps",
    "slits",
    "periodicity",
    "lab",
    "crosscheck",
    "gratings",
    "polarisation",
    "validity",
    "skins-validity",
    "stability",
    "peers",
    "formats",
    "tour-scan",
    # Gathers numbers of those before it.
    "published-figures",
)


def main(words: list[str] | None = None) -> int:
    """The command line; 0, or 2 with one line that says what is wrong."""
    parser = argparse.ArgumentParser(prog="python -m docs.figures", description=__doc__)
    parser.add_argument("pages", nargs="*", metavar="PAGE", help=f"one of {', '.join(PAGES)}")
    parser.add_argument("--from-data", action="store_true", help="measure nothing: write pages anew from docs/data")
    options = parser.parse_args(words)
    try:
        for page in options.pages or PAGES:
            if page not in PAGES:
                raise SetupError(f"unknown page {page!r}; there are {', '.join(PAGES)}")
            start = time.perf_counter()
            if options.from_data:
                made = json.loads((DOCS / "data" / f"{page}.json").read_text(encoding="utf-8"))
            else:
                made = import_module(f".{page.replace('-', '_')}", __package__).figures()
            if made is None:
                # What it needs is not here; it has said so.
                continue
            written = write_page(page, made)
            print(f"{written} ({time.perf_counter() - start:.0f} s)", flush=True)
    except (SetupError, PictureError) as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
