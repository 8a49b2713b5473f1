"""Objects on the ground as Mitsuba dictionaries: the snake, and the stage of all scenes. Lengths are in cm, z is up."""

from __future__ import annotations

from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from .light import Light
from .snake import SnakeFiles

# Largest number of segments of a path: from the light to a surface, and from there to the camera. A third segment
# would add the skin's caustics on the ground, which are faint and need thousands of samples a pixel.
MAX_DEPTH = 2
# Reflectance of the ground, linear sRGB: a dark, slightly reddish soil, so that the snake stands out. Twin of `SOIL` in
# crates/realtime/src/view.rs.
SOIL = (0.020, 0.0155, 0.012)


@dataclass(frozen=True)
class View:
    """Resolution in pixels, and the camera: its position `origin_cm`, and `target_cm` in the middle of the picture.

    `fov_deg` is the horizontal field of view. +z is up in the picture, so the camera must not look along z. The
    defaults are for the snake.
    """

    width: int = 384
    height: int = 256
    origin_cm: tuple[float, float, float] = (-1.2, -7.0, 8.5)
    target_cm: tuple[float, float, float] = (-1.0, 0.55, 0.9)
    fov_deg: float = 30.0

    def sensor(self, spp: int) -> dict:
        """The camera as a dictionary, with a film of linear sRGB and `spp` samples a pixel.

        The `multijitter` sampler stratifies wavelengths, which divides colour noise by 4 at 64 samples a pixel. It
        may round up numbers of samples that are not square.
        """
        return {
            "type": "perspective",
            "fov": self.fov_deg,
            "to_world": mi.ScalarTransform4f().look_at(list(self.origin_cm), list(self.target_cm), [0, 0, 1]),
            "sampler": {"type": "multijitter", "sample_count": spp},
            "film": {
                "type": "hdrfilm",
                "width": self.width,
                "height": self.height,
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "gaussian"},
            },
        }


def snake_scene(
    bsdf: dict | mi.BSDF, files: SnakeFiles, light: Light, view: View, spp: int = 64, max_depth: int = MAX_DEPTH
) -> dict:
    """Snake, ground, light and camera as a dictionary. The body runs along x, with the tail at +x.

    `bsdf` is one-sided, a dictionary or an object; the scene makes it two-sided. `spp` is the number of samples a
    pixel, `max_depth` the largest number of segments of a path.
    """
    snake = {"type": "ply", "filename": str(files.mesh), "bsdf": {"type": "twosided", "skin": bsdf}}
    return stage({"snake": snake}, light.emitters(), view, spp, max_depth)


def stage(objects: dict, emitters: dict, view: View, spp: int = 64, max_depth: int = MAX_DEPTH) -> dict:
    """A scene of `objects` on the ground z = 0 in the light of `emitters`.

    Both map names in the scene to Mitsuba's dictionaries. The ground is a square with sides of 4 m around the origin,
    larger than the pictures show. `spp` and `max_depth` are as in `snake_scene`.
    """
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": max_depth},
        "sensor": view.sensor(spp),
        **objects,
        "ground": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().scale(200),
            "bsdf": soil(),
        },
        **emitters,
    }


def soil() -> dict:
    """The material of the ground."""
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(SOIL)}}


def raw_texture(values: np.ndarray, filter_type: str = "nearest") -> dict:
    """A Mitsuba texture of numbers, not colours, with `values` of shape (rows, columns).

    The first row is at v = 0, the first column at u = 0. `filter_type` is `nearest` or `bilinear`. Outside the unit
    square the value is that of the nearest edge.
    """
    bitmap = mi.Bitmap(np.ascontiguousarray(values, dtype=np.float32)[..., None])
    return {"type": "bitmap", "bitmap": bitmap, "raw": True, "filter_type": filter_type, "wrap_mode": "clamp"}


def colour_texture(values: np.ndarray) -> dict:
    """A Mitsuba texture of reflectances in linear sRGB, of shape (rows, columns, 3), bilinear and repeated.

    The first row is at v = 0, the first column at u = 0.
    """
    return {"type": "bitmap", "bitmap": mi.Bitmap(np.ascontiguousarray(values, dtype=np.float32))}
