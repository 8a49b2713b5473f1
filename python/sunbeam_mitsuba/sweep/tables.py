"""Surfaces that a worker holds, and the memory of their tables: estimated before a build, limited by a cache.

A worker's memory is WORKER_BYTES and the memory *for tables*. Held surfaces and the peak of a build fit into the memory
for tables. Between builds the held surfaces take at most HELD_FRACTION of it, unless only the newest is left.
"""

from __future__ import annotations

import json
import os
import time
from collections import OrderedDict
from collections.abc import Iterable, Mapping

from .._errors import SunbeamError
from .command import CommandError, find_command, table_bytes
from .instruments import converted
from .limits import LIGHT, Value
from .reflector import Reflector, make_reflector

# Peak memory of a build divided by the estimated size of the finished spectral table. Estimated from the parts that a
# build also holds: values at all knots, grids of transforms, the sampler and the albedo. Larger values refuse surfaces
# that would fit; with smaller ones the system kills workers.
_PEAK_OVER_TABLE = 6.0
#: Memory of a worker in bytes without tables: Python, Mitsuba, and one batch of directions, with a margin. Larger
#: values allow fewer workers and refuse surfaces that would fit; with smaller ones the system may kill workers.
WORKER_BYTES = 0.6e9
#: Largest fraction of the memory for tables that held surfaces take between builds. With a larger fraction fewer
#: surfaces are built again; a smaller one leaves more memory for pictures.
HELD_FRACTION = 0.5
# Presets whose tables take only some megabytes at coherence lengths of at most _SMALL_COHERENCE_UM µm. They need no
# estimate, which would run the command.
_SMALL_PRESETS = ("flat", "sinusoidal", "blazed", "lamellar")
_SMALL_COHERENCE_UM = 1000.0
# Default of the parameter `coherence_length` in µm, equal to the library's (src/config/); no test compares them.
_DEFAULT_COHERENCE_UM = 65.0
# Largest number of surfaces estimated before the workers start; workers estimate the others. Each estimate runs the
# command ``sunbeam``, so larger values delay the start. Smaller ones may miss the largest surface.
_ESTIMATED_BEFORE = 32


class TooLarge(ValueError):
    """The worker's memory is too small for a build; the message is one line with the numbers."""


def estimated_peak_bytes(parameters: Mapping[str, Value]) -> float:
    """Peak memory in bytes while the tables are built; 0 for a small surface and where it is unknown.

    The peak follows from the library's estimate of the finished table, by ``sunbeam height-field``. Without the command
    the peak is unknown, and only the library's build limit refuses large tables. Raises :class:`CommandError` where the
    surface is refused, and ``SweepError`` where ``SUNBEAM_COMMAND`` cannot be run.
    """
    # The command estimates only the spectral table of the scalar theory.
    if parameters.get("theory") == "rigorous" or find_command() is None:
        return 0.0
    if parameters.get("preset") in _SMALL_PRESETS and _coherence_um(parameters) <= _SMALL_COHERENCE_UM:
        return 0.0
    return _PEAK_OVER_TABLE * table_bytes(parameters)


def _coherence_um(parameters: Mapping[str, Value]) -> float:
    """Coherence length of a surface in µm."""
    return float(parameters.get("coherence_length", _DEFAULT_COHERENCE_UM))


def largest_estimate(surfaces: Iterable[Mapping[str, Value]]) -> float:
    """The largest estimated peak in bytes among the _ESTIMATED_BEFORE surfaces with the largest files.

    Among files of equal size, and presets, longer coherence lengths come first. Refused surfaces count as 0, since they
    become rows with an error.
    """

    def size(parameters: Mapping[str, Value]) -> tuple[float, float]:
        """Sorting key: the file's size in bytes, 0 without a file, and the coherence length in µm."""
        name = str(parameters.get("filename", ""))
        file_bytes = os.path.getsize(name) if name and os.path.exists(name) else 0
        return file_bytes, _coherence_um(parameters)

    largest = 0.0
    for parameters in sorted(surfaces, key=size, reverse=True)[:_ESTIMATED_BEFORE]:
        try:
            largest = max(largest, estimated_peak_bytes(converted(parameters)))
        except (CommandError, SunbeamError):
            continue
    return largest


class HeldSurfaces:
    """Cache of surfaces by their parameters, which drops the least recently used where memory is short."""

    def __init__(self, memory_bytes: float):
        #: Memory limit of the worker in bytes, which may be changed between calls; 0 where it has none.
        self.memory_bytes = memory_bytes
        #: Seconds spent so far on estimating and building tables, or reading them from the disk cache.
        self.seconds = 0.0
        # Surfaces and the bytes of their tables by key, the least recently used first.
        self._held: OrderedDict[str, tuple[Reflector, float]] = OrderedDict()

    def get(self, parameters: Mapping[str, Value]) -> Reflector:
        """Returns the surface with these parameters, and builds it if it is not held.

        An instrument's file must be converted already (:func:`converted`). Raises :class:`TooLarge` where the build
        does not fit, and errors of :func:`estimated_peak_bytes` and ``make_reflector``.
        """
        key = _key(parameters)
        if key in self._held:
            self._held.move_to_end(key)
            return self._held[key][0]
        start = time.perf_counter()
        try:
            estimated_bytes = self._make_room_for_build(parameters) if self.memory_bytes else 0.0
            made = make_reflector(parameters)
            # The estimate replaces an unknown size.
            self._held[key] = (made, made.table_bytes or estimated_bytes)
            if self.memory_bytes:
                self._drop_until(HELD_FRACTION * self._for_tables_bytes(), kept=1)
        finally:
            self.seconds += time.perf_counter() - start
        return made

    def __len__(self) -> int:
        """Number of held surfaces."""
        return len(self._held)

    def _make_room_for_build(self, parameters: Mapping[str, Value]) -> float:
        """Drops surfaces until the others and the peak of the build fit into the memory for tables.

        Returns the estimated bytes of the finished tables. Raises :class:`TooLarge`, and drops nothing, if the build
        alone does not fit.
        """
        peak_bytes, available_bytes = estimated_peak_bytes(parameters), self._for_tables_bytes()
        if available_bytes < 0:
            raise TooLarge(
                f"the worker has {self.memory_bytes / 1e9:.3g} GB, less than the {WORKER_BYTES / 1e9:.3g} GB that it "
                "needs without tables: fewer workers or more memory would do"
            )
        if peak_bytes > available_bytes:
            raise TooLarge(
                f"building the tables would take about {peak_bytes / 1e9:.1f} GB, and the worker has "
                f"{available_bytes / 1e9:.1f} GB for them: fewer workers, a shorter coherence_length or a larger "
                "tolerance would do"
            )
        self._drop_until(available_bytes - peak_bytes)
        return peak_bytes / _PEAK_OVER_TABLE

    def _for_tables_bytes(self) -> float:
        """Memory for tables of a worker with a limit; negative below WORKER_BYTES."""
        return self.memory_bytes - WORKER_BYTES

    def _drop_until(self, budget_bytes: float, kept: int = 0) -> None:
        """Drops the least recently used surfaces until the others fit into the budget, or only ``kept`` are left."""
        while len(self._held) > kept and sum(size for _, size in self._held.values()) > budget_bytes:
            self._held.popitem(last=False)


def _key(parameters: Mapping[str, Value]) -> str:
    """Key of a surface in the cache: all parameters except the light's, and the file's modification time."""
    surface = {name: value for name, value in parameters.items() if name not in LIGHT}
    name = str(surface.get("filename", ""))
    changed_ns = os.stat(name).st_mtime_ns if name and os.path.exists(name) else 0
    return json.dumps([surface, changed_ns], sort_keys=True)
