"""Materials of the snake: the plugin `diffraction` (docs/plugin.md) with a preset or a scan, over pigment."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np

# Refractive index of keratin, of which a snake's skin consists; equal to the realtime renderer's.
KERATIN = 1.56
# Factor on the pigment's linear reflectance. Chosen for a nearly black snake with visible diffraction colours.
PIGMENT_SHARE = 0.35

# Parameters that each preset needs on the snake besides its name. The mesh's tangent, the relief's x axis at rotation
# 0, runs from head to tail. The fingers of a skin's cells point to the tail. The Elaphe preset has its fingers along
# +y, so its relief is rotated by −90°.
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
    """Parameters of the plugin for a measured height field. Sizes in µm are required where the file states none."""
    if not Path(filename).is_file():
        raise ValueError(f"there is no height field {filename}")
    parameters = {"filename": str(Path(filename).resolve()), "rotation": rotation_deg}
    if pixel_size_um is not None:
        parameters["pixel_size"] = pixel_size_um
    if max_height_um is not None:
        parameters["max_height"] = max_height_um
    return parameters


def pigment_texture(pigment: Path, share: float = PIGMENT_SHARE) -> dict:
    """The Mitsuba texture of an sRGB picture, with its linear reflectance times `share`."""
    linear = mi.Bitmap(str(pigment)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
    return {"type": "bitmap", "bitmap": mi.Bitmap(share * np.array(linear))}


def skin_bsdf(parameters: dict, pigment: Path, eta: float = KERATIN) -> dict:
    """The material as a dictionary: keratin with the relief, over the pigment of the sRGB picture `pigment`."""
    return {"type": "diffraction", "eta": eta, "diffuse_reflectance": pigment_texture(pigment), **parameters}
