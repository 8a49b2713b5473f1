"""The part `renderings`: figures 2.14 to 2.18 of Single 2014 by FLSS on the GPU, and path-traced in Mitsuba."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import mitsuba as mi
import numpy as np
from PIL import Image

from mitsuba_scenes import picture
from mitsuba_scenes.crosscheck.cases import SCANS
from mitsuba_scenes.environment import use_variant
from mitsuba_scenes.light import Light
from mitsuba_scenes.render import EXPOSURE_STOPS
from mitsuba_scenes.scene import View
from mitsuba_scenes.skin import pigment_texture, preset_skin, scanned_skin
from mitsuba_scenes.snake import snake_files

from .appearance import greyed, mean_chroma, mean_delta_e, read_exr
from .marks import box, compass, inset, light_cone
from .page import images
from .relief_plots import relief, show_relief, show_term
from .studio import RESOLUTION, SPP, SUN, Sheet, Shot, Studio, both, draw

PART = "renderings"
# Rays along each side of a pixel on the GPU; one, as in a fragment shader.
SUPERSAMPLE = 1
# View of the snake.
VIEW = View(300, 200)
# Width of the pictures on the sheets.
SHOWN = VIEW.width
# FLSS needs a scan that repeats; a window as wide as the scan suppresses interference between repeats.
SCAN_WINDOW = {"tiling": "periodic", "coherence_length": 6.5}
# Figure 2.15: factor on the pigment's reflectance. Chosen: it turns the near black into brown.
PIGMENT_BRIGHTER = 10
# Figure 2.17: the widest field of view in degrees.
WIDEST_DEG = 30.0
# Figure 2.17: the magnification from picture to picture.
CLOSER = 5
# Figure 2.17: the number of pictures.
ZOOMS = 3
# Figure 2.17: the point in the middle of the pictures. Chosen, on the snake's back.
ZOOM_TARGET_CM = (-0.462, -0.476, 2.018)
# Figure 2.18: directions in which light travels, from its captions. The first is printed as (−3.3130, 0, −0.9999),
# which is no unit vector; the steps of the others give an x near 0.
SOUTH_TO_NORTH = ((0.0, 0.0, -0.9999), (-0.1989, 0.0, -0.9799), (-0.3897, 0.0, -0.9208))
SOUTHEAST_TO_WEST = ((0.0995, 0.0993, -0.9900), (0.0995, 0.2940, -0.9505), (0.0995, 0.4770, -0.8731))
# Centre of the insets' box in pixels.
INSET_AT = (190, 85)
# Half side of the insets' box in pixels.
INSET_HALF = 15


def skins() -> dict[str, tuple[str, dict]]:
    """Surfaces by name, with their captions: the scans, if present, and the presets."""
    found = {}
    for species, path in SCANS.items():
        if path.exists():
            # The fingers of both scans lie along x, as the body does.
            found[f"{species}-scan"] = (f"{species.capitalize()}, scan", {**scanned_skin(path), **SCAN_WINDOW})
        else:
            print(f"NOT DRAWN: no scan at {path}, so the procedural skin alone stands for {species}", flush=True)
        found[f"{species}-preset"] = (f"{species.capitalize()}, procedural", preset_skin(species))
    found["blazed"] = ("Blazed", preset_skin("blazed"))
    return found


def measured(skins: dict, species: str) -> str:
    """The name of the species' scan, or without it of its preset."""
    return f"{species}-scan" if f"{species}-scan" in skins else f"{species}-preset"


def bare(skin: dict, caption: str, **how) -> Shot:
    """A shot of the diffraction alone, by FLSS."""
    return Shot(caption, skin, "flss", view=how.pop("view", VIEW), pigment=False, **how)


def gratings(studio: Studio, skins: dict, folder: Path) -> dict:
    """Figure 2.14: the snake with each surface, and its mean chroma."""
    panels = {"blazed": "(a)", "elaphe": "(b)", "xenopeltis": "(c)"}
    ordered = sorted(skins, key=lambda name: ("preset" in name, panels[name.split("-")[0]]))
    shots = [bare(skins[name][1], f"{panels[name.split('-')[0]]} {skins[name][0]}") for name in ordered]
    sheet = draw(Sheet("gratings", "Diffraction of three surfaces", "2.14", "", both(shots)), studio, folder, SHOWN)
    chroma = {}
    for name, shot in zip(ordered, shots):
        mask = studio.mask(shot)
        found = {
            by: mean_chroma(read_exr(studio.shoot(replace(shot, method=method))[0]), mask)
            for by, method in (("flss", "flss"), ("path_traced", None))
        }
        chroma[name] = {"label": skins[name][0], **found}
    rankings = {}
    for kind in ("scan", "preset"):
        compared = ["blazed", *(f"{species}-{kind}" for species in SCANS)]
        if all(name in chroma for name in compared):
            rankings[kind] = sorted(compared, key=lambda name: -chroma[name]["flss"])
    agrees = {kind: order == [f"xenopeltis-{kind}", f"elaphe-{kind}", "blazed"] for kind, order in rankings.items()}
    return {"sheet": sheet, "chroma": chroma, "rankings": rankings, "as_ranked": agrees}


def over(pigment: np.ndarray, diffraction: np.ndarray, mask: Path) -> dict:
    """Effect of the diffraction's colour over the pigment and over a brighter one; pictures in linear sRGB.

    `delta_e` is the difference from the picture with grey diffraction of equal luminance; `chroma` is the mean chroma.
    """
    found = {"chroma_alone": mean_chroma(diffraction, mask)}
    for name, factor in (("dark", 1.0), ("bright", PIGMENT_BRIGHTER)):
        coloured, grey = (factor * pigment + light for light in (diffraction, greyed(diffraction)))
        with TemporaryDirectory() as folder:
            paths = [Path(folder) / f"{kind}.exr" for kind in ("coloured", "grey")]
            for path, pixels in zip(paths, (coloured, grey)):
                mi.Bitmap(pixels.astype(np.float32)).write(str(path))
            found[f"delta_e_{name}"] = mean_delta_e(*paths, mask)
        found[f"chroma_{name}"] = mean_chroma(coloured, mask)
    return found


def elaphe(studio: Studio, skins: dict, folder: Path) -> dict:
    """Figure 2.15: Elaphe without and with its pigment, and the effect of the diffraction's colour."""
    name = measured(skins, "elaphe")
    alone = bare(skins[name][1], "(a) diffraction alone")
    final = replace(alone, caption="(b) over the pigment", pigment=True)
    sheet = draw(Sheet("elaphe", "Elaphe", "2.15", "", both([alone, final])), studio, folder, SHOWN)
    mask = studio.mask(alone)
    # Light adds up, so the difference is the light from the pigment.
    pigment = read_exr(studio.shoot(final)[0]) - read_exr(studio.shoot(alone)[0])
    colour = {
        species: {
            "label": skins[measured(skins, species)][0],
            **over(pigment, read_exr(studio.shoot(bare(skins[measured(skins, species)][1], ""))[0]), mask),
        }
        for species in SCANS
    }
    cone = Image.fromarray(picture.tone_mapped(pigment, EXPOSURE_STOPS))
    light_cone(cone, VIEW, SUN, VIEW.target_cm)
    figure, axes = plt.subplots(1, 4, figsize=(15, 3.6), width_ratios=(1.5, 1, 1, 1), layout="constrained")
    axes[0].imshow(np.array(cone))
    axes[0].set(title="(c) pigment, and where light comes from")
    axes[0].set_axis_off()
    show_relief(axes[1], relief(skins[name][1]), f"(d) {skins[name][0]}")
    show_term(axes[2], skins[name][1], 1, "(e) |DFT(h)|")
    show_term(axes[3], skins[name][1], 8, "(e) |DFT(h⁸)|")
    figure.savefig(folder / "elaphe-relief.png", dpi=80)
    plt.close(figure)
    reflectance = float(np.array(pigment_texture(studio.snake.pigment)["bitmap"]).mean())
    return {
        "sheet": sheet,
        "label": skins[name][0],
        "colour": colour,
        "pigment_reflectance": reflectance,
        "brighter": PIGMENT_BRIGHTER,
    }


def xenopeltis(studio: Studio, skins: dict, folder: Path) -> dict:
    """Figure 2.16: Xenopeltis with its nanostructure and the third term."""
    names = [name for name in skins if name.startswith("xenopeltis")]
    shot = bare(skins[names[0]][1], f"(a) {skins[names[0]][0]}, flss")
    row = [shot, replace(shot, caption="(a) Mitsuba, path-traced", method=None)]
    sheet = draw(Sheet("xenopeltis", "Xenopeltis", "2.16", "", [row]), studio, folder, SHOWN)
    figure, axes = plt.subplots(1, 2 * len(names), figsize=(3.8 * 2 * len(names), 3.6), layout="constrained")
    for name, (left, right) in zip(names, axes.reshape(-1, 2)):
        show_relief(left, relief(skins[name][1]), f"(b) {skins[name][0]}")
        show_term(right, skins[name][1], 3, f"(c) |DFT(h³)|, {skins[name][0].split(', ')[1]}")
    figure.savefig(folder / "xenopeltis-relief.png", dpi=80)
    plt.close(figure)
    return {"sheet": sheet, "label": skins[names[0]][0]}


def closer(studio: Studio, skins: dict, folder: Path) -> dict:
    """Figure 2.17: Elaphe, each picture five times closer than the previous."""
    label, skin = skins[measured(skins, "elaphe")]
    half = math.tan(math.radians(WIDEST_DEG / 2))
    angles_deg = [2 * math.degrees(math.atan(half / CLOSER**k)) for k in range(ZOOMS)]
    shots = [
        bare(
            skin,
            f"{deg:.4g}°",
            view=replace(VIEW, fov_deg=deg, target_cm=ZOOM_TARGET_CM),
            mark=None if deg == angles_deg[-1] else partial(box, share=1 / CLOSER),
        )
        for deg in angles_deg
    ]
    sheet = draw(Sheet("closer", "Closer", "2.17", "", both(shots)), studio, folder, SHOWN)
    zooms = [
        {"fov_deg": deg, "chroma": mean_chroma(read_exr(studio.shoot(shot)[0]), studio.mask(shot))}
        for deg, shot in zip(angles_deg, shots)
    ]
    return {"sheet": sheet, "label": label, "zooms": zooms}


def sun_of(travels: tuple[float, float, float]) -> Light:
    """The sun for a direction of figure 2.18, whose x axis is taken as north and y axis as east."""
    north, east, up = (-component for component in travels)
    elevation_deg = math.degrees(math.atan2(up, math.hypot(north, east)))
    return Light(math.degrees(math.atan2(north, east)), elevation_deg, "directional", 0)


def moving_sun(studio: Studio, skins: dict, folder: Path) -> dict:
    """Figure 2.18: Elaphe under a moving sun, and the change of the picture per degree."""
    label, skin = skins[measured(skins, "elaphe")]
    enlarge = partial(inset, centre=INSET_AT, half=INSET_HALF)

    def first(picture: Image.Image) -> None:
        enlarge(picture)
        compass(picture, VIEW, VIEW.target_cm, (2.6, 1.6))

    columns = {"S to N": SOUTH_TO_NORTH, "SE to W": SOUTHEAST_TO_WEST}
    shots = {
        way: [
            bare(skin, f"{way}, {k + 1}", light=sun_of(travels), mark=first if (way, k) == ("S to N", 0) else enlarge)
            for k, travels in enumerate(directions)
        ]
        for way, directions in columns.items()
    }
    traced = {"caption": "Mitsuba, path-traced", "method": None, "mark": enlarge}
    rows = [[view for shot in row for view in (shot, replace(shot, **traced))] for row in zip(*shots.values())]
    sheet = draw(Sheet("moving-sun", "The sun moves", "2.18", "", rows), studio, folder, SHOWN)
    steps = []
    for way, column in shots.items():
        for k, (a, b) in enumerate(zip(column, column[1:])):
            degrees = math.degrees(math.acos(float(np.clip(a.light.to_sun() @ b.light.to_sun(), -1, 1))))
            changes = {
                by: mean_delta_e(*(studio.shoot(replace(shot, method=method))[0] for shot in (a, b)), studio.mask(a))
                for by, method in (("flss", "flss"), ("path_traced", None))
            }
            steps.append(
                {
                    "way": way,
                    "from": k + 1,
                    "to": k + 2,
                    "sun_deg": degrees,
                    **{f"delta_e_{by}": value for by, value in changes.items()},
                    **{f"delta_e_{by}_per_deg": value / degrees for by, value in changes.items()},
                }
            )
    suns = [
        {"way": way, "panel": k + 1, "azimuth_deg": shot.light.azimuth_deg, "elevation_deg": shot.light.elevation_deg}
        for way, column in shots.items()
        for k, shot in enumerate(column)
    ]
    return {"sheet": sheet, "label": label, "steps": steps, "suns": suns}


def mesh_counts(resolution: float) -> dict:
    """Numbers of vertices and faces of the snake, from the header of its file."""
    header = snake_files(resolution).mesh.read_bytes()[:1000].decode("ascii", "ignore")
    return {
        name: int(header.split(f"element {element} ")[1].split()[0])
        for name, element in (("vertices", "vertex"), ("faces", "face"))
    }


def figures() -> dict:
    """Draws all sheets; returns the numbers of the part."""
    use_variant()
    folder, worn = images(PART), skins()
    with TemporaryDirectory() as scratch:
        studio = Studio(Path(scratch), RESOLUTION, SUPERSAMPLE)
        made = {
            make.__name__: make(studio, worn, folder) for make in (gratings, elaphe, xenopeltis, closer, moving_sun)
        }
        return {
            "spp": SPP,
            "rays": SUPERSAMPLE**2,
            "adapter": studio.adapter,
            "has_scans": any(name.endswith("scan") for name in worn),
            "sun": {"azimuth_deg": SUN.azimuth_deg, "elevation_deg": SUN.elevation_deg},
            "mesh": mesh_counts(RESOLUTION),
            "default_mesh": mesh_counts(4.0),
            "window_um": SCAN_WINDOW["coherence_length"],
            **made,
        }
