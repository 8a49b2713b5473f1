"""The mean colour under an illuminant, and the gamut of colours over the angle of view.

The angle of view is the angle with the normal in the plane of incidence. The mirror direction is at the angle of
incidence, and the light at minus this angle.

A *want* is a group of figures of a sweep. Its *question* is a case, a surface under a setting, and its *answer* has the
figures and pictures (want.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..colours import Doubles

# Largest angle of view to either side in degrees. Larger values include views nearer to the horizon.
_VIEW_MAX_DEG = 85.0
# Number of directions over which the detector averages. More of them resolve narrower peaks and take longer.
_DIRECTIONS_PER_VIEW = 10
# Luminance, relative to the brightest view, below which a view appears black and is left out of the gamut. Smaller
# values add colours too dark to be seen.
_LUMINANCE_FLOOR = 0.01
# Height of the strip of colours in pixels.
_STRIP_PIXELS = 16
# The root above 1 of x⁴ = x + 1. Its powers −1, −2, −3 are the steps of the low-discrepancy sequence R₃ (Roberts 2018).
_R3_BASE = 1.2207440846057596


@dataclass(frozen=True)
class Colour(Want):
    """``[want.colour]``: ``illuminant`` (D65, E, A), ``samples`` (4096), ``gamut`` (true), ``detector_deg`` (1),
    ``mirror_deg`` (3), ``lambda_step_nm`` (5).

    Defaults are in parentheses. The mean colour is the colour of the light reflected into all directions. The gamut is
    the convex hull, in CIE 1976 u'v', of the colours that a detector sees. The detector is ``detector_deg`` wide, and
    its angles of view go from −_VIEW_MAX_DEG to _VIEW_MAX_DEG. The gamut leaves out views within ``mirror_deg`` of the
    mirror direction and views darker than _LUMINANCE_FLOOR.
    """

    #: One of ILLUMINANTS.
    illuminant: str
    #: Number of sampled directions for the mean colour.
    samples: int
    #: Whether the gamut is computed.
    gamut: bool
    #: Width of the detector in the angle of view, in degrees.
    detector_deg: float
    #: Largest angle in degrees between a view and the mirror direction at which the gamut leaves the view out.
    mirror_deg: float
    #: Step between wavelengths in nm.
    lambda_step_nm: float

    name = "colour"

    @classmethod
    def read(cls, table: object, folder: Path) -> Colour:
        keys = ["illuminant", "samples", "gamut", "detector_deg", "mirror_deg", "lambda_step_nm"]
        options = Options(cls.name, table, keys)
        return cls(
            illuminant=options.choice("illuminant", "D65", Words(ILLUMINANTS)),
            samples=options.whole("samples", 4096, 16, 10_000_000),
            gamut=options.truth("gamut", True),
            detector_deg=options.number("detector_deg", 1.0, Numbers(0.05, 20, "degrees")),
            mirror_deg=options.number("mirror_deg", 3.0, Numbers(0, 45, "degrees")),
            lambda_step_nm=options.number("lambda_step_nm", 5.0, Numbers(1, 20, "nm")),
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
            Column("gamut_views", "whole", "number of views whose colours span the gamut"),
            Column("gamut", "gamut", "corners of the gamut: angle of view in degrees, u', v'"),
            Column(
                "strip",
                "text",
                f"PNG file of the colours from -{_VIEW_MAX_DEG:g} to {_VIEW_MAX_DEG:g} degrees of view, "
                "below the sweep's folder",
            ),
        ]

    def compute(self, question: Question) -> Answer:
        nm = wavelengths_nm(self.lambda_step_nm)
        # A perfect reflector has Y = 1.
        weights = xyz_weights(self.illuminant, self.lambda_step_nm)
        spectrum = question.reflector().albedo(question.wi(), nm, _low_discrepancy(self.samples))
        xyz = weighted(spectrum[None], weights)[0]
        rgb = weighted(spectrum[None], rgb_weights(self.illuminant, self.lambda_step_nm))[0]
        answer = Answer()
        answer.number("luminance", float(xyz[1]))
        for channel, value in zip("rgb", rgb):
            answer.number(f"srgb_{channel}", float(value))
        white = weights.sum(axis=0)
        for axis, value in zip("lab", lab(xyz, white)):
            answer.number(f"lab_{axis}", float(value))
        if self.gamut:
            self._add_gamut(answer, question, nm)
        return answer

    def _add_gamut(self, answer: Answer, question: Question, nm: Doubles) -> None:
        """Adds the gamut, its area and the strip of colours to the answer; ``nm`` are the wavelengths in nm.

        Raises :class:`WantError` where a value is not finite.
        """
        view_deg, spectra = self._views(question, nm)
        off_mirror = np.abs(view_deg - question.theta_i_deg) > self.mirror_deg
        xyz = weighted(spectra, xyz_weights(self.illuminant, self.lambda_step_nm))
        brightest = xyz[off_mirror, 1].max(initial=0.0)
        # Indices of the views whose colours span the gamut. Black views have no chromaticity.
        counted = np.flatnonzero(off_mirror & (xyz[:, 1] > _LUMINANCE_FLOOR * brightest) & (xyz[:, 1] > 0))
        uv = chromaticities(xyz[counted])
        corners = hull(uv)
        answer.number("gamut_area", polygon_area(uv[corners]) if len(corners) > 2 else 0.0)
        answer.figures["gamut_views"] = len(counted)
        answer.figures["gamut"] = [
            {"view_deg": round(float(view_deg[counted[i]]), 6), "u": float(uv[i, 0]), "v": float(uv[i, 1])}
            for i in corners
        ]
        rgb = weighted(spectra, rgb_weights(self.illuminant, self.lambda_step_nm))
        # The exposure leaves out the mirror's peak, which would make all other views dark.
        exposure = automatic_exposure(rgb[off_mirror]) if off_mirror.any() else 1.0
        strip = np.repeat(encoded(rgb, exposure)[None], _STRIP_PIXELS, axis=0)
        answer.pictures["strip.png"] = png(strip)
        answer.thumbnails["strip"] = thumbnail(strip)

    def _views(self, question: Question, nm: Doubles) -> tuple[Doubles, Doubles]:
        """Angles of view in degrees, ``[views]``, and the spectra seen there by the detector, ``[views, wavelengths]``.

        A spectrum is the BSDF's mean over the width of the detector in 1/sr. Raises :class:`WantError` where a value is
        not finite.
        """
        # Adjacent views, each about as wide as the detector. A gamut with an area needs at least three.
        count = max(3, round(2 * _VIEW_MAX_DEG / self.detector_deg))
        # Angles of the directions in radians, the centres of equal parts.
        edges = np.linspace(-_VIEW_MAX_DEG, _VIEW_MAX_DEG, count * _DIRECTIONS_PER_VIEW + 1)
        thetas = np.radians((edges[:-1] + edges[1:]) / 2)
        phi = np.radians(question.phi_i_deg)
        # Positive angles are on the side away from the light, whose azimuth is phi.
        wo = np.stack([-np.sin(thetas) * np.cos(phi), -np.sin(thetas) * np.sin(phi), np.cos(thetas)], axis=-1)
        f = question.reflector().eval(question.wi(), wo.astype(np.float32), nm)
        bad = int(np.count_nonzero(~np.isfinite(f)))
        if bad:
            raise WantError(f"{bad} of {f.size} values over the angle of view are not finite")
        spectra = f.astype(np.float64).reshape(count, _DIRECTIONS_PER_VIEW, len(nm)).mean(axis=1)
        view_deg = np.degrees(thetas).reshape(count, _DIRECTIONS_PER_VIEW).mean(axis=1)
        return view_deg, spectra


def _low_discrepancy(count: int) -> NDArray[np.float32]:
    """Points ``[count, 3]`` of the sequence R₃ in [0, 1)³: the fractional parts of 1/2 + n·_R3_BASE^(−1, −2, −3).

    ``n`` counts from 1.
    """
    n = np.arange(1, count + 1, dtype=np.float64)[:, None]
    steps = _R3_BASE ** -np.arange(1.0, 4.0)
    # The largest number below 1 in single precision is 1 − 2⁻²⁴. Numbers between it and 1 could be rounded to 1.
    points: NDArray[np.float32] = np.minimum((0.5 + n * steps) % 1, 1 - 2.0**-24).astype(np.float32)
    return points
