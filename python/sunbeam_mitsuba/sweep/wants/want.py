"""The interface of wanted figures, and the reader of their options.

A *want* is a kind of figure with its options (``[want.NAME]`` of a specification). It declares columns of the table and
answers a *question*, one case, with figures and pictures.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from ..errors import SweepError
from ..limits import Accepted, Numbers, Value, check_keys, shown
from ..reflector import Reflector, ReflectorError

#: Wavelengths accepted in options, those that the CIE observer sees.
VISIBLE_NM = Numbers(380, 780, "nm")


class WantError(ValueError):
    """A figure is not available for this case; the message is one line. The case's other figures stay valid."""


@dataclass(frozen=True)
class Column:
    """A column of the table: name, kind (a key of ``report.KINDS``), and meaning with unit."""

    name: str
    kind: str
    meaning: str


@dataclass
class Answer:
    """Results of a want: figures by column, pictures as encoded files, and their thumbnails as PNG for the sheet.

    Keys of ``pictures`` are endings of file names, such as ``map.exr``.
    """

    figures: dict[str, Any] = field(default_factory=dict)
    pictures: dict[str, bytes] = field(default_factory=dict)
    thumbnails: dict[str, bytes] = field(default_factory=dict)

    def number(self, name: str, value: float) -> None:
        """Adds a figure. Raises :class:`WantError` where it is not finite."""
        if not math.isfinite(value):
            raise WantError(f"{name} is {value}, which is no finite number")
        self.figures[name] = float(value)


class Question(ABC):
    """A case for a want: its parameters, with the file's absolute path, and its surface on demand."""

    parameters: Mapping[str, Value]
    theta_i_deg: float
    phi_i_deg: float

    @abstractmethod
    def reflector(self) -> Reflector:
        """The surface, built at the first call and cached for later cases.

        Raises ``SunbeamError`` or :class:`ReflectorError` where the surface is refused.
        """

    def wi(self) -> list[float]:
        """Unit vector towards the light in the surface's frame."""
        theta, phi = math.radians(self.theta_i_deg), math.radians(self.phi_i_deg)
        return [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]


class Want(ABC):
    """A kind of figure, with its options."""

    #: Name in ``[want.NAME]``, and prefix of the columns.
    name: ClassVar[str]
    #: Whether computing needs the command ``sunbeam``.
    needs_command: ClassVar[bool] = False

    @classmethod
    @abstractmethod
    def read(cls, table: object, folder: Path) -> Want:
        """Reads the options of ``[want.NAME]``. Raises :class:`SweepError` for unknown keys and values out of range."""

    @abstractmethod
    def identity(self) -> dict[str, Any]:
        """The options that determine the results, as a JSON object."""

    @abstractmethod
    def columns(self) -> list[Column]:
        """Columns of the figures, without the prefix of their names."""

    @abstractmethod
    def compute(self, question: Question) -> Answer:
        """Computes the figures of a case.

        Raises :class:`WantError`, ``SunbeamError``, ``CommandError`` or :class:`ReflectorError` with one line.
        """

    def check_parameters(self, names: set[str], values: Mapping[str, set[Value]]) -> None:
        """Raises :class:`SweepError` for parameters that the figure cannot respect; by default there are none."""
        return

    def check_here(self) -> None:
        """Raises :class:`SweepError` where this machine lacks a requirement; by default there are none."""
        return


class Options:
    """Reader of the options of one ``[want.NAME]``; refuses unknown keys."""

    def __init__(self, name: str, table: object, accepted: list[str]):
        self.where = f"want.{name}"
        self.table = check_keys(self.where, table, accepted)

    def number(self, key: str, default: float, accepted: Accepted) -> float:
        """A number within ``accepted``."""
        return float(self._checked(key, default, accepted))

    def whole(self, key: str, default: int, low: int, high: int) -> int:
        """A whole number from ``low`` to ``high``."""
        value = self.table.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise SweepError(f"{self.where}: {key} is {shown(value)}, but must be a whole number from {low} to {high}")
        return value

    def choice(self, key: str, default: str, accepted: Accepted) -> str:
        """One of the accepted words."""
        return str(self._checked(key, default, accepted))

    def truth(self, key: str, default: bool) -> bool:
        """A truth value."""
        value = self.table.get(key, default)
        if not isinstance(value, bool):
            raise SweepError(f"{self.where}: {key} is {shown(value)}, but must be true or false")
        return value

    def wavelengths_nm(self, default: tuple[float, ...], most: int) -> tuple[float, ...]:
        """The list ``wavelengths_nm`` of at most ``most`` visible wavelengths."""
        given = self.table.get("wavelengths_nm", list(default))
        listed = given if isinstance(given, list) else [given]
        if not 1 <= len(listed) <= most or not all(VISIBLE_NM.accepts(value) for value in listed):
            accepted = f"a list of at most {most}, each {VISIBLE_NM}"
            raise SweepError(f"{self.where}: wavelengths_nm is {shown(given)}, but must be {accepted}")
        return tuple(float(value) for value in listed)

    def _checked(self, key: str, default: Any, accepted: Accepted) -> Any:
        value = self.table.get(key, default)
        if not accepted.accepts(value):
            raise SweepError(f"{self.where}: {key} is {shown(value)}, but must be {accepted}")
        return value


__all__ = [
    "VISIBLE_NM",
    "Answer",
    "Column",
    "Options",
    "Question",
    "Reflector",
    "ReflectorError",
    "Want",
    "WantError",
]
