"""The BRDF map: colours over the hemisphere of outgoing directions, as ``sunbeam brdf-map`` draws it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..colours import rgb_weights, wavelengths_nm, weighted
from ..limits import Numbers
from ..pictures import exr, png, thumbnail
from .exposed import exposed
from .want import Answer, Column, Options, Question, Want


@dataclass(frozen=True)
class BrdfMap(Want):
    """``[want.map]``: ``size`` in pixels (128), ``lambda_step_nm`` (5), ``exposure`` (that at which 1 % clips).

    Right is +x and up is +y. The EXR holds ``f_r`` in 1/sr as linear sRGB under D65, where a reflectance of 1 is
    (1, 1, 1). The PNG holds its product with the exposure. ``exr = false`` or ``png = false`` leaves a file out.
    """

    size: int
    lambda_step_nm: float
    exposure: float
    files: tuple[str, ...]

    name = "map"

    @classmethod
    def read(cls, table: object, folder: Path) -> BrdfMap:
        options = Options(cls.name, table, ["size", "lambda_step_nm", "exposure", "exr", "png"])
        exposure = 0.0
        if "exposure" in options.table:
            exposure = options.number("exposure", 1.0, Numbers(0, 1e9, open_low=True))
        return cls(
            options.whole("size", 128, 8, 4096),
            options.number("lambda_step_nm", 5.0, Numbers(1, 20, "nm")),
            exposure,
            tuple(kind for kind in ("exr", "png") if options.truth(kind, True)),
        )

    def identity(self) -> dict[str, Any]:
        return {
            "want": self.name,
            "size": self.size,
            "lambda_step_nm": self.lambda_step_nm,
            "exposure": self.exposure,
            "files": list(self.files),
        }

    def columns(self) -> list[Column]:
        return [
            Column("exposure", "number", "factor on the PNG's linear values"),
            *(Column(f"mean_{channel}", "number", f"mean of f_r over the disc, linear sRGB {channel}, in 1/sr")
              for channel in "rgb"),
            *(Column(kind, "text", f"the map's {kind.upper()} file, below the sweep's folder") for kind in self.files),
        ]  # fmt: skip

    def compute(self, question: Question) -> Answer:
        centres = (np.arange(self.size) + 0.5) / self.size * 2 - 1
        x, y = np.meshgrid(centres, -centres)
        inside = x**2 + y**2 < 1
        z = np.sqrt(1 - x[inside] ** 2 - y[inside] ** 2)
        wo = np.stack([x[inside], y[inside], z], axis=-1).astype(np.float32)
        nm = wavelengths_nm(self.lambda_step_nm)
        weights = rgb_weights("D65", self.lambda_step_nm)
        reflector = question.reflector()
        pixels = np.zeros((self.size, self.size, 3))
        # Slabs of directions limit the memory to 2e6 values of f_r at a time. Chosen.
        slab = max(1, 2_000_000 // len(nm))
        parts = [
            weighted(reflector.eval(question.wi(), wo[first : first + slab], nm), weights)
            for first in range(0, len(wo), slab)
        ]
        pixels[inside] = np.concatenate(parts)
        answer, shown = exposed(pixels, pixels[inside], self.exposure)
        if "exr" in self.files:
            answer.pictures["map.exr"] = exr(pixels)
        if "png" in self.files:
            answer.pictures["map.png"] = png(shown)
        answer.thumbnails["map"] = thumbnail(shown)
        return answer
