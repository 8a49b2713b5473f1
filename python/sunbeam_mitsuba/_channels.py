"""The channels of an instrument's file, and which of them is the relief."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ._errors import SunbeamError
from ._relief import is_length

# Parts of titles, in lower case, of signals that are no relief even where their unit is a length. Both lists are those
# of the native readers (crates/height_field/src/file/channel.rs).
# fmt: off
_NO_RELIEF = (
    "error", "deflection", "amplitude", "phase", "friction", "lateral", "adhesion", "modulus", "dissipation",
    "deformation", "indentation", "potential", "current", "setpoint", "drive", "frequency", "stiffness", "bias",
)
# Parts of titles, in lower case and without blanks, of reliefs; the axis is Nanosurf's.
_RELIEF = ("height", "topo", "zsens", "zaxis", "elevation", "relief", "hauteur", "höhe", "altura")
# fmt: on
# Channels that a message lists at most.
_LISTED = 16


@dataclass(frozen=True)
class Channel:
    """A channel of a file: its number from 0, its title, the unit of its values (empty where the file tells none), and
    whether these can be heights: lengths, or numbers without a unit."""

    number: int
    title: str
    unit: str
    can_be_heights: bool

    def __str__(self) -> str:
        return f'{self.number} "{self.title}" ({self.unit or "no unit"})'

    @property
    def rank(self) -> int | None:
        """Place in the order in which channels are taken by default, the lowest first; ``None`` for what is no relief.

        Titles of reliefs go before others, and lengths before numbers without a unit.
        """
        title = self.title.lower()
        if not self.can_be_heights or any(part in title for part in _NO_RELIEF):
            return None
        words = title.translate(str.maketrans("", "", " _-"))
        titled = title == "z" or any(part in words for part in _RELIEF)
        return (0 if titled else 1) + (0 if self.unit else 2)


def channel_of(info: Any) -> Channel:
    """A channel from SurfaceTopography's description of it, a ``ChannelInfo``.

    Some of its readers mark values that are no lengths by a pair in place of the unit, others by the channel's kind.
    """
    title = " ".join(str(info.name).split())
    lengths = info.is_height_channel and not isinstance(info.unit, tuple)
    unit = info.data_unit if isinstance(info.data_unit, str) else "" if lengths else "no length"
    return Channel(info.index, title, unit, lengths and (not unit or is_length(unit)))


def choose(channels: tuple[Channel, ...], wanted: int | str | None) -> Channel:
    """The channel of this number or title, or by default the first of the lowest rank.

    Raises :class:`SunbeamError` with a list of the channels where none fits, or what fits can be no heights.
    """
    there_are = "there are " + listed(channels)
    if wanted is None:
        ranked = [(channel.rank, channel.number, channel) for channel in channels if channel.rank is not None]
        if not ranked:
            raise SunbeamError(f"no channel is a height by its title and unit, choose one with channel; {there_are}")
        return min(ranked, key=lambda entry: entry[:2])[2]
    name = str(wanted).strip().lower()
    fitting = [channel for channel in channels if str(channel.number) == name]
    fitting += [channel for channel in channels if channel.title.lower() == name]
    if not fitting:
        raise SunbeamError(f'there is no channel "{wanted}"; {there_are}')
    if not fitting[0].can_be_heights:
        raise SunbeamError(f"channel {fitting[0]} is not a length; {there_are}")
    return fitting[0]


def listed(channels: Iterable[Channel]) -> str:
    """Channels in one line, the first 16 of them."""
    names = [str(channel) for channel in channels]
    return ", ".join(names[:_LISTED]) + (f" and {len(names) - _LISTED} more" if len(names) > _LISTED else "")
