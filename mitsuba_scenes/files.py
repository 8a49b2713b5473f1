"""Writes the XML scenes and their files: `python -m mitsuba_scenes.files`, called by `make scenes`."""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from .environment import FALLBACK_VARIANT, REPOSITORY, SetupError, use_variant
from .outputs import output_folder
from .skin import pigment_texture
from .snake import snake_files
from .tool import sunbeam

# Folder of the XML scenes in the repository.
XML = Path(__file__).resolve().parent / "xml"
# Rectangle of the procedural skin written as scan.gsf, since the repository holds no scan: x, y, width and height in
# µm. It has the size of the published scans.
PIECE_UM = "10,10,6.5,6.5"


def write_scenes(folder: Path, resolution: float = 4.0) -> list[Path]:
    """Copies the XML scenes into `folder`, with snake.ply, pigment.exr and scan.gsf beside them.

    Returns the paths of the copied scenes. A Mitsuba variant must be selected. `resolution` is a factor on the number
    of the mesh's cells (`snake_files`).
    """
    folder.mkdir(parents=True, exist_ok=True)
    files = snake_files(resolution)
    shutil.copyfile(files.mesh, folder / "snake.ply")
    pigment_texture(files.pigment)["bitmap"].write(str(folder / "pigment.exr"))
    sunbeam("height-field", "--preset", "xenopeltis", "--crop", PIECE_UM, "-o", folder / "scan.gsf")
    return [Path(shutil.copy(scene, folder)) for scene in sorted(XML.glob("*.xml"))]


def main(words: list[str] | None = None) -> int:
    """Runs the command. Exit status: 0, or 2 after one line on stderr that names the error."""
    parser = argparse.ArgumentParser(prog="python -m mitsuba_scenes.files", description=__doc__)
    folder = str(REPOSITORY / "out" / "scenes")
    parser.add_argument("-o", "--output", type=output_folder, default=folder, help="folder of the scenes")
    options = parser.parse_args(words)
    try:
        use_variant(FALLBACK_VARIANT)
        for scene in write_scenes(options.output):
            # A command that renders the scene.
            print(f"mitsuba -a target/mitsuba -m llvm_ad_spectral {scene}")
    except SetupError as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
