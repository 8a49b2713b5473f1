"""The snake on dark soil, as a Mitsuba dictionary. Lengths are in cm, z is up, the body runs along x, tail at +x."""

from __future__ import annotations

from dataclasses import dataclass

import mitsuba as mi

from .light import Light
from .snake import SnakeFiles

# Largest number of segments of a path: from the light to the skin, and from the skin to the camera. A third segment
# would add the skin's caustics on the ground, which are faint and need thousands of samples a pixel.
MAX_DEPTH = 2
# Reflectance of the ground, linear sRGB: a dark, slightly reddish soil, so that the snake stands out.
SOIL = (0.020, 0.0155, 0.012)


@dataclass(frozen=True)
class View:
    """Resolution in pixels, and the camera: its position `origin_cm`, and `target_cm` in the middle of the picture.

    `fov_deg` is the horizontal field of view.
    """

    width: int = 384
    height: int = 256
    origin_cm: tuple[float, float, float] = (-1.2, -7.0, 8.5)
    target_cm: tuple[float, float, float] = (-1.0, 0.55, 0.9)
    fov_deg: float = 30.0

    def sensor(self, spp: int) -> dict:
        """The camera as a dictionary, with a film of linear sRGB and `spp` samples a pixel.

        The `multijitter` sampler stratifies wavelengths, which divides colour noise by 4 at 64 samples a pixel. It
        requires a square number of samples.
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
    """Snake, ground, light and camera as a dictionary.

    `bsdf` is one-sided, a dictionary or an object; the scene makes it two-sided. `spp` is the number of samples a
    pixel, `max_depth` the largest number of segments of a path.
    """
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": max_depth},
        "sensor": view.sensor(spp),
        "snake": {"type": "ply", "filename": str(files.mesh), "bsdf": {"type": "twosided", "skin": bsdf}},
        "ground": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().scale(200),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(SOIL)}},
        },
        **light.emitters(),
    }
