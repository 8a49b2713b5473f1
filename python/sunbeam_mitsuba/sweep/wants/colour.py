"""The mean colour under an illuminant, and the gamut of colours over the angle of view."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..colours import (
    ILLUMINANTS,
    chromaticities,
    hull,
    lab,
    polygon_area,
    rgb_weights,
    wavelengths_nm,
    weighted,
    xyz_weights,
)
from ..limits import Numbers, Words
from ..pictures import automatic_exposure, encoded, png, thumbnail
from .want import Answer, Column, Options, Question, Want, WantError

# Largest angle of view in the plane of incidence, to either side, in degrees.
_VIEW_MAX_DEG = 85.0
# Number of directions that are averaged over the detector's width. Chosen.
_WITHIN_DETECTOR = 10
# Luminance, relative to the brightest view, below which a colour is left out of the gamut. Chosen: it appears black.
_FLOOR = 0.01
# Height of the strip of colours in pixels.
_STRIP_PIXELS = 16
# Base of the additive recurrence R₃ (Roberts 2018), the root of x⁴ = x + 1: a low-discrepancy sequence in 3D.
_RECURRENCE = 1.2207440846057596


@dataclass(frozen=True)
class Colour(Want):
    """``[want.colour]``: ``illuminant`` (D65, E, A), ``samples`` (4096), ``gamut`` (true), ``detector_deg`` (1),
    ``mirror_deg`` (3), ``lambda_step_nm`` (5).

    The mean colour is the colour of the light reflected into all directions. The gamut is the convex hull, in CIE 1976
    u'v', of the colours seen by a detector ``detector_deg`` wide, from −85° to 85° in the plane of incidence. It leaves
    out views within ``mirror_deg`` of the mirror direction and views below 1 % of the brightest luminance.
    """

    illuminant: str
    samples: int
    gamut: bool
    detector_deg: float
    mirror_deg: float
    lambda_step_nm: float

    name = "colour"

    @classmethod
    def read(cls, table: object, folder: Path) -> Colour:
        keys = ["illuminant", "samples", "gamut", "detector_deg", "mirror_deg", "lambda_step_nm"]
        options = Options(cls.name, table, keys)
        return cls(
            options.choice("illuminant", "D65", Words(ILLUMINANTS)),
            options.whole("samples", 4096, 16, 10_000_000),
            options.truth("gamut", True),
            options.number("detector_deg", 1.0, Numbers(0.05, 20, "degrees")),
            options.number("mirror_deg", 3.0, Numbers(0, 45, "degrees")),
            options.number("lambda_step_nm", 5.0, Numbers(1, 20, "nm")),
        )

    def identity(self) -> dict[str, Any]:
        return {"want": self.name, **{key: getattr(self, key) for key in self.__dataclass_fields__}}

    def columns(self) -> list[Column]:
        mean = [
            Column("luminance", "number", "Y of the mean colour, 1 for a perfect reflector"),
            *(
                Column(f"srgb_{channel}", "number", f"mean colour, linear sRGB {channel}; white is 1")
                for channel in "rgb"
            ),
            *(Column(f"lab_{axis}", "number", f"mean colour, CIELAB {axis.upper()}*") for axis in "lab"),
        ]
        if not self.gamut:
            return mean
        return [
            *mean,
            Column("gamut_area", "number", "area of the gamut in the CIE 1976 u'v' diagram"),
            Column("gamut_views", "whole", "views whose colour counts"),
            Column("gamut", "gamut", "corners of the gamut: angle of view in degrees, u', v'"),
            Column("strip", "text", "colours over the angle of view as PNG, from -85 to 85 degrees"),
        ]

    def compute(self, question: Question) -> Answer:
        nm = wavelengths_nm(self.lambda_step_nm)
        weights = xyz_weights(self.illuminant, self.lambda_step_nm)
        index = np.arange(1, self.samples + 1, dtype=np.float64)[:, None]
        steps = _RECURRENCE ** -np.arange(1.0, 4.0)
        # Random numbers stay below 1 in single precision.
        u = np.minimum((0.5 + index * steps) % 1, 1 - 2.0**-24).astype(np.float32)
        spectrum = question.reflector().albedo(question.wi(), nm, u)
        xyz = weighted(spectrum[None], weights)[0]
        rgb = weighted(spectrum[None], rgb_weights(self.illuminant, self.lambda_step_nm))[0]
        answer = Answer()
        answer.number("luminance", float(xyz[1]))
        for channel, value in zip("rgb", rgb):
            answer.number(f"srgb_{channel}", float(value))
        for axis, value in zip("lab", lab(xyz, weights.sum(axis=0))):
            answer.number(f"lab_{axis}", float(value))
        if self.gamut:
            self._add_gamut(answer, question, nm)
        return answer

    def _add_gamut(self, answer: Answer, question: Question, nm: Any) -> None:
        """Adds the gamut, its area and the strip of colours to the answer."""
        count = max(3, round(2 * _VIEW_MAX_DEG / self.detector_deg))
        edges = np.linspace(-_VIEW_MAX_DEG, _VIEW_MAX_DEG, count * _WITHIN_DETECTOR + 1)
        views = np.radians((edges[:-1] + edges[1:]) / 2)
        phi = np.radians(question.phi_i_deg)
        # Positive angles are on the side of the mirror direction.
        wo = np.stack([-np.sin(views) * np.cos(phi), -np.sin(views) * np.sin(phi), np.cos(views)], axis=-1)
        f = question.reflector().eval(question.wi(), wo.astype(np.float32), nm)
        bad = int(np.count_nonzero(~np.isfinite(f)))
        if bad:
            raise WantError(f"{bad} of {f.size} values over the angle of view are not finite")
        seen = f.astype(np.float64).reshape(count, _WITHIN_DETECTOR, len(nm)).mean(axis=1)
        angles = np.degrees(views).reshape(count, _WITHIN_DETECTOR).mean(axis=1)
        xyz = weighted(seen, xyz_weights(self.illuminant, self.lambda_step_nm))
        off_mirror = np.abs(angles - question.theta_i_deg) > self.mirror_deg
        brightest = xyz[off_mirror, 1].max(initial=0.0)
        counted = np.flatnonzero(off_mirror & (xyz[:, 1] > _FLOOR * brightest) & (xyz[:, 1] > 0))
        uv = chromaticities(xyz[counted])
        corners = hull(uv)
        area = polygon_area(uv[corners]) if len(corners) > 2 else 0.0
        answer.number("gamut_area", area)
        answer.figures["gamut_views"] = len(counted)
        answer.figures["gamut"] = [
            {"view_deg": round(float(angles[counted[i]]), 6), "u": float(uv[i, 0]), "v": float(uv[i, 1])}
            for i in corners
        ]
        rgb = weighted(seen, rgb_weights(self.illuminant, self.lambda_step_nm))
        exposure = automatic_exposure(rgb[off_mirror]) if off_mirror.any() else 1.0
        strip = np.repeat(encoded(rgb, exposure)[None], _STRIP_PIXELS, axis=0)
        answer.pictures["strip.png"] = png(strip)
        answer.thumbnails["strip"] = thumbnail(strip)
