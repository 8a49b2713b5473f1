"""The interface of wanted figures, and the reader of their options.

A *want* is a group of figures with its options, the TOML table ``[want.NAME]`` of a specification. Each want declares
columns of the results. For a *question*, one case (a surface in light from one direction), it computes an *answer*:
figures and pictures.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from ..errors import SweepError
from ..limits import Accepted, Numbers, Truth, Value, check_keys, check_whole, shown
from ..reflector import Reflector

# Wavelengths accepted in options: the visible ones.
_VISIBLE_NM = Numbers(380, 780, "nm")
# Largest number of wavelengths in an option: each whole nm of _VISIBLE_NM.
_WAVELENGTHS_MAX = 401
# Accepted exposures. Zero stands for automatic exposure, so it is excluded.
_EXPOSURE = Numbers(0, 1e9, open_low=True)


class WantError(ValueError):
    """A want has no answer for this case; the message is one line. The answers of the other wants stay valid."""


@dataclass(frozen=True)
class Column:
    """A column of the results."""

    name: str
    #: A key of ``report.KINDS``, which gives its Arrow type.
    kind: str
    #: Meaning with unit, in a few words.
    meaning: str


@dataclass
class Answer:
    """Results of a want for one case."""

    #: Values by name of their column, without the want's prefix, of the Arrow type of its kind. Missing ones are null.
    figures: dict[str, Any] = field(default_factory=dict)
    #: Contents of files by the ending of their name, such as ``map.exr``.
    pictures: dict[str, bytes] = field(default_factory=dict)
    #: Small PNGs by the title of their column on the contact sheet.
    thumbnails: dict[str, bytes] = field(default_factory=dict)

    def number(self, name: str, value: float) -> None:
        """Adds the figure of the column ``name``. Raises :class:`WantError` where it is not finite."""
        if not math.isfinite(value):
            raise WantError(f"{name} is {value}, which is no finite number")
        self.figures[name] = float(value)


class Question(ABC):
    """A case for a want."""

    #: Parameters of the surface and angles of the light; ``filename`` is an absolute path.
    parameters: Mapping[str, Value]
    #: Angle between the direction towards the light and the normal.
    theta_i_deg: float
    #: Azimuth of the direction towards the light, from the x axis towards the y axis.
    phi_i_deg: float

    @abstractmethod
    def reflector(self) -> Reflector:
        """The surface, built at the first call and cached for later cases.

        Raises ``SunbeamError`` or ``ReflectorError`` where the surface is refused.
        """

    def wi(self) -> list[float]:
        """Unit vector towards the light in the surface's frame."""
        theta, phi = math.radians(self.theta_i_deg), math.radians(self.phi_i_deg)
        return [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]


class Want(ABC):
    """A group of figures, with its options."""

    #: Name in ``[want.NAME]``, and prefix of the columns.
    name: ClassVar[str]

    @classmethod
    @abstractmethod
    def read(cls, table: object, folder: Path) -> Want:
        """Reads the TOML table ``[want.NAME]``, in which file names are relative to ``folder``.

        Raises :class:`SweepError` for unknown keys and values out of range.
        """

    @abstractmethod
    def identity(self) -> dict[str, Any]:
        """The options that determine the results, as a JSON object: a part of the identity of a case."""

    @abstractmethod
    def columns(self) -> list[Column]:
        """Columns of the figures in order, their names without the prefix."""

    @abstractmethod
    def compute(self, question: Question) -> Answer:
        """Computes the figures of a case.

        Raises :class:`WantError`, ``SunbeamError``, ``CommandError`` or ``ReflectorError`` with a message of one line.
        """

    def check_parameters(self, names: set[str], values: Mapping[str, set[Value]]) -> None:
        """Raises :class:`SweepError` for parameters that the want cannot take into account.

        ``names`` are those of all parameters of the sweep, and ``values`` their values (of a sampled range both ends).
        By default all are accepted.
        """
        return

    def check_here(self) -> None:
        """Raises :class:`SweepError` where this machine lacks a requirement; by default there is none."""
        return


class Options:
    """Reader of the options of one ``[want.NAME]``.

    Its methods return the option ``key``, or ``default`` where it is missing, and raise :class:`SweepError` for a value
    that is not accepted.
    """

    def __init__(self, name: str, table: object, accepted: list[str]):
        """Raises :class:`SweepError` for keys of the TOML table that are not ``accepted``."""
        self.where = f"want.{name}"
        self.table = check_keys(self.where, table, accepted)

    def number(self, key: str, default: float, accepted: Accepted) -> float:
        """A number within ``accepted``."""
        return float(self._checked(key, default, accepted))

    def optional_number(self, key: str, accepted: Accepted) -> float | None:
        """A number within ``accepted``; ``None`` where it is missing."""
        return None if self.table.get(key) is None else float(self._checked(key, None, accepted))

    def whole(self, key: str, default: int, low: int, high: int) -> int:
        """A whole number from ``low`` to ``high``."""
        return check_whole(f"{self.where}: {key}", self.table.get(key, default), low, high)

    def choice(self, key: str, default: str, accepted: Accepted) -> str:
        """A text that is accepted."""
        return str(self._checked(key, default, accepted))

    def truth(self, key: str, default: bool) -> bool:
        """A truth value."""
        return bool(self._checked(key, default, Truth()))

    def exposure(self) -> float:
        """The option ``exposure``, a factor on linear sRGB; 0 where it is missing, for automatic exposure."""
        return self.optional_number("exposure", _EXPOSURE) or 0.0

    def wavelengths_nm(self, default: tuple[float, ...]) -> tuple[float, ...]:
        """The option ``wavelengths_nm``, a wavelength or a list of at most _WAVELENGTHS_MAX."""
        given = self.table.get("wavelengths_nm", list(default))
        listed = given if isinstance(given, list) else [given]
        if not 1 <= len(listed) <= _WAVELENGTHS_MAX or not all(_VISIBLE_NM.accepts(value) for value in listed):
            accepted = f"a list of at most {_WAVELENGTHS_MAX}, each {_VISIBLE_NM}"
            raise SweepError(f"{self.where}: wavelengths_nm is {shown(given)}, but must be {accepted}")
        return tuple(float(value) for value in listed)

    def _checked(self, key: str, default: Any, accepted: Accepted) -> Any:
        """The option as it was given, or the default; either must be accepted."""
        value = self.table.get(key, default)
        if not accepted.accepts(value):
            raise SweepError(f"{self.where}: {key} is {shown(value)}, but must be {accepted}")
        return value
