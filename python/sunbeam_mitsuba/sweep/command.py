"""Runs the command ``sunbeam`` (crates/cli), which computes numbers that the package itself cannot compute.

``sunbeam height-field`` reports statistics and periods of a relief and the estimated size of its tables, and
``sunbeam orders`` the diffraction orders of a grating. Both print a JSON object.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

from .errors import SweepError
from .limits import SOURCE, SURFACE, Value

# Path of the command in a checkout after `make tool`.
_BUILT = Path(__file__).resolve().parents[3] / "target" / "release" / "sunbeam"
# Parameters that change neither the heights nor a reflector's table.
_OPTICS = ("eta", "k", "obliquity", "transmission")
# Index of a body that transmits, for estimates where the parameters give a name or nothing: the plugin's default, bk7.
_BODY_ETA = 1.5046
_MISSING = "the command sunbeam is missing: put it on PATH, or name it in the environment variable SUNBEAM_COMMAND"


class CommandError(ValueError):
    """Refusal by the command; the message is the last line that it printed on stderr."""


def find_command() -> str | None:
    """Finds the command: ``SUNBEAM_COMMAND``, or ``sunbeam`` on ``PATH``, or the one built in the checkout, or none.

    Raises :class:`SweepError` where ``SUNBEAM_COMMAND`` cannot be run.
    """
    named = os.environ.get("SUNBEAM_COMMAND")
    if named:
        if shutil.which(named) is None:
            raise SweepError(f"SUNBEAM_COMMAND names {named}, which cannot be run")
        return named
    return shutil.which("sunbeam") or (str(_BUILT) if _BUILT.exists() else None)


def require_command() -> str:
    """Name or path of the command. Raises :class:`SweepError` where it is missing."""
    found = find_command()
    if found is None:
        raise SweepError(_MISSING)
    return found


def surface_words(parameters: Mapping[str, Value]) -> list[str]:
    """Command-line arguments that describe a surface, such as ``--pixel-size=0.1``.

    The command knows the parameters in SOURCE and SURFACE of limits.py. The others are left out.
    """
    words = []
    for name, value in parameters.items():
        if name in SOURCE or name in SURFACE:
            option = "height-field" if name == "filename" else name.replace("_", "-")
            text = str(value).lower() if isinstance(value, bool) else str(value)
            words.append(f"--{option}={text}")
    return words


def ask(*words: str) -> dict[str, Any]:
    """Runs the command with arguments ``words`` and parses its output, a JSON object.

    Raises :class:`CommandError` where the command refuses, and :class:`SweepError` where it is missing.
    """
    done = subprocess.run([require_command(), *words], capture_output=True, text=True)
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
        raise CommandError(lines[-1].removeprefix("sunbeam: "))
    return cast("dict[str, Any]", json.loads(done.stdout))


def describe(parameters: Mapping[str, Value]) -> dict[str, Any]:
    """Report of ``sunbeam height-field`` on a surface. The report is cached, since all settings of a surface need it.

    Callers must not change the result. Raises :class:`CommandError` where the surface is refused, and
    :class:`SweepError` where the command is missing.
    """
    # Without the optics, surfaces that differ in them alone share one report.
    return _report({key: value for key, value in parameters.items() if key not in _OPTICS})


def table_bytes(parameters: Mapping[str, Value]) -> float:
    """Estimated size in bytes of the surface's finished scalar table, by ``sunbeam height-field``.

    The table of a body that transmits has its relief magnified by the index. The errors are those of :func:`describe`.
    """
    transmission = parameters.get("transmission", "none")
    if transmission == "none":
        return float(describe(parameters)["table_bytes_estimate"])
    # The command has no ``int_ior``, the index of the medium below. It equals ``eta``, since the medium above is air.
    eta = parameters.get("eta", parameters.get("int_ior", _BODY_ETA))
    given = {key: value for key, value in parameters.items() if key not in _OPTICS}
    given |= {"transmission": transmission, "eta": _BODY_ETA if isinstance(eta, str) else eta}
    return float(_report(given)["table_bytes_estimate"])


def _report(parameters: Mapping[str, Value]) -> dict[str, Any]:
    """Report of ``sunbeam height-field``, cached until the file of the heights changes."""
    name = parameters.get("filename")
    # A missing file gets time 0, which has no effect: the command refuses the file.
    changed_ns = os.stat(str(name)).st_mtime_ns if name is not None and os.path.exists(str(name)) else 0
    return _described(tuple(surface_words(parameters)), changed_ns)


@lru_cache(maxsize=64)
def _described(words: tuple[str, ...], changed_ns: int) -> dict[str, Any]:
    """The cached report. ``changed_ns``, the file's modification time, is only part of the cache key."""
    return ask("height-field", *words)
