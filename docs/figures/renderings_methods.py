"""Part `renderings-methods` of the documentation (page.py): comparisons of published methods.

It repeats figures 2.20 to 2.22 and B.1, and table 2.1, of M. Single's thesis, called Single 2014. The methods FLSS and
NMM are the thesis'. *GPU Gems' form* is Stam's shader as published in GPU Gems, chapter 8. All three are methods of the
realtime renderer (docs/realtime.md). A *shot* describes one picture (studio.py). Shots have `pigment=False`: the
pigment's colour would hide differences of the diffraction.

`insist` raises SetupError if the numbers contradict a sentence of the page.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from mitsuba_scenes.contact_sheet import contact_sheet
from mitsuba_scenes.crosscheck import realtime
from mitsuba_scenes.crosscheck.cases import SCANS
from mitsuba_scenes.environment import use_variant
from mitsuba_scenes.light import Light
from mitsuba_scenes.picture import tone_mapped
from mitsuba_scenes.scene import View
from mitsuba_scenes.skin import preset_skin, scanned_skin
from mitsuba_scenes.tool import sunbeam

from . import alignment, hues, stam_maps
from .appearance import read_exr
from .lab import period
from .page import images, insist
from .renderings import SCAN_WINDOW
from .speed_error import processor
from .studio import SPP, SUPERSAMPLE, Shot, Studio

PART = "renderings-methods"
# Files of the scans by capitalised species.
SCAN_FILES = {species.capitalize(): path for species, path in SCANS.items()}
# Camera above the compact disc, whose mesh is in cm. The first two numbers are width and height in pixels.
DISC_VIEW = View(200, 200, origin_cm=(0, -3, 26), target_cm=(0, 0, 0), fov_deg=28)
# The light of the disc: a sun at this azimuth and elevation in degrees, without sky.
DISC_LIGHT = Light(180, 70, "directional", sky_radiance=0)
# Spacing of a compact disc's tracks.
CD_UM = 1.6
# Spacing of the tracks in a public demonstration of Stam's shader (docs/realtime.md#stam-and-the-shader-of-gpu-gems).
DEMO_UM = 10.0
# Option of the method `stam` that selects GPU Gems' form.
GEMS = {"stam_form": "gems"}
# Size of the timed frames of table 2.1 in pixels.
FRAME = "384x256"
# Number of renders of a timed frame. `sunbeam render` reports the median time of each stage; of two renders that is the
# longer time. More renders give steadier times and take longer.
REPEATS = 2
# A BRDF map counts as symmetric if the ratio of the luminances of its halves, right and left, is nearer to 1 than this.
SYMMETRIC = 1e-3
# A BRDF map counts as one-sided if the ratio of the luminances of its halves, brighter and darker, is above this.
ONE_SIDED = 2.0
# Peak angles count as equal if they differ by less than this.
ALIKE_DEG = 1.0


@dataclass
class Drawn:
    """The picture of a shot in linear sRGB, (rows, columns, 3), and as a displayed PNG."""

    shot: Shot
    pixels: np.ndarray
    png: Path


def figures() -> dict:
    """All numbers of the part: an entry for each figure or table, and the settings; draws the figures."""
    use_variant()
    folder = images(PART)
    with TemporaryDirectory() as scratch:
        studio = Studio(Path(scratch))
        by_figure = {
            "cut_outs": cut_outs(folder / "cut-outs.png"),
            "disc": disc(studio, folder),
            "symmetry": symmetry(studio.folder),
            "xenopeltis": xenopeltis(studio, folder),
            "nmm": nmm(studio, folder),
            "frames": frames(studio),
            "frame_size": FRAME.replace("x", " × "),
        }
        return {
            **by_figure,
            "adapter": studio.adapter,
            "processor": processor(),
            "cores": os.cpu_count(),
            "has_scans": all(path.exists() for path in SCAN_FILES.values()),
            "spp": SPP,
            "rays": SUPERSAMPLE**2,
            "limits": {
                "clipped_percent": 100 * hues.CLIPPED,
                "dark_percent": 100 * hues.DARK,
                "near_deg": hues.NEAR_DEG,
                "coloured": hues.COLOURED,
                "bin_deg": hues.BIN_DEG,
                "blue_deg": hues.BLUE_DEG,
            },
        }


def surfaces(species: str) -> dict[str, dict]:
    """Parameters of the plugin by title: "SPECIES, scan", if the scan is present, and "SPECIES, procedural"."""
    path, skins = SCAN_FILES[species], {}
    if path.exists():
        skins[f"{species}, scan"] = scanned_skin(path)
    else:
        print(f"NOT DRAWN: no scan at {path}, so there is no measured {species}", flush=True)
    skins[f"{species}, procedural"] = preset_skin(species.lower())
    return skins


def repeating(skin: dict) -> dict:
    """Parameters of the skin for methods that need a relief that repeats.

    Presets repeat by themselves. A scan repeats under SCAN_WINDOW, a coherence window as wide as the scan, so that its
    repeats hardly interfere.
    """
    return {**skin, **SCAN_WINDOW} if "filename" in skin else skin


def cut_outs(file: Path) -> list[dict]:
    """Figure 2.20: draws cut-outs; returns the period of each, and the `wander_nm` of its lines of constant phase.

    The wander is the rms distance of these lines from straight ones (alignment.py). Raises SetupError unless that of
    the compact disc is the smallest.
    """
    # The axis of each cut-out is that of the surface's strongest period. Skins have rows of fingers, long parallel
    # ridges. In the scans the fingers lie along x. Elaphe's strongest period is across the fingers, along y. That of
    # Xenopeltis is from row to row, along x.
    skins = surfaces("Elaphe")
    chosen = {title: alignment.cut_out(skin, "y") for title, skin in skins.items() if "filename" in skin}
    chosen["CD"] = alignment.cut_out({"preset": "cd"}, "x")
    for title, skin in surfaces("Xenopeltis").items():
        if "filename" in skin:
            chosen[title] = alignment.cut_out(skin, "x")
    # Without the rotation that it has on the snake, the preset has its fingers along y and its period along x.
    chosen["Elaphe, procedural"] = alignment.cut_out({"preset": "elaphe"}, "x")
    alignment.draw(chosen, file)
    rows = [
        {"title": title, "period_um": cut.period_um, "wander_nm": 1e3 * cut.wander_um} for title, cut in chosen.items()
    ]
    least = min(rows, key=lambda row: row["wander_nm"])
    insist(PART, least["title"] == "CD", "the disc is the most regular")
    return rows


def draw(studio: Studio, shots: list[Shot]) -> tuple[list[Drawn], np.ndarray]:
    """Draws shots that share object, rotation, light and view, each with its own exposure.

    Returns the pictures, and the directions at their pixels, the array of `pairs_of`.
    """
    pairs = pairs_of(studio, shots[0])
    return [exposed(studio, shot, hues.lit(pairs)) for shot in shots], pairs


def exposed(studio: Studio, shot: Shot, lit: np.ndarray) -> Drawn:
    """Draws a shot and exposes it by the pixels of the mask `lit`."""
    exr = studio.shoot(shot).exr
    pixels, png = read_exr(exr), exr.with_name(f"{exr.stem}-exposed.png")
    Image.fromarray(tone_mapped(pixels, hues.exposure_stops(pixels[lit]))).save(png)
    print(shot.caption, flush=True)
    return Drawn(shot, pixels, png)


def pairs_of(studio: Studio, shot: Shot) -> np.ndarray:
    """Directions to sun and camera where the pixels' centres see the object, an array (rows, columns, 8).

    `hues.lit` describes its eight numbers.
    """
    npy, exr = studio.folder / "pairs.npy", studio.folder / "pairs.exr"
    mesh = (studio.disc if shot.disc else studio.snake).mesh
    rotation = {name: value for name, value in shot.skin.items() if name == "rotation"}
    # The fastest method and relief serve, since only the rotation among the surface's parameters changes directions.
    realtime.render(exr, "stam", mesh, {"preset": "blazed", **rotation}, shot.light, shot.view, pairs=npy)
    return np.load(npy)


def sheet(rows: list[list[Drawn]], studio: Studio, file: Path) -> None:
    """Writes rows of pictures with captions as one JPEG."""
    png = studio.folder / "sheet.png"
    contact_sheet([[(drawn.png, drawn.shot.caption) for drawn in row] for row in rows], png, rows[0][0].shot.view.width)
    with Image.open(png) as made:
        made.save(file, quality=88)


def disc(studio: Studio, folder: Path) -> dict:
    """Figure 2.21: draws a disc by FLSS, by GPU Gems' form and path-traced; returns the result of `disc_peaks`.

    `disc_peaks` (stam_maps.py) has the peak angles of order 1. Raises SetupError if the numbers contradict the page.
    """
    flss = Shot("FLSS", {"preset": "cd"}, "flss", DISC_LIGHT, view=DISC_VIEW, pigment=False, disc=True)
    shots = [flss]
    for um in (CD_UM, DEMO_UM):
        shots.append(
            replace(flss, caption=f"Stam, GPU Gems, {um:g} um", method="stam", options={**GEMS, "period_um": um})
        )
    shots.append(replace(flss, caption="path-traced (Mitsuba 3)", method=None))
    # The disc's numbers come from BRDF maps, which need no directions at pixels.
    drawn, _ = draw(studio, shots)
    sheet([drawn], studio, folder / "disc.jpg")
    found = stam_maps.disc_peaks(studio.folder, CD_UM, DEMO_UM)
    # Three rows of GPU Gems' form: with the tracks' own spacing, the demonstration's, and the fitted one.
    own_deg, _, fitted_deg = (row["largest_off_deg"] for row in found["gems"])
    holds = fitted_deg < ALIKE_DEG < own_deg
    insist(PART, holds, "GPU Gems' form agrees with FLSS on the disc only if its spacing is fitted")
    return found


def symmetry(folder: Path) -> list[dict]:
    """The rows of `stam_maps.symmetry` for both gratings, and for Xenopeltis without its rotation on the snake.

    Raises SetupError unless GPU Gems' form is symmetric, and FLSS one-sided on the blazed grating.
    """
    skins = {"Blazed": {"preset": "blazed"}, "CD": {"preset": "cd"}}
    for title, skin in surfaces("Xenopeltis").items():
        skins[title] = repeating({name: value for name, value in skin.items() if name != "rotation"})
    found = stam_maps.symmetry(folder, skins)
    insist(PART, all(abs(row["gems"] - 1) < SYMMETRIC for row in found), "GPU Gems' form is symmetric")
    # The first row is that of "Blazed".
    blazed = found[0]["flss"]
    insist(PART, max(blazed, 1 / blazed) > ONE_SIDED, "the blazed grating sends its light to one side")
    return found


def xenopeltis(studio: Studio, folder: Path) -> list[dict]:
    """Figure 2.22: draws Xenopeltis by FLSS, by GPU Gems' form and path-traced; returns a row for each picture.

    - `dark_near`, `dark`: the fractions of dark pixels near highlights, and among all lit pixels.
    - `hues`: the effective number of hues (hues.py).
    - `three_bins`: the fraction of the coloured pixels in the three fullest bins of hues.

    Raises SetupError unless GPU Gems' form has more dark pixels near highlights and fewer hues than FLSS.
    """
    rows, found, plotted = [], [], {}
    for title, skin in surfaces("Xenopeltis").items():
        repeated = repeating(skin)
        gems = {**GEMS, "period_um": period(skin, "x")["period_um"]}
        kind = title.split(", ")[1]
        shots = [
            Shot(f"{kind}, FLSS", repeated, "flss", pigment=False),
            Shot(f"{kind}, Stam (GPU Gems)", repeated, "stam", pigment=False, options=gems),
            Shot(f"{kind}, path-traced", skin, None, pigment=False),
        ]
        row, pairs = draw(studio, shots)
        rows.append(row)
        lit, near = hues.lit(pairs), hues.near_highlight(pairs)
        for drawn in row:
            pixels = drawn.pixels[lit]
            fractions = hues.histogram(pixels)
            plotted[drawn.shot.caption] = fractions
            found.append(
                {
                    "caption": drawn.shot.caption,
                    "dark_near": hues.dark_fraction(pixels, near[lit]),
                    "dark": hues.dark_fraction(pixels, np.ones(len(pixels), dtype=bool)),
                    "hues": hues.effective_hues(fractions),
                    "three_bins": float(np.sort(fractions)[-3:].sum()),
                }
            )
        # The rows of this surface, in the order of its shots. That of the path-traced one is not compared.
        flss, stam, _ = found[-3:]
        # Twice as many dark pixels count as a lack of colours.
        more_dark = stam["dark_near"] > 2 * flss["dark_near"]
        insist(PART, more_dark, f"GPU Gems' form lacks colours near highlights on {title}")
        insist(PART, stam["hues"] < flss["hues"], f"GPU Gems' form has more discrete colours on {title}")
    sheet(rows, studio, folder / "xenopeltis.jpg")
    plot_hues(plotted, folder / "hues.svg")
    return found


def plot_hues(histograms: dict[str, np.ndarray], file: Path) -> None:
    """Draws histograms of hues by caption, "SURFACE, METHOD", in one plot for each surface."""
    titles = list(dict.fromkeys(caption.rsplit(", ", 1)[0] for caption in histograms))
    figure = Figure(figsize=(4.2 * len(titles), 2.8), layout="constrained")
    for axes, title in zip(np.atleast_1d(figure.subplots(1, len(titles), sharey=True)), titles):
        for caption, fractions in histograms.items():
            if caption.startswith(title):
                edges = np.linspace(0, 360, len(fractions) + 1)
                axes.stairs(100 * fractions, edges, label=caption.removeprefix(f"{title}, "), linewidth=1.3)
        axes.set(title=title, xlabel="hue / degrees", xlim=(0, 360), xticks=range(0, 361, 60))
        axes.legend(fontsize="small", frameon=False)
    figure.axes[0].set_ylabel("share of coloured pixels / %")
    with matplotlib.rc_context({"svg.hashsalt": file.stem}):
        figure.savefig(file, metadata={"Date": None})


def nmm(studio: Studio, folder: Path) -> list[dict]:
    """Figure B.1: draws Elaphe by FLSS, by NMM as in Single 2014, and by NMM with quadrature weights.

    Returns three rows for each surface, one for each method in this order. A row has CIELAB's mean a* and b* of the lit
    pixels, and under `of_blue` those of the pixels that are blue by FLSS.
    """
    rows, found = [], []
    for title, skin in surfaces("Elaphe").items():
        kind = title.split(", ")[1]
        flss = Shot(f"{kind}, FLSS", repeating(skin), "flss", pigment=False)
        published = replace(flss, caption=f"{kind}, NMM", method="nmm", options={"weighted": False})
        weighted = replace(flss, caption=f"{kind}, NMM weighted", method="nmm")
        row, pairs = draw(studio, [flss, published, weighted])
        rows.append(row)
        lit = hues.lit(pairs)
        reference = row[0].pixels[lit]
        for drawn in row:
            pixels = drawn.pixels[lit]
            blue = hues.blue_means(reference, pixels)
            found.append({"caption": drawn.shot.caption, **hues.cast(pixels), "of_blue": blue})
    sheet(rows, studio, folder / "nmm.jpg")
    return found


def frames(studio: Studio) -> list[dict]:
    """Table 2.1: milliseconds of a frame on the GPU, frames per second, and faces of the mesh, by skin and method."""
    found = []
    for species in SCAN_FILES:
        for title, skin in surfaces(species).items():
            for method in ("flss", "nmm"):
                arguments = ["--mesh", studio.snake.mesh, "--method", method, "--size", FRAME, "--repeat", REPEATS]
                arguments += realtime.surface_words(repeating(skin))
                report = json.loads(sunbeam("render", "-o", studio.folder / "frame.exr", *arguments))
                ms, faces = report["gpu_ms"], report["triangles"]
                found.append({"title": title, "method": method, "ms": ms, "fps": 1e3 / ms, "faces": faces})
                print(f"{title}, {method}: {ms:.0f} ms", flush=True)
    return found
