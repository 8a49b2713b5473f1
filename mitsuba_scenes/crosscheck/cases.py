"""Surfaces, lights and scenes of the comparison of both renderers, with their parameters.

The renderers are Mitsuba with the plugin, and the realtime renderer `sunbeam render`. Check (a) compares values at
points of the surface, check (b) rendered pictures (__init__.py).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import mitsuba as mi
import numpy as np

from ..environment import REPOSITORY
from ..light import Light
from ..scene import View, snake_scene
from ..skin import KERATIN, preset_skin, scanned_skin
from ..snake import SnakeFiles
from ..tool import sunbeam
from .realtime import surface_words

# Folder of measured data, which the repository does not contain: the environment variable SUNBEAM_DATA, or a default
# beside the checkout.
DATA = Path(os.environ.get("SUNBEAM_DATA", REPOSITORY.parent / "shared" / "data"))
# The published atomic-force scans by species.
SCANS = {species: DATA / "afm" / f"{species}.gsf" for species in ("elaphe", "xenopeltis")}
# The scan that is compared by default.
SCAN = SCANS["xenopeltis"]
# The presets that are compared.
SKINS = ("blazed", "elaphe", "xenopeltis")
# Rays along each side of a pixel for a relief with few orders: a grating, or the small tile of a scan. Such a relief is
# bright in few directions, which fewer rays per pixel would miss.
SUPERSAMPLE_FEW_ORDERS = 16
# Rays along each side of a pixel for a relief with many orders. Fewer rays suffice, and each takes longer to evaluate.
SUPERSAMPLE_MANY_ORDERS = 6
# Parameters of the plugin that define the heights; the others define optics and orientation.
RELIEF_PARAMETERS = (
    "preset",
    "period",
    "height",
    "region_size",
    "region_spread",
    "filename",
    "pixel_size",
    "max_height",
    "channel",
    "fill",
    "tiling",
    "level",
    "scale",
    "depth",
)
# Parameters of both renderers in checks (a) and (b). The realtime method FLSS (docs/realtime.md) has only one coherence
# window, the patch over which light interferes, at a fixed position ("patch"). It has no energy conservation. The
# obliquity factor (docs/model.md#the-reflectance) and the refractive index are set, too, so that they are equal.
SAME_MODEL = {"model": "patch", "obliquity": "stam", "conserve_energy": False, "eta": KERATIN}


@dataclass(frozen=True)
class Case:
    """A surface, its parameters, and the resolution of its realtime picture.

    `name` labels reports and files. `skin` has parameters of the plugin `diffraction`; `sunbeam render` has options of
    the same names (`realtime.surface_words`). `supersample` is the number of the realtime renderer's rays along each
    side of a pixel in check (b).
    """

    name: str
    skin: dict
    supersample: int


def cases(scan: Path = SCAN) -> list[Case]:
    """The scan if its file exists, the presets in SKINS, one preset under a cover, and one of other scale and depth.

    A missing scan is reported on stdout.
    """
    presets = [
        Case(name, preset_skin(name), SUPERSAMPLE_FEW_ORDERS if name == "blazed" else SUPERSAMPLE_MANY_ORDERS)
        for name in SKINS
    ]
    # The cover's index differs from keratin's, 1.56, since a relief between two media of nearly the same index would
    # reflect next to nothing. The flat side of the cover reflects like a mirror, so it sends no light of a
    # directional sun to the camera.
    presets.append(Case("covered-blazed", {**preset_skin("blazed"), "cover_eta": 1.2}, SUPERSAMPLE_FEW_ORDERS))
    resized = {**preset_skin("xenopeltis"), "scale": 0.7, "depth": 0.8}
    presets.append(Case("resized-xenopeltis", resized, SUPERSAMPLE_MANY_ORDERS))
    if not scan.exists():
        print(f"NOT CHECKED: no scan at {scan}, so no measured height field is compared", flush=True)
        return presets
    # FLSS sums over diffraction orders, which only a periodic relief has.
    skin = {**scanned_skin(scan), "tiling": "periodic"}
    return [Case(f"scan-{scan.stem}", skin, SUPERSAMPLE_FEW_ORDERS), *presets]


def sun(azimuth_deg: float, elevation_deg: float) -> Light:
    """Directional sunlight without sky, the only light of the realtime renderer. The angles are those of `Light`."""
    return Light(azimuth_deg, elevation_deg, sun="directional", sky_radiance=0)


def mirrored(case: Case, folder: Path) -> Case:
    """The surface with the heights h(−x, y), for a negative control. Writes the heights into `folder`.

    The mirrored relief reflects like the original with the sign of u reversed, where u is the x component of wi + wo.
    """
    exr, npy = folder / f"{case.name}-relief.exr", folder / f"{case.name}-mirrored.npy"
    folder.mkdir(parents=True, exist_ok=True)
    # `sunbeam height-field` writes the relief in the relief's own frame and refuses a rotation.
    surface = {name: value for name, value in case.skin.items() if name != "rotation"}
    sunbeam("height-field", "-o", exr, *surface_words(surface))
    bitmap = mi.Bitmap(str(exr))
    # The EXR's first row is the top of the relief, at the largest y; an array's first row is y = 0.
    heights = np.array(bitmap, dtype=np.float64).reshape(bitmap.height(), bitmap.width())[::-1]
    # Reversal moves the pixel at x = 0 to the end; the roll moves it back, as the relief repeats.
    np.save(npy, np.roll(heights[:, ::-1], 1, axis=1))
    # Pixels are square, except a grating's: it has one row, whose size along y does not matter.
    pixel_um = float(bitmap.metadata()["pixelSizeX_um"])
    kept = {name: value for name, value in case.skin.items() if name not in RELIEF_PARAMETERS}
    # The written heights are levelled already.
    skin = {**kept, "filename": str(npy), "pixel_size": pixel_um, "tiling": "periodic", "level": "none"}
    return Case(f"{case.name}, mirrored", skin, case.supersample)


def plugin(case: Case, **parameters) -> mi.BSDF:
    """The one-sided BSDF of the case; `parameters` replace or extend those of its skin."""
    return mi.load_dict({"type": "diffraction", **case.skin, **parameters})


@contextmanager
def turned(bsdf: mi.BSDF, degrees: float) -> Iterator[None]:
    """Rotates the BSDF's relief by further `degrees` within the context, without building its tables again."""
    parameters = mi.traverse(bsdf)
    # A copy of the rotation in degrees, since the assignment below changes the value in `parameters` in place.
    rotation = mi.Float(parameters["rotation.value"])
    parameters["rotation.value"] = rotation + degrees
    parameters.update()
    try:
        yield
    finally:
        parameters["rotation.value"] = rotation
        parameters.update()


def bare_scene(bsdf: mi.BSDF, files: SnakeFiles, light: Light, view: View, spp: int, film: dict | None = None) -> dict:
    """The scene dictionary of snake, sun and camera without the ground; `film` replaces that of the view.

    BSDF sampling is off: its directions never hit a directional sun, the only light.
    """
    scene = snake_scene(bsdf, files, light, view, spp)
    scene["integrator"] = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    del scene["ground"]
    if film is not None:
        scene["sensor"]["film"] = film
    return scene
