"""Surfaces of the BRDF maps: a blazed grating, and scans of two snakes' skins with the presets that imitate them.

Both skins have *fingers*, long parallel ridges; those of Xenopeltis are in rows, the *layers*. Surfaces are oriented as
in figure 2.2 of M. Single's thesis, Single 2014: fingers of both skins along y, and layers of Xenopeltis along x. The
scans and the Xenopeltis preset are therefore turned by 90°.

Heights are in µm, indexed [iy, ix] with y = 0 first. Light interferes within the coherence window, a Gaussian that is
centred on pixel (0, 0). Its standard deviation is a quarter of the coherence length. The surfaces repeat.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from mitsuba_scenes.crosscheck.cases import SCANS

from .heights import height_field

# Species with a scan and a preset.
SKINS = ("elaphe", "xenopeltis")
# Edge of `Surfaces.blazed_tile`, and the default coherence length, equal to the plugin's.
TILE_UM = 65.0
# Period of the blazed grating, equal to the preset's. A tile has 26 periods.
PERIOD_UM = 2.5
# Height of the blazed grating, equal to the preset's.
HEIGHT_UM = 0.25
# Pixels of a period of the blazed grating. With more the facet, which pixels make a staircase, is smoother.
PIXELS_OF_PERIOD = 40


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface: its name on the page, its heights, the edge of a square pixel, and the coherence length.

    `arguments` are those of `sunbeam` that select the surface.
    """

    name: str
    arguments: tuple
    pixel_um: float
    heights_um: np.ndarray = field(repr=False)
    coherence_um: float = TILE_UM

    @property
    def extent_um(self) -> tuple[float, float]:
        """Lengths along x and y; a relief of one row is one pixel long along y."""
        rows, columns = self.heights_um.shape
        return columns * self.pixel_um, rows * self.pixel_um

    def with_coherence(self, coherence_um: float) -> Surface:
        """The surface with another coherence length, for presets alone: arguments of files have one already."""
        return replace(self, arguments=(*self.arguments, "--coherence-length", coherence_um), coherence_um=coherence_um)


class Surfaces:
    """All surfaces of the page; those that are no preset of `sunbeam` are written as files into a folder.

    `blazed` is the preset, one period that repeats. `blazed_tile` is the grating as a file, a tile of 65 µm in one row
    of pixels.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        pixel_in_period = np.arange(round(TILE_UM / PERIOD_UM) * PIXELS_OF_PERIOD) % PIXELS_OF_PERIOD
        heights_um = HEIGHT_UM * (pixel_in_period[None, :] + 0.5) / PIXELS_OF_PERIOD
        pixel_um = PERIOD_UM / PIXELS_OF_PERIOD
        self.blazed = Surface("blazed", ("--preset", "blazed"), pixel_um, heights_um)
        self.blazed_tile = self.written(Surface("blazed", (), pixel_um, heights_um))
        self._skins = {name: [*self._scan(name), self._preset(name)] for name in SKINS}

    def skin(self, name: str) -> list[Surface]:
        """The surfaces of a species, one of SKINS: the scan if it is present, then the preset."""
        return self._skins[name]

    def _scan(self, name: str) -> list[Surface]:
        """The species' scan as the only element of a list; empty, after one printed line, without its file."""
        if not SCANS[name].exists():
            print(f"NOT SHOWN: no scan at {SCANS[name]}, so there are no maps of the measured {name}", flush=True)
            return []
        heights_um, pixel_um = read_heights("--height-field", SCANS[name])
        heights_um = np.rot90(heights_um, -1)
        # The middle of the scan moves to pixel (0, 0), where the coherence window is centred. The coherence length is
        # the scan's edge, so the window has faded at the edges.
        heights_um = np.roll(heights_um, [n // 2 for n in heights_um.shape], axis=(0, 1))
        coherence_um = len(heights_um) * pixel_um
        return [self.written(Surface(f"{name.capitalize()}, scan", (), pixel_um, heights_um, coherence_um))]

    def _preset(self, name: str) -> Surface:
        """The preset of a species; that of Xenopeltis is turned."""
        heights_um, pixel_um = read_heights("--preset", name)
        caption = f"{name.capitalize()}, procedural"
        if name == "elaphe":
            return Surface(caption, ("--preset", name), pixel_um, heights_um)
        return self.written(Surface(caption, (), pixel_um, np.rot90(heights_um, -1)))

    def written(self, surface: Surface) -> Surface:
        """A copy of the surface whose heights are written to a new file, with `arguments` that read this file."""
        file = self.folder / f"surface-{len(list(self.folder.glob('surface-*')))}.npy"
        np.save(file, np.ascontiguousarray(surface.heights_um))
        source = ("--height-field", file, "--pixel-size", surface.pixel_um, "--level", "none", "--tiling", "periodic")
        return replace(surface, arguments=(*source, "--coherence-length", surface.coherence_um))

    def about_the_base(self, surface: Surface) -> Surface:
        """The surface with one pixel lowered, so that the middle of the range is the other pixels' lowest height.

        `sunbeam` expands the phase screen about the middle of the range, Single 2014 about the lowest height. For this
        surface both are the same. The pixel is the farthest from the centre of the coherence window, where the window
        is negligible.
        """
        # Heights from 0 to H, and one pixel at −H.
        heights_um = surface.heights_um - surface.heights_um.min()
        heights_um[tuple(n // 2 for n in heights_um.shape)] = -heights_um.max()
        return self.written(replace(surface, heights_um=heights_um))

    def cut(self, surface: Surface, edge_um: float) -> Surface:
        """The square with this edge about pixel (0, 0), as a tile with a coherence length of 65 µm.

        Pixel (0, 0) of the surface is pixel (0, 0) of the tile.
        """
        # `square` has pixel (0, 0) in its middle; the roll moves it back.
        heights_um = np.roll(square(surface, edge_um), 2 * [-(round(edge_um / surface.pixel_um) // 2)], axis=(0, 1))
        name = f"{surface.name}, {edge_um:g} µm"
        return self.written(replace(surface, name=name, heights_um=heights_um, coherence_um=TILE_UM))


def square(surface: Surface, edge_um: float) -> np.ndarray:
    """Heights of the square with the edge `edge_um` about pixel (0, 0), which is in the middle of the result.

    The edge is at most that of the relief. A relief of one row is constant along y.
    """
    pixels = round(edge_um / surface.pixel_um)
    heights_um = surface.heights_um
    tile = np.repeat(heights_um, pixels, axis=0) if len(heights_um) == 1 else heights_um
    return np.roll(tile, 2 * [pixels // 2], axis=(0, 1))[:pixels, :pixels]


@lru_cache
def read_heights(*arguments) -> tuple[np.ndarray, float]:
    """Heights and edge of a square pixel in µm, by `sunbeam height-field` with these `arguments`.

    The array is shared by all callers, so they must not change it.
    """
    heights_um, report = height_field(*arguments)
    return heights_um, report["pixel_um"][0]


def cut_out(surface: Surface, edge_um: float, bar_um: float | None, pixels: int) -> Image.Image:
    """A picture of the heights of `square`, `pixels` wide and high, +y up.

    Heights are grey, the lowest black; they must not all be equal. A red scale bar, `bar_um` long, is in the lower
    right corner; `None` leaves it out.
    """
    heights_um = square(surface, edge_um)
    grey = np.uint8(np.round(255 * (heights_um - heights_um.min()) / np.ptp(heights_um)))
    # Row 0 of the heights is the lowest y, that of a picture the highest.
    picture = Image.fromarray(np.ascontiguousarray(grey[::-1])).resize((pixels, pixels), Image.Resampling.BILINEAR)
    picture = picture.convert("RGB")
    if bar_um:
        # Right and upper end of the bar, which is 5 pixels thick: `rectangle` fills from `top` to `top + 4` inclusive.
        right, top = pixels - 12, pixels - 14
        ImageDraw.Draw(picture).rectangle([right - bar_um / edge_um * pixels, top, right, top + 4], fill=(230, 30, 30))
    return picture
