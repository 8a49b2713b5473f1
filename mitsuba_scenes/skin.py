"""Materials of the snake: the plugin `diffraction` (docs/plugin.md) with a preset or a scan, over pigment."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np

from .scene import colour_texture, raw_texture

# Refractive index of keratin, the material of a snake's scales. It equals `KERATIN` of the realtime renderer
# (crates/realtime/src/view.rs); no test compares them.
KERATIN = 1.56
# Factor on the pigment's linear reflectance. Larger values hide the diffraction colours on the nearly black snake. It
# equals `PIGMENT_SCALE` of the realtime renderer; no test compares them.
PIGMENT_SCALE = 0.35

# Parameters of the plugin that each preset needs on the snake besides its name. At rotation 0 the relief's x axis is
# the mesh's tangent, which runs from head to tail. The finger-like ridges of a skin's cells must point to the tail. The
# preset `elaphe` has them along +y, so its relief is rotated by −90° (counter-clockwise is positive).
PRESETS = {
    "blazed": {},
    "elaphe": {"rotation": -90.0},
    "xenopeltis": {},
    "cd": {},
}

# Length of the snake, and width of its sheet of scales around the body, in half scales: a scale is two half scales long
# and wide, and overlaps its neighbours. They are the defaults of `sunbeam snake`.
ROWS = (27, 17)
# Exponent p of a scale's outline towards the tail, along^p + |across|^p = 1 in half scales. It equals that of the mesh
# (crates/realtime/src/snake/lattice.rs); no test compares them.
OUTLINE = 1.4
# Texels per half scale of the textures that vary from scale to scale. Larger values give smoother outlines.
TEXELS = 48
# Smallest and largest size of the relief on the scales, relative to the preset. A wider range varies the colours more
# from scale to scale. Chosen by eye.
SIZES = (0.85, 1.0)
# Standard deviation in degrees of the relief's angle on the scales. Larger values scatter the colours more. Chosen by
# eye.
TURN_DEG = 4.0
# Seed of sizes and angles, an arbitrary number.
SEED = 7


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


def pigment_texture(pigment: Path, factor: float = PIGMENT_SCALE) -> dict:
    """The Mitsuba texture of the sRGB picture `pigment`, with its linear reflectance times `factor`."""
    linear = mi.Bitmap(str(pigment)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
    return colour_texture(factor * np.array(linear))


def skin_bsdf(parameters: dict, pigment: Path, eta: float = KERATIN) -> dict:
    """The material as a dictionary: an interface of index `eta` with the relief, over a diffuse pigment.

    `parameters` are those of the plugin for the relief and replace the others; `pigment` is an sRGB picture.
    """
    return {"type": "diffraction", "eta": eta, "diffuse_reflectance": pigment_texture(pigment), **parameters}


def scale_values(values: np.ndarray) -> np.ndarray:
    """A picture over the snake's UVs, (ROWS[1], ROWS[0]) times TEXELS, that has one number on each scale.

    Row 0 is at v = 0, column 0 at u = 0.

    u runs along the body from head to tail, v around it. Scale (i, j), where i + j is even, has its centre at
    u = i/ROWS[0], v = j/ROWS[1], and the number `values[i, j]`. i is from 0 to ROWS[0], j from 0 to ROWS[1]; further
    entries of `values` are ignored. The picture leaves out that the mesh displaces the tips of its scales at random, by
    up to a twentieth of a half scale.
    """
    rows_u, rows_v = ROWS
    # Centres of the texels in half scales: y along v, x along u.
    y, x = (np.mgrid[: rows_v * TEXELS, : rows_u * TEXELS] + 0.5) / TEXELS
    picture = np.zeros_like(x)
    # A scale lies over those nearer to the tail, so it is painted after them.
    for i in range(rows_u, -1, -1):
        for j in range(rows_v + 1):
            # No scale has its centre here.
            if (i + j) % 2:
                continue
            # The square of texels that the scale can cover: from one half scale before its centre to one beyond it,
            # within the picture.
            rows, columns = (slice(max(k - 1, 0) * TEXELS, (k + 1) * TEXELS) for k in (j, i))
            along, across = x[rows, columns] - i, np.abs(y[rows, columns] - j)
            # The outline is an arc towards the tail, and parallel sides, |across| = 1, towards the head (lattice.rs).
            inside = np.maximum(along, 0) ** OUTLINE + across**OUTLINE <= 1
            picture[rows, columns] = np.where(inside, values[i, j], picture[rows, columns])
    return picture


def varied_skin(name: str) -> dict:
    """Parameters of the plugin for a preset whose relief varies at random in size and angle from scale to scale.

    The plugin's parameter `scale` is the relative size of the relief. Sizes are uniformly distributed, angles normally.
    """
    parameters = preset_skin(name)
    random = np.random.default_rng(SEED)
    # Two more rows and columns than `scale_values` reads. Another shape would give the scales other random numbers.
    shape = (ROWS[0] + 3, ROWS[1] + 3)
    sizes, turns = random.uniform(*SIZES, shape), random.normal(parameters.get("rotation", 0.0), TURN_DEG, shape)
    return {**parameters, "scale": raw_texture(scale_values(sizes)), "rotation": raw_texture(scale_values(turns))}
