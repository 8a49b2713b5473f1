"""Channels of an instrument's file, and the choice of the one that holds the relief."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ._errors import SunbeamError
from ._relief import is_length

# Both lists equal those of the native readers (crates/height_field/src/file/channel.rs).
# Lower-case parts of the titles of error signals, which are no reliefs even if their unit is a length.
# fmt: off
_NO_RELIEF = (
    "error", "deflection", "amplitude", "phase", "friction", "lateral", "adhesion", "modulus", "dissipation",
    "deformation", "indentation", "potential", "current", "setpoint", "drive", "frequency", "stiffness", "bias",
)
# Lower-case parts, without blanks, of the titles of reliefs; "zaxis" is Nanosurf's.
_RELIEF = ("height", "topo", "zsens", "zaxis", "elevation", "relief", "hauteur", "höhe", "altura")
# fmt: on
# Largest number of channels that a message lists. Chosen, for a message of one line.
_LISTED = 16


@dataclass(frozen=True)
class Channel:
    """A channel of a file: number from 0, title, and unit, which is empty if the file states none.

    ``can_be_heights`` holds for values that are lengths or have no unit.
    """

    number: int
    title: str
    unit: str
    can_be_heights: bool

    def __str__(self) -> str:
        return f'{self.number} "{self.title}" ({self.unit or "no unit"})'

    @property
    def rank(self) -> int | None:
        """Rank in the default choice, the lowest first; ``None`` for a channel that is no relief.

        Titles of reliefs come before other titles, and lengths before numbers without a unit.
        """
        title = self.title.lower()
        if not self.can_be_heights or any(part in title for part in _NO_RELIEF):
            return None
        words = title.translate(str.maketrans("", "", " _-"))
        titled = title == "z" or any(part in words for part in _RELIEF)
        return (0 if titled else 1) + (0 if self.unit else 2)


def channel_of(info: Any) -> Channel:
    """Converts SurfaceTopography's description of a channel, a ``ChannelInfo``.

    Some readers mark values that are no lengths by a pair in place of the unit, others by the channel's kind.
    """
    title = " ".join(str(info.name).split())
    lengths = info.is_height_channel and not isinstance(info.unit, tuple)
    unit = info.data_unit if isinstance(info.data_unit, str) else "" if lengths else "no length"
    return Channel(info.index, title, unit, lengths and (not unit or is_length(unit)))


def choose(channels: tuple[Channel, ...], wanted: int | str | None) -> Channel:
    """Finds the channel with the number or title ``wanted``, or by default the first of the lowest rank.

    Raises :class:`SunbeamError` with a list of the channels where none fits, or where its values are no heights.
    """
    available = "there are " + listed(channels)
    if wanted is None:
        ranked = [(channel.rank, channel.number, channel) for channel in channels if channel.rank is not None]
        if not ranked:
            raise SunbeamError(f"no channel is a height by its title and unit, choose one with channel; {available}")
        return min(ranked, key=lambda entry: entry[:2])[2]
    name = str(wanted).strip().lower()
    fitting = [channel for channel in channels if str(channel.number) == name]
    fitting += [channel for channel in channels if channel.title.lower() == name]
    if not fitting:
        raise SunbeamError(f'there is no channel "{wanted}"; {available}')
    if not fitting[0].can_be_heights:
        raise SunbeamError(f"channel {fitting[0]} is not a length; {available}")
    return fitting[0]


def listed(channels: Iterable[Channel]) -> str:
    """Names the first 16 channels in one line."""
    names = [str(channel) for channel in channels]
    return ", ".join(names[:_LISTED]) + (f" and {len(names) - _LISTED} more" if len(names) > _LISTED else "")
