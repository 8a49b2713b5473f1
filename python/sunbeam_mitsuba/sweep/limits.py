"""Parameters of surfaces and settings, with the values that each accepts.

A *setting* is a combination of parameters under which every surface of a sweep is computed (spec.py). docs/plugin.md
explains the parameters. The limits repeat those of the library (``src/config/``), so that a sweep refuses a range
beyond a limit before it computes anything. ``tests/test_sweep_spec.py`` compares them with the library's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Union

from .errors import SweepError

#: Types of a parameter's value. ``Union`` is needed since Python 3.9 cannot evaluate ``str | float``.
Value = Union[str, float, bool]


@dataclass(frozen=True)
class Numbers:
    """Numbers from ``low`` to ``high``, both finite, in ``unit``; ``open_low`` and ``open_high`` exclude that end.

    With ``whole`` they are integers, not ``float``.
    """

    low: float
    high: float
    unit: str = ""
    open_low: bool = False
    open_high: bool = False
    whole: bool = False

    def accepts(self, value: object) -> bool:
        """Whether the value is a number in the range. Comparisons with NaN are false."""
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return False
        if self.whole and not isinstance(value, int):
            return False
        above = value > self.low if self.open_low else value >= self.low
        below = value < self.high if self.open_high else value <= self.high
        return above and below

    def __str__(self) -> str:
        first, last = "(" if self.open_low else "[", ")" if self.open_high else "]"
        unit = f" in {self.unit}" if self.unit else ""
        kind = "a whole number" if self.whole else "a number"
        return f"{kind}{unit} in {first}{self.low:g}, {self.high:g}{last}"


@dataclass(frozen=True)
class Words:
    """A choice of some texts, each one word."""

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
        """Whether the value is a text that is not empty."""
        return isinstance(value, str) and value != ""

    def __str__(self) -> str:
        return "a text"


@dataclass(frozen=True)
class NumberOrText:
    """A number within limits, or any text that is not empty."""

    numbers: Numbers

    def accepts(self, value: object) -> bool:
        """Whether the value is such a number or text."""
        return self.numbers.accepts(value) or Text().accepts(value)

    def __str__(self) -> str:
        return f"{self.numbers} or a text"


@dataclass(frozen=True)
class Truth:
    """A truth value."""

    def accepts(self, value: object) -> bool:
        """Whether the value is true or false."""
        return isinstance(value, bool)

    def __str__(self) -> str:
        return "true or false"


#: Accepted values of a parameter. Its text completes "must be …" in messages.
Accepted = Union[Numbers, Words, Text, NumberOrText, Truth]

#: Accepted lengths of a relief.
LENGTH_UM = Numbers(0, 1e3, "µm", open_low=True)

#: Sources of the heights, which belong to a surface and not to a setting.
SOURCE: dict[str, Accepted] = {
    "preset": Words(("blazed", "sinusoidal", "lamellar", "cd", "elaphe", "xenopeltis", "flat")),
    "filename": Text(),
}
#: The library's other parameters, common to all interfaces. They belong to a surface or to a setting.
SURFACE: dict[str, Accepted] = {
    "period": LENGTH_UM,
    "height": LENGTH_UM,
    "region_size": Numbers(3, 33, "µm"),
    "region_spread": Numbers(0, 0.1),
    "pixel_size": LENGTH_UM,
    "max_height": LENGTH_UM,
    # Its number in the file, or its title.
    "channel": NumberOrText(Numbers(0, 1e3, whole=True)),
    "fill": Words(("none", "laplace", "mean")),
    "level": Words(("none", "mean", "plane", "quadratic", "lines")),
    "tiling": Words(("periodic", "aperiodic")),
    "scale": Numbers(1e-3, 1),
    "depth": Numbers(1e-3, 1),
    "theory": Words(("scalar", "rigorous")),
    "coherence_length": Numbers(1e-3, 1e5, "µm"),
    "model": Words(("ensemble", "patch")),
    "obliquity": Words(("auto", "stam", "small_slope", "unit")),
    "conserve_energy": Truth(),
    "shadowing": Truth(),
    "eta": Numbers(1e-3, 1e3),
    "k": Numbers(0, 1e3),
    "cover_eta": Numbers(1, 2.6),
    "transmission": Words(("none", "film", "interface")),
    "tolerance": Numbers(1e-6, 0.1),
    "build_limit": Numbers(1, 1e6),
}
#: Parameters of Mitsuba's BSDF alone. They belong to a surface or to a setting.
BSDF_ONLY: dict[str, Accepted] = {
    "material": Text(),
    # Refractive indices, or names of media.
    "int_ior": NumberOrText(Numbers(1, 4)),
    "ext_ior": NumberOrText(Numbers(1, 4)),
    "cover_reflection": Truth(),
    "back_reflection": Truth(),
    "specular_reflectance": Numbers(0, 1),
    "specular_transmittance": Numbers(0, 1),
    "diffuse_reflectance": Numbers(0, 1),
    "rotation": Numbers(-360, 360, "degrees"),
}
#: Angles of the direction towards the light in the surface's frame, (sin θ cos φ, sin θ sin φ, cos θ). They belong to a
#: setting.
LIGHT: dict[str, Accepted] = {
    "theta_i_deg": Numbers(0, 90, "degrees", open_high=True),
    "phi_i_deg": Numbers(-360, 360, "degrees"),
}
#: All parameters in the order of the columns of a sweep's results.
PARAMETERS: dict[str, Accepted] = {**SOURCE, **SURFACE, **BSDF_ONLY, **LIGHT}


def check_value(where: str, name: str, value: object) -> Value:
    """Returns the value if the parameter ``name`` accepts it, as ``float`` if it accepts numbers alone.

    Raises :class:`SweepError` otherwise. ``where`` names the specification's table in the message.
    """
    accepted = PARAMETERS[name]
    if not accepted.accepts(value):
        raise SweepError(f"{where}: {name} is {shown(value)}, but must be {accepted}")
    return float(value) if isinstance(accepted, Numbers) else value  # type: ignore[arg-type,return-value]


def check_whole(where: str, value: object, low: int, high: int) -> int:
    """Returns the value if it is an integer from ``low`` to ``high``.

    Raises :class:`SweepError` otherwise. ``where`` names the value in the message.
    """
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise SweepError(f"{where} is {shown(value)}, but must be a whole number from {low} to {high}")
    return value


def shown(value: object) -> str:
    """The value as text for a message, a ``float`` with six digits."""
    return f"{value:g}" if isinstance(value, float) else repr(value)


def check_keys(where: str, given: object, accepted: tuple[str, ...] | list[str]) -> dict[str, object]:
    """Returns ``given`` if it is a table and all its keys are accepted.

    Raises :class:`SweepError` otherwise. ``where`` names the table in the message.
    """
    if not isinstance(given, dict):
        raise SweepError(f"{where} must be a table, but is {shown(given)}")
    for key in given:
        if key not in accepted:
            raise SweepError(f"{where}: unknown key {key!r}; accepted are {', '.join(accepted)}")
    return given
