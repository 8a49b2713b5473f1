"""Stam's shader of GPU Gems and FLSS in BRDF maps at normal incidence: peak angles and symmetry."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mitsuba_scenes.crosscheck.realtime import surface_words
from mitsuba_scenes.tool import sunbeam

from .appearance import read_exr
from .rgb_against_spectral import XYZ_OF_SRGB

# Side of the maps for peaks in pixels; odd, so that the middle row is the plane y = 0.
PEAKS_SIZE = 401
# Side of the maps for symmetry in pixels, likewise odd.
SYMMETRY_SIZE = 101
CHANNELS = ("red", "green", "blue")
# Centres of GPU Gems' three bumps in µm, in the order of CHANNELS.
GEMS_TOPS_UM = (0.875, 0.75, 0.625)
# Range of wavelengths of an order in GPU Gems.
GEMS_RANGE_UM = (0.5, 1.0)
# Range of wavelengths of an order in FLSS.
FLSS_RANGE_UM = (0.38, 0.78)
GEMS = {"method": "stam", "stam_form": "gems"}
FLSS = {"method": "flss", "backend": "gpu"}


@dataclass(frozen=True)
class Peaks:
    """Peaks of the first order in each channel, as sines of the angle with the normal."""

    sines: tuple[float, ...]

    @property
    def degrees(self) -> list[float]:
        return np.degrees(np.arcsin(self.sines)).tolist()


def brdf_map(folder: Path, skin: dict, size: int, options: dict) -> np.ndarray:
    """The map of a surface at normal incidence in linear sRGB, (rows, columns, 3) from the top down."""
    exr = folder / "map.exr"
    sunbeam("brdf-map", "-o", exr, "--size", size, *surface_words({**skin, **options}))
    return read_exr(exr).astype(np.float64)


def peaks(pixels: np.ndarray, spacing_um: float, range_um: tuple[float, float]) -> Peaks:
    """Peaks in the middle row of the first order of a spacing, for light in the range `range_um`."""
    size = len(pixels)
    row, sine = pixels[size // 2], (np.arange(size) + 0.5) * 2 / size - 1
    first = np.flatnonzero((sine > range_um[0] / spacing_um) & (sine < range_um[1] / spacing_um))
    found = []
    for channel in range(3):
        top = first[np.argmax(row[first, channel])]
        before, at, after = row[top - 1 : top + 2, channel]
        # Vertex of the parabola through three pixels.
        shift = 0.5 * (before - after) / (before - 2 * at + after)
        found.append(float(sine[top] + shift * 2 / size))
    return Peaks(tuple(found))


def disc_peaks(folder: Path, spacing_um: float, demo_um: float) -> dict:
    """The first order of the disc's tracks in FLSS, and in GPU Gems' form at three spacings.

    The spacings are the tracks', that of a public demonstration, and the one that fits the mean of FLSS's channels.
    `largest_off_deg` is the largest difference over channels.
    """
    skin = {"preset": "cd"}
    flss = peaks(brdf_map(folder, skin, PEAKS_SIZE, FLSS), spacing_um, FLSS_RANGE_UM)
    fitted_um = float(np.mean([top / sine for top, sine in zip(GEMS_TOPS_UM, flss.sines)]))
    rows = []
    for name, um in (("the tracks' own", spacing_um), ("a demonstration's", demo_um), ("fitted", fitted_um)):
        drawn = brdf_map(folder, skin, PEAKS_SIZE, {**GEMS, "period_um": um})
        found = peaks(drawn, um, GEMS_RANGE_UM).degrees
        off = np.subtract(found, flss.degrees)
        rows.append(
            {
                "name": name,
                "spacing_um": um,
                "degrees": found,
                "largest_off_deg": float(np.abs(off).max()),
                "equation_deg": np.degrees(np.arcsin(np.array(GEMS_TOPS_UM) / um)).tolist(),
            }
        )
    wavelengths_nm = [1e3 * spacing_um * sine for sine in flss.sines]
    return {"spacing_um": spacing_um, "flss_deg": flss.degrees, "flss_nm": wavelengths_nm, "gems": rows}


def right_over_left(pixels: np.ndarray) -> float:
    """Luminance of the right half of a map over that of the left half, without the middle column."""
    luminance = pixels @ XYZ_OF_SRGB[1]
    half = pixels.shape[1] // 2
    return float(luminance[:, half + 1 :].sum() / luminance[:, :half].sum())


def symmetry(folder: Path, skins: dict[str, dict]) -> list[dict]:
    """Right over left of each surface, by FLSS and by GPU Gems' form."""
    rows = []
    for title, skin in skins.items():
        flss, gems = (right_over_left(brdf_map(folder, skin, SYMMETRY_SIZE, options)) for options in (FLSS, GEMS))
        rows.append({"title": title, "flss": flss, "gems": gems})
    return rows
