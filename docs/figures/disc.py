"""A compact disc as a mesh: a flat ring whose texture coordinate u runs along the radius and v around the ring.

The x axis of a relief follows u, so grooves along its y axis become circles. So do the rows of pits of the preset `cd`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

# Inner radius of a compact disc's tracks.
INNER_RADIUS_CM = 2.3
# Outer radius of a compact disc's tracks.
OUTER_RADIUS_CM = 5.8
# Height of the disc above the scenes' ground z = 0. At height 0 disc and ground would coincide; a larger height would
# be seen as a gap.
HEIGHT_CM = 0.2
# Quadrilaterals of the mesh around the ring. More make the outline rounder, and the direction of the tracks, which is
# constant in each triangle, more accurate.
ANGULAR_CELLS = 240
# Quadrilaterals of the mesh along the radius. More make the interpolated texture coordinates more accurate.
RADIAL_CELLS = 4


def write_disc(ply: Path) -> Path:
    """Writes the horizontal ring as PLY in cm, with normals along +z and texture coordinates in [0, 1]; returns `ply`.

    v is 0 on the +x axis and grows counter-clockwise seen from above. The radial lines v = 0 and v = 1 coincide and
    differ only in their texture coordinates, so their vertices are written for both.
    """
    v, u = np.meshgrid(np.linspace(0, 1, ANGULAR_CELLS + 1), np.linspace(0, 1, RADIAL_CELLS + 1), indexing="ij")
    radius_cm, angle = INNER_RADIUS_CM + (OUTER_RADIUS_CM - INNER_RADIUS_CM) * u, 2 * np.pi * v
    zero = np.zeros_like(u)
    position = (radius_cm * np.cos(angle), radius_cm * np.sin(angle), zero + HEIGHT_CM)
    normal = (zero, zero, zero + 1)
    vertices = np.stack([*position, *normal, u, v], axis=-1).reshape(-1, 8)
    # Vertices along a radius are neighbours in the list: vertex (i, j), the i-th around and the j-th outwards, has the
    # index i·step + j.
    step = RADIAL_CELLS + 1
    # Indices of each quadrilateral's corners a, b, c and d, counter-clockwise seen from above. `a` is the inner corner
    # at the smaller v, and `b` the outer one at this v.
    a = (np.arange(ANGULAR_CELLS)[:, None] * step + np.arange(RADIAL_CELLS)).ravel()
    b, c, d = a + 1, a + step + 1, a + step
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
    lines = [
        "ply",
        "format ascii 1.0",
        f"element vertex {len(vertices)}",
        *(f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz", "u", "v")),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header",
        *(" ".join(f"{number:.9g}" for number in vertex) for vertex in vertices),
        *(f"3 {i} {j} {k}" for i, j, k in faces),
    ]
    ply.write_text("\n".join(lines) + "\n")
    return ply
