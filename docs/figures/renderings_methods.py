"""The part `renderings-methods`: figures 2.20 to 2.22 and B.1 of Single 2014, and its table 2.1."""

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
# Files of the scans by species.
SPECIES = {species.capitalize(): path for species, path in SCANS.items()}
# The disc from above.
DISC = View(200, 200, origin_cm=(0, -3, 26), target_cm=(0, 0, 0), fov_deg=28)
# The light of the disc.
DISC_LIGHT = Light(180, 70, "directional", 0)
# Spacing of a compact disc's tracks in µm.
CD_UM = 1.6
# Spacing of the demonstration's disc in µm.
DEMO_UM = 10.0
# Options of GPU Gems' form of Stam's shader (docs/realtime.md).
GEMS = {"stam_form": "gems"}
# Size of the timed frames of table 2.1 in pixels.
FRAME = "384x256"
# Number of repeats of a timed frame.
REPEATS = 2
# Largest deviation from 1 of the luminance of the right half over the left half of a symmetric map.
SYMMETRIC = 1e-3
# Smallest luminance of the right half over the left half of a one-sided map.
ONE_SIDED = 2.0
# Largest difference of peak angles that count as equal, in degrees.
ALIKE_DEG = 1.0


@dataclass
class Drawn:
    """A picture in linear sRGB, (rows, columns, 3), and as shown."""

    shot: Shot
    pixels: np.ndarray
    png: Path


def figures() -> dict:
    """Draws all figures; returns the numbers of the part."""
    use_variant()
    folder = images(PART)
    with TemporaryDirectory() as scratch:
        studio = Studio(Path(scratch))
        made = {
            "cut_outs": cut_outs(folder / "cut-outs.png"),
            "disc": disc(studio, folder),
            "symmetry": symmetry(studio.folder),
            "xenopeltis": xenopeltis(studio, folder),
            "nmm": nmm(studio, folder),
            "frames": frames(studio),
            "frame_size": FRAME.replace("x", " × "),
        }
        return {
            **made,
            "adapter": studio.adapter,
            "processor": processor(),
            "cores": os.cpu_count(),
            "has_scans": all(path.exists() for path in SPECIES.values()),
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
    """Parameters of the measured skin, if present, and of the procedural one, by title."""
    path, found = SPECIES[species], {}
    if path.exists():
        found[f"{species}, scan"] = scanned_skin(path)
    else:
        print(f"NOT DRAWN: no scan at {path}, so there is no measured {species}", flush=True)
    found[f"{species}, procedural"] = preset_skin(species.lower())
    return found


def of_one_window(skin: dict) -> dict:
    """The surface for the published methods: a scan repeats, under a window as wide as the scan."""
    return {**skin, **SCAN_WINDOW} if "filename" in skin else skin


def cut_outs(file: Path) -> list[dict]:
    """Figure 2.20: draws the cut-outs; returns the deviations of their lines of constant phase."""
    elaphe, rows_of_fingers = surfaces("Elaphe"), surfaces("Xenopeltis")
    chosen = {title: alignment.cut_out(skin, "y") for title, skin in elaphe.items() if "filename" in skin}
    chosen["CD"] = alignment.cut_out({"preset": "cd"}, "x")
    for title, skin in rows_of_fingers.items():
        if "filename" in skin:
            chosen[title] = alignment.cut_out(skin, "x")
    chosen["Elaphe, procedural"] = alignment.cut_out({"preset": "elaphe"}, "x")
    alignment.draw(chosen, file)
    found = [
        {"title": title, "period_um": cut.period_um, "wander_nm": 1e3 * cut.wander_um} for title, cut in chosen.items()
    ]
    disc = next(row["wander_nm"] for row in found if row["title"] == "CD")
    insist(PART, all(disc < row["wander_nm"] for row in found if row["title"] != "CD"), "the disc is the most regular")
    return found


def draw(studio: Studio, shots: list[Shot]) -> tuple[list[Drawn], np.ndarray]:
    """Draws shots of one surface with separate exposures; returns them and the directions at their pixels."""
    pairs = seen(studio, shots[0])
    return [exposed(studio, shot, pairs[..., 6] > 0) for shot in shots], pairs


def exposed(studio: Studio, shot: Shot, lit: np.ndarray) -> Drawn:
    """Draws a shot and exposes it by its lit pixels."""
    exr, _, _ = studio.shoot(shot)
    pixels, png = read_exr(exr), exr.with_name(f"{exr.stem}-exposed.png")
    Image.fromarray(tone_mapped(pixels, hues.exposure_stops(pixels[lit]))).save(png)
    print(shot.caption, flush=True)
    return Drawn(shot, pixels, png)


def seen(studio: Studio, shot: Shot) -> np.ndarray:
    """Directions in the grating's frame at the centre of each pixel, by `sunbeam render --pairs`."""
    npy, exr = studio.folder / "pairs.npy", studio.folder / "pairs.exr"
    mesh = (studio.disc if shot.disc else studio.snake).mesh
    turned = {name: value for name, value in shot.skin.items() if name == "rotation"}
    # The fastest surface, since the directions depend on its rotation alone.
    realtime.render(exr, "stam", mesh, {"preset": "blazed", **turned}, shot.light, shot.view, pairs=npy)
    return np.load(npy)


def sheet(rows: list[list[Drawn]], studio: Studio, file: Path) -> None:
    """Writes the rows as one picture with captions."""
    png = studio.folder / "sheet.png"
    contact_sheet([[(drawn.png, drawn.shot.caption) for drawn in row] for row in rows], png, rows[0][0].shot.view.width)
    with Image.open(png) as made:
        made.save(file, quality=88)


def disc(studio: Studio, folder: Path) -> dict:
    """Figure 2.21: the disc by FLSS and by GPU Gems' shader, and their angles of peaks."""
    flss = Shot("FLSS", {"preset": "cd"}, "flss", DISC_LIGHT, view=DISC, pigment=False, disc=True)
    row = [flss]
    for um in (CD_UM, DEMO_UM):
        row.append(
            replace(flss, caption=f"Stam, GPU Gems, {um:g} um", method="stam", options={**GEMS, "period_um": um})
        )
    row.append(replace(flss, caption="path-traced (Mitsuba 3)", method=None))
    drawn, _ = draw(studio, row)
    sheet([drawn], studio, folder / "disc.jpg")
    found = stam_maps.disc_peaks(studio.folder, CD_UM, DEMO_UM)
    own, _, fitted = (row["largest_off_deg"] for row in found["gems"])
    insist(
        PART, fitted < ALIKE_DEG < own, "GPU Gems' form agrees with FLSS on the disc where its spacing is fitted alone"
    )
    return found


def symmetry(folder: Path) -> list[dict]:
    """Luminance of the right half over the left half of BRDF maps at normal incidence."""
    skins = {"Blazed": {"preset": "blazed"}, "CD": {"preset": "cd"}}
    for title, skin in surfaces("Xenopeltis").items():
        skins[title] = of_one_window({name: value for name, value in skin.items() if name != "rotation"})
    found = stam_maps.symmetry(folder, skins)
    insist(PART, all(abs(row["gems"] - 1) < SYMMETRIC for row in found), "GPU Gems' form is symmetric")
    blazed = found[0]["flss"]
    insist(PART, max(blazed, 1 / blazed) > ONE_SIDED, "the blazed grating sends its light to one side")
    return found


def xenopeltis(studio: Studio, folder: Path) -> list[dict]:
    """Figure 2.22: Xenopeltis by FLSS, by GPU Gems' shader and path-traced."""
    rows, found, plotted = [], [], {}
    for title, skin in surfaces("Xenopeltis").items():
        one = of_one_window(skin)
        spacing_um = period(skin, "x")["period_um"]
        kind = title.split(", ")[1]
        shots = [
            Shot(f"{kind}, FLSS", one, "flss", pigment=False),
            Shot(f"{kind}, Stam (GPU Gems)", one, "stam", pigment=False, options={**GEMS, "period_um": spacing_um}),
            Shot(f"{kind}, path-traced", skin, None, pigment=False),
        ]
        row, pairs = draw(studio, shots)
        rows.append(row)
        lit, near = pairs[..., 6] > 0, hues.near_highlight(pairs)
        for drawn in row:
            pixels = drawn.pixels[lit]
            shares = hues.histogram(pixels)
            plotted[drawn.shot.caption] = shares
            found.append(
                {
                    "caption": drawn.shot.caption,
                    "dark_near": hues.dark_share(pixels, near[lit]),
                    "dark": hues.dark_share(pixels, np.ones(len(pixels), dtype=bool)),
                    "hues": hues.effective_hues(shares),
                    "three_bins": float(np.sort(shares)[-3:].sum()),
                }
            )
        flss, stam, _ = found[-3:]
        insist(
            PART, stam["dark_near"] > 2 * flss["dark_near"], f"colours are missing near highlights on {title} in Stam's"
        )
        insist(PART, stam["hues"] < flss["hues"], f"colours on {title} are more discrete in Stam's")
    sheet(rows, studio, folder / "xenopeltis.jpg")
    plot_hues(plotted, folder / "hues.svg")
    return found


def plot_hues(shares: dict[str, np.ndarray], file: Path) -> None:
    """Draws fractions of hues by picture, one plot for each surface."""
    titles = list(dict.fromkeys(caption.rsplit(", ", 1)[0] for caption in shares))
    figure = Figure(figsize=(4.2 * len(titles), 2.8), layout="constrained")
    for axes, title in zip(np.atleast_1d(figure.subplots(1, len(titles), sharey=True)), titles):
        for caption, share in shares.items():
            if caption.startswith(title):
                edges = np.linspace(0, 360, len(share) + 1)
                axes.stairs(100 * share, edges, label=caption.removeprefix(f"{title}, "), linewidth=1.3)
        axes.set(title=title, xlabel="hue / degrees", xlim=(0, 360), xticks=range(0, 361, 60))
        axes.legend(fontsize="small", frameon=False)
    figure.axes[0].set_ylabel("share of coloured pixels / %")
    with matplotlib.rc_context({"svg.hashsalt": file.stem}):
        figure.savefig(file, metadata={"Date": None})


def nmm(studio: Studio, folder: Path) -> list[dict]:
    """Figure B.1: Elaphe by FLSS and by NMM, without weights as in Single 2014 and with weights."""
    rows, found = [], []
    for title, skin in surfaces("Elaphe").items():
        kind = title.split(", ")[1]
        flss = Shot(f"{kind}, FLSS", of_one_window(skin), "flss", pigment=False)
        published = replace(flss, caption=f"{kind}, NMM", method="nmm", options={"weighted": False})
        weighted = replace(flss, caption=f"{kind}, NMM weighted", method="nmm")
        row, pairs = draw(studio, [flss, published, weighted])
        rows.append(row)
        lit = pairs[..., 6] > 0
        reference = row[0].pixels[lit]
        for drawn in row:
            pixels = drawn.pixels[lit]
            blue = hues.of_blue(reference, pixels)
            found.append({"caption": drawn.shot.caption, **hues.cast(pixels), "of_blue": blue})
    sheet(rows, studio, folder / "nmm.jpg")
    return found


def frames(studio: Studio) -> list[dict]:
    """Table 2.1: milliseconds of a frame and frames a second by FLSS and NMM."""
    found = []
    for species in SPECIES:
        for title, skin in surfaces(species).items():
            for method in ("flss", "nmm"):
                words = ["--mesh", studio.snake.mesh, "--method", method, "--size", FRAME, "--repeat", REPEATS]
                words += realtime.surface_words(of_one_window(skin))
                made = json.loads(sunbeam("render", "-o", studio.folder / "frame.exr", *words))
                ms = made["gpu_ms"]
                found.append({"title": title, "method": method, "ms": ms, "fps": 1e3 / ms, "faces": made["triangles"]})
                print(f"{title}, {method}: {ms:.0f} ms", flush=True)
    return found
