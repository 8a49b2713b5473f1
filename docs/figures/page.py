"""A page of the documentation whose every number came out of the run that wrote it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from mitsuba_scenes.environment import REPOSITORY, SetupError

from . import card

DOCS = REPOSITORY / "docs"
# Presets that stand in for measured skins.
PROCEDURAL = ("elaphe", "xenopeltis")


def images(name: str, docs: Path = DOCS) -> Path:
    """The folder of a page's pictures, made where it is missing."""
    folder = docs / "images" / name
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def write_page(name: str, figures: dict, docs: Path = DOCS) -> Path:
    """Fills `templates/NAME.md.j2` with the figures: writes `NAME.md`, and the figures as `data/NAME.json`.

    The template also has `card`, what was measured on a graphics card. What it asks for and the figures lack is an
    error, as is a number that JSON does not know.
    """
    data = docs / "data" / f"{name}.json"
    data.parent.mkdir(parents=True, exist_ok=True)
    data.write_text(json.dumps(figures, indent=1, allow_nan=False) + "\n")
    templates = Environment(
        loader=FileSystemLoader(DOCS / "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    templates.filters.update(named=named, scans_first=scans_first, measured=card.measured)
    templates.globals["card"] = card.read()
    page = docs / f"{name}.md"
    page.write_text(templates.get_template(f"{name}.md.j2").render(figures))
    return page


def named(surface: str) -> str:
    """What pages call a surface: a skin that was not measured is said to be procedural."""
    if "scan" in surface:
        return surface
    return re.sub(rf"\b({'|'.join(PROCEDURAL)})\b", r"\1 (procedural)", surface)


def scans_first(rows: Iterable, key: str | None = None) -> list:
    """Rows with scans before the others: a row is its name, begins with it, or has it by `key`."""

    def name(row) -> str:
        if key is not None:
            return row[key]
        return row if isinstance(row, str) else row[0]

    return sorted(rows, key=lambda row: "scan" not in name(row))


def insist(page: str, holds: bool, statement: str) -> None:
    """An error where the numbers do not carry what the page says in words."""
    if not holds:
        raise SetupError(f"the numbers do not carry it that {statement}: change docs/templates/{page}.md.j2")
