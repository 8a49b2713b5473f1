"""The parameters that a surface and its settings may have, and the values that each accepts.

The library decides what it accepts (``src/config/``); these are the same limits, so that a range which crosses one is
refused before anything is computed. A test holds them against the library's own messages.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Union

from .errors import SweepError

#: What a parameter may be.
Value = Union[str, float, bool]


@dataclass(frozen=True)
class Numbers:
    """Numbers from ``low`` to ``high``; ``open_low`` and ``open_high`` leave the end itself out."""

    low: float
    high: float
    unit: str = ""
    open_low: bool = False
    open_high: bool = False

    def accepts(self, value: object) -> bool:
        """Whether the value is a finite number in the range."""
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            return False
        above = value > self.low if self.open_low else value >= self.low
        below = value < self.high if self.open_high else value <= self.high
        return above and below

    def __str__(self) -> str:
        first, last = "(" if self.open_low else "[", ")" if self.open_high else "]"
        unit = f" in {self.unit}" if self.unit else ""
        return f"a number{unit} in {first}{self.low:g}, {self.high:g}{last}"


@dataclass(frozen=True)
class Words:
    """One of these words."""

    words: tuple[str, ...]

    def accepts(self, value: object) -> bool:
        """Whether the value is one of the words."""
        return value in self.words

    def __str__(self) -> str:
        return "one of " + ", ".join(self.words)


@dataclass(frozen=True)
class Text:
    """Any text that is not empty."""

    def accepts(self, value: object) -> bool:
        """Whether the value is text."""
        return isinstance(value, str) and value != ""

    def __str__(self) -> str:
        return "a text"


@dataclass(frozen=True)
class Truth:
    """True or false."""

    def accepts(self, value: object) -> bool:
        """Whether the value is one of the two."""
        return isinstance(value, bool)

    def __str__(self) -> str:
        return "true or false"


Accepted = Union[Numbers, Words, Text, Truth]

_LENGTH = Numbers(0, 1e3, "µm", open_low=True)

#: What says where the heights come from; a surface's alone.
SOURCE: dict[str, Accepted] = {
    "preset": Words(("blazed", "sinusoidal", "lamellar", "cd", "elaphe", "xenopeltis", "flat")),
    "filename": Text(),
}
#: What the library takes besides, whichever interface asks (µm where it is a length).
SURFACE: dict[str, Accepted] = {
    "period": _LENGTH,
    "height": _LENGTH,
    "region_size": Numbers(3, 33, "µm"),
    "region_spread": Numbers(0, 0.1),
    "pixel_size": _LENGTH,
    "max_height": _LENGTH,
    "channel": Text(),
    "fill": Words(("none", "laplace", "mean")),
    "level": Words(("none", "mean", "plane", "quadratic", "lines")),
    "tiling": Words(("periodic", "aperiodic")),
    "theory": Words(("scalar", "rigorous")),
    "coherence_length": Numbers(1e-3, 1e5, "µm"),
    "model": Words(("ensemble", "patch")),
    "obliquity": Words(("auto", "stam", "small_slope", "unit")),
    "conserve_energy": Truth(),
    "shadowing": Truth(),
    "eta": Numbers(1e-3, 1e3),
    "k": Numbers(0, 1e3),
    "tolerance": Numbers(1e-6, 0.1),
    "build_limit": Numbers(1, 1e6),
}
#: What only Mitsuba's BSDF knows.
SCENE: dict[str, Accepted] = {
    "material": Text(),
    "specular_reflectance": Numbers(0, 1),
    "diffuse_reflectance": Numbers(0, 1),
    "rotation": Numbers(-360, 360, "degrees"),
}
#: The direction of the light, in the surface's frame: (sin θ cos φ, sin θ sin φ, cos θ).
LIGHT: dict[str, Accepted] = {
    "theta_i_deg": Numbers(0, 90, "degrees", open_high=True),
    "phi_i_deg": Numbers(-360, 360, "degrees"),
}
#: All of them, in the order of the table's columns.
PARAMETERS: dict[str, Accepted] = {**SOURCE, **SURFACE, **SCENE, **LIGHT}


def check_value(where: str, name: str, value: object) -> Value:
    """The value, where the parameter accepts it.

    Raises :class:`SweepError` with the place in the specification, the parameter, the value and what is accepted.
    """
    accepted = PARAMETERS[name]
    if not accepted.accepts(value):
        raise SweepError(f"{where}: {name} is {shown(value)}, but must be {accepted}")
    return float(value) if isinstance(accepted, Numbers) else value  # type: ignore[arg-type,return-value]


def shown(value: object) -> str:
    """A value as a message has it."""
    return f"{value:g}" if isinstance(value, float) else repr(value)


def check_keys(where: str, given: object, accepted: tuple[str, ...] | list[str]) -> dict[str, object]:
    """The table, where it is one and has no other keys than these.

    Raises :class:`SweepError` with the first key that is unknown and those that are accepted.
    """
    if not isinstance(given, dict):
        raise SweepError(f"{where} must be a table, but is {shown(given)}")
    for key in given:
        if key not in accepted:
            raise SweepError(f"{where}: unknown key {key!r}; accepted are {', '.join(accepted)}")
    return given
