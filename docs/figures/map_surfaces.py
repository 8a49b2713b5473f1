"""The surfaces of the BRDF maps, oriented as in figure 2.2 of Single 2014: blazed grating, scans and presets.

Figure 2.2 has the fingers of both skins along y and the layers of Xenopeltis along x. The scans and the Xenopeltis
preset are turned by 90°.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image, ImageDraw

from mitsuba_scenes.crosscheck.cases import SCANS
from mitsuba_scenes.tool import sunbeam

SKINS = ("elaphe", "xenopeltis")
# Edge of the presets' tiles.
TILE_UM = 65.0
# Period of the blazed grating.
PERIOD_UM = 2.5
# Height of the blazed grating.
HEIGHT_UM = 0.25
# Pixels of a period in a tile of 65 µm with 26 whole periods.
PIXELS_OF_PERIOD = 40


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface: arguments of `sunbeam`, and heights in µm with rows along +y."""

    name: str
    words: tuple
    pixel_um: float
    heights_um: np.ndarray = field(repr=False)
    coherence_um: float = TILE_UM

    @property
    def extent_um(self) -> tuple[float, float]:
        """Length along x and y; a relief of one row is one pixel long along y."""
        rows, columns = self.heights_um.shape
        return columns * self.pixel_um, rows * self.pixel_um

    def with_coherence(self, coherence_um: float) -> Surface:
        """A preset under a window of another coherence length."""
        return replace(self, words=(*self.words, "--coherence-length", coherence_um), coherence_um=coherence_um)


class Surfaces:
    """Writes the files of the surfaces into a folder."""

    def __init__(self, folder: Path):
        self.folder = folder
        rows = np.arange(round(TILE_UM / PERIOD_UM) * PIXELS_OF_PERIOD) % PIXELS_OF_PERIOD
        heights = HEIGHT_UM * (rows[None, :] + 0.5) / PIXELS_OF_PERIOD
        pixel_um = PERIOD_UM / PIXELS_OF_PERIOD
        # Each period is the preset's, with other pixels.
        self.blazed = Surface("blazed", ("--preset", "blazed"), pixel_um, heights)
        self.blazed_row = self.written(Surface("blazed", (), pixel_um, heights))
        self._skins = {name: [*self._scan(name), self._preset(name)] for name in SKINS}

    def skin(self, name: str) -> list[Surface]:
        """The scan where it is present, then the preset."""
        return self._skins[name]

    def _scan(self, name: str) -> list[Surface]:
        """The scan of a species as a list of one surface; an empty list without its file."""
        if not SCANS[name].exists():
            print(f"NOT SHOWN: no scan at {SCANS[name]}, so there are no maps of the measured {name}", flush=True)
            return []
        heights, pixel_um = read_heights("--height-field", SCANS[name])
        # The middle of the scan moves to pixel (0, 0), the centre of the coherence window. The window is negligible at
        # the scan's edges.
        heights = np.rot90(heights, -1)
        heights = np.roll(heights, [n // 2 for n in heights.shape], axis=(0, 1))
        extent_um = len(heights) * pixel_um
        return [self.written(Surface(f"{name.capitalize()}, scan", (), pixel_um, heights, extent_um))]

    def _preset(self, name: str) -> Surface:
        heights, pixel_um = read_heights("--preset", name)
        caption = f"{name.capitalize()}, procedural"
        if name == "elaphe":
            return Surface(caption, ("--preset", name), pixel_um, heights)
        return self.written(Surface(caption, (), pixel_um, np.rot90(heights, -1)))

    def written(self, surface: Surface) -> Surface:
        """The surface as read from a file."""
        file = self.folder / f"surface-{len(list(self.folder.glob('surface-*')))}.npy"
        np.save(file, np.ascontiguousarray(surface.heights_um))
        words = ("--height-field", file, "--pixel-size", surface.pixel_um, "--level", "none", "--tiling", "periodic")
        return replace(surface, words=(*words, "--coherence-length", surface.coherence_um))

    def about_the_base(self, surface: Surface) -> Surface:
        """The surface with one pixel lowered until the lowest height is the middle of the range.

        A series about the middle of the range is then one about the lowest height, as in Single 2014. The pixel is
        where the coherence window is negligible.
        """
        heights = surface.heights_um - surface.heights_um.min()
        heights[tuple(n // 2 for n in heights.shape)] = -heights.max()
        return self.written(replace(surface, heights_um=heights))

    def cut(self, surface: Surface, edge_um: float) -> Surface:
        """A square about the middle of the window, repeated, with the coherence length of 65 µm."""
        pixels = round(edge_um / surface.pixel_um)
        centred = np.roll(surface.heights_um, 2 * [pixels // 2], axis=(0, 1))[:pixels, :pixels]
        name = f"{surface.name}, {edge_um:g} µm"
        return self.written(replace(surface, name=name, heights_um=centred, coherence_um=TILE_UM))


@lru_cache
def read_heights(*words) -> tuple[np.ndarray, float]:
    """Heights in µm and edge of a pixel in µm, by `sunbeam height-field`."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "heights.npy"
        report = json.loads(sunbeam("height-field", *words, "-o", file))
        return np.load(file), report["pixel_um"][0]


def cut_out(surface: Surface, edge_um: float, bar_um: float | None, pixels: int) -> Image.Image:
    """The square about the middle of the window in grey, the lowest height black, +y up, with a red bar for scale."""
    count = round(edge_um / surface.pixel_um)
    heights = surface.heights_um
    # A relief of one row is the same along y.
    square = np.repeat(heights, count, axis=0) if len(heights) == 1 else heights
    part = np.roll(square, 2 * [count // 2], axis=(0, 1))[:count, :count]
    grey = np.uint8(np.round(255 * (part - part.min()) / np.ptp(part)))
    # Row 0 is the lowest y.
    picture = Image.fromarray(np.ascontiguousarray(grey[::-1])).resize((pixels, pixels), Image.Resampling.BILINEAR)
    picture = picture.convert("RGB")
    if bar_um:
        right, low = pixels - 12, pixels - 14
        ImageDraw.Draw(picture).rectangle([right - bar_um / edge_um * pixels, low, right, low + 4], fill=(230, 30, 30))
    return picture
