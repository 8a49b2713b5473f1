"""Size, roughness and periods of the relief, reported by ``sunbeam height-field``.

A *want* is a group of figures of a sweep. Its *question* is a case, a surface under a setting, and its *answer* has the
figures and pictures (want.py).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from ..command import describe, require_command
from .want import Answer, Column, Options, Question, Want


class _Figure(NamedTuple):
    """A column of the table of results, and the place of its value in the report."""

    name: str
    #: Kind of the column (want.Column).
    kind: str
    #: Keys and indices that lead from the report to the value.
    path: tuple[str | int, ...]
    meaning: str


_FIGURES = (
    _Figure("pixels_x", "whole", ("pixels", 0), "pixels along x"),
    _Figure("pixels_y", "whole", ("pixels", 1), "pixels along y"),
    _Figure("extent_x_um", "number", ("extent_um", 0), "extent along x in µm"),
    _Figure("extent_y_um", "number", ("extent_um", 1), "extent along y in µm"),
    _Figure("peak_to_valley_um", "number", ("peak_to_valley_um",), "highest minus lowest height in µm"),
    _Figure("rms_um", "number", ("rms_um",), "root mean square height in µm"),
    _Figure("rms_slope_x", "number", ("rms_slope", 0), "root mean square slope along x"),
    _Figure("rms_slope_y", "number", ("rms_slope", 1), "root mean square slope along y"),
    _Figure("sa_um", "number", ("roughness", "sa_um"), "ISO 25178 Sa in µm"),
    _Figure("ssk", "number", ("roughness", "ssk"), "ISO 25178 Ssk; none for a flat relief"),
    _Figure("sku", "number", ("roughness", "sku"), "ISO 25178 Sku; none for a flat relief"),
    _Figure("sdq", "number", ("roughness", "sdq"), "ISO 25178 Sdq"),
    _Figure("period_x_um", "number", ("periods", "x", "period_um"), "strongest period along x in µm; none without one"),
    _Figure(
        "period_x_direction_deg",
        "number",
        ("periods", "x", "direction_deg"),
        "direction of its waves from +x in degrees",
    ),
    _Figure(
        "period_x_share",
        "number",
        ("periods", "x", "power_share"),
        "fraction of the heights' variance near this period",
    ),
    _Figure("period_y_um", "number", ("periods", "y", "period_um"), "strongest period along y in µm; none without one"),
    _Figure(
        "period_y_direction_deg",
        "number",
        ("periods", "y", "direction_deg"),
        "direction of its waves from +x in degrees",
    ),
    _Figure(
        "period_y_share",
        "number",
        ("periods", "y", "power_share"),
        "fraction of the heights' variance near this period",
    ),
)


class Statistics(Want):
    """``[want.statistics]``, without options. The figures depend only on the parameters of the relief."""

    name = "statistics"

    @classmethod
    def read(cls, table: object, folder: Path) -> Statistics:
        # Refuses every option.
        Options(cls.name, table, [])
        return cls()

    def identity(self) -> dict[str, Any]:
        return {"want": self.name}

    def columns(self) -> list[Column]:
        return [Column(figure.name, figure.kind, figure.meaning) for figure in _FIGURES]

    def check_here(self) -> None:
        require_command()

    def compute(self, question: Question) -> Answer:
        report = describe(question.parameters)
        answer = Answer()
        for figure in _FIGURES:
            value: Any = report
            for key in figure.path:
                # The entry of an axis is null where the relief has no period along it.
                value = value[key] if value is not None else None
            # A figure without a value leaves its cell empty.
            if value is None:
                continue
            if figure.kind == "whole":
                answer.figures[figure.name] = int(value)
            else:
                answer.number(figure.name, value)
        return answer
