"""Writes the sweep's table of settings and figures, the table of times, and the summary.

A row is a *case*: a surface under one of the specification's ``settings`` (optics and light). A *want* (wants/want.py)
is a group of figures: computed numbers and pictures. It declares their columns. The record of a case (work.record_of)
has the figures by column.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

from .limits import PARAMETERS, Numbers, Truth
from .spec import Case, Spec
from .store import SUMMARY, TABLE, TIMES, StoreError, picture_path, read_result, write_whole
from .wants import Column

#: Arrow type of each kind of column (Column.kind). The last three kinds are tables within a cell, each row a struct:
#: peaks (wants/peaks.py), diffraction orders with efficiencies for TE and TM light and their mean (wants/orders.py),
#: and corners of a gamut in CIE 1976 u'v' (wants/colour.py).
KINDS: dict[str, pa.DataType] = {
    "number": pa.float64(),
    "whole": pa.int64(),
    "text": pa.string(),
    "truth": pa.bool_(),
    "angles": pa.list_(
        pa.struct([("wavelength_nm", pa.float64()), ("peak_deg", pa.float64()), ("grating_deg", pa.float64())])
    ),
    "orders": pa.list_(
        pa.struct(
            [
                ("theory", pa.string()),
                ("wavelength_nm", pa.float64()),
                ("side", pa.string()),
                ("order", pa.int64()),
                ("theta_deg", pa.float64()),
                ("phi_deg", pa.float64()),
                ("te", pa.float64()),
                ("tm", pa.float64()),
                ("mean", pa.float64()),
            ]
        )
    ),
    "gamut": pa.list_(pa.struct([("view_deg", pa.float64()), ("u", pa.float64()), ("v", pa.float64())])),
}
# Number of rows in a group of the Parquet file. Larger groups compress better; smaller ones take less memory, since a
# group's rows are in memory as Python objects.
_GROUP_ROWS = 10_000


class Row(NamedTuple):
    """A row of the table."""

    #: Values by column. Columns without a value are ``None`` or missing.
    cells: dict[str, Any]
    #: The case's record (work.record_of) as stored, with ``pictures``: sizes in bytes by ending (store.write_result).
    record: dict[str, Any]


def columns_of(spec: Spec) -> list[Column]:
    """Columns of the table in order: the case, its parameters, its outcome, and the wanted figures."""
    found = [
        Column("row", "whole", "place in the order of the specification, from 0"),
        Column("identity", "text", "identity of the case, in the names of its files"),
        Column("surface", "text", "the surface's name, or that of its file or preset"),
    ]
    for name in spec.parameter_names:
        accepted = PARAMETERS[name]
        kind = "number" if isinstance(accepted, Numbers) else "truth" if isinstance(accepted, Truth) else "text"
        unit_and_range = f", {accepted}" if isinstance(accepted, Numbers) else ""
        found.append(Column(name, kind, f"parameter {name}{unit_and_range}; none where it has its default"))
    found += [
        Column("input_sha256", "text", "checksum of the height field's file; none for a preset"),
        Column("version", "text", "versions of the package, its library and Mitsuba"),
        Column("status", "text", "done or failed"),
        Column("error", "text", "all errors in one line; none without an error"),
    ]
    for want in spec.wants:
        found += [Column(f"{want.name}_{column.name}", column.kind, column.meaning) for column in want.columns()]
    return found


def read_rows(folder: Path, cases: list[Case]) -> Iterator[Row]:
    """Yields the row of each case, from the results in the sweep's folder.

    Raises :class:`StoreError` where a result was removed after it was written.
    """
    for case in cases:
        record = read_result(folder, case.identity)
        if record is None:
            raise StoreError(f"the result of row {case.row} is no longer in {folder}; the same command makes it again")
        cells = {
            "row": case.row,
            "identity": case.identity,
            "surface": case.surface,
            **case.parameters,
            "input_sha256": (record["input"] or {}).get("sha256"),
            "version": record["version"],
            "status": record["status"],
            "error": record["error"] or None,
            **record["figures"],
        }
        for ending in record["pictures"]:
            # The path of map.exr is in the column map_exr, that of strip.png in colour_strip.
            column = "colour_strip" if ending == "strip.png" else ending.replace(".", "_")
            cells[column] = picture_path(case.identity, ending)
        yield Row(cells, record)


def write_tables(spec: Spec, cases: list[Case]) -> None:
    """Writes ``sweep.parquet``, whose bytes depend on the results alone, and ``times.parquet``.

    Raises :class:`StoreError` where a result is missing, or a table cannot be written.
    """
    fields = [
        pa.field(column.name, KINDS[column.kind], metadata={"meaning": column.meaning}) for column in columns_of(spec)
    ]
    # Time of the case, the part of it for building tables, its end (UTC, ISO 8601), and the process, as host:pid.
    time_fields = [
        ("row", pa.int64()),
        ("identity", pa.string()),
        ("seconds", pa.float64()),
        ("tables_seconds", pa.float64()),
        ("finished", pa.string()),
        ("worker", pa.string()),
    ]
    table, times = _ParquetTable(pa.schema(fields)), _ParquetTable(pa.schema(time_fields))
    for cells, record in read_rows(spec.output, cases):
        table.add(cells)
        times.add({"row": cells["row"], "identity": cells["identity"], **record["time"]})
    write_whole(spec.output / TABLE, table.finish())
    write_whole(spec.output / TIMES, times.finish())


class _ParquetTable:
    """Encodes rows as a Parquet file in memory, a group of rows at a time."""

    def __init__(self, schema: pa.Schema):
        self._schema = schema
        # Rows that are not encoded yet, fewer than _GROUP_ROWS.
        self._rows: list[dict[str, Any]] = []
        self._buffer = io.BytesIO()
        self._writer = pq.ParquetWriter(self._buffer, schema, compression="zstd")

    def add(self, cells: dict[str, Any]) -> None:
        """Adds a row, its values by column; missing columns become null, and keys outside the schema are ignored."""
        self._rows.append(cells)
        if len(self._rows) >= _GROUP_ROWS:
            self._flush()

    def finish(self) -> bytes:
        """Ends the table and returns the file's content."""
        if self._rows:
            self._flush()
        self._writer.close()
        return self._buffer.getvalue()

    def _flush(self) -> None:
        """Encodes the rows of `_rows` as a group."""
        self._writer.write_table(pa.Table.from_pylist(self._rows, schema=self._schema))
        self._rows = []


def write_summary(spec: Spec, state: str, facts: dict[str, Any]) -> None:
    """Writes ``sweep.json``: the state, the facts, the wants' options, the columns' meanings, and the specification.

    ``state`` is "unfinished" or "finished"; ``facts`` are further entries. Raises :class:`StoreError` where the file
    cannot be written.
    """
    content = {
        "state": state,
        **facts,
        "wants": [want.identity() for want in spec.wants],
        "columns": {column.name: column.meaning for column in columns_of(spec)},
        "specification": spec.source,
    }
    write_whole(spec.output / SUMMARY, (json.dumps(content, indent=1, default=str) + "\n").encode())
