"""A compact disc as a mesh: a flat ring with u along the radius, so that tracks across x are circles."""

from __future__ import annotations

from pathlib import Path

import numpy as np

# Inner radius of a compact disc's tracks.
INNER_CM = 2.3
# Outer radius of a compact disc's tracks.
OUTER_CM = 5.8
# Height above the ground.
HEIGHT_CM = 0.2
# Cells of the mesh around the ring.
AROUND = 240
# Cells of the mesh along the radius.
ACROSS = 4


def write_disc(ply: Path) -> Path:
    """Writes the horizontal ring, 12 cm across, as PLY in cm with normals and texture coordinates."""
    v, u = np.meshgrid(np.linspace(0, 1, AROUND + 1), np.linspace(0, 1, ACROSS + 1), indexing="ij")
    radius, angle = INNER_CM + (OUTER_CM - INNER_CM) * u, 2 * np.pi * v
    zero = np.zeros_like(u)
    columns = (radius * np.cos(angle), radius * np.sin(angle), zero + HEIGHT_CM, zero, zero, zero + 1, u, v)
    vertices = np.stack(columns, axis=-1).reshape(-1, 8)
    corner = (np.arange(AROUND)[:, None] * (ACROSS + 1) + np.arange(ACROSS)).ravel()
    a, b, c, d = corner, corner + 1, corner + ACROSS + 2, corner + ACROSS + 1
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
