"""Writes the XML scenes and their files: `python -m mitsuba_scenes.files`, called by `make scenes`."""

from __future__ import annotations

import argparse
import re
import shutil
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np

from .discs import CD, DVD, disc_scene, window
from .environment import FALLBACK_VARIANT, REPOSITORY, SetupError, use_variant
from .films import spectacles_scene, spectrometer_scene, window_scene, wing_scene
from .foils import card_scene, note_scene
from .light import Light
from .outputs import output_folder
from .scene import View, snake_scene
from .skin import pigment_texture, skin_bsdf, varied_skin
from .snake import SnakeFiles, snake_files
from .tool import sunbeam

# Folder of the scenes that are written by hand in XML.
XML = Path(__file__).resolve().parent / "xml"
# Rectangle of the procedural skin written as scan.gsf, since the repository holds no scan: x, y, width and height in
# µm. The rectangle has the size of the published scans.
PIECE_UM = "10,10,6.5,6.5"


def python_scenes(files: SnakeFiles) -> dict[str, dict]:
    """The scenes that are made by Python alone, by name. The snake's mesh is `files.mesh`."""
    return {
        "card": card_scene(),
        "banknote": note_scene(),
        "cd": disc_scene(),
        "cd-window": disc_scene(emitters=window(CD)),
        "dvd": disc_scene(kind=DVD),
        "dvd-window": disc_scene(kind=DVD, emitters=window(DVD)),
        "spectrometer": spectrometer_scene(),
        "spectacles": spectacles_scene(),
        "window": window_scene(),
        "wing": wing_scene(),
        "snake-varied": snake_scene(skin_bsdf(varied_skin("xenopeltis"), files.pigment), files, Light(), View()),
    }


def with_files(scene: dict, folder: Path, stem: str) -> dict:
    """Writes the scene's bitmaps and height fields into `folder`. Returns the scene with the names of their files.

    A bitmap is written as `stem`-PARAMETER.exr, so the parameters with bitmaps must differ in name within a scene. A
    height field, a `filename` with an absolute path, is copied under its own name. Relative file names are left as they
    are.
    """
    written = {}
    for key, value in scene.items():
        if isinstance(value, dict) and "bitmap" in value:
            name = f"{stem}-{key}.exr"
            value["bitmap"].write(str(folder / name))
            written[key] = {"filename": name, **{k: v for k, v in value.items() if k != "bitmap"}}
        elif key == "filename" and Path(value).is_absolute():
            written[key] = Path(shutil.copy(value, folder)).name
        else:
            written[key] = with_files(value, folder, stem) if isinstance(value, dict) else value
    return written


def xml_text(state: mi.parser.ParserState) -> str:
    """The XML of a parsed scene with a matrix for every transform. The transforms of `state` are replaced.

    Mitsuba would write products of a scale, a rotation and a translation, whose relative errors reach 1e-3. Therefore
    each transform becomes a translation by its number, which the matrix then replaces in the text. Numbers begin at 1,
    since Mitsuba leaves out a translation by 0.
    """
    matrices = []
    for node in state.nodes:
        for name, value in list(node.props.items()):
            # The parser holds transforms in double precision in every variant.
            if isinstance(value, mi.ScalarTransform4d):
                node.props[name] = mi.ScalarTransform4f().translate([len(matrices) + 1, 0, 0])
                matrices.append(" ".join(repr(float(entry)) for entry in np.ravel(value.matrix)))
    text = mi.parser.write_string(state)
    return re.sub(r'<translate x="(\d+)"/>', lambda found: f'<matrix value="{matrices[int(found[1]) - 1]}"/>', text)


def export(scene: dict, path: Path) -> Path:
    """Writes the scene as XML to `path`, with its files beside it, and returns the path.

    `width`, `height` and `spp` are defaults that the command `mitsuba` can replace.
    """
    state = mi.parser.parse_dict(mi.parser.ParserConfig(mi.variant()), with_files(scene, path.parent, path.stem))
    # Mitsuba names the defaults resx and resy. It writes its own version, which earlier releases would refuse.
    text = xml_text(state).replace("resx", "width").replace("resy", "height")
    path.write_text(re.sub(r'(<scene version=)"[^"]*"', r'\1"3.0.0"', text))
    return path


def write_scenes(folder: Path, resolution: float = 4.0) -> list[Path]:
    """Writes all scenes into `folder`, with snake.ply, pigment.exr, scan.gsf and the textures beside them.

    Returns the paths of the scenes: copies of those in XML, then those made by Python. A Mitsuba variant must be
    selected. `resolution` is a factor on the number of the mesh's quadrilaterals in each direction (`snake_files`).
    """
    folder.mkdir(parents=True, exist_ok=True)
    files = snake_files(resolution)
    shutil.copyfile(files.mesh, folder / "snake.ply")
    pigment_texture(files.pigment)["bitmap"].write(str(folder / "pigment.exr"))
    sunbeam("height-field", "--preset", "xenopeltis", "--crop", PIECE_UM, "-o", folder / "scan.gsf")
    copies = [Path(shutil.copy(scene, folder)) for scene in sorted(XML.glob("*.xml"))]
    # The scenes name the copy beside them.
    made = python_scenes(SnakeFiles(Path("snake.ply"), files.pigment))
    return copies + [export(scene, folder / f"{name}.xml") for name, scene in made.items()]


def main(words: list[str] | None = None) -> int:
    """Runs the command with the arguments `words`, by default those of the process.

    Returns the exit status: 0, or 2 after one line on stderr that names the error. Wrong arguments end the process with
    status 2, by argparse, which also prints the usage.
    """
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
