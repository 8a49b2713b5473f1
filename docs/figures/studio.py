"""Pictures by the realtime renderer or path-traced, on sheets with captions."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

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

# View of the snake in most shots.
SNAKE = View(240, 160)
# Rays along each side of a pixel on the GPU.
SUPERSAMPLE = 2
# Samples a pixel in Mitsuba: two passes of 36, since a pass needs a square number.
SPP = 72
# The demo's sun without sky, which the realtime renderer lacks.
SUN = Light(sun="directional", sky=0)
# Resolution of the snake's mesh: 1 has about as many faces as Single 2014's.
RESOLUTION = 1.0
# Refractive index η + ik of aluminium in the visible, one value for all wavelengths.
ALUMINIUM = {"eta": 1.0, "k": 6.9}


@dataclass(frozen=True)
class Shot:
    """A picture: on the GPU by a method with its `options`, or path-traced (`method` None).

    `mark` draws onto the picture of the sheet; comparisons use the picture without it.
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

    def scene(self, method: str | None = None) -> str:
        """A key that is equal for equal pictures, without caption and mark, by this method."""
        return repr(replace(self, caption="", method=method, mark=None))


@dataclass
class Sheet:
    """Rows of shots for one picture file."""

    name: str
    title: str
    figure: str
    text: str
    rows: list[list[Shot]] = field(default_factory=list)


def both(shots: list[Shot]) -> list[list[Shot]]:
    """A row of shots, and below it the same shots path-traced."""
    return [shots, [replace(shot, caption="Mitsuba", method=None) for shot in shots]]


class Studio:
    """Draws shots into a folder, each once. `adapter` is the GPU's name after the first picture on it.

    `supersample` is the number of rays along each side of a pixel on the GPU.
    """

    def __init__(self, folder: Path, resolution: float = RESOLUTION, supersample: int = SUPERSAMPLE):
        self.folder = folder
        self.supersample = supersample
        self.snake = snake_files(resolution)
        self.disc = SnakeFiles(write_disc(folder / "disc.ply"), self.snake.pigment)
        self.adapter = ""
        self._taken: dict[str, tuple[Path, Path, float]] = {}
        self._masks: dict[str, Path] = {}

    def shoot(self, shot: Shot) -> tuple[Path, Path, float]:
        """The picture as EXR and as PNG, and its seconds without the building of tables."""
        key = shot.scene(shot.method)
        if key not in self._taken:
            exr = self.folder / f"{len(self._taken)}.exr"
            # Stam's obliquity factor, as in Single 2014.
            optics = ALUMINIUM if shot.disc else {"eta": KERATIN, "obliquity": "stam"}
            take = self._trace if shot.method is None else self._draw
            seconds = take(shot, self._files(shot), optics, exr)
            self._taken[key] = (exr, exr.with_suffix(".png"), seconds)
        return self._taken[key]

    def mask(self, shot: Shot) -> Path:
        """A PNG that is white where the centre of a pixel sees the mesh, black elsewhere."""
        key = repr((shot.view, shot.disc))
        if key not in self._masks:
            npy = self.folder / f"mask-{len(self._masks)}.npy"
            words = ["--method", "stam", "--preset", "flat", "--period-um", 1, "--mesh", self._files(shot).mesh]
            sunbeam("render", "-o", npy.with_suffix(".exr"), "--pairs", npy, *words, *view_words(shot.view))
            to_camera = np.load(npy)[..., 3:6]
            Image.fromarray(np.uint8(255 * to_camera.any(axis=-1))).save(npy.with_suffix(".png"))
            self._masks[key] = npy.with_suffix(".png")
        return self._masks[key]

    def _files(self, shot: Shot) -> SnakeFiles:
        return self.disc if shot.disc else self.snake

    def _trace(self, shot: Shot, files: SnakeFiles, optics: dict, exr: Path) -> float:
        """Path-traces a shot without energy conservation, which the realtime methods lack; returns seconds."""
        skin = {**shot.skin, **optics, "conserve_energy": False}
        bsdf = skin_bsdf(skin, files.pigment) if shot.pigment else {"type": "diffraction", **skin}
        result = picture.render(bsdf, files, shot.light, shot.view, SPP, passes=2)
        picture.check(result.pixels, shot.caption)
        picture.write(result.pixels, exr, EXPOSURE_STOPS)
        return result.seconds["later_pass"] * 2

    def _draw(self, shot: Shot, files: SnakeFiles, optics: dict, exr: Path) -> float:
        """Draws a shot by the realtime renderer; returns seconds on the GPU."""
        light = shot.light
        words = ["render", "-o", exr, "--png", exr.with_suffix(".png"), "--exposure", EXPOSURE_STOPS]
        words += ["--method", shot.method, "--mesh", files.mesh, "--supersample", self.supersample]
        words += view_words(shot.view)
        words += ["--light-azimuth", light.azimuth_deg, "--light-elevation", light.elevation_deg]
        words += [] if shot.pigment else ["--blend", "none"]
        asked = {**shot.skin, **optics, **shot.options}
        if shot.options.get("stam_form") == "gems":
            asked.pop("obliquity", None)  # An obliquity factor has no effect on this form and is refused.
        report = json.loads(sunbeam(*words, *realtime.surface_words(asked)))
        # The adapter's name without the driver's version.
        self.adapter = report["adapter"].split(" (")[0]
        return report["gpu_ms"] / 1e3


def view_words(view: View) -> list:
    """The arguments of `sunbeam render` for size and camera."""
    words = ["--size", f"{view.width}x{view.height}", "--fov", view.fov_deg]
    for name, place in (("origin", view.origin_cm), ("target", view.target_cm)):
        words += [f"--camera-{name}", ",".join(map(str, place))]
    return words


def told(seconds: float) -> str:
    """Seconds with two significant digits, and all digits before the point."""
    return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.2g} s"


def draw(sheet: Sheet, studio: Studio, folder: Path, width: int = SNAKE.width) -> dict:
    """Writes the sheet with pictures `width` pixels wide; returns the figures of its pictures.

    A path-traced picture is the reference of the GPU's earlier pictures of its scene on the sheet.
    """
    cells, rows, drawn = [], [], []
    for row in sheet.rows:
        cells.append([])
        for shot in row:
            exr, png, seconds = studio.shoot(shot)
            figures = {
                "caption": shot.caption,
                "seconds": seconds,
                "time": told(seconds),
                "delta_e_mean": None,
                "flip": None,
            }
            if shot.method is None:
                for other, held, other_exr in drawn:
                    if other.method is not None and other.scene() == shot.scene():
                        found = realtime.compare(exr, other_exr, exposure=EXPOSURE_STOPS)
                        held["delta_e_mean"], held["flip"] = found["delta_e_2000"]["mean"], found["flip"]["mean"]
            drawn.append((shot, figures, exr))
            rows.append(figures)
            cells[-1].append((_marked(shot, png), f"{shot.caption}, {told(seconds)}"))
            print(f"{sheet.name}: {cells[-1][-1][1]}", flush=True)
    png = studio.folder / f"{sheet.name}.png"
    contact_sheet(cells, png, width)
    with Image.open(png) as made:
        made.save(folder / f"{sheet.name}.jpg", quality=88)
    held = [row for row in rows if row["delta_e_mean"] is not None]
    return {
        "name": sheet.name,
        "title": sheet.title,
        "figure": sheet.figure,
        "text": sheet.text,
        "pictures": rows,
        "largest_delta_e": max((row["delta_e_mean"] for row in held), default=None),
        "held": held,
    }


def _marked(shot: Shot, png: Path) -> Path:
    """A copy of the picture with the shot's mark."""
    if shot.mark is None:
        return png
    marked = png.with_name(f"{png.stem}-marked.png")
    with Image.open(png) as plain:
        picture = plain.convert("RGB")
    shot.mark(picture)
    picture.save(marked)
    return marked
