"""The contact sheet: one HTML file with thumbnails and figures, sortable by every column."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from .report import columns_of
from .spec import Spec
from .store import SHEET, write_whole

#: Largest number of rows on the sheet. Chosen: a page of some 20 MB with two pictures a row. The table has all rows.
ROWS_MAX = 2000
# Kinds of columns with one value a row; tables within a cell are left out.
_PLAIN = ("number", "whole", "text", "truth")
# Columns left out: stated below the title, or of use to programs alone.
_LEFT_OUT = ("identity", "version", "input_sha256", "status")


def write_sheet(spec: Spec, rows: Iterable[tuple[dict[str, Any], dict[str, Any]]], facts: dict[str, Any]) -> None:
    """Writes ``index.html`` from the table's rows and their records. Raises ``StoreError``."""
    shown = [(row, record) for (row, record), _ in zip(rows, range(ROWS_MAX))]
    columns = [column for column in columns_of(spec) if column.kind in _PLAIN and column.name not in _LEFT_OUT]
    # Empty columns are left out, such as the errors of a sweep without any.
    columns = [column for column in columns if any(row.get(column.name) is not None for row, _ in shown)]
    is_file = {
        f"{want.name}_{column.name}" for want in spec.wants for column in want.columns() if column.kind == "text"
    }
    pictures = sorted({name for _, record in shown for name in record["thumbnails"]})
    lines = [
        {
            "failed": record["status"] == "failed",
            "pictures": [(record["thumbnails"].get(name), _full(row, name)) for name in pictures],
            "cells": [_cell(row.get(column.name), column.name in is_file) for column in columns],
        }
        for row, record in shown
    ]
    templates = Environment(
        loader=FileSystemLoader(Path(__file__).parent), undefined=StrictUndefined, autoescape=True, trim_blocks=True
    )
    page = templates.get_template("sheet.html.j2").render(
        columns=columns, pictures=pictures, lines=lines, facts=facts, rows_max=ROWS_MAX, title=spec.output.name
    )
    write_whole(spec.output / SHEET, page.encode())


def _full(row: dict[str, Any], name: str) -> str | None:
    """Path of the full picture of the thumbnail ``name``, relative to the sweep's folder."""
    found = row.get("colour_strip") if name == "strip" else row.get(f"{name}_png")
    return str(found) if found else None


def _cell(value: Any, is_file: bool) -> dict[str, Any]:
    """A cell of the template: its text, the key by which the column sorts, and a link for a file."""
    if value is None:
        return {"shown": "", "sorts": "", "link": None}
    if isinstance(value, float):
        return {"shown": f"{value:.5g}", "sorts": repr(value), "link": None}
    return {"shown": "open" if is_file else str(value), "sorts": str(value), "link": str(value) if is_file else None}
