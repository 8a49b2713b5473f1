"""The surfaces that a worker holds, and what their tables take."""

from __future__ import annotations

import json
import os
import time
from collections import OrderedDict
from collections.abc import Iterable, Mapping

from .._errors import SunbeamError
from .command import CommandError, describe, find_command
from .instruments import converted
from .limits import LIGHT, Value
from .reflector import Reflector, make_reflector

#: Peak of memory while tables are built, over the size of the finished table of spectra that is estimated: knots as
#: complex numbers in double precision, grids of transforms, the sampler and the albedo.
BUILD_PEAK = 6.0
#: What a worker needs besides: Python, Mitsuba, and one batch of directions, in bytes.
WORKER_BYTES = 0.6e9
#: Share of a worker's memory for the tables that it holds, so that building one and a picture still fit.
HELD_SHARE = 0.5
# Surfaces whose tables take some megabytes whatever their numbers are, up to this coherence length: nobody is asked.
_SMALL_PRESETS = ("flat", "sinusoidal", "blazed", "lamellar")
_SMALL_COHERENCE_UM = 1000.0
# Most surfaces that are asked for an estimate before the workers start; workers ask all the others.
_ASKED_BEFORE = 32


class TooLarge(ValueError):
    """Tables that do not fit into the worker's memory; the message is one line with the estimate."""


def estimated_bytes(parameters: Mapping[str, Value]) -> float:
    """Peak of memory in bytes while the tables are built, or 0 for a surface that is small in any case or unknown.

    The estimate of the table is the library's own, through ``sunbeam height-field``; without the command nothing is
    known before the library refuses what takes more than its build limit. Raises :class:`CommandError` where the
    surface is refused.
    """
    coherence_um = float(parameters.get("coherence_length", 65.0))
    if parameters.get("theory") == "rigorous" or find_command() is None:
        return 0.0
    if parameters.get("preset") in _SMALL_PRESETS and coherence_um <= _SMALL_COHERENCE_UM:
        return 0.0
    return BUILD_PEAK * float(describe(parameters)["table_bytes_estimate"])


def largest_estimate(surfaces: Iterable[Mapping[str, Value]]) -> float:
    """The largest estimate in bytes of these surfaces: of the 32 with the largest files and coherence lengths.

    Surfaces that are refused count as nothing, since they become rows with an error.
    """

    def size(parameters: Mapping[str, Value]) -> tuple[float, float]:
        name = str(parameters.get("filename", ""))
        stored = os.path.getsize(name) if name and os.path.exists(name) else 0
        return stored, float(parameters.get("coherence_length", 65.0))

    largest = 0.0
    for parameters in sorted(surfaces, key=size, reverse=True)[:_ASKED_BEFORE]:
        try:
            largest = max(largest, estimated_bytes(converted(parameters)))
        except (CommandError, SunbeamError):
            continue
    return largest


class HeldSurfaces:
    """Surfaces by their parameters, the least recently used given up where memory is short.

    ``memory_bytes`` is the worker's limit, or 0 for none.
    """

    def __init__(self, memory_bytes: float):
        self.memory_bytes = memory_bytes
        #: Seconds spent on building, or reading from the cache, since the object was made.
        self.seconds = 0.0
        self._held: OrderedDict[str, tuple[Reflector, float]] = OrderedDict()

    def get(self, parameters: Mapping[str, Value]) -> Reflector:
        """The surface, built where it is not held.

        Raises :class:`TooLarge` where its tables do not fit, and what the library refuses.
        """
        key = _key(parameters)
        if key in self._held:
            self._held.move_to_end(key)
            return self._held[key][0]
        start = time.perf_counter()
        try:
            expected = self._checked(parameters) if self.memory_bytes else 0.0
            self._make_room(expected / BUILD_PEAK)
            made = make_reflector(parameters)
            self._held[key] = (made, made.table_bytes)
            self._make_room(0.0)
        finally:
            self.seconds += time.perf_counter() - start
        return made

    def __len__(self) -> int:
        return len(self._held)

    def _checked(self, parameters: Mapping[str, Value]) -> float:
        expected = estimated_bytes(parameters)
        available = self.memory_bytes - WORKER_BYTES
        if expected > available:
            raise TooLarge(
                f"building the tables would take about {expected / 1e9:.1f} GB, and the worker has "
                f"{max(available, 0) / 1e9:.1f} GB for them: fewer workers, a shorter coherence_length or a larger "
                "tolerance would do"
            )
        return expected

    def _make_room(self, needed_bytes: float) -> None:
        """Gives surfaces up until those held and what is to come fit; the newest stays."""
        if not self.memory_bytes:
            return
        budget = HELD_SHARE * max(self.memory_bytes - WORKER_BYTES, 0)
        keep = 1 if needed_bytes == 0 else 0
        while len(self._held) > keep and sum(size for _, size in self._held.values()) + needed_bytes > budget:
            self._held.popitem(last=False)


def _key(parameters: Mapping[str, Value]) -> str:
    """What decides the tables: all parameters but the light's, and when the file was changed."""
    own = {name: value for name, value in parameters.items() if name not in LIGHT}
    name = str(own.get("filename", ""))
    changed = os.stat(name).st_mtime_ns if name and os.path.exists(name) else 0
    return json.dumps([own, changed], sort_keys=True)
