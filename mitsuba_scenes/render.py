"""Renders the snake with one skin: `python -m mitsuba_scenes.render --skin xenopeltis -o out/snake.exr`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from . import picture
from .environment import DEFAULT_VARIANT, SetupError, use_variant
from .light import SUN_KINDS, Light
from .outputs import output_file
from .scene import MAX_DEPTH, View
from .skin import KERATIN, PRESETS, preset_skin, scanned_skin, skin_bsdf
from .snake import SnakeFiles, snake_files

# Exposure of PNG pictures in stops (doublings): the sunlit snake is dark and diffracts little light, so it is shown
# four times as bright. Larger values brighten it further and compress more highlights.
EXPOSURE_STOPS = 2.0


def positive(kind: type) -> Callable[[str], float]:
    """An argparse type: a finite number above zero of the type `kind`, int or float."""

    def convert(text):
        value = kind(text)
        if not 0 < value < float("inf"):
            raise argparse.ArgumentTypeError(f"{text} is not a finite number above zero")
        return value

    # Argparse names the converter in its message on other text: "invalid int value".
    convert.__name__ = kind.__name__
    return convert


def arguments(words: list[str] | None) -> tuple[argparse.ArgumentParser, argparse.Namespace]:
    """Makes the parser, and parses the arguments `words`, by default those of the process.

    Returns the parser, whose name begins error messages, and the options.
    """
    view, light = View(), Light()
    parser = argparse.ArgumentParser(
        prog="python -m mitsuba_scenes.render",
        description="Renders the snake; writes a linear EXR and a tone-mapped PNG beside it.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    add = parser.add_argument
    skin = parser.add_mutually_exclusive_group()
    skin.add_argument("--skin", choices=list(PRESETS), default="xenopeltis", help="a named surface")
    skin.add_argument("--height-field", type=Path, metavar="FILE", help="a scan: .exr, .png, .gsf, .npy or .txt")
    add("--pixel-size", type=positive(float), metavar="UM", help="edge of a pixel, for a scan without a scale")
    height_help = "height of the largest value, for a scan without a unit of height"
    add("--max-height", type=positive(float), metavar="UM", help=height_help)
    rotation_help = "turns the relief counter-clockwise, seen from outside (None: the skin's own angle)"
    add("--rotation", type=float, metavar="DEG", help=rotation_help)
    add("--eta", type=positive(float), default=KERATIN, help="refractive index of the skin")
    add(
        "--light-direction",
        type=float,
        nargs=2,
        metavar=("AZIMUTH", "ELEVATION"),
        default=(light.azimuth_deg, light.elevation_deg),
        help="direction to the sun in degrees: counter-clockwise from +x (the tail) seen from above; above the ground",
    )
    add("--sun", choices=SUN_KINDS, default=light.sun, help="parallel light, or a disc of the sun's size in the sky")
    add("--sky", type=float, default=light.sky_radiance, help="radiance of the sky; a white plane facing the sun has 1")
    size = (view.width, view.height)
    add("--resolution", type=positive(int), nargs=2, metavar=("W", "H"), default=size, help="size in pixels")
    add("--spp", type=positive(int), default=64, help="samples a pixel, rounded up to a square number in each pass")
    add("--max-depth", type=positive(int), default=MAX_DEPTH, help="longest path, in segments")
    add("--exposure", type=float, default=EXPOSURE_STOPS, help="brightens the PNG, in stops")
    add("--variant", default=DEFAULT_VARIANT, help="variant of Mitsuba")
    add("--mesh", type=Path, help="another mesh than the snake, with UVs, as PLY in cm (None: the snake)")
    add("--pigment", type=Path, help="another picture of the diffuse reflectance (None: the snake's)")
    add("-o", "--output", type=output_file(".exr", beside=(".png",)), default="out/snake.exr", help="the EXR")
    return parser, parser.parse_args(words)


def run(options: argparse.Namespace) -> None:
    """Renders and writes the picture.

    Raises ValueError for contradictory options, values out of range and missing files; RuntimeError where Mitsuba
    refuses a parameter or a file; OSError where a file cannot be read or written; and SetupError or PictureError as
    `use_variant`, `snake_files` and `picture.check` do.
    """
    if options.height_field:
        skin = scanned_skin(options.height_field, options.pixel_size, options.max_height)
    elif options.pixel_size or options.max_height:
        raise ValueError("--pixel-size and --max-height go with --height-field")
    else:
        skin = preset_skin(options.skin)
    if options.rotation is not None:
        # The plugin's parameter is in degrees, too.
        skin["rotation"] = options.rotation
    for given in (options.mesh, options.pigment):
        if given and not given.is_file():
            raise ValueError(f"there is no file {given}")
    light = Light(*options.light_direction, sun=options.sun, sky_radiance=options.sky)
    view = View(*options.resolution)

    # After the checks above, so that wrong options are refused at once.
    variant = use_variant(options.variant)
    if options.mesh and options.pigment:
        # The snake's files are not needed, nor the command `sunbeam`, which writes them.
        files = SnakeFiles(options.mesh, options.pigment)
    else:
        snake = snake_files()
        files = SnakeFiles(options.mesh or snake.mesh, options.pigment or snake.pigment)
    passes, spp_per_pass = picture.split(view.width, view.height, options.spp)
    samples = passes * spp_per_pass
    print(f"rendering {view.width} x {view.height}, {samples} samples a pixel, {variant}", flush=True)
    bsdf = skin_bsdf(skin, files.pigment, options.eta)
    result = picture.render(bsdf, files, light, view, options.spp, options.max_depth)
    # Refuses values that are not finite, and a black picture.
    picture.check(result.pixels, str(options.output))
    png = picture.write(result.pixels, options.output, options.exposure)
    print(", ".join(f"{name} {value:.2f} s" for name, value in result.seconds.items()))
    print(f"wrote {options.output} and {png}")


def main(words: list[str] | None = None) -> int:
    """Runs the command with the arguments `words`, by default those of the process.

    Returns the exit status: 0, or 2 after one line on stderr that names the error. Wrong arguments end the process with
    status 2, by argparse, which also prints the usage.
    """
    parser, options = arguments(words)
    try:
        run(options)
    # RuntimeError is Mitsuba's.
    except (SetupError, ValueError, picture.PictureError, OSError, RuntimeError) as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
