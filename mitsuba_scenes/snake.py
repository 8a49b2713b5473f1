"""Mesh and pigment of the snake, written by `sunbeam snake` and kept in target/scenes/."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from .environment import REPOSITORY
from .tool import TOOL, sunbeam

# Folder of the written files.
FOLDER = REPOSITORY / "target" / "scenes"


@dataclass(frozen=True)
class SnakeFiles:
    """Files of the snake: `mesh`, a PLY in cm with z up, and `pigment`, an sRGB picture over the mesh's UVs."""

    mesh: Path
    pigment: Path


def snake_files(resolution: float = 4.0, tool: Path = TOOL, folder: Path = FOLDER) -> SnakeFiles:
    """Paths of the snake's files in `folder`.

    `resolution` is the factor of `sunbeam snake --resolution` on the number of the mesh's quadrilaterals in each
    direction; larger values give smoother scales and larger files. The files are written if one is missing or older
    than the executable `tool`, since a new build may draw another snake. Raises SetupError where `tool` fails.
    """
    files = SnakeFiles(folder / f"snake-{resolution:g}.ply", folder / f"pigment-{resolution:g}.png")
    # Time at which `tool` was built. If it is missing, all files count as outdated, and the call below fails.
    built_at = tool.stat().st_mtime if tool.exists() else math.inf
    if all(path.exists() and path.stat().st_mtime > built_at for path in (files.mesh, files.pigment)):
        return files
    folder.mkdir(parents=True, exist_ok=True)
    # Renamed after the command ends, so that an interrupted one leaves no unfinished file under the final names.
    with TemporaryDirectory(dir=folder) as unfinished:
        mesh, pigment = (Path(unfinished) / path.name for path in (files.mesh, files.pigment))
        sunbeam("snake", "-o", mesh, "--resolution", f"{resolution:g}", "--pigment", pigment, tool=tool)
        mesh.replace(files.mesh)
        pigment.replace(files.pigment)
    return files
