"""A small scene that several parts of the run (parts.py) render, and the difference of two pictures."""

from __future__ import annotations

import mitsuba as mi
import numpy as np

# Pixels along each side: few, because the parts test kernels, not pictures.
SIZE = 16
# Samples per pixel.
SPP = 16


def ball(bsdf: dict | mi.BSDF) -> mi.Scene:
    """A unit sphere with the BSDF, under a constant sky and a directional sun."""
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 3},
            "sensor": {
                "type": "perspective",
                "fov": 40,
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}},
            },
            "sky": {"type": "constant", "radiance": 0.5},
            "sun": {"type": "directional", "direction": [0.3, 0.5, -1.0], "irradiance": 3.0},
            "ball": {"type": "sphere", "bsdf": bsdf},
        }
    )


def picture(scene: mi.Scene, seed: int = 0) -> np.ndarray:
    """Renders in linear sRGB, (rows, columns, 3)."""
    return np.array(mi.render(scene, spp=SPP, seed=seed), dtype=float)[..., :3]


# Largest difference of a pixel, relative to the brightest pixel, that passes as rounding.
ROUNDING = 1e-3
# Fraction of pixels that may differ by more, 5 of the 256. Kernels of different structure round differently, which can
# send a path in another direction.
STRAY = 0.02


def differing(ours: np.ndarray, theirs: np.ndarray) -> float:
    """The fraction of pixels that differ by more than ROUNDING of the brightest; NaN always differs."""
    close = np.abs(ours - theirs).max(axis=-1) <= ROUNDING * np.abs(theirs).max()
    return float(np.mean(~close))
