"""Materials of the snake: the plugin `diffraction` (docs/plugin.md) with a preset or a scan, over pigment."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np

# Refractive index of keratin, of which a snake's skin consists; equal to the realtime renderer's.
KERATIN = 1.56
# Factor on the pigment's linear reflectance. Larger values hide the diffraction colours on the nearly black snake.
PIGMENT_SCALE = 0.35

# Parameters that each preset needs on the snake besides its name. At rotation 0 the relief's x axis is the mesh's
# tangent, which runs from head to tail. The finger-like ridges of a skin's cells must point to the tail. The preset
# `elaphe` has them along +y, so its relief is rotated by −90°.
PRESETS = {
    "blazed": {},
    "elaphe": {"rotation": -90.0},
    "xenopeltis": {},
    "cd": {},
}


def preset_skin(name: str) -> dict:
    """Parameters of the plugin for a preset. Raises ValueError for an unknown name."""
    if name not in PRESETS:
        raise ValueError(f"unknown skin {name!r}; there are {', '.join(PRESETS)}")
    return {"preset": name, **PRESETS[name]}


def scanned_skin(
    filename: Path, pixel_size_um: float | None = None, max_height_um: float | None = None, rotation_deg: float = 0.0
) -> dict:
    """Parameters of the plugin for a measured height field.

    `pixel_size_um` (edge of a pixel) and `max_height_um` are required where the file does not state them.
    `rotation_deg` turns the relief counter-clockwise. Raises ValueError for a missing file.
    """
    if not Path(filename).is_file():
        raise ValueError(f"there is no height field {filename}")
    parameters = {"filename": str(Path(filename).resolve()), "rotation": rotation_deg}
    if pixel_size_um is not None:
        parameters["pixel_size"] = pixel_size_um
    if max_height_um is not None:
        parameters["max_height"] = max_height_um
    return parameters


def pigment_texture(pigment: Path, scale: float = PIGMENT_SCALE) -> dict:
    """The Mitsuba texture of the sRGB picture `pigment`, with its linear reflectance times `scale`."""
    linear = mi.Bitmap(str(pigment)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
    return {"type": "bitmap", "bitmap": mi.Bitmap(scale * np.array(linear))}


def skin_bsdf(parameters: dict, pigment: Path, eta: float = KERATIN) -> dict:
    """The material as a dictionary: an interface of index `eta` with the relief, over a diffuse pigment.

    `parameters` are those of the plugin for the relief and replace the others; `pigment` is an sRGB picture.
    """
    return {"type": "diffraction", "eta": eta, "diffuse_reflectance": pigment_texture(pigment), **parameters}
