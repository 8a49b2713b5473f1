"""The contact sheet ``index.html``: one HTML file with thumbnails and figures, sortable by every column."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import islice
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from .report import Row, columns_of
from .spec import Spec
from .store import SHEET, write_whole

# Largest number of rows on the sheet, about 20 MB with two pictures in each row. Larger pages open slowly. The table
# of results (report.py) has all rows.
_ROWS_MAX = 2000
# Kinds of columns with a single value in a row, unlike those with a table in a cell.
_SINGLE_VALUE_KINDS = ("number", "whole", "text", "truth")
# Columns left out. The version is below the title, and failed rows are coloured. ``identity`` and ``input_sha256`` are
# for programs.
_LEFT_OUT = ("identity", "version", "input_sha256", "status")


def write_sheet(spec: Spec, rows: Iterable[Row], facts: dict[str, Any]) -> None:
    """Writes ``index.html`` from the rows of the table of results.

    The page states ``cases``, ``failed`` and ``version`` of the ``facts``. Raises ``StoreError`` where a record is
    missing or the page cannot be written.
    """
    shown = list(islice(rows, _ROWS_MAX))
    columns = [
        column for column in columns_of(spec) if column.kind in _SINGLE_VALUE_KINDS and column.name not in _LEFT_OUT
    ]
    # Empty columns are left out, such as the errors of a sweep without any.
    columns = [column for column in columns if any(row.cells.get(column.name) is not None for row in shown)]
    # Texts computed by a want (a group of figures, wants/want.py) are always paths of files.
    file_columns = {
        f"{want.name}_{column.name}" for want in spec.wants for column in want.columns() if column.kind == "text"
    }
    # Names of the thumbnails, such as "map". Each has a column of pictures.
    pictures = sorted({name for row in shown for name in row.record["thumbnails"]})
    lines = [
        {
            "failed": row.record["status"] == "failed",
            # For each name the thumbnail, a PNG in base 64, and the path of the full picture, or ``None``.
            "pictures": [(row.record["thumbnails"].get(name), _full_picture(row, name)) for name in pictures],
            "cells": [_cell(row.cells.get(column.name), column.name in file_columns) for column in columns],
        }
        for row in shown
    ]
    templates = Environment(
        loader=FileSystemLoader(Path(__file__).parent), undefined=StrictUndefined, autoescape=True, trim_blocks=True
    )
    page = templates.get_template("sheet.html.j2").render(
        columns=columns, pictures=pictures, lines=lines, facts=facts, rows_max=_ROWS_MAX, title=spec.output.name
    )
    write_whole(spec.output / SHEET, page.encode())


def _full_picture(row: Row, name: str) -> str | None:
    """Path of the full picture of the thumbnail ``name``, relative to the sweep's folder; ``None`` without one."""
    # The thumbnail "strip" belongs to the want `colour`, and others to the want of their name, whose picture is a PNG.
    found = row.cells.get("colour_strip" if name == "strip" else f"{name}_png")
    return str(found) if found else None


def _cell(value: Any, is_file: bool) -> dict[str, Any]:
    """A cell of the template ``sheet.html.j2``.

    Its entries are the text ``shown``; ``sorts``, the text by whose number or letters the column is sorted; and
    ``link``, the path of a file or ``None``.
    """
    if value is None:
        return {"shown": "", "sorts": "", "link": None}
    if isinstance(value, float):
        return {"shown": f"{value:.5g}", "sorts": repr(value), "link": None}
    return {"shown": "open" if is_file else str(value), "sorts": str(value), "link": str(value) if is_file else None}
