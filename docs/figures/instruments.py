"""The part `instruments`: test files of the library SurfaceTopography, converted, against native readers and Gwyddion.

It needs the folder of these files in the environment's `SAMPLES`; docs/height-fields.md says where to get them.
Gwyddion is compared where the program is on `PATH`.
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

from mitsuba_scenes.environment import REPOSITORY, SetupError
from mitsuba_scenes.tool import sunbeam

from .page import insist

PART = "instruments"
# Formats of the native readers, with an extension of each.
NATIVE = {"di": ".spm", "sdf": ".sdf", "x3p": ".x3p", "xyz": ".xyz", "gwy": ".gwy", "asc": ".txt"}
# Text formats, which the native readers may refuse, and for which Gwyddion asks for sizes.
TEXT = ("asc", "xyz")
# Largest difference of equal heights over peak to valley: rounding of doubles with an offset of up to 1e4 times peak to
# valley, and of scales in text with seven digits.
SAME = 1e-6


@dataclass(frozen=True)
class Sample:
    """A file with its format, and the relief or the reason of its refusal."""

    path: Path
    format: str
    reading: Any
    refusal: str


def figures() -> dict | None:
    """Converts all files; `None`, after one printed line, without `SAMPLES`."""
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
    insist(PART, all(row["native"]["same"] for row in native), "the native readers give the same")
    insist(PART, all(row["gwyddion"]["same"] for row in gwyddion), "Gwyddion gives the same, or its mirror image")
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
    """Names of formats that only the library reads and of which no map was available."""
    seen = {row["format"] for row in refused if "profiles" not in row["reason"]}
    extensions = converter().EXTENSIONS
    return [
        row["name"]
        for row in formats
        if not row["maps"] and row["format"] not in seen and extensions & set(row["extensions"])
    ]


def reasons(refused: list[dict]) -> dict[str, int]:
    """Numbers of files refused as profiles, as bare arrays, by size, by unit, or as unreadable."""
    kinds = {"profiles": "profiles", "bare arrays": "arrays", "does not tell": "units", "more than the": "sizes"}
    counts = dict.fromkeys([*kinds.values(), "unreadable"], 0)
    for row in refused:
        counts[next((kind for part, kind in kinds.items() if part in row["reason"]), "unreadable")] += 1
    return counts


def read(path: Path) -> Sample:
    """Converts a file; points without a unit are in µm."""
    convert = converter()
    known, options = "", {}
    try:
        known = convert.library().detect_format(str(path))
    except convert.library().CannotDetectFileFormat:
        known = "unknown"
    try:
        if known == "xyz":
            options = {"unit": "µm"}
        return Sample(path, known, convert.read(path, **options), "")
    except convert.SunbeamError as error:
        return Sample(path, known, None, str(error).removeprefix(f"{path}: "))


def converter() -> Any:
    """The module `sunbeam_mitsuba.convert` of the checkout."""
    if str(REPOSITORY / "python") not in sys.path:
        sys.path.insert(0, str(REPOSITORY / "python"))
    import sunbeam_mitsuba.convert as convert

    return convert


def readable() -> list[str]:
    """Names of SurfaceTopography's formats, in alphabetical order."""
    return sorted(reader.format() for reader in converter().library().readers)


def compared(sample: Sample, work: Path) -> dict:
    """Figures of a map: its size, and differences from the native reader and from Gwyddion."""
    relief = sample.reading.relief
    return {
        "file": sample.path.name,
        "format": sample.format,
        "pixels": list(relief.heights_um.shape[::-1]),
        "holes": relief.holes,
        "native": beside_native(sample, work),
        "gwyddion": beside_gwyddion(sample, work),
    }


def beside_native(sample: Sample, work: Path) -> dict | None:
    """Largest differences from the native reader's heights and pixels; `None` for other formats."""
    if sample.format not in NATIVE:
        return None
    copy, out = work / f"copy{NATIVE[sample.format]}", work / "native.npy"
    shutil.copy(sample.path, copy)
    words = ("--height-field", copy, "--level", "none", "--fill", "mean", "-o", out)
    try:
        pixel_um = json.loads(sunbeam("height-field", *words))["pixel_um"]
    except SetupError:
        if sample.format in TEXT:
            return None
        raise
    return differences(sample.reading.relief, np.load(out), pixel_um)


def beside_gwyddion(sample: Sample, work: Path) -> dict | None:
    """Compares with Gwyddion's heights; `None` where Gwyddion cannot read the file or is not installed."""
    if sample.format in TEXT or shutil.which("gwyddion") is None:
        return None
    made = work / f"{sample.path.name}.gwy"
    run_gwyddion(f"--convert-to-gwy={made}", str(sample.path))
    if not made.exists():
        return None
    from gwyfile import load

    relief = sample.reading.relief
    found = []
    for key, field in load(str(made)).items():
        if not key.endswith("/data") or np.shape(field.data) != relief.heights_um.shape:
            continue
        unit = field.si_unit_z.unitstr if field.si_unit_z else None
        if unit != "m":
            continue
        # Gwyddion's first row is the top. Both have a mask of missing points.
        heights_um = np.array(field.data)[::-1] * 1e6
        rows, columns = heights_um.shape
        pixel_um = (field.xreal * 1e6 / columns, field.yreal * 1e6 / rows)
        for mirrored in (False, True):
            shown = heights_um[::-1] if mirrored else heights_um
            found.append({**differences(relief, shown, pixel_um), "mirrored": mirrored})
    return min(found, key=lambda one: one["heights"], default=None)


def differences(relief: Any, heights_um: np.ndarray, pixel_um: Any) -> dict:
    """Largest difference of heights over peak to valley, outside missing points, and relative difference of pixels."""
    known = np.isfinite(relief.heights_um)
    apart = heights_um[known] - relief.heights_um[known]
    # Gwyddion omits the offset of some surfaces, which does not affect diffraction.
    heights = float(np.abs(apart - np.median(apart)).max() / relief.peak_to_valley_um)
    pixels = float(np.abs(np.array(pixel_um) / relief.pixel_um - 1).max())
    return {"heights": heights, "pixels": pixels, "same": max(heights, pixels) < SAME}


def run_gwyddion(*words: str) -> str:
    """Runs Gwyddion, with its own X server if available, and returns its output."""
    display = ("xvfb-run", "-a") if shutil.which("xvfb-run") else ()
    done = subprocess.run([*display, "gwyddion", *words], capture_output=True, text=True, timeout=120)
    return done.stdout


def gwyddion_version() -> str:
    """The version's number: the line is "Gwyddion 2.62 (date)"."""
    return run_gwyddion("--version").split()[1]


def format_figures(name: str, maps: list[dict], refused: list[dict]) -> dict:
    """A format's row: extensions, number of maps, and comparisons."""
    reader = converter().library().lookup_reader_by_format[name]
    own = [row for row in maps if row["format"] == name]
    return {
        "format": name,
        "name": reader.name(),
        "extensions": list(reader.file_extensions()),
        "maps": len(own),
        "refused": sum(row["format"] == name for row in refused),
        **{by: summary([row[by] for row in own if row[by] is not None]) for by in ("native", "gwyddion")},
    }


def summary(rows: list[dict]) -> dict | None:
    """Number of equal files and largest difference of heights; `None` without files."""
    if not rows:
        return None
    return {
        "files": len(rows),
        "heights": max(row["heights"] for row in rows),
        "mirrored": any(row.get("mirrored", False) for row in rows),
    }
