"""BRDF maps as panels of a sheet: drawn by `sunbeam brdf-map`, compared with a reference map, and captioned.

A *map* shows the BRDF over outgoing directions for one direction of the light. Its pixels are direction sines (x, y) in
[−1, 1]², +y up. Those with x² + y² < 1, the *disc*, are outgoing directions. A *panel* is a picture on the sheet: a
drawing, or a map reduced to PANEL pixels a side. An *inset* in a panel enlarges a rectangle of the map. An *exposure*
is a factor on the map's linear values.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from mitsuba_scenes.contact_sheet import PAPER, contact_sheet
from mitsuba_scenes.tool import sunbeam

from .map_surfaces import Surface

# Side of a panel in pixels, and of a map without an inset.
PANEL = 168
# Default number of pixels of a map with an inset in each pixel of the panel, along each side. Such numbers are odd, so
# that the centre of each pixel of the panel is the centre of a pixel of the map.
FINE = 3
# Options of the reference for spectra: the method FLSS (docs/realtime.md), with relative errors too small to be seen.
REFERENCE_SPECTRUM = ("--method", "flss", "--tolerance", 1e-4)
# Options of the reference map, in wavelength steps of 1 nm.
REFERENCE = (*REFERENCE_SPECTRUM, "--lambda-step", 1)
# Colour of the boxes of insets, sRGB bytes.
RED = (230, 30, 30)
# Font of the captions, which has Greek letters.
FONT = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
# Size of the captions' letters in pixels.
FONT_SIZE = 11


class Box(NamedTuple):
    """A rectangle of a map, in direction sines."""

    x_min: float
    x_max: float
    y_min: float
    y_max: float


class DrawnMap(NamedTuple):
    """The EXR of a map, with linear values, and the exposure of the PNG beside the EXR."""

    exr: Path
    exposure: float

    @property
    def png(self) -> Path:
        """The map as displayed."""
        return self.exr.with_suffix(".png")


@dataclass(frozen=True, eq=False)
class Panel:
    """A map of a surface, by the options of a method, and its caption.

    - `theta_i_deg`: the angle of incidence; light comes from the side of +x.
    - `box`, `fine`: with a box the map has `fine` (odd) times the pixels of a panel along each side, and an inset shows
      the box.
    - `reference_surface`: the surface of the reference map, if it is not the map's own.
    - `exposure`: the map's exposure, by default that of the reference map.
    - `compared`: whether the map gets errors. The reference map of one without errors serves the exposure alone. It is
      at normal incidence, so that maps at several angles have one exposure.
    """

    caption: str
    surface: Surface
    options: tuple
    theta_i_deg: float = 0
    box: Box | None = None
    fine: int = FINE
    exposure: float | None = None
    compared: bool = True
    reference_surface: Surface | None = None

    @property
    def size(self) -> int:
        """Side of the map in pixels."""
        return PANEL * self.fine if self.box else PANEL

    def arguments(self) -> tuple:
        """The arguments of `sunbeam brdf-map` for the map."""
        return (*self.surface.arguments, "--theta-i", self.theta_i_deg, "--size", self.size, *self.options)

    def reference_arguments(self) -> tuple:
        """The arguments of `sunbeam brdf-map` for the reference map."""
        surface = self.reference_surface or self.surface
        theta_i_deg = self.theta_i_deg if self.compared else 0
        return (*surface.arguments, "--theta-i", theta_i_deg, "--size", self.size, *REFERENCE)


@dataclass(frozen=True, eq=False)
class Drawing:
    """A panel that is no map: a finished picture, PANEL pixels wide and high."""

    caption: str
    picture: Image.Image


@dataclass
class Sheet:
    """Panels of one picture file NAME.jpg, in rows of `columns`."""

    name: str
    columns: int
    panels: list[Panel | Drawing] = field(default_factory=list)


class Maps:
    """Draws maps into a folder, each once."""

    def __init__(self, folder: Path):
        self.folder = folder
        # Finished maps by arguments and exposure.
        self._drawn: dict[tuple, DrawnMap] = {}

    def drawn(self, arguments: tuple, exposure: float | None = None) -> DrawnMap:
        """The map with these `arguments` of `sunbeam brdf-map`.

        The default exposure clips 1 % of the pixels that are not black.
        """
        key = (*arguments, exposure)
        if key not in self._drawn:
            exr = self.folder / f"map-{len(self._drawn)}.exr"
            exposed = () if exposure is None else ("--exposure", exposure)
            report = json.loads(sunbeam("brdf-map", "-o", exr, "--png", exr.with_suffix(".png"), *arguments, *exposed))
            self._drawn[key] = DrawnMap(exr, report["exposure"])
        return self._drawn[key]

    def map_of(self, panel: Panel) -> DrawnMap:
        """The panel's map, at the exposure of the panel, or else of the reference map."""
        return self.drawn(panel.arguments(), panel.exposure or self.reference(panel).exposure)

    def reference(self, panel: Panel) -> DrawnMap:
        """The panel's reference map."""
        return self.drawn(panel.reference_arguments())

    def error(self, panel: Panel) -> dict:
        """Differences of the panel's map from its reference: CIEDE2000 and FLIP over the disc, and CIEDE2000 where lit.

        `delta_e_p99` is the 99th percentile; the others are means.
        """
        found = self.compare(panel, disc(panel.size))
        return {
            "delta_e_mean": found["delta_e_2000"]["mean"],
            "delta_e_p99": found["delta_e_2000"]["p99"],
            "delta_e_lit": self.compare(panel, self.lit(panel))["delta_e_2000"]["mean"],
            "flip": found["flip"]["mean"],
        }

    def lit(self, panel: Panel) -> np.ndarray:
        """Mask of the pixels where the displayed reference is not black."""
        return np.asarray(Image.open(self.reference(panel).png).convert("RGB")).max(axis=-1) > 0

    def compare(self, panel: Panel, mask: np.ndarray) -> dict:
        """The report of `sunbeam compare` on the panel's map and its reference, where `mask` is true.

        Both are exposed as the reference.
        """
        reference, compared = self.reference(panel), self.map_of(panel)
        png = self.folder / "mask.png"
        Image.fromarray(np.where(mask, 255, 0).astype(np.uint8)).save(png)
        # `compare` takes the exposure in stops.
        return json.loads(
            sunbeam("compare", reference.exr, compared.exr, "--exposure", math.log2(reference.exposure), "--mask", png)
        )


def sines(size: int) -> np.ndarray:
    """Direction sines x of the pixels' centres along a row of a map `size` pixels wide, in ascending order."""
    return (np.arange(size) + 0.5) * 2 / size - 1


def disc(size: int) -> np.ndarray:
    """Mask of the disc in a map `size` pixels wide and high."""
    return np.hypot(sines(size)[:, None], sines(size)) < 1


def short(delta_e: float) -> str:
    """A colour difference in two digits, or "< 0.01"."""
    return f"{delta_e:.2g}" if delta_e >= 0.01 else "< 0.01"


def picture_of(panel: Panel, png: Path) -> Image.Image:
    """The displayed map `png` at the size of the panel, with its inset; outside the disc it has the sheet's colour."""
    pixels = np.array(Image.open(png).convert("RGB"))
    size = len(pixels)
    pixels[~disc(size)] = PAPER
    # A block of `step` × `step` pixels of the map becomes one pixel of the panel, the block's middle one.
    step = size // PANEL
    image = Image.fromarray(np.ascontiguousarray(pixels[step // 2 :: step, step // 2 :: step]))
    if panel.box is None:
        return image
    # The box in pixels of the map.
    left, right = (round((x + 1) / 2 * size) for x in (panel.box.x_min, panel.box.x_max))
    top, bottom = (round((1 - y) / 2 * size) for y in (panel.box.y_max, panel.box.y_min))
    boxed = Image.fromarray(np.ascontiguousarray(pixels[top:bottom, left:right]))
    # Two or three fifths of the panel leave the middle of the map, where the boxes are, free.
    width = PANEL * (3 if boxed.width > boxed.height else 2) // 5
    inset = boxed.resize((width, round(width * boxed.height / boxed.width)), Image.Resampling.BICUBIC)
    canvas = ImageDraw.Draw(image)
    canvas.rectangle([left // step - 1, top // step - 1, right // step, bottom // step], outline=RED)
    corner = (PANEL - width - 2, PANEL - inset.height - 2)
    image.paste(inset, corner)
    canvas.rectangle([corner[0] - 1, corner[1] - 1, PANEL - 2, PANEL - 2], outline=RED)
    return image


def draw(sheet: Sheet, maps: Maps, folder: Path) -> dict:
    """Writes the sheet as JPEG into `folder`; returns the file's name and the errors of the compared panels."""
    cells, errors = [], []
    for number, panel in enumerate(sheet.panels):
        caption = panel.caption
        if isinstance(panel, Drawing):
            picture = panel.picture
        else:
            picture = picture_of(panel, maps.map_of(panel).png)
            if panel.compared:
                errors.append({"caption": caption.replace("\n", ", "), **maps.error(panel)})
                caption += f"\nΔE {short(errors[-1]['delta_e_mean'])}, lit {short(errors[-1]['delta_e_lit'])}"
        png = maps.folder / f"{sheet.name}-{number}.png"
        picture.save(png)
        cells.append((png, caption))
        print(f"{sheet.name}: {caption!r}", flush=True)
    rows = [cells[i : i + sheet.columns] for i in range(0, len(cells), sheet.columns)]
    whole = maps.folder / f"{sheet.name}.png"
    contact_sheet(rows, whole, PANEL, ImageFont.truetype(FONT, FONT_SIZE))
    file = folder / f"{sheet.name}.jpg"
    with Image.open(whole) as drawn:
        drawn.save(file, quality=88)
    return {"picture": file.name, "panels": errors}
