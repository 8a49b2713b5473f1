"""A small scene for several parts, and the difference of two pictures."""

from __future__ import annotations

import mitsuba as mi
import numpy as np

# Pixels along each side, and samples per pixel.
SIZE, SPP = 16, 16


def ball(bsdf: dict | mi.BSDF) -> mi.Scene:
    """A ball under a constant sky and a small sun."""
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
    """Linear colours (rows, columns, 3)."""
    return np.array(mi.render(scene, spp=SPP, seed=seed), dtype=float)[..., :3]


# Difference of a pixel relative to the brightest one, and the fraction of pixels that may exceed it. Kernels of
# different structure round differently, which changes single paths.
RELATIVE, STRAY = 1e-3, 0.02


def differing(ours: np.ndarray, theirs: np.ndarray) -> float:
    """The fraction of pixels that differ by more than RELATIVE of the brightest; NaN always differs."""
    close = np.abs(ours - theirs).max(axis=-1) <= RELATIVE * np.abs(theirs).max()
    return float(np.mean(~close))
