"""The demo, `make demo`: skins, a scan, a moving sun, foils and films in Mitsuba; then the two renderers compared.

Writes an EXR and a PNG for each picture, a contact sheet, `report.json`, and the short cross-check
(crosscheck/run.py).
"""

from __future__ import annotations

import argparse
import gc
import itertools
import json
import os
import platform
import re
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import drjit as dr
import mitsuba as mi

from . import picture
from .contact_sheet import contact_sheet
from .crosscheck.cases import SCAN
from .crosscheck.run import Disagreement, crosscheck, insist
from .discs import DISC_VIEW, disc_scene
from .environment import DEFAULT_VARIANT, REPOSITORY, SetupError, use_variant
from .films import SPECTACLES_VIEW, WINDOW_VIEW, spectacles_scene, window_scene
from .foils import CARD_VIEW, card_scene
from .light import Light
from .outputs import output_folder
from .render import EXPOSURE_STOPS, positive
from .scene import View
from .side_by_side import side_by_side
from .skin import preset_skin, scanned_skin, skin_bsdf
from .snake import SnakeFiles, snake_files

# Presets of the first row of the sheet, with their captions.
SKINS = {"blazed": "Blazed", "elaphe": "Elaphe, procedural", "xenopeltis": "Xenopeltis, procedural"}
# Azimuths of the sun in the second row, counter-clockwise from +x seen from above.
SWEEP_AZIMUTHS_DEG = (-170.0, -130.0, -100.0)
# Pictures of the third row by the name of their files: caption, function that makes the scene, and its camera.
FOILS_AND_FILMS = {
    "card": ("Holographic card, aluminium", card_scene, CARD_VIEW),
    "compact-disc": ("Compact disc under polycarbonate", disc_scene, DISC_VIEW),
    "window": ("Window film in the sun, its spectra on the floor", window_scene, WINDOW_VIEW),
    "spectacles": ("Street lamps through diffraction spectacles", spectacles_scene, SPECTACLES_VIEW),
}
# Exposure of the third row in stops (doublings): 0, since unlike the snake these scenes need no brightening.
FOILS_AND_FILMS_EXPOSURE_STOPS = 0.0


class Shot(NamedTuple):
    """A picture of the sheet: file name without ending, caption, parameters of the plugin, and light."""

    name: str
    caption: str
    skin: dict
    light: Light


def shots() -> list[list[Shot]]:
    """The sheet's first two rows: every skin in one light, and one skin in several lights.

    A missing scan is reported on stdout and left out.
    """
    skins = [Shot(name, caption, preset_skin(name), Light()) for name, caption in SKINS.items()]
    if SCAN.exists():
        skins.insert(0, Shot("scan-xenopeltis", "Xenopeltis, AFM scan", scanned_skin(SCAN), Light()))
    else:
        print(f"no scan at {SCAN}: skipping the picture of a measured height field", flush=True)
    sweep = [
        Shot(
            f"light-{number}",
            f"Xenopeltis, procedural, sun at azimuth {azimuth_deg:g}°",
            preset_skin("xenopeltis"),
            Light(azimuth_deg),
        )
        for number, azimuth_deg in enumerate(SWEEP_AZIMUTHS_DEG, 1)
    ]
    return [skins, sweep]


def tables(description: str) -> dict:
    """Size in MB and relative error of a skin's precomputed tables, parsed from `description`, which is `str(bsdf)`.

    Raises ValueError if the description lacks one of them.
    """
    # RGB and mono variants have "tables of colours".
    size = re.search(r"tables of (?:colours of )?([0-9.e+-]+) MB", description)
    error = re.search(r"relative error ([0-9.e+-]+[0-9])", description)
    if not (size and error):
        raise ValueError(f"no size and error of the tables in {description!r}")
    return {"size_mb": float(size[1]), "relative_error": float(error[1])}


def stage_times(seconds: dict) -> str:
    """The seconds of a picture's stages (`picture.render`) as text for the terminal."""
    return ", ".join(f"{stage} {value:.2f} s" for stage, value in seconds.items())


def versions() -> dict:
    """Versions of the software, the machine's architecture, and the number of cores of this process."""
    return {
        "mitsuba": mi.__version__,
        "drjit": dr.__version__,
        "python": platform.python_version(),
        "machine": platform.machine(),
        "cores": len(os.sched_getaffinity(0)),
    }


def main(words: list[str] | None = None) -> int:
    """Runs the command with the arguments `words`, by default those of the process.

    Returns the exit status: 0, 1 if the renderers disagree, or 2 after one line on stderr for another error. Wrong
    arguments end the process with status 2, by argparse, which also prints the usage.
    """
    view = View()
    parser = argparse.ArgumentParser(prog="python -m mitsuba_scenes.demo", description=__doc__)
    add = parser.add_argument
    add("-o", "--output", type=output_folder, default=str(REPOSITORY / "out"), help="folder of pictures and report")
    add("--variant", default=DEFAULT_VARIANT, help="variant of Mitsuba; only a spectral one compares the renderers")
    size = (view.width, view.height)
    add("--resolution", type=positive(int), nargs=2, metavar=("W", "H"), default=size, help="in pixels")
    add("--spp", type=positive(int), default=32, help="samples a pixel (32)")
    options = parser.parse_args(words)
    try:
        make(options.output, options.variant, View(*options.resolution), options.spp)
    except Disagreement as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return 1
    except (SetupError, picture.PictureError, ValueError, OSError, RuntimeError) as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return 2
    return 0


def make(output: Path, variant: str, view: View, spp: int) -> None:
    """Renders all pictures, compares the renderers, and writes pictures and `report.json` into `output`.

    `view` is the camera of the snake's pictures; the others take only its resolution. The compared renderers are
    Mitsuba with the plugin, and the realtime renderer `sunbeam render`. If they disagree, `insist` raises Disagreement.
    In a variant without wavelengths the comparison is skipped.
    """
    start = time.perf_counter()
    variant = use_variant(variant)
    files = snake_files()
    rows = shots()
    count = sum(len(row) for row in rows) + len(FOILS_AND_FILMS)
    announce = announcer(count)
    pictures: dict[str, dict] = {}
    report = {
        "variant": variant,
        "resolution": [view.width, view.height],
        "spp": spp,
        "versions": versions(),
        "pictures": pictures,
    }
    sheet = snake_rows(rows, files, view, spp, output, announce, pictures)
    # A kernel of Dr.Jit contains the code of all existing BSDFs. Those of the skins are unused after `snake_rows`. They
    # are deleted here, so that the kernels of the next pictures are smaller.
    gc.collect()
    sheet.append(foils_and_films_row(view, spp, output, announce, pictures))
    contact_sheet(sheet, output / "contact-sheet.png", view.width)
    # The report is written before the comparison, which may fail: it needs a GPU adapter, or one in software.
    write_report(report, output, start)
    print(f"{count} pictures, contact-sheet.png and report.json are in {output} ({report['seconds']:.0f} s)")
    if not mi.is_spectral:
        print(f"NOT CHECKED: {variant} has no wavelengths, so the renderers are not compared", flush=True)
        return
    print("the same picture by both renderers ...", end=" ", flush=True)
    both = report["both_renderers"] = side_by_side(files, view, spp, output)
    flip, delta_e = both["compared"]["flip"]["mean"], both["compared"]["delta_e_2000"]["mean"]
    print(f"both-renderers.png: FLIP {flip:.3f}, ΔE2000 {delta_e:.2f} on average", flush=True)
    print("comparing the path tracer and the realtime renderer", flush=True)
    report["crosscheck"] = crosscheck(output / "crosscheck", short=True)
    write_report(report, output, start)
    insist(report["crosscheck"])


def announcer(count: int) -> Callable[[str], None]:
    """A function that prints the number and the caption of each of `count` pictures before it is rendered."""
    numbers = itertools.count(1)

    def announce(caption: str) -> None:
        print(f"[{next(numbers)}/{count}] {caption} ...", end=" ", flush=True)

    return announce


def snake_rows(
    rows: list[list[Shot]],
    files: SnakeFiles,
    view: View,
    spp: int,
    output: Path,
    announce: Callable[[str], None],
    pictures: dict[str, dict],
) -> list[list[tuple[Path, str]]]:
    """Renders the shots, and adds their entries of the report to `pictures` by file name without ending.

    Returns the (PNG, caption) of each picture, by rows. Raises PictureError for a black picture or values that are not
    finite.
    """
    sheet: list[list[tuple[Path, str]]] = []
    bsdf_of_skin: dict[str, mi.BSDF] = {}
    for row in rows:
        sheet.append([])
        for name, caption, skin, light in row:
            announce(caption)
            # Pictures with equal parameters of the skin share one BSDF, so its tables are built once: the first
            # `render` takes the dictionary of `skin_bsdf`, later ones its BSDF.
            key = json.dumps(skin, sort_keys=True)
            bsdf = bsdf_of_skin.get(key) or skin_bsdf(skin, files.pigment)
            # The first pass includes the compilation of kernels; later ones show the time without it.
            result = picture.render(bsdf, files, light, view, spp, passes=2)
            bsdf_of_skin[key] = result.bsdf
            picture.check(result.pixels, name)
            png = picture.write(result.pixels, output / f"{name}.exr", EXPOSURE_STOPS)
            print(stage_times(result.seconds), flush=True)
            sheet[-1].append((png, caption))
            pictures[name] = {
                "files": [f"{name}.exr", f"{name}.png"],
                "light": vars(light),
                "skin": skin,
                "seconds": result.seconds,
                "tables": tables(str(result.bsdf)),
                "bsdf": str(result.bsdf),
                "mean_rgb": result.pixels.mean(axis=(0, 1)).tolist(),
            }
    return sheet


def foils_and_films_row(
    view: View, spp: int, output: Path, announce: Callable[[str], None], pictures: dict[str, dict]
) -> list[tuple[Path, str]]:
    """Renders FOILS_AND_FILMS at the resolution of `view`, and adds their entries of the report to `pictures`.

    Returns the (PNG, caption) of each picture. Raises PictureError as `snake_rows` does.
    """
    row = []
    for name, (caption, make_scene, camera) in FOILS_AND_FILMS.items():
        announce(caption)
        scene = make_scene(replace(camera, width=view.width, height=view.height))
        pixels, seconds = picture.render_scene(scene, spp, passes=2)
        picture.check(pixels, name)
        row.append((picture.write(pixels, output / f"{name}.exr", FOILS_AND_FILMS_EXPOSURE_STOPS), caption))
        print(stage_times(seconds), flush=True)
        pictures[name] = {
            "files": [f"{name}.exr", f"{name}.png"],
            "seconds": seconds,
            "mean_rgb": pixels.mean(axis=(0, 1)).tolist(),
        }
    return row


def write_report(report: dict, output: Path, start: float) -> None:
    """Adds the seconds since `start`, a value of `time.perf_counter`, to the report, and writes it to `report.json`."""
    report["seconds"] = time.perf_counter() - start
    (output / "report.json").write_text(json.dumps(report, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())
