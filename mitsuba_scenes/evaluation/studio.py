"""Pictures of a surface drawn by the realtime renderer or path-traced, put together into sheets."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path

from PIL import Image

from .. import picture
from ..contact_sheet import contact_sheet
from ..crosscheck import realtime
from ..light import Light
from ..render import EXPOSURE_STOPS
from ..scene import View
from ..skin import KERATIN, skin_bsdf
from ..snake import SnakeFiles, snake_files
from ..tool import sunbeam
from .disc import write_disc

SNAKE = View(240, 160)
# Rays along each side of a pixel on the GPU, samples a pixel in Mitsuba.
SUPERSAMPLE, SPP = 2, 64
# As on the demonstration's pictures, without the sky, which the realtime renderer lacks.
SUN = Light(sun="directional", sky=0)
# Of the mesh: 1 has the faces that Single 2014 counts, the scenes of Mitsuba have sixteen times as many.
RESOLUTION = 1.0
ALUMINIUM = {"eta": 1.0, "k": 6.9}


@dataclass(frozen=True)
class Shot:
    """A picture: on the GPU by a method with its `options`, or path-traced (`method` None)."""

    caption: str
    skin: dict
    method: str | None
    light: Light = SUN
    view: View = SNAKE
    pigment: bool = True
    disc: bool = False
    options: dict = field(default_factory=dict)


@dataclass
class Sheet:
    """Rows of pictures that belong together."""

    name: str
    title: str
    figure: str
    text: str
    rows: list[list[Shot]] = field(default_factory=list)


def both(shots: list[Shot]) -> list[list[Shot]]:
    """The row as it is, and path-traced below."""
    return [shots, [replace(shot, caption="Mitsuba", method=None) for shot in shots]]


class Studio:
    """Draws shots into a folder. `adapter` names the GPU once something was drawn on it."""

    def __init__(self, folder: Path, resolution: float = RESOLUTION):
        self.folder = folder
        self.snake = snake_files(resolution)
        self.disc = SnakeFiles(write_disc(folder / "disc.ply"), self.snake.pigment)
        self.adapter = ""
        self._count = 0

    def shoot(self, shot: Shot) -> tuple[Path, Path, float]:
        """The picture as EXR and as PNG, and the seconds it took without what is built only once."""
        self._count += 1
        exr = self.folder / f"{self._count}.exr"
        files = self.disc if shot.disc else self.snake
        optics = ALUMINIUM if shot.disc else {"eta": KERATIN}
        traced = shot.method is None
        seconds = self._trace(shot, files, optics, exr) if traced else self._draw(shot, files, optics, exr)
        return exr, exr.with_suffix(".png"), seconds

    def _trace(self, shot: Shot, files: SnakeFiles, optics: dict, exr: Path) -> float:
        # The realtime renderer scales no energy.
        skin = {**shot.skin, **optics, "conserve_energy": False}
        bsdf = skin_bsdf(skin, files.pigment) if shot.pigment else {"type": "diffraction", **skin}
        result = picture.render(bsdf, files, shot.light, shot.view, SPP, passes=2)
        picture.check(result.pixels, shot.caption)
        picture.write(result.pixels, exr, EXPOSURE_STOPS)
        return result.seconds["later_pass"] * 2

    def _draw(self, shot: Shot, files: SnakeFiles, optics: dict, exr: Path) -> float:
        view, light = shot.view, shot.light
        words = ["render", "-o", exr, "--png", exr.with_suffix(".png"), "--exposure", EXPOSURE_STOPS]
        words += ["--method", shot.method, "--mesh", files.mesh, "--supersample", SUPERSAMPLE]
        words += ["--size", f"{view.width}x{view.height}", "--fov", view.fov_deg]
        for name, place in (("origin", view.origin_cm), ("target", view.target_cm)):
            words += [f"--camera-{name}", ",".join(map(str, place))]
        words += ["--light-azimuth", light.azimuth_deg, "--light-elevation", light.elevation_deg]
        words += [] if shot.pigment else ["--blend", "none"]
        report = json.loads(sunbeam(*words, *realtime.surface_words({**shot.skin, **optics, **shot.options})))
        # Without the driver's version.
        self.adapter = report["adapter"].split(" (")[0]
        return report["gpu_ms"] / 1e3


def draw(sheet: Sheet, studio: Studio, folder: Path) -> dict:
    """Writes the sheet, and returns the figures of its pictures."""
    cells, rows, drawn = [], [], []
    for row in sheet.rows:
        cells.append([])
        for column, shot in enumerate(row):
            exr, png, seconds = studio.shoot(shot)
            figures = {"caption": shot.caption, "seconds": seconds, "delta_e_mean": None, "flip": None}
            # What is path-traced is the reference of what was drawn just before: in the row above, or in the same one.
            if shot.method is None:
                held = [drawn[-1][column]] if len(sheet.rows) > 1 else rows[:]
                for other in held:
                    found = realtime.compare(exr, other["exr"], exposure=EXPOSURE_STOPS)
                    other["delta_e_mean"], other["flip"] = found["delta_e_2000"]["mean"], found["flip"]["mean"]
            figures["exr"] = exr
            rows.append(figures)
            cells[-1].append((png, f"{shot.caption}, {seconds:.2g} s"))
            print(f"{sheet.name}: {cells[-1][-1][1]}", flush=True)
        drawn.append(rows[-len(row) :])
    for figures in rows:
        del figures["exr"]
    png = studio.folder / f"{sheet.name}.png"
    contact_sheet(cells, png, SNAKE.width)
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
