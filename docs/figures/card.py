"""Figures of a graphics card from `docs/data/gpu.json`, which `make bench-gpu` writes.

A figure without a row in the file, or without the file, is `None`, and pages say "not run".
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

from mitsuba_scenes.environment import REPOSITORY

FILE = REPOSITORY / "docs" / "data" / "gpu.json"
NOT_RUN = "not run"


@dataclass(frozen=True)
class Card:
    """Figures of a run. `kind` is `rgb` or `spectral`, for the variants `cuda_ad_rgb` and `cuda_ad_spectral`."""

    name: str | None = None
    driver: str | None = None
    parts: dict = field(default_factory=dict)

    def _rows(self, part: str) -> list[dict]:
        return self.parts.get(part, {}).get("rows", [])

    def _row(self, part: str, **wanted) -> dict | None:
        rows = (row for row in self._rows(part) if all(row.get(key) == value for key, value in wanted.items()))
        return next(rows, None)

    def call_ns(self, kind: str, material: str, call: str) -> float | None:
        """Nanoseconds of one call."""
        row = self._row("calls", kind=kind, call=call)
        return row and row["ns"].get(material)

    def render_ratio(self, kind: str, scene: str, material: str) -> float | None:
        """Time of a render over that of `roughconductor`, by the wall clock."""
        row = self._row("renders", kind=kind, scene=scene)
        ratio = row and row.get("ratio", {}).get(material)
        return ratio and ratio["wall"]

    def frame_ms(self, method: str, width: int, height: int) -> float | None:
        """Milliseconds of a frame of the realtime renderer, all stages."""
        row = self._row("realtime", method=method, size=[width, height])
        return row and row["ms"]

    def shading_us(self, method: str, width: int, height: int) -> float | None:
        """Microseconds of shading per lit pixel of a frame of this size."""
        row = self._row("realtime", method=method, size=[width, height])
        return row and 1e3 * row["stages_ms"]["shade"] / row["lit_pixels"]


def read(file: Path = FILE) -> Card:
    """The card of the file, or one without figures if the file is missing."""
    if not file.exists():
        return Card()
    results = json.loads(file.read_text(encoding="utf-8"))
    about = results["machine"]
    return Card(about["card"], about.get("driver"), results["parts"])


def measured(value: float | None, digits: str = ".2g", unit: str = "") -> str:
    """A figure with its unit, or "not run"."""
    return NOT_RUN if value is None else f"{value:{digits}}{unit}"
