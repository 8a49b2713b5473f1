"""What every wanted figure has in common."""

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

#: Wavelengths in nm that may be asked for: those that the observer sees.
VISIBLE_NM = Numbers(380, 780, "nm")


class WantError(ValueError):
    """A figure cannot be had for this case; the message is one line. The case's other figures stand."""


@dataclass(frozen=True)
class Column:
    """A column of the table: its name, its kind (a key of ``report.KINDS``) and what it holds, with the unit."""

    name: str
    kind: str
    meaning: str


@dataclass
class Answer:
    """What was found: figures by column, pictures as the bytes of files, and small PNGs of these for the sheet.

    Keys of ``pictures`` end the files' names, such as ``map.exr``.
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
    """A case as a want sees it: its parameters, with the file's full path, and its tables where it asks for them."""

    parameters: Mapping[str, Value]
    theta_i_deg: float
    phi_i_deg: float

    @abstractmethod
    def reflector(self) -> Reflector:
        """The surface, built at the first call and held for later cases.

        Raises ``SunbeamError`` or :class:`ReflectorError` where it is refused.
        """

    def wi(self) -> list[float]:
        """The direction of the light in the surface's frame."""
        theta, phi = math.radians(self.theta_i_deg), math.radians(self.phi_i_deg)
        return [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]


class Want(ABC):
    """A kind of figure, with its options."""

    #: Its name in ``[want.NAME]`` and at the beginning of its columns.
    name: ClassVar[str]
    #: Whether it asks the command ``sunbeam``.
    needs_command: ClassVar[bool] = False

    @classmethod
    @abstractmethod
    def read(cls, table: object, folder: Path) -> Want:
        """Reads the options of ``[want.NAME]``. Raises :class:`SweepError` for what is unknown or out of range."""

    @abstractmethod
    def identity(self) -> dict[str, Any]:
        """All that decides what is computed, as JSON knows it."""

    @abstractmethod
    def columns(self) -> list[Column]:
        """Its columns, named without the want's own name."""

    @abstractmethod
    def compute(self, question: Question) -> Answer:
        """The figures of a case.

        Raises :class:`WantError`, ``SunbeamError``, ``CommandError`` or :class:`ReflectorError` with one line.
        """

    def check_parameters(self, names: set[str], values: Mapping[str, set[Value]]) -> None:
        """Refuses, with :class:`SweepError`, parameters that it cannot take into account; of itself it takes all."""
        return

    def check_here(self) -> None:
        """Refuses, with :class:`SweepError`, a machine that lacks what it needs; of itself it needs nothing."""
        return


class Options:
    """Reads the options of one ``[want.NAME]``, and refuses those that are unknown."""

    def __init__(self, name: str, table: object, accepted: list[str]):
        self.where = f"want.{name}"
        self.table = check_keys(self.where, table, accepted)

    def number(self, key: str, default: float, accepted: Accepted) -> float:
        """A number, in the range."""
        return float(self._checked(key, default, accepted))

    def whole(self, key: str, default: int, low: int, high: int) -> int:
        """A whole number, in the range."""
        value = self.table.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise SweepError(f"{self.where}: {key} is {shown(value)}, but must be a whole number from {low} to {high}")
        return value

    def choice(self, key: str, default: str, accepted: Accepted) -> str:
        """A word, one of those accepted."""
        return str(self._checked(key, default, accepted))

    def truth(self, key: str, default: bool) -> bool:
        """True or false."""
        value = self.table.get(key, default)
        if not isinstance(value, bool):
            raise SweepError(f"{self.where}: {key} is {shown(value)}, but must be true or false")
        return value

    def wavelengths_nm(self, default: tuple[float, ...], most: int) -> tuple[float, ...]:
        """The list ``wavelengths_nm``, each of them visible."""
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
