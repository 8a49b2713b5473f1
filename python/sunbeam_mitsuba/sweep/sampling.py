"""Combinations of parameters' values: a product, a list or a random sample.

They are read from a table of the specification, such as::

    combine = "product"
    coherence_length = [65, 130]
    theta_i_deg = { from = 0, to = 60, count = 7 }

which gives 14 combinations.
"""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Iterator
from dataclasses import dataclass

from .errors import SweepError
from .limits import PARAMETERS, Numbers, Value, check_keys, check_value, check_whole, shown

#: Largest number of combinations in a sweep, checked before any is generated. All cases are in memory at once.
ROWS_MAX = 1_000_000
#: Keys of a table of values besides its parameters.
KEYS = ("combine", "count", "seed")
# Values of ``combine``.
_KINDS = ("product", "list", "sample")
# Keys of a range.
_RANGE_KEYS = ("from", "to", "count", "step", "scale")


@dataclass(frozen=True)
class Span:
    """A range of numbers from ``first`` to ``last``, uniform in the value, or in the logarithm if ``logarithmic``."""

    first: float
    last: float
    logarithmic: bool

    def at(self, fraction: float) -> float:
        """The number at a fraction, 0 to 1, of the range."""
        if self.logarithmic:
            value = self.first * (self.last / self.first) ** fraction
        else:
            value = self.first + (self.last - self.first) * fraction
        return _rounded(value)


@dataclass(frozen=True)
class Combinations:
    """Parameters' values and the way to combine them into ``count`` combinations."""

    #: Names of the parameters.
    names: tuple[str, ...]
    #: Number of combinations.
    count: int
    #: One of _KINDS.
    kind: str
    #: Values of each of the parameters. Only a sample has spans. In a list all tuples have equal lengths.
    values: tuple[tuple[Value, ...] | Span, ...]
    #: Seed of a sample.
    seed: int = 0

    def __iter__(self) -> Iterator[dict[str, Value]]:
        """Yields the combinations, values by parameter. In a product the last parameter changes fastest."""
        if self.kind == "sample":
            yield from self._drawn()
            return
        # Without parameters there is one combination, but `zip` would give none.
        if not self.names:
            yield {}
            return
        # All values are tuples here; the condition is for the type checker.
        lists = [values for values in self.values if not isinstance(values, Span)]
        for row in itertools.product(*lists) if self.kind == "product" else zip(*lists):
            yield dict(zip(self.names, row))

    def listed(self) -> dict[str, tuple[Value, ...]]:
        """The values of each parameter, or both ends of a span."""
        return {
            name: (values.first, values.last) if isinstance(values, Span) else values
            for name, values in zip(self.names, self.values)
        }

    def _drawn(self) -> Iterator[dict[str, Value]]:
        """Yields random combinations, each parameter uniform over its span or tuple."""
        # Python guarantees that random() gives equal numbers for a seed in all versions.
        source = random.Random(self.seed)
        for _ in range(self.count):
            row: dict[str, Value] = {}
            for name, values in zip(self.names, self.values):
                # A fraction in [0, 1).
                u = source.random()
                row[name] = values.at(u) if isinstance(values, Span) else values[int(u * len(values))]
            yield row


def read_combinations(where: str, table: dict[str, object], accepted: list[str]) -> Combinations:
    """Reads a table of parameters, each a value, a list, or a range ``{from, to, count}`` or ``{from, to, step}``.

    The key ``combine`` is one of

    - ``product``: all combinations (the default);
    - ``list``: the first values together, then the second values, and so on; a single value is repeated;
    - ``sample``: ``count`` random combinations with ``seed`` (0). A range is ``{from, to}`` and gives any number in it.

    ``scale = "log"`` in a range makes it uniform in its logarithm.

    ``where`` names the table in messages; ``accepted`` are names of parameters, in the order of the result's ``names``.
    Raises :class:`SweepError` for unknown keys, contradictions, and values that a parameter does not accept.
    """
    check_keys(where, table, [*KEYS, *accepted])
    kind = table.get("combine", "product")
    if kind not in _KINDS:
        raise SweepError(f"{where}: combine is {shown(kind)}, but must be one of {', '.join(_KINDS)}")
    is_sample = kind == "sample"
    for key in ("count", "seed"):
        if key in table and not is_sample:
            raise SweepError(f'{where}: {key} needs combine = "sample"')
    names = tuple(name for name in accepted if name in table)
    values = tuple(_values(where, name, table[name], is_sample) for name in names)
    if is_sample:
        count = check_whole(f"{where}: count", table.get("count"), 1, ROWS_MAX)
        seed = check_whole(f"{where}: seed", table.get("seed", 0), 0, 2**63)
        return Combinations(names, count, "sample", values, seed)
    # Only a sample has spans; the condition is for the type checker.
    lists = [listed for listed in values if not isinstance(listed, Span)]
    if kind == "list":
        longest = max(map(len, lists), default=1)
        for name, listed in zip(names, lists):
            if len(listed) not in (1, longest):
                raise SweepError(f"{where}: {name} has {len(listed)} values, but a list needs 1 or {longest}")
        repeated = tuple(listed * longest if len(listed) == 1 else listed for listed in lists)
        return Combinations(names, longest, "list", repeated)
    return Combinations(names, math.prod(map(len, lists)), "product", tuple(lists))


def _values(where: str, name: str, given: object, is_sample: bool) -> tuple[Value, ...] | Span:
    """Reads the value ``given`` of the parameter ``name``: a range, a list, or a single value.

    Raises :class:`SweepError` for values that the parameter does not accept.
    """
    if isinstance(given, dict):
        return _range(f"{where}: {name}", name, given, is_sample)
    if isinstance(given, list):
        if not given:
            raise SweepError(f"{where}: {name} is an empty list; give at least one value")
        return tuple(check_value(where, name, value) for value in given)
    return (check_value(where, name, given),)


def _range(where: str, name: str, given: dict[str, object], is_sample: bool) -> tuple[Value, ...] | Span:
    """Reads a range of the parameter ``name``: its values, or a span for a sample.

    ``where`` names the range in messages. Raises :class:`SweepError` for a range that is not accepted.
    """
    check_keys(where, given, list(_RANGE_KEYS))
    if not isinstance(PARAMETERS[name], Numbers):
        raise SweepError(f"{where} is a range, but must be {PARAMETERS[name]}")
    ends = []
    for key in ("from", "to"):
        if key not in given:
            raise SweepError(f"{where}: a range needs from and to")
        ends.append(float(check_value(f"{where}: {key}", name, given[key])))
    if given.get("scale", "linear") not in ("linear", "log"):
        raise SweepError(f"{where}: scale is {shown(given['scale'])}, but must be one of linear, log")
    logarithmic = given.get("scale") == "log"
    if logarithmic and min(ends) <= 0:
        raise SweepError(f'{where}: a range with scale = "log" must be above 0, but begins at {min(ends):g}')
    span = Span(ends[0], ends[1], logarithmic)
    if is_sample:
        if "count" in given or "step" in given:
            raise SweepError(f"{where}: a sample draws from a range; leave out its count and step")
        return span
    if ("count" in given) == ("step" in given):
        raise SweepError(f"{where}: a range needs one of count and step")
    if "count" in given:
        count = check_whole(f"{where}: count", given["count"], 2, ROWS_MAX)
        return tuple(span.at(i / (count - 1)) for i in range(count))
    return _stepped(where, given["step"], span)


def _stepped(where: str, step: object, span: Span) -> tuple[Value, ...]:
    """The values of a linear span from its first in steps of ``step``, up to its last at most.

    Raises :class:`SweepError` for a step that is no positive number, a logarithmic or falling span, and too many
    values.
    """
    if isinstance(step, bool) or not isinstance(step, (int, float)) or not 0 < step < math.inf or span.logarithmic:
        raise SweepError(f"{where}: step is {shown(step)}, but must be a number above 0, and is for linear ranges")
    if span.last < span.first:
        raise SweepError(f"{where}: a range with a step must rise, but goes from {span.first:g} to {span.last:g}")
    steps = (span.last - span.first) / step
    if steps > ROWS_MAX:
        raise SweepError(f"{where}: the range has {steps:.3g} values; accepted are at most {ROWS_MAX}")
    # Rounding can put the last value beyond the end. A relative and an absolute margin keep it.
    count = int(steps * (1 + 1e-12) + 1e-9) + 1
    return tuple(_rounded(span.first + i * step) for i in range(count))


def _rounded(value: float) -> float:
    """The value rounded to twelve significant digits, so that the third step of 0.1 is 0.3, not 0.30000000000000004."""
    return float(f"{value:.12g}")
