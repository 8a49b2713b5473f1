"""Generated text of the documentation: a template, its data, and the marked region of a page that they fill.

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

DOCS = REPOSITORY / "docs"
# Presets that stand in for measured skins.
PROCEDURAL = ("elaphe", "xenopeltis")


def images(name: str, docs: Path = DOCS) -> Path:
    """The folder of a part's pictures, created where it is missing."""
    folder = docs / "images" / name
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def write_part(name: str, figures: dict, docs: Path = DOCS) -> Path:
    """Renders the part's template into its region and saves the figures as `data/NAME.json`; returns the page.

    The page is read from the documentation and written to `docs`. Templates also see `card`, the measurements on a
    graphics card. A variable that the figures lack is an error, as is a number that JSON does not know.
    """
    data = docs / "data" / f"{name}.json"
    data.parent.mkdir(parents=True, exist_ok=True)
    data.write_text(json.dumps(figures, indent=1, allow_nan=False) + "\n")
    page, text, region = find_region(name)
    written = docs / page.name
    written.write_text(f"{text[: region.start(1)]}{render(name, figures)}{text[region.end(1) :]}")
    return written


def render(name: str, figures: dict) -> str:
    """The part's Markdown with filled paragraphs, no blank lines at its ends and one line break after it."""
    templates = Environment(
        loader=FileSystemLoader(DOCS / "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=False,
    )
    templates.filters.update(named=named, scans_first=scans_first, measured=card.measured)
    templates.globals["card"] = card.read()
    text = templates.get_template(f"{name}.md.j2").render(figures).strip()
    return wrapped(re.sub(r"\n{3,}", "\n\n", text)) + "\n"


def find_region(name: str) -> tuple[Path, str, re.Match]:
    """The page that holds the part's region, its text, and the match whose group 1 is the region's contents."""
    marks = re.compile(rf"<!-- {name}: [^\n]* -->\n(.*?)<!-- /{name} -->\n", re.S)
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        if region := marks.search(text):
            return page, text, region
    raise SetupError(f"no page of docs/ has a region <!-- {name}: … --> to <!-- /{name} -->")


def named(surface: str) -> str:
    """The name of a surface on pages: skins that were not measured are marked as procedural."""
    if "scan" in surface:
        return surface
    return re.sub(rf"\b({'|'.join(PROCEDURAL)})\b", r"\1 (procedural)", surface)


def scans_first(rows: Iterable, key: str | None = None) -> list:
    """Rows with scans before all others, in stable order.

    A row's name is its value under `key`; without `key`, the row itself or its first item.
    """

    def name(row) -> str:
        if key is not None:
            return row[key]
        return row if isinstance(row, str) else row[0]

    return sorted(rows, key=lambda row: "scan" not in name(row))


def insist(part: str, holds: bool, statement: str) -> None:
    """Raises an error where the numbers contradict a statement of the template."""
    if not holds:
        raise SetupError(f"the numbers do not carry it that {statement}: change docs/templates/{part}.md.j2")
