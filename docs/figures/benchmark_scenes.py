"""Scenes for measurements of the cost of the plugin's BSDF `diffraction`, with Mitsuba's `roughconductor` beside it.

Lengths are in cm, and z is up. Radiances are factors on Mitsuba's `d65`. Places, sizes and radiances without a comment
are arbitrary, since all materials are measured in the same scenes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import mitsuba as mi

from mitsuba_scenes.crosscheck.cases import SCAN
from mitsuba_scenes.light import Light
from mitsuba_scenes.scene import SOIL, View, snake_scene
from mitsuba_scenes.skin import KERATIN, pigment_texture, preset_skin, scanned_skin
from mitsuba_scenes.snake import FOLDER, snake_files

from .disc import write_disc

# Largest number of segments of a path.
MAX_DEPTH = 6
# Samples per pixel: a square, since the sampler `multijitter` of `View` may round up other numbers.
SPP = 64
# Samples per pixel of the sphere, which has the sampler `independent`, for any number.
SPHERE_SPP = 32
# Optical parameters of aluminium, for `diffraction` and for `roughconductor`.
ALUMINIUM = {"material": "Al"}
# Optical parameters of keratin, the material of skin, for `diffraction` and for `roughconductor`.
SKIN = {"eta": KERATIN, "k": 0.0}
# Roughness of `roughconductor`, Mitsuba's default.
ALPHA = 0.1
# Type in Mitsuba, and name in results, of the material with which all others are compared.
REFERENCE = "roughconductor"

# Cameras of the scenes. `BenchmarkScene.load` sets their width and height in pixels.
SPHERE_VIEW = View(origin_cm=(0, -6, 2.5), target_cm=(0, 0, 0.8), fov_deg=30)
SNAKE_VIEW = View()
DISC_VIEW = View(origin_cm=(0, -16, 13), target_cm=(0, 0, 0), fov_deg=42)
SCAN_VIEW = View(origin_cm=(0, -0.7, 1.0), target_cm=(0, 0, 0), fov_deg=30)


@dataclass(frozen=True)
class BenchmarkScene:
    """A scene in which one object gets several materials in turn.

    - `title`: the description of the scene in the documentation.
    - `surfaces`: reliefs by name, as parameters of `diffraction`.
    - `optics`: the medium, as parameters of both `diffraction` and `roughconductor`.
    - `spp`: the default number of samples per pixel.
    - `build`: makes the scene's dictionary from the object's BSDF, a view and the samples per pixel.
    """

    name: str
    title: str
    surfaces: dict[str, dict]
    optics: dict
    view: View
    spp: int
    build: Callable[[mi.BSDF, View, int], dict]
    # Makes further parameters of `diffraction`. They may contain objects of Mitsuba, which need a selected variant, so
    # the function is called late.
    extra: Callable[[], dict] = dict

    def bsdfs(self) -> dict[str, dict]:
        """Dictionaries of the diffraction BSDFs by relief, then of REFERENCE in the same medium without `extra`."""
        by_relief = {name: self.diffraction(surface) for name, surface in self.surfaces.items()}
        return {**by_relief, REFERENCE: {"type": REFERENCE, "alpha": ALPHA, **self.optics}}

    def diffraction(self, surface: dict) -> dict:
        """The dictionary of the diffraction BSDF on a relief.

        The obliquity factor is Stam's for all media; the plugin's default depends on the medium.
        """
        return {"type": "diffraction", "obliquity": "stam", **surface, **self.optics, **self.extra()}

    def with_materials(self, surfaces: dict[str, dict], optics: dict) -> BenchmarkScene:
        """A copy of the scene with other reliefs and another medium, without `extra` parameters such as the pigment."""
        return replace(self, surfaces=surfaces, optics=optics, extra=dict)

    def load(self, bsdf: mi.BSDF, size: tuple[int, int], spp: int | None = None) -> mi.Scene:
        """The loaded scene; `size` is (width, height) in pixels. By default `spp` is the scene's number of samples."""
        view = replace(self.view, width=size[0], height=size[1])
        return mi.load_dict(self.build(bsdf, view, spp or self.spp))


def scenes() -> list[BenchmarkScene]:
    """The sphere, the snake, the compact disc and the scan, in this order."""
    scan, scan_caption = scanned_surface()
    return [
        BenchmarkScene(
            "sphere",
            "sphere on a floor, constant light and a small lamp",
            {name: preset_skin(name) for name in ("blazed", "xenopeltis")},
            ALUMINIUM,
            SPHERE_VIEW,
            SPHERE_SPP,
            sphere_parts,
        ),
        BenchmarkScene(
            "snake",
            "the snake in sun and sky",
            {"xenopeltis": preset_skin("xenopeltis")},
            SKIN,
            SNAKE_VIEW,
            SPP,
            snake_parts,
            extra=lambda: {"diffuse_reflectance": pigment_texture(snake_files().pigment)},
        ),
        BenchmarkScene(
            "disc", "a compact disc under a lamp", {"cd": preset_skin("cd")}, ALUMINIUM, DISC_VIEW, SPP, disc_parts
        ),
        BenchmarkScene("scan", f"{scan_caption} from close by", {"scan": scan}, SKIN, SCAN_VIEW, SPP, scan_parts),
    ]


def scanned_surface() -> tuple[dict, str]:
    """Parameters and caption of the AFM scan of Xenopeltis, or of the preset if the scan is missing."""
    if SCAN.exists():
        return scanned_skin(SCAN), "an AFM scan of Xenopeltis"
    print(f"no scan at {SCAN}: the preset replaces it", flush=True)
    return preset_skin("xenopeltis"), "the Xenopeltis preset (there is no scan)"


def lamp(centre_cm: tuple, radius_cm: float, radiance: float) -> dict:
    """A luminous ball of this radiance, with the spectrum of D65."""
    emitter = {"type": "area", "radiance": {"type": "d65", "scale": radiance}}
    return {"type": "sphere", "center": list(centre_cm), "radius": radius_cm, "emitter": emitter}


def sky(radiance: float) -> dict:
    """A uniform sky of this radiance, with the spectrum of D65."""
    return {"type": "constant", "radiance": {"type": "d65", "scale": radiance}}


def floor(half_width_cm: float, reflectance: tuple = (0.5, 0.5, 0.5)) -> dict:
    """A horizontal diffuse square at z = 0; `reflectance` is linear sRGB."""
    return {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().scale(half_width_cm),
        "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(reflectance)}},
    }


def sphere_parts(bsdf: mi.BSDF, view: View, spp: int) -> dict:
    """A ball of radius 1 cm on a grey floor, under a uniform sky and a small lamp."""
    sensor = view.sensor(spp)
    sensor["sampler"] = {"type": "independent", "sample_count": spp}
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": MAX_DEPTH},
        "sensor": sensor,
        "ball": {"type": "sphere", "center": [0, 0, 1], "radius": 1, "bsdf": bsdf},
        "floor": floor(20),
        "lamp": lamp((3, -3, 4), 0.2, 30),
        "sky": sky(0.5),
    }


def snake_parts(bsdf: mi.BSDF, view: View, spp: int) -> dict:
    """The snake in sun and sky, with paths of up to MAX_DEPTH segments instead of the 2 of mitsuba_scenes' demo."""
    return snake_scene(bsdf, snake_files(), Light(), view, spp, MAX_DEPTH)


@cache
def disc_mesh() -> Path:
    """The PLY file of the disc, written once per process."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    return write_disc(FOLDER / "disc.ply")


def disc_parts(bsdf: mi.BSDF, view: View, spp: int) -> dict:
    """The disc on the snake's soil, under a desk lamp and a faint sky.

    The disc lies slightly above the soil. Light from the soil reaches its underside, so the BSDF is made two-sided.
    """
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": MAX_DEPTH},
        "sensor": view.sensor(spp),
        "disc": {"type": "ply", "filename": str(disc_mesh()), "bsdf": {"type": "twosided", "skin": bsdf}},
        "floor": floor(200, SOIL),
        "lamp": lamp((-8, 12, 25), 2, 60),
        "sky": sky(0.05),
    }


def scan_parts(bsdf: mi.BSDF, view: View, spp: int) -> dict:
    """A square sample with a side of 2 cm that fills the picture, under a lamp and a faint sky."""
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": MAX_DEPTH},
        "sensor": view.sensor(spp),
        "sample": {"type": "rectangle", "bsdf": bsdf},
        "lamp": lamp((0.4, 1.2, 1.5), 0.2, 60),
        "sky": sky(0.1),
    }
