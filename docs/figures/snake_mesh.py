"""The snake's mesh: how its scales end, at three zoom levels, and what that is in numbers.

Beside the mesh of today stands the one before it, a grid whose rows ran across the edges of the scales. It can no
longer be made; its pictures and its numbers, which the same code took, are kept (`measure`, `shoot`).
"""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import drjit as dr
import mitsuba as mi
import numpy as np
from PIL import Image

from mitsuba_scenes import picture
from mitsuba_scenes.environment import use_variant
from mitsuba_scenes.light import Light
from mitsuba_scenes.render import EXPOSURE_STOPS
from mitsuba_scenes.scene import View
from mitsuba_scenes.skin import preset_skin, skin_bsdf
from mitsuba_scenes.snake import SnakeFiles, snake_files

from .page import DOCS, images

PAGE = "snake-mesh"
BEFORE = DOCS / "data" / "snake-mesh-before.json"
RESOLUTIONS = (1, 4)
SKIN = "xenopeltis"
# Horizontal fields of view, each five times closer than the one before it: 2·atan(tan(15°)/5^k).
ZOOMS_DEG = (30.0, 6.135, 1.228)
# Where scales meet, on either mesh.
TARGET_CM = (-0.897, -0.498, 1.851)
SIZE = (360, 240)
SPP = 36
# A triangle that is so much steeper than its shading normals is part of the step from one scale to the next.
WALL_DEG = 30.0
# Rays that single precision lets slip through a closed sheet.
SLIPPED_SHARE = 1e-4
# Jumps and turns above these are counted.
JUMP_DEG, TURN_DEG = 10.0, 45.0


def view(fov_deg: float) -> View:
    """The camera of the pictures, and of the rays that are counted."""
    return View(*SIZE, target_cm=TARGET_CM, fov_deg=fov_deg)


def shoot(files: SnakeFiles, when: str, folder: Path) -> None:
    """Writes the three pictures of a mesh as `WHEN-FOV.jpg`."""
    skin = skin_bsdf(preset_skin(SKIN), files.pigment)
    for fov_deg in ZOOMS_DEG:
        made = picture.render(skin, files, Light(), view(fov_deg), SPP)
        picture.check(made.pixels, f"{when}, {fov_deg:g} degrees")
        skin = made.bsdf
        mapped = picture.tone_mapped(made.pixels, EXPOSURE_STOPS)
        Image.fromarray(mapped).save(folder / f"{when}-{fov_deg:.0f}.jpg", quality=88)
        print(f"{when}, {fov_deg:g} degrees", flush=True)


def degrees_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles between vectors along the last axis, which need no length."""
    cosine = (a * b).sum(-1) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b, axis=-1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def measure(mesh: Path) -> dict:
    """Counts of a mesh; jumps of normals in degrees and shares of edges; shares of the rays of the widest view."""
    shape = mi.load_dict({"type": "ply", "filename": str(mesh)})
    params = mi.traverse(shape)
    positions, normals, triangles = (
        np.array(params[name], dtype=kind).reshape(-1, 3)
        for name, kind in (("vertex_positions", float), ("vertex_normals", float), ("faces", int))
    )
    return {
        "vertices": len(positions),
        "faces": len(triangles),
        **_edges(positions, normals, triangles),
        **_rays(mi.load_dict({"type": "scene", "snake": shape})),
    }


def _edges(positions: np.ndarray, normals: np.ndarray, triangles: np.ndarray) -> dict:
    """Jumps across edges within scales, and turns of the lines along which scales end."""
    p = positions[triangles]
    facets = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    is_wall = degrees_between(facets, normals[triangles].sum(1)) > WALL_DEG
    corners = normals[triangles[~is_wall]]
    spread = np.max([degrees_between(corners[:, k], corners[:, k - 1]) for k in range(3)], axis=0)
    # Each edge with the triangles on its two sides.
    edges = np.sort(np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    owners = np.tile(np.arange(len(triangles)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, owners = edges[order], owners[order]
    shared = np.flatnonzero((edges[1:] == edges[:-1]).all(1))
    one, other = owners[shared], owners[shared + 1]
    within = ~is_wall[one] & ~is_wall[other]
    jumps = degrees_between(facets[one[within]], facets[other[within]])
    # Where scales end and begin: between a wall and the scale above or below it.
    lines = edges[shared[is_wall[one] != is_wall[other]]]
    turns = _turns(positions, lines)
    return {
        "jump_p99_deg": float(np.quantile(jumps, 0.99)),
        "jumps_share": float((jumps > JUMP_DEG).mean()),
        "spread_p99_deg": float(np.quantile(spread, 0.99)),
        "spread_share": float((spread > JUMP_DEG).mean()),
        "turns_share": float((turns > TURN_DEG).mean()),
    }


def _turns(positions: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Turns in degrees at the vertices that join two of these edges."""
    ends = np.concatenate([lines, lines[:, ::-1]])
    ends = ends[np.argsort(ends[:, 0], kind="stable")]
    vertices, first, count = np.unique(ends[:, 0], return_index=True, return_counts=True)
    joints = count == 2
    middle = positions[vertices[joints]]
    before, after = (positions[ends[first[joints] + k, 1]] for k in (0, 1))
    return degrees_between(middle - before, after - middle)


def _rays(scene: mi.Scene) -> dict:
    """What the rays through the pixels' centres see, as shares of those inside the snake's outline."""
    width, height = SIZE
    index = dr.arange(mi.UInt32, width * height)
    place = mi.Point2f((index % width + 0.5) / width, (index // width + 0.5) / height)
    ray, _ = mi.load_dict(view(ZOOMS_DEG[0]).sensor(1)).sample_ray(0, 0.5, place, mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    to_sun = mi.Vector3f(Light().to_sun())
    hidden = scene.ray_test(si.spawn_ray(to_sun)) & (dr.dot(si.sh_frame.n, to_sun) > 0)
    wall = dr.dot(si.n, si.sh_frame.n) < np.cos(np.radians(WALL_DEG))

    def seen(mask: mi.Bool) -> np.ndarray:
        return np.array(mask).reshape(height, width)

    skin = seen(si.is_valid())
    outline = ~outside(skin)
    gap = outline & (~skin | seen(dr.dot(si.n, ray.d) > 0))
    return {
        "rays": int(outline.sum()),
        "gap_share": float(gap.sum() / outline.sum()),
        "wall_share": float((skin & seen(wall)).sum() / outline.sum()),
        "dark_wall_share": float((skin & seen(wall & hidden)).sum() / outline.sum()),
        "hidden_share": float((skin & seen(hidden)).sum() / outline.sum()),
    }


def outside(skin: np.ndarray) -> np.ndarray:
    """The pixels that are connected with the rim of the picture without crossing the skin."""
    free = ~skin
    found = np.zeros_like(free)
    found[[0, -1]], found[:, [0, -1]] = free[[0, -1]], free[:, [0, -1]]
    while True:
        grown = found.copy()
        grown[1:] |= found[:-1]
        grown[:-1] |= found[1:]
        grown[:, 1:] |= found[:, :-1]
        grown[:, :-1] |= found[:, 1:]
        grown &= free
        if (grown == found).all():
            return found
        found = grown


def figures() -> dict:
    """Draws the mesh of today beside the pictures that are kept; returns the numbers of both."""
    use_variant()
    folder = images(PAGE)
    before = json.loads(BEFORE.read_text())
    shoot(snake_files(), "after", folder)
    with TemporaryDirectory() as scratch:
        after = {str(factor): measure(snake_files(factor, folder=Path(scratch)).mesh) for factor in RESOLUTIONS}
    # What the page says of them.
    for factor, now in after.items():
        then = before[factor]
        better = all(now[name] < then[name] for name in ("wall_share", "jumps_share", "spread_share", "turns_share"))
        if not better or max(now["gap_share"], then["gap_share"]) > SLIPPED_SHARE:
            raise ValueError(f"at resolution {factor} the page's words are no longer true: {now} after {then}")
    return {
        "before": before,
        "after": after,
        "zooms_deg": ZOOMS_DEG,
        "spp": SPP,
        "wall_deg": WALL_DEG,
        "jump_deg": JUMP_DEG,
        "turn_deg": TURN_DEG,
    }
