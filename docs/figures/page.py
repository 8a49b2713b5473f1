"""Generated text of the documentation: templates, their data, and the regions of pages that they fill.

A *part* is a template `templates/NAME.md.j2`, its numbers `data/NAME.json`, and a region between
`<!-- NAME: … -->` and `<!-- /NAME -->` on one of the pages `docs/*.md`. A page may hold several parts, and text
written by hand around them.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from mitsuba_scenes.environment import REPOSITORY, SetupError

from . import card
from .wrap import wrapped

# Folder of the documentation.
DOCS = REPOSITORY / "docs"
# Presets that imitate measured skins. Pages mark them as procedural, so that nobody takes them for measurements.
PROCEDURAL = ("elaphe", "xenopeltis")


def images(name: str, docs: Path = DOCS) -> Path:
    """The folder of a part's pictures, `docs/images/NAME`, created if it is missing."""
    folder = docs / "images" / name
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def write_part(name: str, figures: dict, docs: Path = DOCS) -> Path:
    """Fills the region of a part from its template, and saves its numbers as `data/NAME.json`; returns the page.

    Template and page are read from the repository's documentation; page and data are written to the folder `docs`.
    Raises ValueError for numbers that JSON lacks (NaN and infinity), and SetupError if no page has a region for the
    part. Both errors leave the files as they were.
    """
    page, text, region = find_region(name)
    data, written = docs / "data" / f"{name}.json", docs / page.name
    data.parent.mkdir(parents=True, exist_ok=True)
    # The data are saved first, so that a fault of the template loses no measurement: after its correction
    # `--from-data` fills the region.
    data.write_text(json.dumps(figures, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    filled = f"{text[: region.start(1)]}{render(name, figures)}{text[region.end(1) :]}"
    written.write_text(filled, encoding="utf-8")
    return written


def render(name: str, figures: dict) -> str:
    """The part's Markdown with filled paragraphs, no blank lines at its ends and one line break after it.

    Templates see the keys of `figures` as variables, and `card`, the measurements on a graphics card, which come from
    another file (card.py). A variable that is missing raises jinja2's UndefinedError.
    """
    environment = Environment(
        loader=FileSystemLoader(DOCS / "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=False,
    )
    environment.filters.update(named=named, scans_first=scans_first, measured=card.measured)
    environment.globals["card"] = card.read()
    text = environment.get_template(f"{name}.md.j2").render(figures).strip()
    # Statements of the template may leave several blank lines in turn.
    return wrapped(re.sub(r"\n{3,}", "\n\n", text)) + "\n"


def find_region(name: str) -> tuple[Path, str, re.Match]:
    """The page with the part's region, the page's text, and the match whose group 1 is the region's contents.

    Raises SetupError without such a page.
    """
    marks = re.compile(rf"<!-- {name}: [^\n]* -->\n(.*?)<!-- /{name} -->\n", re.S)
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        if region := marks.search(text):
            return page, text, region
    raise SetupError(f"no page of docs/ has a region <!-- {name}: … --> to <!-- /{name} -->")


def named(surface: str) -> str:
    """The name of a surface on pages, with "(procedural)" after each of PROCEDURAL; names of scans are unchanged."""
    if "scan" in surface:
        return surface
    return re.sub(rf"\b({'|'.join(PROCEDURAL)})\b", r"\1 (procedural)", surface)


def scans_first(rows: Iterable, key: str | None = None) -> list:
    """The rows with those of scans first, otherwise in the given order; a scan has "scan" in its name.

    A row's name is its value under `key`. Without `key` it is the row itself if that is a string, else its first item.
    """

    def name(row) -> str:
        if key is not None:
            return row[key]
        return row if isinstance(row, str) else row[0]

    return sorted(rows, key=lambda row: "scan" not in name(row))


def insist(part: str, holds: bool, statement: str) -> None:
    """Raises SetupError unless `statement`, which the part's template makes, `holds` for the measured numbers."""
    if not holds:
        raise SetupError(f"the numbers contradict that {statement}; change docs/templates/{part}.md.j2")
