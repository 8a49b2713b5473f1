"""Part `instruments` of the documentation (page.py): files of instruments, read by `sunbeam_mitsuba.convert`.

The converter reads with SurfaceTopography, called the *library* here. It is compared with *native readers*, those of
`sunbeam height-field`, and with the program Gwyddion if that is on `PATH`. The files are the library's test files. The
environment variable `SAMPLES` names their folder; docs/height-fields.md says where to get them. A *map* is a file with
heights on a grid; a *profile* has heights along a line. A *relief* is the converter's heights of a map.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from gwyfile import load as load_gwy

from mitsuba_scenes.environment import REPOSITORY, SetupError
from mitsuba_scenes.tool import sunbeam

from .page import insist

PART = "instruments"
# The library's names of the formats that native readers know, with a file extension that selects the native reader.
NATIVE = {"di": ".spm", "sdf": ".sdf", "x3p": ".x3p", "xyz": ".xyz", "gwy": ".gwy", "asc": ".txt"}
# Text formats. Native readers may refuse such files, and Gwyddion asks its user for their sizes.
TEXT = ("asc", "xyz")
# Relative difference below which heights and pixel edges count as equal. A smaller one would reject text files, whose
# scales have seven digits.
SAME = 1e-6


@dataclass(frozen=True)
class Sample:
    """A file, the library's name of its format or "unknown", and the result of the converter.

    `reading` is a `convert.Reading` and `refusal` empty, or `reading` is `None` and `refusal` the converter's message.
    """

    path: Path
    format: str
    reading: Any
    refusal: str


def figures() -> dict | None:
    """All numbers of the part; `None`, after one printed line, without `SAMPLES`.

    - `maps`, `refused`: a row for each file that the converter reads, and one for each other file.
    - `formats`: a row for each format of the library.
    - `untried`, `reasons`: the results of the functions of these names.
    - `native`, `beside_gwyddion`: numbers of the files and formats compared with native readers, and with Gwyddion.

    Raises SetupError if a reader differs from the converter.
    """
    folder = os.environ.get("SAMPLES")
    if not folder:
        print(f"{PART}: left as it is, since SAMPLES names no folder (docs/height-fields.md says which)", flush=True)
        return None
    files = sorted(path for path in Path(folder).iterdir() if path.is_file())
    if not files:
        raise SetupError(f"SAMPLES={folder} has no files")
    samples = [read(path) for path in files]
    with TemporaryDirectory() as work:
        maps = [compared(sample, Path(work)) for sample in samples if sample.reading is not None]
    refused = [{"file": s.path.name, "format": s.format, "reason": s.refusal} for s in samples if s.reading is None]
    native = [row for row in maps if row["native"] is not None]
    gwyddion = [row for row in maps if row["gwyddion"] is not None]
    insist(PART, all(row["native"]["same"] for row in native), "the native readers give the same heights")
    insist(
        PART, all(row["gwyddion"]["same"] for row in gwyddion), "Gwyddion gives the same heights, or their mirror image"
    )
    # The page lists the formats whose maps Gwyddion shows upside down.
    mirrored = sorted({row["format"] for row in gwyddion if row["gwyddion"]["mirrored"]})
    insist(PART, mirrored == ["sdf", "x3p"], "only X3P and surface data files are upside down in Gwyddion")
    formats = [format_figures(name, maps, refused) for name in readable()]
    return {
        "library": version("SurfaceTopography"),
        "gwyddion": gwyddion_version() if gwyddion else None,
        "maps": maps,
        "refused": refused,
        "formats": formats,
        "untried": untried(formats, refused),
        "reasons": reasons(refused),
        "native": {"files": len(native), "formats": len({row["format"] for row in native})},
        "beside_gwyddion": {"files": len(gwyddion), "formats": len({row["format"] for row in gwyddion})},
    }


def untried(formats: list[dict], refused: list[dict]) -> list[str]:
    """Names of formats that only the converter reads and of which no file was available.

    Profiles do not count as files of a format, since the converter reads maps alone.
    """
    seen = {row["format"] for row in refused if "profiles" not in row["reason"]}
    # Extensions that no native reader reads.
    extensions = converter().EXTENSIONS
    return [
        row["name"]
        for row in formats
        if not row["maps"] and row["format"] not in seen and extensions & set(row["extensions"])
    ]


def reasons(refused: list[dict]) -> dict[str, int]:
    """Numbers of refused files by the reason: profiles, bare arrays, no unit, a size above the limit, unreadable.

    Raises SetupError for a message that matches no kind or several, so that a changed message is not counted wrongly.
    """
    # Kinds of reasons by phrases of the converter's messages.
    kinds = {
        "holds profiles": "profiles",
        "holds bare arrays": "arrays",
        "does not tell its unit": "units",
        "more than the": "sizes",
        "SurfaceTopography fails on it": "unreadable",
        "SurfaceTopography knows no format": "unreadable",
        "no point has a height": "unreadable",
    }
    counts = dict.fromkeys(kinds.values(), 0)
    for row in refused:
        matching = [kind for phrase, kind in kinds.items() if phrase in row["reason"]]
        if len(matching) != 1:
            raise SetupError(f"{PART}: the refusal of {row['file']} is of no known kind: {row['reason']}")
        counts[matching[0]] += 1
    return counts


def read(path: Path) -> Sample:
    """Reads a file by the converter; lists of points (`xyz`), which state no unit, are read as µm."""
    convert = converter()
    try:
        name = convert.library().detect_format(str(path))
    except convert.library().CannotDetectFileFormat:
        name = "unknown"
    try:
        return Sample(path, name, convert.read(path, unit="µm" if name == "xyz" else None), "")
    except convert.SunbeamError as error:
        return Sample(path, name, None, str(error).removeprefix(f"{path}: "))


def converter() -> Any:
    """The module `sunbeam_mitsuba.convert` of the checkout, whose package need not be installed."""
    if str(REPOSITORY / "python") not in sys.path:
        sys.path.insert(0, str(REPOSITORY / "python"))
    import sunbeam_mitsuba.convert as convert

    return convert


def readable() -> list[str]:
    """The library's names of its formats, in alphabetical order."""
    return sorted(reader.format() for reader in converter().library().readers)


def compared(sample: Sample, work: Path) -> dict:
    """A row for a map: its numbers of pixels, and differences from the native reader and from Gwyddion.

    `pixels` are the numbers along x and y, and `holes` is the number of points without a height.
    """
    relief = sample.reading.relief
    return {
        "file": sample.path.name,
        "format": sample.format,
        "pixels": list(relief.heights_um.shape[::-1]),
        "holes": relief.holes,
        "native": against_native(sample, work),
        "gwyddion": against_gwyddion(sample, work),
    }


def against_native(sample: Sample, work: Path) -> dict | None:
    """Differences from the native reader; `None` for formats without one, and for text that it refuses."""
    if sample.format not in NATIVE:
        return None
    # The name's ending selects the native reader.
    copy, out = work / f"copy{NATIVE[sample.format]}", work / "native.npy"
    shutil.copy(sample.path, copy)
    # The native reader must fill points without a height; `differences` does not compare these points.
    arguments = ("--height-field", copy, "--level", "none", "--fill", "mean", "-o", out)
    try:
        pixel_um = json.loads(sunbeam("height-field", *arguments))["pixel_um"]
    except SetupError:
        if sample.format in TEXT:
            return None
        raise
    return differences(sample.reading.relief, np.load(out), pixel_um)


def against_gwyddion(sample: Sample, work: Path) -> dict | None:
    """Differences from Gwyddion's heights, or from their mirror image along y if `mirrored`.

    Gwyddion's file may have several channels. Those in metres with the relief's size are compared, each as it is and
    mirrored, and the smallest differences are returned. `None` for text, without such a channel, and without Gwyddion.
    """
    if sample.format in TEXT or shutil.which("gwyddion") is None:
        return None
    made = work / f"{sample.path.name}.gwy"
    run_gwyddion(f"--convert-to-gwy={made}", str(sample.path))
    if not made.exists():
        return None
    relief = sample.reading.relief
    found = []
    for key, field in load_gwy(str(made)).items():
        # Channels are data fields under keys such as "/0/data"; the file has other entries too.
        if not key.endswith("/data") or np.shape(field.data) != relief.heights_um.shape:
            continue
        if not field.si_unit_z or field.si_unit_z.unitstr != "m":
            continue
        # Gwyddion's first row is the top, the relief's that of the smallest y.
        heights_um = np.array(field.data)[::-1] * 1e6
        rows, columns = heights_um.shape
        pixel_um = (field.xreal * 1e6 / columns, field.yreal * 1e6 / rows)
        for mirrored in (False, True):
            oriented_um = heights_um[::-1] if mirrored else heights_um
            found.append({**differences(relief, oriented_um, pixel_um), "mirrored": mirrored})
    return min(found, key=lambda one: one["heights"], default=None)


def differences(relief: Any, heights_um: np.ndarray, pixel_um: Any) -> dict:
    """Largest differences of `heights_um` and `pixel_um` from those of `relief`, and whether they are below SAME.

    `pixel_um` has the edges of a pixel along x and y. The result's `heights` is relative to peak to valley, over points
    where the relief has a height, without a constant offset. `pixels` is relative to the edges.
    """
    known = np.isfinite(relief.heights_um)
    difference_um = heights_um[known] - relief.heights_um[known]
    # Gwyddion omits the constant offset of some surfaces. An offset does not affect diffraction, so it is subtracted.
    heights = float(np.abs(difference_um - np.median(difference_um)).max() / relief.peak_to_valley_um)
    pixels = float(np.abs(np.array(pixel_um) / relief.pixel_um - 1).max())
    return {"heights": heights, "pixels": pixels, "same": max(heights, pixels) < SAME}


def run_gwyddion(*arguments: str) -> str:
    """Runs Gwyddion and returns its output, also if it fails, such as on a format that it cannot read.

    Gwyddion needs a display even for conversions, so it gets an X server of its own if `xvfb-run` is installed. It may
    wait for an answer to a dialogue: after two minutes subprocess.TimeoutExpired is raised.
    """
    display = ("xvfb-run", "-a") if shutil.which("xvfb-run") else ()
    done = subprocess.run([*display, "gwyddion", *arguments], capture_output=True, text=True, timeout=120)
    return done.stdout


def gwyddion_version() -> str:
    """Gwyddion's version number, from a line such as "Gwyddion 2.62 (date)"."""
    return run_gwyddion("--version").split()[1]


def format_figures(name: str, maps: list[dict], refused: list[dict]) -> dict:
    """A row for the format that the library calls `name`.

    It has the format's full name, extensions, numbers of maps and of refused files, and the `summary` of each
    comparison.
    """
    reader = converter().library().lookup_reader_by_format[name]
    own = [row for row in maps if row["format"] == name]
    return {
        "format": name,
        "name": reader.name(),
        "extensions": list(reader.file_extensions()),
        "maps": len(own),
        "refused": sum(row["format"] == name for row in refused),
        **{peer: summary([row[peer] for row in own if row[peer] is not None]) for peer in ("native", "gwyddion")},
    }


def summary(rows: list[dict]) -> dict | None:
    """Number of compared files, largest difference of heights, and whether any is mirrored; `None` without files."""
    if not rows:
        return None
    return {
        "files": len(rows),
        "heights": max(row["heights"] for row in rows),
        "mirrored": any(row.get("mirrored", False) for row in rows),
    }
