"""Part `renderings` of the documentation (page.py): figures 2.14 to 2.18 of M. Single's thesis, called Single 2014.

Each figure is drawn by the thesis' method FLSS (docs/realtime.md) on the GPU, and path-traced in Mitsuba. Pictures show
the snake with a scanned skin, the procedural preset that imitates it, or a blazed grating. A *shot* describes one
picture (studio.py). A function for each figure draws a *sheet*, one picture file with several shots, and returns the
figure's numbers. Chromas are CIELAB's. The diffracted light is added to that of the *pigment*, the skin's diffuse
colour.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

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
from .studio import RESOLUTION, SPP, SUN, Sheet, Shot, Studio, draw, with_path_traced

PART = "renderings"
# Rays along each side of a pixel on the GPU; one, as in a fragment shader.
SUPERSAMPLE = 1
# View of the snake; width and height in pixels.
VIEW = View(300, 200)
# Factor on the cells of the snake's mesh along each direction, the default of mitsuba_scenes/snake.py. The page's
# pictures have a coarser mesh, of RESOLUTION; the page states the numbers of faces of both.
DEFAULT_RESOLUTION = 4.0
# Parameters of the plugin for a scan under FLSS, which needs a relief that repeats. A coherence length equal to the
# scan's edge of 6.5 µm suppresses interference between repeats.
SCAN_WINDOW = {"tiling": "periodic", "coherence_length": 6.5}
# Figure 2.15: factor on the light of the pigment, which turns its near black into brown. A larger one hides more of the
# diffraction's colour.
PIGMENT_BRIGHTER = 10
# Figure 2.17: the field of view of the first picture, the widest.
WIDEST_DEG = 30.0
# Figure 2.17: the magnification of each picture relative to the one before.
CLOSER = 5
# Figure 2.17: the number of pictures.
ZOOMS = 3
# Figure 2.17: the point in the middle of the pictures, a place on the snake's back.
ZOOM_TARGET_CM = (-0.462, -0.476, 2.018)
# Figure 2.18: directions in which light travels, from the figure's captions. The first one of SOUTH_TO_NORTH is printed
# as (−3.3130, 0, −0.9999), which is no unit vector. Its x is taken as 0: x falls by 0.19 from the second to the third.
SOUTH_TO_NORTH = ((0.0, 0.0, -0.9999), (-0.1989, 0.0, -0.9799), (-0.3897, 0.0, -0.9208))
SOUTHEAST_TO_WEST = ((0.0995, 0.0993, -0.9900), (0.0995, 0.2940, -0.9505), (0.0995, 0.4770, -0.8731))
# Figure 2.18: centre in pixels of the box that an inset shows enlarged.
INSET_AT = (190, 85)
# Figure 2.18: half side of this box in pixels.
INSET_HALF = 15
# Figure 2.18: distances of the compass's letters E and W, and of N and S, from the view's target in the scene.
COMPASS_CM = (2.6, 1.6)


class Skin(NamedTuple):
    """A surface: its name on the page, `label`, and parameters of the plugin."""

    label: str
    parameters: dict


def all_skins() -> dict[str, Skin]:
    """The surfaces: `SPECIES-scan`, if the scan is present, `SPECIES-preset` for both species, and `blazed`."""
    skins = {}
    for species, path in SCANS.items():
        if path.exists():
            # The fingers of a skin are long parallel ridges. Those of both scans lie along x, as the body does, so no
            # rotation is needed.
            skins[f"{species}-scan"] = Skin(f"{species.capitalize()}, scan", {**scanned_skin(path), **SCAN_WINDOW})
        else:
            print(f"NOT DRAWN: no scan at {path}, so {species} is drawn with the procedural skin alone", flush=True)
        skins[f"{species}-preset"] = Skin(f"{species.capitalize()}, procedural", preset_skin(species))
    skins["blazed"] = Skin("Blazed", preset_skin("blazed"))
    return skins


def scan_or_preset(skins: dict[str, Skin], species: str) -> Skin:
    """The scan of a species if it is present, else its preset."""
    return skins.get(f"{species}-scan") or skins[f"{species}-preset"]


def bare(skin: Skin, caption: str, view: View = VIEW, **options) -> Shot:
    """A shot of the diffraction alone, by FLSS, with further fields of `Shot` as `options`."""
    return Shot(caption, skin.parameters, "flss", view=view, pigment=False, **options)


def linear(studio: Studio, shot: Shot) -> np.ndarray:
    """The picture of a shot in linear sRGB, (rows, columns, 3)."""
    return read_exr(studio.shoot(shot).exr)


def by_renderer(shot: Shot) -> dict[str, Shot]:
    """The shot by FLSS and the shot path-traced, by their keys in the data."""
    return {"flss": replace(shot, method="flss"), "path_traced": replace(shot, method=None)}


def gratings(studio: Studio, skins: dict[str, Skin], folder: Path) -> dict:
    """Figure 2.14: the snake with each surface, and its mean chroma.

    `rankings` orders the surfaces by falling chroma with FLSS, once with the scans and once with the presets.
    `as_ranked` states for both whether the order is Single 2014's.
    """
    panels = {"blazed": "(a)", "elaphe": "(b)", "xenopeltis": "(c)"}

    def panel(name: str) -> str:
        """The letter of the surface `name`, a key of `skins`."""
        return panels[name.split("-")[0]]

    # Scans and the blazed grating come first.
    ordered = sorted(skins, key=lambda name: ("preset" in name, panel(name)))
    shots = [bare(skins[name], f"{panel(name)} {skins[name].label}") for name in ordered]
    rows = with_path_traced(shots)
    sheet = draw(Sheet("gratings", "Diffraction of three surfaces", "2.14", rows), studio, folder, VIEW.width)
    chroma = {}
    for name, shot in zip(ordered, shots):
        mask = studio.mask(shot)
        means = {key: mean_chroma(linear(studio, each), mask) for key, each in by_renderer(shot).items()}
        chroma[name] = {"label": skins[name].label, **means}
    rankings = {}
    # There is no ranking with the scans if one is missing.
    for kind in ("scan", "preset"):
        compared = ["blazed", *(f"{species}-{kind}" for species in SCANS)]
        if all(name in chroma for name in compared):
            rankings[kind] = sorted(compared, key=lambda name: -chroma[name]["flss"])
    agrees = {kind: order == [f"xenopeltis-{kind}", f"elaphe-{kind}", "blazed"] for kind, order in rankings.items()}
    return {"sheet": sheet, "chroma": chroma, "rankings": rankings, "as_ranked": agrees}


def effect_of_colour(pigment: np.ndarray, diffraction: np.ndarray, mask: Path) -> dict:
    """Effect of the diffraction's colour over the pigment (`dark`) and over a brighter one (`bright`).

    `pigment` and `diffraction` are the light of each in linear sRGB, (rows, columns, 3). `delta_e_…` is the difference
    between the picture and one with grey diffraction of equal luminance. `chroma_…` is the picture's mean chroma, and
    `chroma_alone` that of the diffraction without pigment. All are means over the pixels where `mask` is white.
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


def elaphe(studio: Studio, skins: dict[str, Skin], folder: Path) -> dict:
    """Figure 2.15: Elaphe without and with its pigment, and the effect of the diffraction's colour by species.

    `brighter` and `pigment_reflectance` are the factor on the pigment's light and the pigment's mean reflectance.
    """
    skin = scan_or_preset(skins, "elaphe")
    alone = bare(skin, "(a) diffraction alone")
    final = replace(alone, caption="(b) over the pigment", pigment=True)
    sheet = draw(Sheet("elaphe", "Elaphe", "2.15", with_path_traced([alone, final])), studio, folder, VIEW.width)
    mask = studio.mask(alone)
    # Light adds up, so the difference of both pictures is the light that the pigment reflects.
    pigment = linear(studio, final) - linear(studio, alone)
    colour = {}
    for species in SCANS:
        of_species = scan_or_preset(skins, species)
        diffraction = linear(studio, bare(of_species, ""))
        colour[species] = {"label": of_species.label, **effect_of_colour(pigment, diffraction, mask)}
    cone = Image.fromarray(picture.tone_mapped(pigment, EXPOSURE_STOPS))
    light_cone(cone, VIEW, SUN, VIEW.target_cm)
    figure, axes = plt.subplots(1, 4, figsize=(15, 3.6), width_ratios=(1.5, 1, 1, 1), layout="constrained")
    axes[0].imshow(np.array(cone))
    axes[0].set(title="(c) pigment, and where light comes from")
    axes[0].set_axis_off()
    show_relief(axes[1], relief(skin.parameters), f"(d) {skin.label}")
    # Magnitudes of the Fourier transforms (DFT) of powers of the heights h, terms of the phase screen's Taylor series.
    show_term(axes[2], skin.parameters, 1, "(e) |DFT(h)|")
    show_term(axes[3], skin.parameters, 8, "(e) |DFT(h⁸)|")
    figure.savefig(folder / "elaphe-relief.png", dpi=80)
    plt.close(figure)
    reflectance = float(np.array(pigment_texture(studio.snake.pigment)["bitmap"]).mean())
    return {
        "sheet": sheet,
        "label": skin.label,
        "colour": colour,
        "pigment_reflectance": reflectance,
        "brighter": PIGMENT_BRIGHTER,
    }


def xenopeltis(studio: Studio, skins: dict[str, Skin], folder: Path) -> dict:
    """Figure 2.16: Xenopeltis, with the scan if present, and plots of the scan and the preset.

    The plots show the heights and the third term of the phase screen's Taylor series.
    """
    # The scan, if present, comes before the preset.
    present = [skin for name, skin in skins.items() if name.startswith("xenopeltis")]
    shot = bare(present[0], f"(a) {present[0].label}, flss")
    row = [shot, replace(shot, caption="(a) Mitsuba, path-traced", method=None)]
    sheet = draw(Sheet("xenopeltis", "Xenopeltis", "2.16", [row]), studio, folder, VIEW.width)
    columns = 2 * len(present)
    figure, axes = plt.subplots(1, columns, figsize=(3.8 * columns, 3.6), layout="constrained")
    for skin, (left, right) in zip(present, axes.reshape(-1, 2)):
        show_relief(left, relief(skin.parameters), f"(b) {skin.label}")
        show_term(right, skin.parameters, 3, f"(c) |DFT(h³)|, {skin.label.split(', ')[1]}")
    figure.savefig(folder / "xenopeltis-relief.png", dpi=80)
    plt.close(figure)
    return {"sheet": sheet, "label": present[0].label}


def closer(studio: Studio, skins: dict[str, Skin], folder: Path) -> dict:
    """Figure 2.17: Elaphe, each picture five times closer than the previous, with its field of view and mean chroma."""
    skin = scan_or_preset(skins, "elaphe")
    half_width = math.tan(math.radians(WIDEST_DEG / 2))
    # The width of the picture in the scene is proportional to the tangent of half the field of view.
    angles_deg = [2 * math.degrees(math.atan(half_width / CLOSER**k)) for k in range(ZOOMS)]
    # A red box on each picture but the last shows the next.
    shots = [
        bare(
            skin,
            f"{deg:.4g}°",
            view=replace(VIEW, fov_deg=deg, target_cm=ZOOM_TARGET_CM),
            mark=None if deg == angles_deg[-1] else partial(box, fraction=1 / CLOSER),
        )
        for deg in angles_deg
    ]
    sheet = draw(Sheet("closer", "Closer", "2.17", with_path_traced(shots)), studio, folder, VIEW.width)
    zooms = [
        {"fov_deg": deg, "chroma": mean_chroma(linear(studio, shot), studio.mask(shot))}
        for deg, shot in zip(angles_deg, shots)
    ]
    return {"sheet": sheet, "label": skin.label, "zooms": zooms}


def sun_of(travels: tuple[float, float, float]) -> Light:
    """The sun whose light travels along a direction (x, y, z) of figure 2.18, of any length.

    The figure's axes x, y and z are taken as north, east and up. In the scene east is +x and north +y.
    """
    north, east, up = (-component for component in travels)
    elevation_deg = math.degrees(math.atan2(up, math.hypot(north, east)))
    # Azimuths of `Light` are counter-clockwise from +x. There is no sky.
    return Light(math.degrees(math.atan2(north, east)), elevation_deg, "directional", sky_radiance=0)


def moving_sun(studio: Studio, skins: dict[str, Skin], folder: Path) -> dict:
    """Figure 2.18: Elaphe under two paths of the sun, and the change of the picture along each step.

    A row of `steps` has the results of `change` for two panels. `suns` has the direction of the sun in each panel.
    """
    skin = scan_or_preset(skins, "elaphe")
    enlarge = partial(inset, centre=INSET_AT, half=INSET_HALF)

    def enlarge_with_compass(image: Image.Image) -> None:
        enlarge(image)
        compass(image, VIEW, VIEW.target_cm, COMPASS_CM)

    paths = {"S to N": SOUTH_TO_NORTH, "SE to W": SOUTHEAST_TO_WEST}
    shots = {
        way: [bare(skin, f"{way}, {k + 1}", light=sun_of(travels), mark=enlarge) for k, travels in enumerate(path)]
        for way, path in paths.items()
    }
    # The compass is drawn on the first picture alone.
    shots["S to N"][0] = replace(shots["S to N"][0], mark=enlarge_with_compass)
    traced = {"caption": "Mitsuba, path-traced", "method": None, "mark": enlarge}
    # A row has one step of each path, by FLSS and path-traced.
    rows = [[each for shot in row for each in (shot, replace(shot, **traced))] for row in zip(*shots.values())]
    sheet = draw(Sheet("moving-sun", "The sun moves", "2.18", rows), studio, folder, VIEW.width)
    steps, suns = [], []
    for way, column in shots.items():
        for k, shot in enumerate(column):
            sun = {"azimuth_deg": shot.light.azimuth_deg, "elevation_deg": shot.light.elevation_deg}
            suns.append({"way": way, "panel": k + 1, **sun})
        for k, (before, after) in enumerate(zip(column, column[1:])):
            steps.append({"way": way, "from": k + 1, "to": k + 2, **change(studio, before, after)})
    return {"sheet": sheet, "label": skin.label, "steps": steps, "suns": suns}


def change(studio: Studio, before: Shot, after: Shot) -> dict:
    """Angle `sun_deg` between the suns of two shots, and the mean CIEDE2000 between their pictures.

    `delta_e_…` is that colour difference for FLSS and for the path tracer, `delta_e_…_per_deg` its ratio to the angle.
    """
    cosine = float(np.clip(before.light.to_sun() @ after.light.to_sun(), -1, 1))
    sun_deg = math.degrees(math.acos(cosine))
    mask, ends = studio.mask(before), by_renderer(after)
    changes = {
        key: mean_delta_e(studio.shoot(start).exr, studio.shoot(ends[key]).exr, mask)
        for key, start in by_renderer(before).items()
    }
    return {
        "sun_deg": sun_deg,
        **{f"delta_e_{key}": value for key, value in changes.items()},
        **{f"delta_e_{key}_per_deg": value / sun_deg for key, value in changes.items()},
    }


def mesh_counts(resolution: float) -> dict:
    """Numbers of vertices and faces of the snake's mesh at a resolution, from the header of its PLY file.

    The header has lines such as "element vertex 1234" in its first 1000 bytes; binary data follow.
    """
    header = snake_files(resolution).mesh.read_bytes()[:1000].decode("ascii", "ignore")
    return {
        name: int(header.split(f"element {element} ")[1].split()[0])
        for name, element in (("vertices", "vertex"), ("faces", "face"))
    }


def figures() -> dict:
    """All numbers of the part: a dictionary for each figure, and the settings; draws the sheets.

    `spp` is Mitsuba's number of samples per pixel, `rays` the number of rays per pixel on the GPU.
    """
    use_variant()
    folder, skins = images(PART), all_skins()
    with TemporaryDirectory() as scratch:
        studio = Studio(Path(scratch), RESOLUTION, SUPERSAMPLE)
        by_figure = {
            "gratings": gratings(studio, skins, folder),
            "elaphe": elaphe(studio, skins, folder),
            "xenopeltis": xenopeltis(studio, skins, folder),
            "closer": closer(studio, skins, folder),
            "moving_sun": moving_sun(studio, skins, folder),
        }
        return {
            "spp": SPP,
            "rays": SUPERSAMPLE**2,
            "adapter": studio.adapter,
            "has_scans": any(name.endswith("scan") for name in skins),
            "sun": {"azimuth_deg": SUN.azimuth_deg, "elevation_deg": SUN.elevation_deg},
            "mesh": mesh_counts(RESOLUTION),
            "default_mesh": mesh_counts(DEFAULT_RESOLUTION),
            "window_um": SCAN_WINDOW["coherence_length"],
            **by_figure,
        }
