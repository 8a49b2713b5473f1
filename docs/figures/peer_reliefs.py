"""The reliefs that are put to both programs, on square tiles whose side is a power of two in pixels.

The side is what the other program's tree of pixels asks for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from mitsuba_scenes.crosscheck.cases import SCAN
from mitsuba_scenes.tool import sunbeam

TILE_UM, PIXEL_UM = 32.0, 0.25
# The scan has 100 pixels of this edge a side.
SCAN_PIXEL_UM, SCAN_SIDE = 0.065, 128


@dataclass(frozen=True)
class Relief:
    """Heights `[iy, ix]` in µm as finely as they are known, and every how many of them the programs are given."""

    name: str
    words: str
    finest: np.ndarray
    finest_pixel_um: float
    step: int = 1

    @property
    def heights(self) -> np.ndarray:
        """What the programs are given, in µm."""
        return np.ascontiguousarray(self.finest[:: self.step, :: self.step])

    @property
    def pixel_um(self) -> float:
        return self.finest_pixel_um * self.step

    @property
    def rms_slope(self) -> float:
        """Root mean square of the slope along x, by differences of the finest heights."""
        return float(np.sqrt(np.mean(np.diff(self.finest, axis=1) ** 2)) / self.finest_pixel_um)


def rough(name: str, words: str, rms_um: float, length_um: float, pixel_um: float = PIXEL_UM, seed: int = 1) -> Relief:
    """A random relief that tiles, with Gaussian heights and the autocorrelation exp(−r²/length²).

    It is known four times as finely as at `PIXEL_UM`, and is the same whatever the pixels.
    """
    fine = PIXEL_UM / 4
    side = round(TILE_UM / fine)
    frequency = np.fft.fftfreq(side, fine)
    amplitude = np.exp(-((np.pi * length_um * np.hypot(frequency[:, None], frequency)) ** 2) / 2)
    noise = np.random.default_rng(seed).standard_normal((side, side))
    heights = np.fft.ifft2(np.fft.fft2(noise) * amplitude).real
    return Relief(name, words, heights * rms_um / heights.std(), fine, round(pixel_um / fine))


def smooth(pixel_um: float = PIXEL_UM) -> Relief:
    return rough("smooth", "random, 0.12 µm rms, correlated over 3 µm", 0.12, 3.0, pixel_um)


def steep(pixel_um: float = PIXEL_UM) -> Relief:
    return rough("steep", "random, 0.42 µm rms, correlated over 2 µm", 0.42, 2.0, pixel_um)


def facets() -> Relief:
    """A saw-tooth of 0.25 µm every 2.5 µm, as the preset `blazed`, rising along +x."""
    step = 8
    fine = PIXEL_UM / step
    side = round(TILE_UM / fine)
    period = round(2.5 / fine)
    row = 0.25 * (np.arange(side) % period) / period
    return Relief("facets", "saw-tooth, 0.25 µm every 2.5 µm with a jump", np.tile(row, (side, 1)), fine, step)


def flat() -> Relief:
    side = round(TILE_UM / PIXEL_UM)
    return Relief("flat", "a plane", np.zeros((side, side)), PIXEL_UM)


def scans(folder: Path = SCAN.parent, names: Sequence[str] = ("xenopeltis", "elaphe")) -> list[Relief]:
    """The measured skins that are present, without their planes, mirrored at their edges up to the tile's size."""
    found = []
    for name in names:
        file = folder / f"{name}.gsf"
        if not file.exists():
            print(f"NOT COMPARED: no scan at {file}", flush=True)
            continue
        with TemporaryDirectory() as scratch:
            levelled = Path(scratch) / "levelled.npy"
            sunbeam("height-field", "--height-field", file, "--level", "plane", "-o", levelled)
            heights = np.load(levelled).astype(np.float64)
        more = SCAN_SIDE - heights.shape[0]
        padded = np.pad(heights, (more // 2, more - more // 2), mode="symmetric")
        words = f"AFM scan of {name.capitalize()}, 6.5 µm"
        found.append(Relief(f"{name}-scan", words, padded - padded.mean(), SCAN_PIXEL_UM))
    return found
