"""Measurements on a graphics card from `docs/data/gpu.json`, which `make bench-gpu` (benches/gpu) writes.

A measurement is `None` if the file or the measurement's row is missing. The documentation then says "not run".
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
    """Name and driver of a card, and the results `parts` of benches/gpu by part.

    A part has a list `rows` with a row for each measurement. Arguments of the methods are

    - `kind`: `rgb` or `spectral`, for Mitsuba's variants `cuda_ad_rgb` and `cuda_ad_spectral`;
    - `material`: a key of `bsdf_calls.bsdfs`, or of `BenchmarkScene.bsdfs` (benchmark_scenes.py);
    - `call`: one of `bsdf_calls.CALLS`;
    - `scene`: the name of a `BenchmarkScene`;
    - `method`: a method of the realtime renderer.
    """

    name: str | None = None
    driver: str | None = None
    parts: dict = field(default_factory=dict)

    def _row(self, part: str, **wanted) -> dict | None:
        """The part's first row with the values `wanted`, or None."""
        rows = self.parts.get(part, {}).get("rows", [])
        return next((row for row in rows if all(row.get(key) == value for key, value in wanted.items())), None)

    def call_ns(self, kind: str, material: str, call: str) -> float | None:
        """Nanoseconds per evaluation by one call of the BSDF, as in bsdf_calls.py."""
        row = self._row("calls", kind=kind, call=call)
        return None if row is None else row["ns"].get(material)

    def render_ratio(self, kind: str, scene: str, material: str) -> float | None:
        """Wall-clock time of a render over that of the scene with Mitsuba's `roughconductor`."""
        row = self._row("renders", kind=kind, scene=scene)
        ratio = None if row is None else row.get("ratio", {}).get(material)
        return None if ratio is None else ratio["wall"]

    def frame_ms(self, method: str, width: int, height: int) -> float | None:
        """Milliseconds of a frame of the realtime renderer, for all its stages; sizes in pixels."""
        row = self._row("realtime", method=method, size=[width, height])
        return None if row is None else row["ms"]

    def shading_us(self, method: str, width: int, height: int) -> float | None:
        """Microseconds of evaluating the method per sunlit pixel of the mesh in a frame; sizes in pixels."""
        row = self._row("realtime", method=method, size=[width, height])
        return None if row is None else 1e3 * row["stages_ms"]["shade"] / row["lit_pixels"]


def read(file: Path = FILE) -> Card:
    """The card of the file; without the file, a card without measurements."""
    if not file.exists():
        return Card()
    results = json.loads(file.read_text(encoding="utf-8"))
    machine = results["machine"]
    return Card(machine["card"], machine.get("driver"), results["parts"])


def measured(value: float | None, digits: str = ".2g", unit: str = "") -> str:
    """A measurement in the format `digits`, followed by `unit` (with any space before it), or "not run"."""
    return NOT_RUN if value is None else f"{value:{digits}}{unit}"
