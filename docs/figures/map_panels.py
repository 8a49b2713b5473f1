"""Maps as panels of a sheet: drawn by `sunbeam`, compared with a reference map, and captioned."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from mitsuba_scenes.contact_sheet import PAPER, contact_sheet
from mitsuba_scenes.tool import sunbeam

from .map_surfaces import Surface

# Side of a panel, and of its map, in pixels.
PANEL = 168
# Factor on the side of a map with an inset; odd, so that each pixel of the panel is a pixel of the map.
FINE = 3
# Options of the reference map: the patch model by FLSS in wavelength steps of 1 nm, with a tolerance far below the
# visible.
REFERENCE = ("--method", "flss", "--tolerance", 1e-4, "--lambda-step", 1)
# Colour of the boxes of insets, sRGB bytes.
RED = (230, 30, 30)
# Font of the captions, which has Greek.
FONT = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
FONT_SIZE = 11


@dataclass(frozen=True, eq=False)
class Panel:
    """A map: a surface, a method with its options, and a caption.

    An inset shows the rectangle `box` (x from, x to, y from, y to in direction sines) of a finer map. `truth` is the
    reference's surface if it is another. The exposure is the reference's, or `exposure`; a map that is not `compared`
    has the exposure of the reference at normal incidence.
    """

    caption: str
    surface: Surface
    method: tuple
    theta_i_deg: float = 0
    box: tuple | None = None
    fine: int = FINE
    exposure: float | None = None
    compared: bool = True
    truth: Surface | None = None

    @property
    def size(self) -> int:
        """Side of the map in pixels."""
        return PANEL * self.fine if self.box else PANEL

    def words(self) -> tuple:
        """The arguments of `sunbeam brdf-map` for the map."""
        return (*self.surface.words, "--theta-i", self.theta_i_deg, "--size", self.size, *self.method)

    def reference_words(self) -> tuple:
        """The arguments of `sunbeam brdf-map` for the reference map."""
        theta_i_deg = self.theta_i_deg if self.compared else 0
        return (*(self.truth or self.surface).words, "--theta-i", theta_i_deg, "--size", self.size, *REFERENCE)


@dataclass(frozen=True, eq=False)
class Drawing:
    """A panel that is not a map."""

    caption: str
    picture: Image.Image


@dataclass
class Sheet:
    """A figure of Single 2014, or ours beside it."""

    name: str
    columns: int
    panels: list = field(default_factory=list)


class Maps:
    """Maps in a folder, each drawn once."""

    def __init__(self, folder: Path):
        self.folder = folder
        self._drawn: dict[tuple, tuple[Path, float]] = {}

    def drawn(self, words: tuple, exposure: float | None = None) -> tuple[Path, float]:
        """The map of these arguments of `sunbeam brdf-map` (.exr, with a .png beside it), and its exposure."""
        key = (*words, exposure)
        if key not in self._drawn:
            exr = self.folder / f"map-{len(self._drawn)}.exr"
            shown = () if exposure is None else ("--exposure", exposure)
            report = json.loads(sunbeam("brdf-map", "-o", exr, "--png", exr.with_suffix(".png"), *words, *shown))
            self._drawn[key] = (exr, report["exposure"])
        return self._drawn[key]

    def of(self, panel: Panel) -> tuple[Path, float]:
        """The panel's map with its own or the reference's exposure."""
        return self.drawn(panel.words(), panel.exposure or self.reference(panel)[1])

    def reference(self, panel: Panel) -> tuple[Path, float]:
        """The reference map, with 1 % of its disc clipped."""
        return self.drawn(panel.reference_words())

    def error(self, panel: Panel) -> dict:
        """Errors of the map against its reference: over the disc, and where the displayed reference is not black."""
        found = self.compared(panel, disc(panel.size))
        return {
            "delta_e_mean": found["delta_e_2000"]["mean"],
            "delta_e_p99": found["delta_e_2000"]["p99"],
            "delta_e_lit": self.compared(panel, self.lit(panel))["delta_e_2000"]["mean"],
            "flip": found["flip"]["mean"],
        }

    def lit(self, panel: Panel) -> np.ndarray:
        """Mask of the pixels of the displayed reference that are not black."""
        return np.asarray(Image.open(self.reference(panel)[0].with_suffix(".png"))).max(axis=-1) > 0

    def compared(self, panel: Panel, where: np.ndarray) -> dict:
        """The report of `sunbeam compare` of reference and map in the pixels of a mask."""
        (reference, exposure), (exr, _) = self.reference(panel), self.of(panel)
        mask = self.folder / "mask.png"
        Image.fromarray(np.where(where, 255, 0).astype(np.uint8)).save(mask)
        return json.loads(sunbeam("compare", reference, exr, "--exposure", math.log2(exposure), "--mask", mask))


def disc(size: int) -> np.ndarray:
    """Mask of the pixels of a map that are directions."""
    sine = (np.arange(size) + 0.5) * 2 / size - 1
    return np.hypot(sine[:, None], sine) < 1


def short(delta_e: float) -> str:
    """A colour difference in two digits, or "< 0.01"."""
    return f"{delta_e:.2g}" if delta_e >= 0.01 else "< 0.01"


def picture_of(panel: Panel, png: Path) -> Image.Image:
    """The map on the sheet's paper, with its inset."""
    fine = np.array(Image.open(png).convert("RGB"))
    fine[~disc(len(fine))] = PAPER
    step = len(fine) // PANEL
    image = Image.fromarray(np.ascontiguousarray(fine[step // 2 :: step, step // 2 :: step]))
    if panel.box is None:
        return image
    x0, x1, y0, y1 = panel.box
    left, right = (round((x + 1) / 2 * len(fine)) for x in (x0, x1))
    top, bottom = (round((1 - y) / 2 * len(fine)) for y in (y1, y0))
    part = Image.fromarray(np.ascontiguousarray(fine[top:bottom, left:right]))
    # Small enough to leave the middle of the map, with the boxes, free.
    width = PANEL * (3 if part.width > part.height else 2) // 5
    inset = part.resize((width, round(width * part.height / part.width)), Image.Resampling.BICUBIC)
    draw = ImageDraw.Draw(image)
    draw.rectangle([left // step - 1, top // step - 1, right // step, bottom // step], outline=RED)
    corner = (PANEL - width - 2, PANEL - inset.height - 2)
    image.paste(inset, corner)
    draw.rectangle([corner[0] - 1, corner[1] - 1, PANEL - 2, PANEL - 2], outline=RED)
    return image


def draw(sheet: Sheet, maps: Maps, folder: Path) -> dict:
    """Writes the sheet as JPEG and returns the errors of its panels."""
    cells, rows = [], []
    for number, panel in enumerate(sheet.panels):
        caption = panel.caption
        if isinstance(panel, Drawing):
            picture = panel.picture
        else:
            picture = picture_of(panel, maps.of(panel)[0].with_suffix(".png"))
            if panel.compared:
                rows.append({"caption": caption.replace("\n", ", "), **maps.error(panel)})
                caption += f"\nΔE {short(rows[-1]['delta_e_mean'])}, lit {short(rows[-1]['delta_e_lit'])}"
        png = maps.folder / f"{sheet.name}-{number}.png"
        picture.save(png)
        cells.append((png, caption))
        print(f"{sheet.name}: {caption!r}", flush=True)
    lines = [cells[i : i + sheet.columns] for i in range(0, len(cells), sheet.columns)]
    whole = maps.folder / f"{sheet.name}.png"
    contact_sheet(lines, whole, PANEL, ImageFont.truetype(FONT, FONT_SIZE))
    picture = folder / f"{sheet.name}.jpg"
    with Image.open(whole) as drawn:
        drawn.save(picture, quality=88)
    return {"picture": picture.name, "panels": rows}
