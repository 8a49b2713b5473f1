"""Angles of the first order's peak for each wavelength, against the grating equation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..command import describe, find_command
from ..errors import SweepError
from ..limits import Numbers, Value, shown
from .want import Answer, Column, Options, Question, Want, WantError

# Search range of the apparent spacing, relative to the expected period. Chosen so that it excludes order 2, whose
# apparent spacing is 1/2 of the period, and order 0, whose is infinite.
_WITHIN = (0.7, 1.4)
# Largest angle with the normal of the search in degrees.
_STEEPEST_DEG = 89.0
# Default periods of presets in µm.
_PRESET_PERIODS_UM = {"blazed": 2.5, "sinusoidal": 2.5, "lamellar": 2.5}


@dataclass(frozen=True)
class Peaks(Want):
    """``[want.peaks]``: ``wavelengths_nm`` (450 to 650 in steps of 25), ``angle_step_deg`` (0.02), ``period_um``.

    The peak is the angle θr of the largest ``f_r`` in the x–z plane, for light from ``theta_i_deg``. Its spacing
    λ/(sin θi + sin θr) is searched between 0.7 and 1.4 of the expected period. The expected period is ``period_um``, or
    the preset's, or the strongest along x by ``sunbeam height-field``.
    """

    wavelengths_nm: tuple[float, ...]
    angle_step_deg: float
    period_um: float | None

    name = "peaks"

    @classmethod
    def read(cls, table: object, folder: Path) -> Peaks:
        options = Options(cls.name, table, ["wavelengths_nm", "angle_step_deg", "period_um"])
        nm = options.wavelengths_nm(tuple(450.0 + 25 * i for i in range(9)), 401)
        step = options.number("angle_step_deg", 0.02, Numbers(1e-3, 1, "degrees"))
        period = options.table.get("period_um")
        accepted = Numbers(0, 1e3, "µm", open_low=True)
        if period is not None and not accepted.accepts(period):
            raise SweepError(f"want.peaks: period_um is {shown(period)}, but must be {accepted}")
        return cls(nm, step, None if period is None else float(period))  # type: ignore[arg-type]

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
            Column("variance_nm2", "number", "its variance over the wavelengths in nm²"),
            Column("period_nm", "number", "the period that was expected, in nm"),
            Column("rms_error_deg", "number", "root mean square of peak angle minus that of the expected period"),
            Column("angles", "angles", "peak angle and that of the grating equation at each wavelength, in degrees"),
        ]

    def check_parameters(self, names: set[str], values: Any) -> None:
        turned = [phi for phi in values.get("phi_i_deg", ()) if phi != 0]
        if turned:
            raise SweepError(f"want.peaks: phi_i_deg is {shown(turned[0])}, but peaks are along x: it must be 0")

    def compute(self, question: Question) -> Answer:
        period_nm = 1e3 * self._period_um(question.parameters)
        sin_i = float(np.sin(np.radians(question.theta_i_deg)))
        reflector = question.reflector()
        rows, spacings, errors = [], [], []
        for nm in self.wavelengths_nm:
            low, high = (float(np.clip(nm / (ratio * period_nm) - sin_i, -1, 1)) for ratio in reversed(_WITHIN))
            first, last = np.clip(np.degrees(np.arcsin([low, high])), -_STEEPEST_DEG, _STEEPEST_DEG)
            # Angles are multiples of the step, independent of the search range.
            angles = np.arange(np.ceil(first / self.angle_step_deg), last / self.angle_step_deg) * self.angle_step_deg
            expected = nm / period_nm - sin_i
            if len(angles) < 3 or abs(expected) >= 1:
                continue
            radians = np.radians(angles)
            wo = np.stack([np.sin(radians), 0 * radians, np.cos(radians)], axis=-1)
            f = reflector.eval(question.wi(), wo, [nm])[:, 0]
            if not f.max() > 0:
                continue
            peak = float(angles[int(f.argmax())])
            grating = float(np.degrees(np.arcsin(expected)))
            rows.append({"wavelength_nm": nm, "peak_deg": round(peak, 9), "grating_deg": grating})
            spacings.append(nm / (sin_i + float(np.sin(np.radians(peak)))))
            errors.append(peak - grating)
        if not rows:
            raise WantError(
                f"no wavelength has a first order above the horizon for a period of {period_nm:g} nm and light "
                f"from {question.theta_i_deg:g} degrees"
            )
        answer = Answer({"angles": rows})
        answer.number("spacing_nm", float(np.mean(spacings)))
        answer.number("variance_nm2", float(np.var(spacings)))
        answer.number("period_nm", period_nm)
        answer.number("rms_error_deg", float(np.sqrt(np.mean(np.square(errors)))))
        return answer

    def _period_um(self, parameters: Any) -> float:
        """The expected period in µm, from the first source that has one. Raises :class:`WantError`."""
        if self.period_um is not None:
            return self.period_um
        given: Value | None = parameters.get("period") or _PRESET_PERIODS_UM.get(str(parameters.get("preset")))
        if given is not None:
            return float(given)
        if find_command() is None:
            raise WantError("the period is not known without the command sunbeam; give want.peaks.period_um")
        along_x = describe(parameters)["periods"]["x"]
        if along_x is None:
            raise WantError("the relief has no period along x; give want.peaks.period_um")
        return float(along_x["period_um"])
