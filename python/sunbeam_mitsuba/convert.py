"""Heights out of the files of instruments, by the library SurfaceTopography, as a ``.gsf`` that all else reads.

The library is the extra ``formats`` of the package. As a command::

    python -m sunbeam_mitsuba.convert scan.ibw -o scan.gsf [--channel 0]
"""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from ._channels import Channel, channel_of, choose, listed
from ._errors import SunbeamError
from ._relief import Relief, relief_of_topography, single_precision, um_per

if TYPE_CHECKING:
    from typing import Union

    Name = Union[str, "os.PathLike[str]"]

__all__ = ["EXTENSIONS", "Channel", "Reading", "convert", "main", "read"]

# fmt: off
#: Extensions, without the dot, of the maps that SurfaceTopography reads and the native readers do not.
EXTENSIONS = frozenset({
    "al3d", "apx", "bcr", "bcrf", "cur", "datx", "di", "ezd", "frt", "ibw", "jpk", "lext", "mdt", "mi", "mnt", "nc",
    "nid", "nms", "oir", "opd", "opdx", "os3d", "plu", "plux", "poir", "stp", "sur", "tmd", "tom", "top", "vk3", "vk4",
    "vk6", "vk7", "zmg", "zon",
})
# fmt: on
INSTALL = 'pip install "sunbeam-mitsuba[formats]"'

# Names of SurfaceTopography's formats. Bare arrays tell neither unit nor size, nor which index is that of x.
_BARE = ("h5", "mat", "npy", "npz")
_TEXT = ("asc", "xyz")
# Its readers put the top of the picture first, but for these, whose files count along +y. In NetCDF it depends on where
# the heights came from.
_COUNT_UP, _EITHER = ("sdf", "x3p", "xyz"), ("nc",)
# Relative difference from which on two sizes disagree, and the largest pixel and range of heights in µm, beyond which a
# length was in another unit: those of the native readers.
_AGREEMENT, _LARGEST_UM = 1e-6, 1e3
# Characters of a message of SurfaceTopography's that are shown.
_SHOWN = 160


@dataclass(frozen=True)
class Reading:
    """A relief out of a file, with all maps of the file and the one that it is."""

    relief: Relief
    channel: Channel
    channels: tuple[Channel, ...]


def read(
    file: Name, channel: int | str | None = None, *, pixel_size: float | None = None, unit: str | None = None
) -> Reading:
    """The relief in a file that SurfaceTopography reads.

    ``channel`` is a number from 0 or a title. By default the first is taken that is a height by its title, or else the
    first whose values are lengths and whose title is not that of an error signal. ``pixel_size`` in µm and ``unit``,
    such as ``"nm"``, are for files that do not tell these; they must agree with a file that does.

    Raises :class:`SunbeamError` in one line: where the library is missing or does not read the file, and where the file
    has no such channel, no size or no unit.
    """
    path = Path(file)
    if not path.is_file():
        raise SunbeamError(f"{path}: there is no such file")
    try:
        # The library warns of what it leaves out; none of it is heights.
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
    """Writes the relief of :func:`read` to a ``.gsf`` with its size and unit; points without a height become NaN.

    Raises :class:`SunbeamError` as :func:`read` does, and, before anything is read, for an output that is no ``.gsf``
    or whose folder cannot be written.
    """
    target = Path(output)
    if target.suffix != ".gsf":
        raise SunbeamError(f"{target}: the output's extension is {target.suffix or 'missing'}; it must be .gsf")
    if target.is_dir() or not target.parent.is_dir() or not os.access(target.parent, os.W_OK):
        raise SunbeamError(f"{target}: cannot be written; name a file in a folder that can")
    reading = read(file, channel, pixel_size=pixel_size, unit=unit)
    _write_gsf(target, reading)
    return reading


def library() -> Any:
    """SurfaceTopography's readers, the module ``SurfaceTopography.IO``.

    Raises :class:`SunbeamError` where it is not installed.
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
    if unit is not None:
        # An unknown one is refused before the file is read.
        um_per(unit)
    if pixel_size is not None and not 0 < pixel_size < float("inf"):
        raise SunbeamError(f"pixel_size is {pixel_size} µm; it must be finite and positive")
    reader = _open(path)
    try:
        known = reader.format()
        if known in _BARE:
            raise SunbeamError(
                "it holds bare arrays, which tell neither unit nor size; save one as .npy, [iy, ix] in µm with iy "
                "growing along +y, and read that with pixel_size"
            )
        found = [info for info in reader.channels if info.dim == 2]
        if not found:
            raise SunbeamError("it holds profiles; a surface needs a map, with heights along x and y")
        channels = tuple(channel_of(info) for info in found)
        chosen = choose(channels, wanted)
        info = found[channels.index(chosen)]
        if not chosen.unit and unit is None:
            raise SunbeamError(f"channel {chosen} does not tell its unit; give unit, such as nm (--unit nm)")
        sizes: dict[str, Any] = {}
        # The grid of points tells its size as it is read.
        if info.physical_sizes is None and known != "xyz":
            sizes["physical_sizes"] = _given_sizes(known, info.nb_grid_pts, pixel_size, str(unit or info.unit))
        top_first = None if known in _EITHER else known not in _COUNT_UP
        relief = relief_of_topography(info.topography(**sizes), unit, top_first)
    except SunbeamError:
        raise
    except Exception as error:
        raise SunbeamError(_failure(error) or type(error).__name__) from error
    finally:
        reader.close()
    _check(relief, pixel_size)
    return Reading(relief, chosen, channels)


def _open(path: Path) -> Any:
    """The reader of a file: by its content, and by its extension where that fits another format, too.

    Some formats have no mark in their content, so that another reader may take such a file for its own.
    """
    readers = library()
    extension = path.suffix[1:].lower()
    found, failure = None, ""
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
                return reader(str(path))
            except Exception as error:
                failure = _failure(error)
    if found is not None:
        return found
    raise SunbeamError(
        failure or "SurfaceTopography knows no format of this content; Gwyddion reads others, and saves them as .gwy"
    )


def _failure(error: Exception) -> str:
    """The library's message in one line; empty where it has none, since then the file is of no format it knows."""
    text = " ".join(str(error).split())
    return f"SurfaceTopography fails on it: {text[:_SHOWN]}" if text else ""


def _given_sizes(known: str, points: Iterable[int], pixel_size: float | None, unit: str) -> tuple[float, ...]:
    """Sizes along x and y, in the file's unit, of a file that tells none.

    Raises :class:`SunbeamError` without a pixel size.
    """
    if known in _TEXT:
        raise SunbeamError("it does not tell its size; sunbeam reads such text itself, with pixel_size in µm")
    if pixel_size is None:
        raise SunbeamError("it does not tell its size; give pixel_size in µm (--pixel-size)")
    return tuple(count * pixel_size / um_per(unit) for count in points)


def _check(relief: Relief, pixel_size: float | None) -> None:
    """Raises :class:`SunbeamError` for a pixel size other than the one given, and for what is no relief by its size."""
    if pixel_size is not None:
        for own in relief.pixel_um:
            if abs(own - pixel_size) > _AGREEMENT * own:
                raise SunbeamError(f"pixel_size is given as {pixel_size} µm, but the file says {own} µm")
    if relief.holes == relief.heights_um.size:
        raise SunbeamError("no point has a height")
    for name, um in (("pixels", max(relief.pixel_um)), ("heights from peak to valley", relief.peak_to_valley_um)):
        if um > _LARGEST_UM:
            raise SunbeamError(f"its {name} are {um:.6g} µm, more than the {_LARGEST_UM:g} µm of the largest relief")


def _write_gsf(target: Path, reading: Reading) -> None:
    """Writes the relief in metres, the row of the largest y first. Raises :class:`SunbeamError` where it cannot."""
    from gsffile import write_gsf

    relief = reading.relief
    rows, columns = relief.heights_um.shape
    dx_um, dy_um = relief.pixel_um
    about = {"XReal": columns * dx_um * 1e-6, "YReal": rows * dy_um * 1e-6, "XYUnits": "m", "ZUnits": "m"}
    # A header of the format has neither of these characters in its values.
    title = reading.channel.title.translate(str.maketrans("=\0", "  "))
    metres = single_precision(relief.heights_um[::-1] * 1e-6)
    part = target.with_name(f".{target.stem}.{os.getpid()}.gsf")
    try:
        write_gsf(part, metres, {**about, "Title": title})
        os.replace(part, target)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise SunbeamError(f"{target}: cannot be written: {error.strerror or error}") from error


class _Parser(argparse.ArgumentParser):
    """Tells in one line what is wrong with the arguments."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"convert: {message}\n")


def main(words: list[str] | None = None) -> int:
    """The command line; the exit code, which is 2 with one line on stderr for what is refused."""
    parser = _Parser(
        prog="python -m sunbeam_mitsuba.convert",
        description="Writes the heights of an instrument's file, with their size and unit, as .gsf.",
        epilog=f"The library SurfaceTopography reads the file: {INSTALL}.",
    )
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="a file of an instrument or a program")
    add("-o", "--output", type=Path, required=True, metavar="FILE.gsf", help="where the heights go")
    add("--channel", metavar="N", help="number or title of the channel (default: the first that is a height)")
    add("--pixel-size", type=float, metavar="UM", help="edge of a pixel in µm, for a file that does not tell its size")
    add("--unit", metavar="UNIT", help="unit of length, such as nm, for a file that does not tell it")
    given = parser.parse_args(words)
    try:
        found = convert(given.file, given.output, given.channel, pixel_size=given.pixel_size, unit=given.unit)
    except SunbeamError as error:
        print(f"convert: {error}", file=sys.stderr)
        return 2
    relief = found.relief
    rows, columns = relief.heights_um.shape
    dx_um, dy_um = relief.pixel_um
    print(f"channels: {listed(found.channels)}", file=sys.stderr)
    print(
        f"{given.output}: channel {found.channel}, {columns} × {rows} pixels of {dx_um:.6g} × {dy_um:.6g} µm, "
        f"{relief.peak_to_valley_um:.6g} µm from peak to valley, {relief.holes} points without a height",
        file=sys.stderr,
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
