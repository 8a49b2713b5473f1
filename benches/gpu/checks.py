"""Runs the checks of a part (`parts.py`); prints each result at once and appends it to a file as a line of JSON."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from .parts import Check

# Exit status of a part's process with a failed check. Python itself exits with 1 after an exception, and with 2 after a
# wrong argument.
FAILED = 3


def run(checks: Iterable[Check], results: Path) -> bool:
    """Runs all checks, and appends a line of JSON for each to the file `results`; returns whether none failed.

    A check is its name and a function that returns a dictionary. It fails if `passed` there is false, or by an
    exception; the next check runs in both cases. Without `passed` it only measures, so it fails by an exception alone.
    """
    passed = True
    with results.open("a", encoding="utf-8") as lines:
        for name, check in checks:
            start = time.perf_counter()
            try:
                row = {"check": name, **check()}
            except Exception as error:
                row = {"check": name, "passed": False, "error": one_line(error)}
            row["seconds"] = round(time.perf_counter() - start, 3)
            row = plain(row)
            lines.write(json.dumps(row, allow_nan=False) + "\n")
            lines.flush()
            print(f"  {summary(row)}", flush=True)
            passed = passed and row.get("passed") is not False
    return passed


def one_line(error: Exception) -> str:
    """The type and message of an exception."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def plain(value):
    """The value with NumPy's scalars as Python's, and NaN and infinity as strings, since JSON cannot represent them."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


def summary(row: dict) -> str:
    """The result of a check as one line of text."""
    # A measurement without `passed` has no mark.
    mark = {True: "ok    ", False: "FAILED", None: "      "}[row.get("passed")]
    figures = ", ".join(flattened({k: v for k, v in row.items() if k not in ("check", "passed", "seconds")}))
    return f"{mark} {row['check']} ({row['seconds']:.1f} s): {figures}"


def flattened(figures: dict, prefix: str = "") -> Iterable[str]:
    """Texts such as `eval median 1e-06`, one per figure: keys of nested dictionaries, and the value."""
    for name, value in figures.items():
        if isinstance(value, dict):
            yield from flattened(value, f"{prefix}{name} ")
        elif isinstance(value, float):
            yield f"{prefix}{name} {value:.3g}"
        else:
            yield f"{prefix}{name} {value}"
