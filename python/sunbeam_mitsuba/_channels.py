"""Channels of an instrument's file, and the choice of the one that holds the relief.

A channel is one map of values over the scan: heights, or a signal of the instrument such as phase or friction.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ._errors import SunbeamError
from ._relief import is_length

# Parts of the titles, in lower case, of signals that are no relief. Their unit may still be a length, as for the
# deflection of a cantilever. The native readers have the same list (crates/height_field/src/file/channel.rs); no test
# compares the two.
# fmt: off
_NO_RELIEF = (
    "error", "deflection", "amplitude", "phase", "friction", "lateral", "adhesion", "modulus", "dissipation",
    "deformation", "indentation", "potential", "current", "setpoint", "drive", "frequency", "stiffness", "bias",
)
# Parts of the titles of reliefs, in lower case, without blanks, `_` and `-`. The list is that of the native readers
# with "zaxis", which the manufacturer Nanosurf uses.
_RELIEF = ("height", "topo", "zsens", "zaxis", "elevation", "relief", "hauteur", "höhe", "altura")
# fmt: on
# Largest number of channels that a message lists. More would make the message, a single line, too long to read.
_LISTED = 16


@dataclass(frozen=True)
class Channel:
    """A channel of a file: number from 0, title, and unit of the values, which is empty if the file states none.

    ``can_be_heights`` is true for values that are lengths or have no unit.
    """

    number: int
    title: str
    unit: str
    can_be_heights: bool

    def __str__(self) -> str:
        return f'{self.number} "{self.title}" ({self.unit or "no unit"})'

    @property
    def rank(self) -> int | None:
        """Rank in the default choice, 0 to 3, the lowest first; ``None`` for a channel that is no relief.

        Lengths come before numbers without a unit. Within each of the two, titles of reliefs come before other titles.
        """
        title = self.title.lower()
        if not self.can_be_heights or any(part in title for part in _NO_RELIEF):
            return None
        joined = title.translate(str.maketrans("", "", " _-"))
        # As a part of titles, "z" would also be found in other words.
        has_relief_title = title == "z" or any(part in joined for part in _RELIEF)
        return (0 if self.unit else 2) + (0 if has_relief_title else 1)


def channel_of(info: Any) -> Channel:
    """Converts SurfaceTopography's description of a channel, a ``ChannelInfo``.

    Its readers mark values that are no lengths in two ways: by the channel's kind, or by a tuple as ``unit``, of the
    lateral unit and that of the values. ``data_unit`` is the unit of the values. If it is not a string, the unit of
    values that are no lengths is "no length", and that of other values is empty.
    """
    title = " ".join(str(info.name).split())
    may_be_lengths = info.is_height_channel and not isinstance(info.unit, tuple)
    if isinstance(info.data_unit, str):
        unit = info.data_unit
    elif may_be_lengths:
        unit = ""
    else:
        unit = "no length"
    return Channel(info.index, title, unit, may_be_lengths and (not unit or is_length(unit)))


def choose(channels: tuple[Channel, ...], wanted: int | str | None) -> Channel:
    """Finds the channel that is ``wanted``, or for ``None`` the first of the lowest rank.

    ``wanted`` is a number, or a title without regard to case. A number counts before an equal title. Raises
    :class:`SunbeamError` with a list of the channels where none fits, or where the wanted one cannot be heights.
    """
    available = "there are " + listed(channels)
    if wanted is None:
        ranked = [(channel.rank, channel.number, channel) for channel in channels if channel.rank is not None]
        if not ranked:
            raise SunbeamError(f"no channel is a height by its title and unit, choose one with channel; {available}")
        _, _, best = min(ranked, key=lambda entry: entry[:2])
        return best
    name = str(wanted).strip().lower()
    fitting = [channel for channel in channels if str(channel.number) == name]
    fitting += [channel for channel in channels if channel.title.lower() == name]
    if not fitting:
        raise SunbeamError(f'there is no channel "{wanted}"; {available}')
    if not fitting[0].can_be_heights:
        raise SunbeamError(f"channel {fitting[0]} is not a length; {available}")
    return fitting[0]


def listed(channels: Iterable[Channel]) -> str:
    """Names the first channels, at most _LISTED, and the number of the others in one line."""
    names = [str(channel) for channel in channels]
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return ", ".join(names[:_LISTED]) + more
