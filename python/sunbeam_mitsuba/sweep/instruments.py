"""Files of instruments in a sweep, in formats that only the Python library SurfaceTopography reads.

Each worker process converts such a file once, by convert.py, to a temporary Gwyddion file (``.gsf``), which sunbeam
reads itself.
"""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterable, Mapping
from functools import cache, lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

from .. import convert
from .._errors import SunbeamError
from .errors import SweepError
from .limits import Value


def needs_converting(parameters: Mapping[str, Value]) -> bool:
    """Whether the surface's file is of a format that only SurfaceTopography reads."""
    return Path(str(parameters.get("filename", ""))).suffix[1:].lower() in convert.EXTENSIONS


def check_library(surfaces: Iterable[Mapping[str, Value]]) -> None:
    """Raises :class:`SweepError` where a surface needs SurfaceTopography, and it is not installed."""
    for parameters in surfaces:
        if needs_converting(parameters):
            try:
                convert.library()
            except SunbeamError as error:
                raise SweepError(f"{parameters['filename']}: {error}") from error
            return


def converted(parameters: Mapping[str, Value]) -> dict[str, Value]:
    """The parameters with an instrument's file replaced by a ``.gsf`` of the chosen channel.

    ``channel`` is removed, since a ``.gsf`` has a single one; ``pixel_size`` in µm is kept. Parameters of a surface
    without such a file are copied. Raises ``SunbeamError`` where the file is refused.
    """
    surface = dict(parameters)
    if not needs_converting(surface):
        return surface
    name = str(surface["filename"])
    channel, pixel_size = surface.pop("channel", None), surface.get("pixel_size")
    try:
        changed_ns = os.stat(name).st_mtime_ns
    except OSError as error:
        raise SunbeamError(f"{name}: cannot be read: {error.strerror}") from error
    # `convert` accepts a channel's number as a text, too.
    surface["filename"] = _gsf_of(
        name, changed_ns, None if channel is None else str(channel), None if pixel_size is None else float(pixel_size)
    )
    return surface


@cache
def _folder() -> TemporaryDirectory[str]:
    """The process's folder of converted files, removed when the process ends, unless it is killed."""
    return TemporaryDirectory(prefix="sunbeam-")


# Beyond `maxsize` paths the cache forgets the oldest. Their files stay, and an instrument's file is converted again
# where needed.
@lru_cache(maxsize=4096)
def _gsf_of(name: str, changed_ns: int, channel: str | None, pixel_size: float | None) -> str:
    """Converts a file and returns the path of its ``.gsf``; ``pixel_size`` is in µm.

    ``changed_ns``, the file's modification time, is only part of the cache key.
    """
    gsf = Path(_folder().name) / f"{uuid.uuid4().hex}.gsf"
    convert.convert(name, gsf, channel, pixel_size=pixel_size)
    return str(gsf)
