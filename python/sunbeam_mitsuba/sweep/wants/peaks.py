"""Angles of the first order's peak at each wavelength, and the spacing that follows by the grating equation.

The grating equation of the first order in the x–z plane is sin θr = λ/d − sin θi, with

- θi, the angle of incidence, on the side of +x;
- θr, the peak's angle with the normal, positive towards +x;
- d, the spacing.

A *want* is a group of figures of a sweep. Its *question* is a case, which is a surface under one setting (optics and
light). Its *answer* has the figures and pictures (want.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..command import describe, find_command
from ..errors import SweepError
from ..limits import LENGTH_UM, Numbers, Value, shown
from ..reflector import Reflector
from .want import Answer, Column, Options, Question, Want, WantError

# Smallest spacing at which the peak is searched, relative to the expected period. It excludes order 2: at its angle the
# equation of the first order gives half the period.
_SPACING_MIN = 0.7
# Largest spacing at which the peak is searched, relative to the expected period. It excludes order 0: at its angle the
# equation of the first order gives an infinite spacing.
_SPACING_MAX = 1.4
# Largest angle with the normal at which the peak is searched, in degrees. Towards 90° the sine, and so the spacing,
# hardly depends on the angle.
_THETA_MAX_DEG = 89.0
# Default periods of presets in µm, equal to the library's (src/config/); no test compares them.
_PRESET_PERIODS_UM = {"blazed": 2.5, "sinusoidal": 2.5, "lamellar": 2.5}


@dataclass(frozen=True)
class Peaks(Want):
    """``[want.peaks]``: ``wavelengths_nm`` (450 to 650 in steps of 25), ``angle_step_deg`` (0.02), ``period_um``.

    Defaults are in parentheses. The peak is the direction in the x–z plane with the largest ``f_r``. It is searched
    where the spacing d = λ/(sin θi + sin θr) is _SPACING_MIN to _SPACING_MAX times the expected period. The expected
    period is the first known one of

    - ``period_um``;
    - the surface's parameter ``period``, or else the preset's default, times the parameter ``scale``;
    - the strongest period along x by ``sunbeam height-field``.
    """

    wavelengths_nm: tuple[float, ...]
    #: Step between the angles of the search in degrees.
    angle_step_deg: float
    #: Expected period of the relief as it is evaluated; ``None`` for that of the surface.
    period_um: float | None

    name = "peaks"

    @classmethod
    def read(cls, table: object, folder: Path) -> Peaks:
        options = Options(cls.name, table, ["wavelengths_nm", "angle_step_deg", "period_um"])
        return cls(
            wavelengths_nm=options.wavelengths_nm(tuple(450.0 + 25 * i for i in range(9))),
            angle_step_deg=options.number("angle_step_deg", 0.02, Numbers(1e-3, 1, "degrees")),
            period_um=options.optional_number("period_um", LENGTH_UM),
        )

    def identity(self) -> dict[str, Any]:
        return {
            "want": self.name,
            "wavelengths_nm": list(self.wavelengths_nm),
            "angle_step_deg": self.angle_step_deg,
            "period_um": self.period_um,
        }

    def columns(self) -> list[Column]:
        return [
            Column("spacing_nm", "number", "mean over the wavelengths of the spacing by the grating equation, in nm"),
            Column("variance_nm2", "number", "variance of the spacing over the wavelengths, in nm²"),
            Column("period_nm", "number", "the expected period in nm"),
            Column("rms_error_deg", "number", "root mean square of peak_deg - grating_deg in degrees"),
            Column("angles", "angles", "at each wavelength the peak's angle, and the grating equation's for period_nm"),
        ]

    def check_parameters(self, names: set[str], values: Mapping[str, set[Value]]) -> None:
        off_plane = [phi for phi in values.get("phi_i_deg", ()) if phi != 0]
        if off_plane:
            raise SweepError(f"want.peaks: phi_i_deg is {shown(off_plane[0])}, but peaks are along x: it must be 0")

    def compute(self, question: Question) -> Answer:
        period_nm = 1e3 * self._period_um(question.parameters)
        sin_i = float(np.sin(np.radians(question.theta_i_deg)))
        # Built before the search, so that the error of a refused surface comes before that of a missing peak.
        reflector = question.reflector()
        rows, spacings_nm, errors_deg = [], [], []
        for nm in self.wavelengths_nm:
            expected_sine = nm / period_nm - sin_i
            # The order is below the horizon where its sine exceeds 1 in magnitude. Such wavelengths are left out.
            peak_deg = self._peak_deg(question, reflector, nm, period_nm) if abs(expected_sine) < 1 else None
            if peak_deg is None:
                continue
            grating_deg = float(np.degrees(np.arcsin(expected_sine)))
            rows.append({"wavelength_nm": nm, "peak_deg": round(peak_deg, 9), "grating_deg": grating_deg})
            spacings_nm.append(nm / (sin_i + float(np.sin(np.radians(peak_deg)))))
            errors_deg.append(peak_deg - grating_deg)
        if not rows:
            raise WantError(
                f"no wavelength has a peak of the first order above the horizon for a period of {period_nm:g} nm and "
                f"light from {question.theta_i_deg:g} degrees"
            )
        answer = Answer({"angles": rows})
        answer.number("spacing_nm", float(np.mean(spacings_nm)))
        answer.number("variance_nm2", float(np.var(spacings_nm)))
        answer.number("period_nm", period_nm)
        answer.number("rms_error_deg", float(np.sqrt(np.mean(np.square(errors_deg)))))
        return answer

    def _peak_deg(self, question: Question, reflector: Reflector, nm: float, period_nm: float) -> float | None:
        """The angle with the largest ``f_r`` at a wavelength in nm, searched around the order of ``period_nm``.

        The result is ``None`` without a peak: where the largest value lies at an end of the search range, where all
        values are 0, and where one is NaN. It is also ``None`` for fewer than three angles, as where almost all of the
        range is below the horizon.
        """
        sin_i = float(np.sin(np.radians(question.theta_i_deg)))
        # Sines of the first and the last angle of the search. The largest spacing has the smallest angle.
        sines = np.array([nm / (ratio * period_nm) - sin_i for ratio in (_SPACING_MAX, _SPACING_MIN)])
        ends_deg = np.degrees(np.arcsin(np.clip(sines, -1, 1)))
        first_deg, last_deg = np.clip(ends_deg, -_THETA_MAX_DEG, _THETA_MAX_DEG)
        # Angles are multiples of the step, independent of the search range.
        multiples = np.arange(np.ceil(first_deg / self.angle_step_deg), last_deg / self.angle_step_deg)
        angles_deg = multiples * self.angle_step_deg
        if len(angles_deg) < 3:
            return None
        radians = np.radians(angles_deg)
        wo = np.stack([np.sin(radians), 0 * radians, np.cos(radians)], axis=-1)
        f = reflector.eval(question.wi(), wo, [nm])[:, 0]
        largest = int(f.argmax())
        # A comparison with NaN is false.
        is_peak = f[largest] > 0 and 0 < largest < len(f) - 1
        return float(angles_deg[largest]) if is_peak else None

    def _period_um(self, parameters: Mapping[str, Value]) -> float:
        """The expected period in µm, from the first source that has one. Raises :class:`WantError` without any."""
        if self.period_um is not None:
            return self.period_um
        given = parameters.get("period") or _PRESET_PERIODS_UM.get(str(parameters.get("preset")))
        if given is not None:
            return float(given) * float(parameters.get("scale", 1.0))
        if find_command() is None:
            raise WantError("the period is not known without the command sunbeam; give want.peaks.period_um")
        along_x = describe(parameters)["periods"]["x"]
        if along_x is None:
            raise WantError("the relief has no period along x; give want.peaks.period_um")
        return float(along_x["period_um"])
