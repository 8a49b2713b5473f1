"""Surfaces that a worker holds, and the memory of their tables: estimated before a build, limited by a cache."""

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

#: Peak memory of a build divided by the estimated size of the finished spectral table. Chosen with a margin: the build
#: also holds nodes in complex double precision, grids of transforms, the sampler and the albedo.
BUILD_PEAK = 6.0
#: Memory of a worker in bytes without tables: Python, Mitsuba, and one batch of directions. Chosen with a margin.
WORKER_BYTES = 0.6e9
#: Fraction of a worker's memory for finished tables. Chosen; the rest is for the next build and a picture.
HELD_FRACTION = 0.5
# Presets whose tables take only some megabytes at coherence lengths up to _SMALL_COHERENCE_UM: they need no estimate.
_SMALL_PRESETS = ("flat", "sinusoidal", "blazed", "lamellar")
# Coherence length in µm up to which _SMALL_PRESETS need no estimate.
_SMALL_COHERENCE_UM = 1000.0
# Largest number of surfaces estimated before the workers start; workers estimate the others.
_ESTIMATED_BEFORE = 32


class TooLarge(ValueError):
    """Tables do not fit into the worker's memory; the message is one line with the estimate."""


def estimated_bytes(parameters: Mapping[str, Value]) -> float:
    """Peak memory in bytes while the tables are built; 0 for a small surface and where it is unknown.

    The library's own estimate of the table comes from ``sunbeam height-field``. Without the command it is unknown, and
    only the library's build limit refuses large tables. Raises :class:`CommandError` where the surface is refused.
    """
    coherence_um = float(parameters.get("coherence_length", 65.0))
    if parameters.get("theory") == "rigorous" or find_command() is None:
        return 0.0
    if parameters.get("preset") in _SMALL_PRESETS and coherence_um <= _SMALL_COHERENCE_UM:
        return 0.0
    return BUILD_PEAK * float(describe(parameters)["table_bytes_estimate"])


def largest_estimate(surfaces: Iterable[Mapping[str, Value]]) -> float:
    """The largest estimate in bytes among the 32 surfaces with the largest files and coherence lengths.

    Refused surfaces count as 0, since they become rows with an error.
    """

    def size(parameters: Mapping[str, Value]) -> tuple[float, float]:
        name = str(parameters.get("filename", ""))
        stored = os.path.getsize(name) if name and os.path.exists(name) else 0
        return stored, float(parameters.get("coherence_length", 65.0))

    largest = 0.0
    for parameters in sorted(surfaces, key=size, reverse=True)[:_ESTIMATED_BEFORE]:
        try:
            largest = max(largest, estimated_bytes(converted(parameters)))
        except (CommandError, SunbeamError):
            continue
    return largest


class HeldSurfaces:
    """Cache of surfaces by their parameters, which drops the least recently used where memory is short.

    ``memory_bytes`` is the worker's limit, or 0 where it has none.
    """

    def __init__(self, memory_bytes: float):
        self.memory_bytes = memory_bytes
        #: Seconds spent so far on building tables, or reading them from the disk cache.
        self.seconds = 0.0
        self._held: OrderedDict[str, tuple[Reflector, float]] = OrderedDict()

    def get(self, parameters: Mapping[str, Value]) -> Reflector:
        """Returns the surface, which is built where it is not held.

        Raises :class:`TooLarge` where its tables do not fit, and the library's errors.
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
        """Estimated peak memory of a build in bytes. Raises :class:`TooLarge` if the worker has less."""
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
        """Drops surfaces until the others and ``needed_bytes`` fit; with 0 bytes the newest stays."""
        if not self.memory_bytes:
            return
        budget = HELD_FRACTION * max(self.memory_bytes - WORKER_BYTES, 0)
        keep = 1 if needed_bytes == 0 else 0
        while len(self._held) > keep and sum(size for _, size in self._held.values()) + needed_bytes > budget:
            self._held.popitem(last=False)


def _key(parameters: Mapping[str, Value]) -> str:
    """Key of a surface's tables: all parameters except the light's, and the file's modification time."""
    surface = {name: value for name, value in parameters.items() if name not in LIGHT}
    name = str(surface.get("filename", ""))
    changed = os.stat(name).st_mtime_ns if name and os.path.exists(name) else 0
    return json.dumps([surface, changed], sort_keys=True)
