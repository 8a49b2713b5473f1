"""The BRDF map: colours over the hemisphere of outgoing directions, the picture of ``sunbeam brdf-map``.

A *want* is a group of figures of a sweep. Its *question* is a case, a surface under a setting, and its *answer* has the
figures and pictures (want.py).
"""

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

# Largest number of values of the BSDF f_r in one call, 8 MB. Larger values take more memory; smaller ones more calls.
_VALUES_PER_CALL = 2_000_000


@dataclass(frozen=True)
class BrdfMap(Want):
    """``[want.map]``: ``size`` in pixels (128), ``lambda_step_nm`` (5), ``exposure`` (automatic), ``exr`` (true),
    ``png`` (true).

    Defaults are in parentheses. The map is the unit disc of outgoing directions, seen along the normal: right is +x and
    up is +y. The EXR has ``f_r`` in 1/sr as linear sRGB under D65; a spectrum that is 1 everywhere would be (1, 1, 1).
    The PNG has the product of ``f_r`` and the exposure. ``exr = false`` or ``png = false`` leaves a file out.
    """

    #: Side of the picture in pixels.
    size: int
    #: Step between wavelengths in nm.
    lambda_step_nm: float
    #: Factor on linear sRGB in the PNG; 0 for automatic exposure.
    exposure: float
    #: Kinds of written files, of "exr" and "png".
    files: tuple[str, ...]

    name = "map"

    @classmethod
    def read(cls, table: object, folder: Path) -> BrdfMap:
        options = Options(cls.name, table, ["size", "lambda_step_nm", "exposure", "exr", "png"])
        return cls(
            size=options.whole("size", 128, 8, 4096),
            lambda_step_nm=options.number("lambda_step_nm", 5.0, Numbers(1, 20, "nm")),
            exposure=options.exposure(),
            files=tuple(kind for kind in ("exr", "png") if options.truth(kind, True)),
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
            *(
                Column(f"mean_{channel}", "number", f"mean of f_r over the disc, linear sRGB {channel}, in 1/sr")
                for channel in "rgb"
            ),
            *(Column(kind, "text", f"the map's {kind.upper()} file, below the sweep's folder") for kind in self.files),
        ]

    def compute(self, question: Question) -> Answer:
        # Centres of the pixels; the first row is the top.
        centres = (np.arange(self.size) + 0.5) / self.size * 2 - 1
        x, y = np.meshgrid(centres, -centres)
        # Pixels whose x and y are those of a unit vector above the horizon.
        inside = x**2 + y**2 < 1
        z = np.sqrt(1 - x[inside] ** 2 - y[inside] ** 2)
        wo = np.stack([x[inside], y[inside], z], axis=-1).astype(np.float32)
        nm = wavelengths_nm(self.lambda_step_nm)
        weights = rgb_weights("D65", self.lambda_step_nm)
        reflector = question.reflector()
        directions_per_call = max(1, _VALUES_PER_CALL // len(nm))
        parts = [
            weighted(reflector.eval(question.wi(), wo[first : first + directions_per_call], nm), weights)
            for first in range(0, len(wo), directions_per_call)
        ]
        pixels = np.zeros((self.size, self.size, 3))
        pixels[inside] = np.concatenate(parts)
        # The means leave out the corners beyond the horizon.
        answer, shown = exposed(pixels, pixels[inside], self.exposure)
        if "exr" in self.files:
            answer.pictures["map.exr"] = exr(pixels)
        if "png" in self.files:
            answer.pictures["map.png"] = png(shown)
        answer.thumbnails["map"] = thumbnail(shown)
        return answer
