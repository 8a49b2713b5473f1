"""Converts files of measuring instruments to ``.gsf``, with the readers of the library SurfaceTopography.

A ``.gsf``, Gwyddion Simple Field, has a text header with size and units, then heights as 32-bit floats. The library
comes with the package's extra ``formats``. Other formats have native readers, those of sunbeam itself
(crates/height_field). On the command line::

    python -m sunbeam_mitsuba.convert scan.ibw -o scan.gsf [--channel 0]
"""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from ._channels import Channel, channel_of, choose, listed
from ._errors import SunbeamError
from ._relief import Relief, relief_of_topography, single_precision, um_per

if TYPE_CHECKING:
    from typing import Union

    # Path of a file. `Union`, since the type checker follows Python 3.9, which has no `str | os.PathLike[str]`.
    Name = Union[str, "os.PathLike[str]"]

__all__ = ["EXTENSIONS", "Channel", "Reading", "convert", "main", "read"]

# fmt: off
#: Extensions, without the dot, of the height maps that SurfaceTopography reads and the native readers do not. The list
#: `INSTRUMENTS` of crates/height_field/src/file/mod.rs, by which the native readers point to this module, has to be the
#: same; tests/test_formats.py tries each extension.
EXTENSIONS = frozenset({
    "al3d", "apx", "bcr", "bcrf", "cur", "datx", "di", "ezd", "frt", "ibw", "jpk", "lext", "mdt", "mi", "mnt", "nc",
    "nid", "nms", "oir", "opd", "opdx", "os3d", "plu", "plux", "poir", "stp", "sur", "tmd", "tom", "top", "vk3", "vk4",
    "vk6", "vk7", "zmg", "zon",
})
# fmt: on
#: Command that installs the reading library, for messages.
INSTALL = 'pip install "sunbeam-mitsuba[formats]"'

# SurfaceTopography's names of formats with bare arrays, which have no unit, no size, and no order of the indices.
_BARE = ("h5", "mat", "npy", "npz")
# SurfaceTopography's names of text formats, which the native readers also read.
_TEXT = ("asc", "xyz")
# SurfaceTopography's name of lists of points x, y, z, whose size follows from the points.
_POINTS = "xyz"
# SurfaceTopography's names of formats whose first row has the smallest y. In all others except _EITHER_FIRST the first
# row is the top of the picture.
_BOTTOM_FIRST = ("sdf", "x3p", "xyz")
# SurfaceTopography's names of formats in which the order of rows depends on the program that wrote the file
# (`top_is_first` in _relief.py).
_EITHER_FIRST = ("nc",)
# Relative difference above which the given pixel size contradicts the file's, as in the native readers.
_PIXEL_SIZE_RTOL = 1e-6
# Largest accepted edge of a pixel and largest accepted range of heights in µm, as in the native readers. A larger
# length is probably in a wrong unit.
_LARGEST_UM = 1e3
# Largest number of characters that are shown of a message of SurfaceTopography, so that it stays readable.
_MESSAGE_MAX = 160


@dataclass(frozen=True)
class Reading:
    """A relief read from a file: the channel that holds it, and all height maps of the file."""

    relief: Relief
    channel: Channel
    channels: tuple[Channel, ...]


def read(
    file: Name, channel: int | str | None = None, *, pixel_size: float | None = None, unit: str | None = None
) -> Reading:
    """Reads the relief in a file with SurfaceTopography.

    ``channel`` is a number from 0 or a title. By default it is the first channel that is a height by its unit and title
    (``Channel.rank`` of _channels.py). ``pixel_size``, the edge of a pixel in µm, and ``unit``, such as ``"nm"``, are
    for files that do not tell them. Where the file tells one, the given value must agree with it.

    Raises :class:`SunbeamError` with one line where the file or the library is missing, and where the library cannot
    read the file. Also raises it where the file lacks the channel, a size or a unit, and where lengths are implausible.
    """
    path = Path(file)
    # Unlike Path.is_file, os.path.isfile does not raise for a name that is too long.
    if not os.path.isfile(path):
        raise SunbeamError(f"{path}: there is no such file")
    try:
        # The library warns of parts of the file that it skips; none of them are heights.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _read(path, channel, pixel_size, unit)
    except SunbeamError as error:
        raise SunbeamError(f"{path}: {error}") from error


def convert(
    file: Name,
    output: Name,
    channel: int | str | None = None,
    *,
    pixel_size: float | None = None,
    unit: str | None = None,
) -> Reading:
    """Writes the relief that :func:`read` returns to the ``.gsf`` file ``output``, and returns it.

    The file has heights and sizes in metres; points without a height are NaN. Raises :class:`SunbeamError` as
    :func:`read` does, and before reading where the output is no ``.gsf`` or its folder cannot be written.
    """
    target = Path(output)
    if target.suffix != ".gsf":
        raise SunbeamError(f"{target}: the output's extension is {target.suffix or 'missing'}; it must be .gsf")
    # os.path.isdir for the reason given in `read`.
    if os.path.isdir(target) or not os.path.isdir(target.parent) or not os.access(target.parent, os.W_OK):
        raise SunbeamError(f"{target}: cannot be written; name a file in a folder that can")
    reading = read(file, channel, pixel_size=pixel_size, unit=unit)
    _write_gsf(target, reading)
    return reading


def library() -> Any:
    """SurfaceTopography's readers, the module ``SurfaceTopography.IO``.

    Raises :class:`SunbeamError` where it is not installed, or not completely.
    """
    try:
        from SurfaceTopography import IO
    except ModuleNotFoundError as error:
        if error.name != "SurfaceTopography":
            raise SunbeamError(f"SurfaceTopography cannot be imported: {error}; {INSTALL} brings all of it") from error
        needs = "" if sys.version_info >= (3, 10) else ", in Python 3.10 or newer"
        raise SunbeamError(f"SurfaceTopography, which reads it, is not installed: {INSTALL}{needs}") from error
    return IO


def _read(path: Path, wanted: int | str | None, pixel_size: float | None, unit: str | None) -> Reading:
    """Reads a file for :func:`read`, which adds the file's name to messages."""
    if unit is not None:
        # An unknown unit is refused before the file is read.
        um_per(unit)
    if pixel_size is not None and not 0 < pixel_size < float("inf"):
        raise SunbeamError(f"pixel_size is {pixel_size} µm; it must be finite and positive")
    reader = _open(path)
    try:
        format_name = reader.format()
        if format_name in _BARE:
            raise SunbeamError(
                "it holds bare arrays, which tell neither unit nor size; save one as .npy, [iy, ix] in µm with iy "
                "growing along +y, and read that with pixel_size"
            )
        maps = [info for info in reader.channels if info.dim == 2]
        if not maps:
            raise SunbeamError("it holds profiles; a surface needs a map, with heights along x and y")
        channels = tuple(channel_of(info) for info in maps)
        chosen = choose(channels, wanted)
        info = maps[channels.index(chosen)]
        if not chosen.unit and unit is None:
            raise SunbeamError(f"channel {chosen} does not tell its unit; give unit, such as nm (--unit nm)")
        sizes: dict[str, Any] = {}
        if info.physical_sizes is None and format_name != _POINTS:
            # `info.unit` is the file's unit along x and y. `relief_of_topography` refuses a given `unit` that
            # contradicts the file's.
            sizes["physical_sizes"] = _given_sizes(format_name, info.nb_grid_pts, pixel_size, unit or info.unit)
        # None: `relief_of_topography` finds the order of rows in the file's header.
        top_first = None if format_name in _EITHER_FIRST else format_name not in _BOTTOM_FIRST
        relief = relief_of_topography(info.topography(**sizes), unit, top_first)
    except SunbeamError:
        # This package's own messages stay as they are.
        raise
    # The library's readers raise many kinds of exceptions for files that they cannot read.
    except Exception as error:
        raise SunbeamError(_failure(error) or type(error).__name__) from error
    finally:
        reader.close()
    _check(relief, pixel_size)
    return Reading(relief, chosen, channels)


def _open(path: Path) -> Any:
    """Opens a file with the reader that recognises its content, or else with one for its extension.

    Some formats have no signature, and readers of other formats may accept such a file. A reader without the file's
    extension is therefore only the last resort, unless it reads text, since text files have any extension.
    """
    readers = library()
    extension = path.suffix[1:].lower()
    # Reader that recognises the content. It is the last resort if it does not have the file's extension.
    found = None
    # Message of the last reader that failed.
    failure = ""
    try:
        found = readers.open_topography(str(path))
        if found.format() in _TEXT or extension in found.file_extensions():
            return found
    except readers.CannotDetectFileFormat:
        pass
    except Exception as error:
        failure = _failure(error)
    for reader in readers.readers:
        if extension in reader.file_extensions():
            try:
                opened = reader(str(path))
            except Exception as error:
                failure = _failure(error)
                continue
            if found is not None:
                found.close()
            return opened
    if found is not None:
        return found
    raise SunbeamError(
        failure or "SurfaceTopography knows no format of this content; Gwyddion reads others, and saves them as .gwy"
    )


def _failure(error: Exception) -> str:
    """The exception's text as a message in one line; empty where it has none."""
    text = " ".join(str(error).split())
    return f"SurfaceTopography fails on it: {text[:_MESSAGE_MAX]}" if text else ""


def _given_sizes(
    format_name: str, points: Iterable[int], pixel_size: float | None, unit: str | None
) -> tuple[float, ...]:
    """Sizes along x and y in the unit ``unit``, for a file that does not tell them.

    ``points`` are the numbers of points along x and y. Raises :class:`SunbeamError` for text, and without a pixel size
    or a unit.
    """
    if format_name in _TEXT:
        raise SunbeamError("it does not tell its size; sunbeam reads such text itself, with pixel_size in µm")
    if pixel_size is None:
        raise SunbeamError("it does not tell its size; give pixel_size in µm (--pixel-size)")
    if not unit:
        raise SunbeamError("it does not tell its unit along x and y; give unit, such as nm (--unit nm)")
    return tuple(count * pixel_size / um_per(unit) for count in points)


def _check(relief: Relief, pixel_size: float | None) -> None:
    """Raises :class:`SunbeamError` for a relief that is implausible.

    Pixels must have the given size, some point must have a height, and neither an edge of a pixel nor the range of
    heights may exceed _LARGEST_UM.
    """
    if pixel_size is not None:
        for edge_um in relief.pixel_um:
            if abs(edge_um - pixel_size) > _PIXEL_SIZE_RTOL * edge_um:
                raise SunbeamError(f"pixel_size is given as {pixel_size} µm, but the file says {edge_um} µm")
    if relief.holes == relief.heights_um.size:
        raise SunbeamError("no point has a height")
    for name, um in (("pixels", max(relief.pixel_um)), ("heights from peak to valley", relief.peak_to_valley_um)):
        if um > _LARGEST_UM:
            raise SunbeamError(f"its {name} are {um:.6g} µm, more than the {_LARGEST_UM:g} µm of the largest relief")


def _write_gsf(target: Path, reading: Reading) -> None:
    """Writes the relief in metres, the row of the largest y first. Raises :class:`SunbeamError` where that fails."""
    try:
        from gsffile import write_gsf
    except ImportError as error:
        raise SunbeamError(f"{target}: cannot be written: {error}; {INSTALL} brings all of it") from error

    relief = reading.relief
    rows, columns = relief.heights_um.shape
    dx_um, dy_um = relief.pixel_um
    header = {"XReal": columns * dx_um * 1e-6, "YReal": rows * dy_um * 1e-6, "XYUnits": "m", "ZUnits": "m"}
    # A value in the header must not contain "=" or the null character. `channel_of` has replaced line breaks already.
    title = reading.channel.title.translate(str.maketrans("=\0", "  "))
    metres = single_precision(relief.heights_um[::-1] * 1e-6)
    # The complete file replaces the target at once, so no reader sees a part of it.
    part = target.with_name(f".{target.stem}.{os.getpid()}.gsf")
    try:
        write_gsf(part, metres, {**header, "Title": title})
        os.replace(part, target)
    # ValueError is that of a title that is not Unicode.
    except (OSError, ValueError) as error:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        reason = getattr(error, "strerror", None) or error
        raise SunbeamError(f"{target}: cannot be written: {reason}") from error


class _Parser(argparse.ArgumentParser):
    """An argument parser that reports wrong arguments in one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"convert: {message}\n")


def main(words: list[str] | None = None) -> int:
    """Runs the command line with the arguments ``words``, by default those of the process.

    Returns the exit code: 0 with a report on stderr, or 2 with a one-line error there. Wrong arguments end the process
    with status 2, also with one line.
    """
    parser = _Parser(
        prog="python -m sunbeam_mitsuba.convert",
        description="Writes the heights of an instrument's file, with their size and unit, as .gsf.",
        epilog=f"The library SurfaceTopography reads the file: {INSTALL}.",
    )
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="a file of an instrument or a program")
    add("-o", "--output", type=Path, required=True, metavar="FILE.gsf", help="where the heights go")
    help_of_channel = "number or title of the channel (default: the first that is a height by its unit and title)"
    # A number stays a text: `choose` compares it with the numbers' texts.
    add("--channel", metavar="N", help=help_of_channel)
    add("--pixel-size", type=float, metavar="UM", help="edge of a pixel in µm, for a file that does not tell its size")
    add("--unit", metavar="UNIT", help="unit of length, such as nm, for a file that does not tell it")
    given = parser.parse_args(words)
    try:
        reading = convert(given.file, given.output, given.channel, pixel_size=given.pixel_size, unit=given.unit)
    except SunbeamError as error:
        print(f"convert: {error}", file=sys.stderr)
        return 2
    relief = reading.relief
    rows, columns = relief.heights_um.shape
    dx_um, dy_um = relief.pixel_um
    print(f"channels: {listed(reading.channels)}", file=sys.stderr)
    print(
        f"{given.output}: channel {reading.channel}, {columns} × {rows} pixels of {dx_um:.6g} × {dy_um:.6g} µm, "
        f"{relief.peak_to_valley_um:.6g} µm from peak to valley, {relief.holes} points without a height",
        file=sys.stderr,
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
