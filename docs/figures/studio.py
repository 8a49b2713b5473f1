"""Pictures of the snake or of a compact disc, on sheets with captions.

A `Shot` describes a picture, the `Studio` renders it, and `draw` arranges the shots of a `Sheet` in one picture file.
Captions have the rendering times. `draw` returns the times and the differences from path-traced pictures.

Pictures are drawn on the GPU by the realtime renderer, the command `sunbeam render`, or path-traced by Mitsuba with the
plugin. Single 2014 is M. Single's thesis, whose figures the sheets repeat.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from mitsuba_scenes import picture
from mitsuba_scenes.contact_sheet import contact_sheet
from mitsuba_scenes.crosscheck import realtime
from mitsuba_scenes.light import Light
from mitsuba_scenes.render import EXPOSURE_STOPS
from mitsuba_scenes.scene import View
from mitsuba_scenes.skin import KERATIN, skin_bsdf
from mitsuba_scenes.snake import SnakeFiles, snake_files
from mitsuba_scenes.tool import sunbeam

from .disc import write_disc

# View of the snake in most shots: the default camera, width and height in pixels.
SNAKE = View(240, 160)
# Default number of rays along each side of a pixel on the GPU. More smooth edges and glints, and take longer.
SUPERSAMPLE = 2
# Number of Mitsuba's passes over a picture. The first includes the compilation of kernels, so the second is timed.
PASSES = 2
# Samples per pixel in Mitsuba, of all passes together: 36 in each, since the sampler needs a square number.
SPP = 72
# The default sun of `Light`, without sky, which the realtime renderer lacks.
SUN = Light(sun="directional", sky_radiance=0)
# Factor on the number of quadrilaterals of the snake's mesh in each direction. With 1 the mesh has about as many faces
# as that of Single 2014.
RESOLUTION = 1.0
# Refractive index η + ik of aluminium near the middle of the visible range, rounded; one value for all wavelengths.
ALUMINIUM = {"eta": 1.0, "k": 6.9}


@dataclass(frozen=True)
class Shot:
    """A picture: on the GPU by a realtime `method` with its `options`, or path-traced (`method` None).

    - `skin`: the surface, as parameters of the plugin. `options`: further ones of the realtime method alone, which a
      path-traced picture ignores.
    - `light`: on the GPU only the direction of its sun counts.
    - `pigment`, `disc`: the object is the snake, with or without its pigment, or the compact disc. Shots of the disc
      must have `pigment=False`.
    - `mark`: draws onto the picture of the sheet. Comparisons use the picture without the mark.
    """

    caption: str
    skin: dict
    method: str | None
    light: Light = SUN
    view: View = SNAKE
    pigment: bool = True
    disc: bool = False
    options: dict = field(default_factory=dict)
    mark: Callable[[Image.Image], None] | None = None

    def picture_key(self) -> str:
        """A key of the picture, equal for shots that differ in caption and mark alone."""
        return repr(replace(self, caption="", mark=None))

    def scene_key(self) -> str:
        """A key of the scene, equal for shots that differ in caption, mark and method alone.

        Options are part of the key, so a GPU picture is compared with the path-traced shot of the same options.
        """
        return repr(replace(self, caption="", mark=None, method=None))


class Taken(NamedTuple):
    """The result of `shoot`: the linear picture, the displayed picture, and the seconds of the rendering alone."""

    exr: Path
    png: Path
    seconds: float


@dataclass
class Sheet:
    """Rows of shots for one picture file NAME.jpg.

    `title`, and the number `figure` of the figure of Single 2014 that the sheet repeats, are copied to the data.
    """

    name: str
    title: str
    figure: str
    rows: list[list[Shot]]


def with_path_traced(shots: list[Shot]) -> list[list[Shot]]:
    """A row of shots, and below it the same shots path-traced."""
    return [shots, [replace(shot, caption="Mitsuba", method=None) for shot in shots]]


class Studio:
    """Takes shots into a folder, each once.

    `resolution` is that of the snake's mesh, `supersample` the number of rays along each side of a pixel on the GPU.
    `adapter` is the GPU's name after the first picture on it, before that an empty string.
    """

    def __init__(self, folder: Path, resolution: float = RESOLUTION, supersample: int = SUPERSAMPLE):
        self.folder = folder
        self.supersample = supersample
        self.snake = snake_files(resolution)
        # `SnakeFiles` requires a pigment, so the disc gets the snake's; shots of the disc do not show it.
        self.disc = SnakeFiles(write_disc(folder / "disc.ply"), self.snake.pigment)
        self.adapter = ""
        self._taken: dict[str, Taken] = {}
        self._masks: dict[str, Path] = {}

    def shoot(self, shot: Shot) -> Taken:
        """The picture of a shot, taken at the first call."""
        key = shot.picture_key()
        if key not in self._taken:
            exr = self.folder / f"{len(self._taken)}.exr"
            # Optical parameters, which both renderers get. Stam's obliquity factor is that of Single 2014. It is the
            # default for a metal, so only the dielectric names it.
            optics = ALUMINIUM if shot.disc else {"eta": KERATIN, "obliquity": "stam"}
            take = self._path_trace if shot.method is None else self._draw_on_gpu
            seconds = take(shot, self._files(shot), optics, exr)
            self._taken[key] = Taken(exr, exr.with_suffix(".png"), seconds)
        return self._taken[key]

    def mask(self, shot: Shot) -> Path:
        """A PNG that is white where the centre of a pixel sees the shot's mesh, black elsewhere."""
        key = repr((shot.view, shot.disc))
        if key not in self._masks:
            npy = self.folder / f"mask-{len(self._masks)}.npy"
            # `--pairs` writes an array (rows, columns, 8) that begins with the unit vectors to sun and camera at the
            # pixels' centres. They do not depend on surface and method, so the fastest are taken. The method `stam`
            # needs a period, and a flat surface has none.
            arguments = ["--method", "stam", "--preset", "flat", "--period-um", 1, "--mesh", self._files(shot).mesh]
            sunbeam("render", "-o", npy.with_suffix(".exr"), "--pairs", npy, *arguments, *view_arguments(shot.view))
            # The vectors to the camera, zero where the pixel's centre does not see the mesh.
            to_camera = np.load(npy)[..., 3:6]
            Image.fromarray(np.uint8(255 * to_camera.any(axis=-1))).save(npy.with_suffix(".png"))
            self._masks[key] = npy.with_suffix(".png")
        return self._masks[key]

    def _files(self, shot: Shot) -> SnakeFiles:
        """Mesh and pigment of the shot's object."""
        return self.disc if shot.disc else self.snake

    def _path_trace(self, shot: Shot, files: SnakeFiles, optics: dict, exr: Path) -> float:
        """Path-traces a shot into `exr` and a PNG beside it; returns seconds of rendering, without compilation.

        Energy conservation is off, since the published realtime methods lack it.
        """
        skin = {**shot.skin, **optics, "conserve_energy": False}
        bsdf = skin_bsdf(skin, files.pigment) if shot.pigment else {"type": "diffraction", **skin}
        result = picture.render(bsdf, files, shot.light, shot.view, SPP, passes=PASSES)
        picture.check(result.pixels, shot.caption)
        picture.write(result.pixels, exr, EXPOSURE_STOPS)
        # Assumes that all passes take as long as the last, which does not compile.
        return result.seconds["later_pass"] * PASSES

    def _draw_on_gpu(self, shot: Shot, files: SnakeFiles, optics: dict, exr: Path) -> float:
        """Draws a shot by the realtime renderer into `exr` and a PNG beside it; returns seconds on the GPU."""
        light = shot.light
        arguments = ["render", "-o", exr, "--png", exr.with_suffix(".png"), "--exposure", EXPOSURE_STOPS]
        arguments += ["--method", shot.method, "--mesh", files.mesh, "--supersample", self.supersample]
        arguments += view_arguments(shot.view)
        arguments += ["--light-azimuth", light.azimuth_deg, "--light-elevation", light.elevation_deg]
        arguments += [] if shot.pigment else ["--blend", "none"]
        # Later parameters replace earlier ones of the same name.
        surface = {**shot.skin, **optics, **shot.options}
        if shot.options.get("stam_form") == "gems":
            # The form of Stam's shader in GPU Gems. The obliquity factor has no effect on it, and the command refuses
            # it.
            surface.pop("obliquity", None)
        report = json.loads(sunbeam(*arguments, *realtime.surface_words(surface)))
        # The adapter's name without the driver's version.
        self.adapter = report["adapter"].split(" (")[0]
        return report["gpu_ms"] / 1e3


def view_arguments(view: View) -> list:
    """The arguments of `sunbeam render` for size and camera."""
    arguments = ["--size", f"{view.width}x{view.height}", "--fov", view.fov_deg]
    for name, position_cm in (("origin", view.origin_cm), ("target", view.target_cm)):
        arguments += [f"--camera-{name}", ",".join(map(str, position_cm))]
    return arguments


def seconds_text(seconds: float) -> str:
    """Seconds as text with two significant digits, or as a whole number from 10 on."""
    return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.2g} s"


class Drawn(NamedTuple):
    """An entry of a sheet: a shot, its figures for the page, and its linear picture."""

    shot: Shot
    figures: dict
    exr: Path


def compare_earlier(reference: Drawn, earlier: list[Drawn]) -> None:
    """Adds the differences from a path-traced reference to the figures of earlier GPU pictures of the same scene.

    The differences are the means over the picture of CIEDE2000, `delta_e_mean`, and of FLIP, `flip`.
    """
    for other in earlier:
        if other.shot.method is not None and other.shot.scene_key() == reference.shot.scene_key():
            report = realtime.compare(reference.exr, other.exr, exposure=EXPOSURE_STOPS)
            other.figures["delta_e_mean"] = report["delta_e_2000"]["mean"]
            other.figures["flip"] = report["flip"]["mean"]


def draw(sheet: Sheet, studio: Studio, folder: Path, width: int = SNAKE.width) -> dict:
    """Writes the sheet into `folder` with pictures `width` pixels wide; returns the figures of its pictures.

    `pictures` lists all pictures row by row, and `compared` the GPU pictures that have a path-traced reference. The
    reference is a later shot of the sheet with the same `scene_key`. `delta_e_mean` and `flip` are `None` without one.
    """
    cells: list[list[tuple[Path, str]]] = []
    entries: list[Drawn] = []
    for row in sheet.rows:
        cells.append([])
        for shot in row:
            exr, png, seconds = studio.shoot(shot)
            figures = {
                "caption": shot.caption,
                "seconds": seconds,
                "time": seconds_text(seconds),
                "delta_e_mean": None,
                "flip": None,
            }
            entry = Drawn(shot, figures, exr)
            if shot.method is None:
                compare_earlier(entry, entries)
            entries.append(entry)
            caption = f"{shot.caption}, {seconds_text(seconds)}"
            cells[-1].append((_marked(shot, png), caption))
            print(f"{sheet.name}: {caption}", flush=True)
    whole = studio.folder / f"{sheet.name}.png"
    contact_sheet(cells, whole, width)
    with Image.open(whole) as made:
        made.save(folder / f"{sheet.name}.jpg", quality=88)
    pictures = [entry.figures for entry in entries]
    return {
        "name": sheet.name,
        "title": sheet.title,
        "figure": sheet.figure,
        "pictures": pictures,
        "compared": [figures for figures in pictures if figures["delta_e_mean"] is not None],
    }


def _marked(shot: Shot, png: Path) -> Path:
    """The file of a copy of the picture with the shot's mark; the picture's own file without a mark."""
    if shot.mark is None:
        return png
    marked = png.with_name(f"{png.stem}-marked.png")
    with Image.open(png) as plain:
        image = plain.convert("RGB")
    shot.mark(image)
    image.save(marked)
    return marked
