"""Scenes for the cost of the BSDF: shape, light, and Mitsuba's `roughconductor` for comparison."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import mitsuba as mi

from mitsuba_scenes.crosscheck.cases import SCAN
from mitsuba_scenes.light import Light
from mitsuba_scenes.scene import SOIL, View, snake_scene
from mitsuba_scenes.skin import KERATIN, pigment_texture, preset_skin, scanned_skin
from mitsuba_scenes.snake import FOLDER, SnakeFiles, snake_files

from .disc import write_disc

# Largest number of segments of a path.
MAX_DEPTH = 6
# Samples a pixel, a square number as the snake's sampler requires.
SPP = 64
# Samples a pixel of the sphere, which has Mitsuba's default sampler.
SPHERE_SPP = 32
# Parameters of surfaces in aluminium.
ALUMINIUM = {"material": "Al"}
# Parameters of skins.
SKIN = {"eta": KERATIN, "k": 0.0}
# Roughness of the microfacet material.
ALPHA = 0.1
# Mitsuba's material with which all others are compared.
REFERENCE = "roughconductor"

SPHERE_VIEW = View(48, 32, origin_cm=(0, -6, 2.5), target_cm=(0, 0, 0.8), fov_deg=30)
SNAKE_VIEW = View(48, 32)
DISC_VIEW = View(48, 32, origin_cm=(0, -16, 13), target_cm=(0, 0, 0), fov_deg=42)
SCAN_VIEW = View(48, 32, origin_cm=(0, -0.7, 1.0), target_cm=(0, 0, 0), fov_deg=30)


@dataclass(frozen=True)
class BenchmarkScene:
    """A scene for several materials.

    `surfaces` has reliefs by name, as parameters of `diffraction`; `optics` the medium, as parameters of both
    `diffraction` and `roughconductor`. `parts` makes the scene's dictionary for a BSDF object.
    """

    name: str
    title: str
    surfaces: dict[str, dict]
    optics: dict
    view: View
    spp: int
    parts: Callable[[mi.BSDF, View, int], dict]
    # Further parameters of `diffraction`, made in the selected variant.
    extra: Callable[[], dict] = dict

    def bsdfs(self) -> dict[str, dict]:
        """Dictionaries of the diffraction BSDFs by relief, and of Mitsuba's rough conductor in the same medium."""
        made = {name: self.diffraction(surface) for name, surface in self.surfaces.items()}
        return {**made, REFERENCE: {"type": "roughconductor", "alpha": ALPHA, **self.optics}}

    def diffraction(self, surface: dict) -> dict:
        """The dictionary of the diffraction BSDF, with one obliquity factor for dielectrics and metals."""
        return {"type": "diffraction", "obliquity": "stam", **surface, **self.optics, **self.extra()}

    def worn(self, surfaces: dict[str, dict], optics: dict) -> BenchmarkScene:
        """The scene with other reliefs and another medium, without pigment."""
        return replace(self, surfaces=surfaces, optics=optics, extra=dict)

    def load(self, bsdf: mi.BSDF, size: tuple[int, int], spp: int | None = None) -> mi.Scene:
        """The scene, `size` pixels wide and high."""
        view = replace(self.view, width=size[0], height=size[1])
        return mi.load_dict(self.parts(bsdf, view, spp or self.spp))


def scenes() -> list[BenchmarkScene]:
    """A sphere in a room without walls, the snake, a disc, and a scan from close by."""
    scan, wears = scanned_surface()
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
            lambda: {"diffuse_reflectance": pigment_texture(snake_files().pigment)},
        ),
        BenchmarkScene(
            "disc", "a compact disc under a lamp", {"cd": preset_skin("cd")}, ALUMINIUM, DISC_VIEW, SPP, disc_parts
        ),
        BenchmarkScene("scan", f"{wears} from close by", {"scan": scan}, SKIN, SCAN_VIEW, SPP, scan_parts),
    ]


def scanned_surface() -> tuple[dict, str]:
    """The AFM scan of Xenopeltis, or without it the preset, and its name."""
    if SCAN.exists():
        return scanned_skin(SCAN), "an AFM scan of Xenopeltis"
    print(f"no scan at {SCAN}: the preset stands in for it", flush=True)
    return preset_skin("xenopeltis"), "the Xenopeltis preset (there is no scan)"


def lamp(centre: tuple, radius: float, radiance: float) -> dict:
    """A small luminous ball, D65."""
    emitter = {"type": "area", "radiance": {"type": "d65", "scale": radiance}}
    return {"type": "sphere", "center": list(centre), "radius": radius, "emitter": emitter}


def sky(radiance: float) -> dict:
    """A uniform sky, D65."""
    return {"type": "constant", "radiance": {"type": "d65", "scale": radiance}}


def floor(half_width: float, reflectance: tuple = (0.5, 0.5, 0.5)) -> dict:
    return {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().scale(half_width),
        "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(reflectance)}},
    }


def sphere_parts(bsdf: mi.BSDF, view: View, spp: int) -> dict:
    """A ball of radius 1 on a grey floor."""
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
    """The demo's snake, with longer paths."""
    return snake_scene(bsdf, snake_files(), Light(), view, spp, MAX_DEPTH)


@cache
def disc_files() -> SnakeFiles:
    """The disc as a mesh, written once a process."""
    return SnakeFiles(write_disc(made_folder() / "disc.ply"), made_folder() / "none.png")


def made_folder():
    FOLDER.mkdir(parents=True, exist_ok=True)
    return FOLDER


def disc_parts(bsdf: mi.BSDF, view: View, spp: int) -> dict:
    """The disc on the soil of the snake, and a desk lamp in place of the sun."""
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": MAX_DEPTH},
        "sensor": view.sensor(spp),
        "disc": {"type": "ply", "filename": str(disc_files().mesh), "bsdf": {"type": "twosided", "skin": bsdf}},
        "floor": floor(200, SOIL),
        "lamp": lamp((-8, 12, 25), 2, 60),
        "sky": sky(0.05),
    }


def scan_parts(bsdf: mi.BSDF, view: View, spp: int) -> dict:
    """A sample of 1 cm that fills the picture, with a lamp above it."""
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": MAX_DEPTH},
        "sensor": view.sensor(spp),
        "sample": {"type": "rectangle", "bsdf": bsdf},
        "lamp": lamp((0.4, 1.2, 1.5), 0.2, 60),
        "sky": sky(0.1),
    }
