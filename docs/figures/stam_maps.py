"""Stam's shader of GPU Gems and FLSS in BRDF maps at normal incidence: peak angles and symmetry.

The shader is called *GPU Gems' form* (docs/realtime.md#stam-and-the-shader-of-gpu-gems). In each order n, each colour
channel has a peak, its *bump*. The bump is centred where d|u|/n is a fixed wavelength. d is the spacing of the grooves,
and u the x component of wi + wo, the sum of the directions to light and viewer. The reference is the method FLSS, full
lambda spectral sampling (docs/realtime.md).

A *BRDF map* is a picture of the BRDF over outgoing directions. Its pixels are direction sines in [−1, 1]².
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mitsuba_scenes.crosscheck.realtime import surface_words
from mitsuba_scenes.tool import sunbeam

from .appearance import read_exr
from .rgb_against_spectral import LUMINANCE

# Side of the maps for peaks in pixels; odd, so that the middle row is the plane y = 0.
PEAKS_SIZE = 401
# Side of the maps for symmetry in pixels; odd, so that the middle column belongs to neither half.
SYMMETRY_SIZE = 101
# Wavelengths of the centres of GPU Gems' bumps, for red, green and blue (`src/methods/stam_gems.rs`).
GEMS_CENTRES_UM = (0.875, 0.75, 0.625)
# Range of wavelengths in which the peaks of an order are searched in GPU Gems' form: the bumps are 0.125 µm wide to
# either side of their centres.
GEMS_RANGE_UM = (0.5, 1.0)
# Range of wavelengths in which the peaks of an order are searched in FLSS: the visible range.
FLSS_RANGE_UM = (0.38, 0.78)
# Options of `sunbeam brdf-map` for GPU Gems' form.
GEMS = {"method": "stam", "stam_form": "gems"}
# Options of `sunbeam brdf-map` for FLSS, whose sums over wavelengths and orders are slow on the processor.
FLSS = {"method": "flss", "backend": "gpu"}


@dataclass(frozen=True)
class Peaks:
    """Peaks of the first order in red, green and blue, as sines of the angle with the normal."""

    sines: tuple[float, ...]

    @property
    def degrees(self) -> list[float]:
        """The peaks' angles with the normal."""
        return np.degrees(np.arcsin(self.sines)).tolist()


def brdf_map(folder: Path, surface: dict, size: int, options: dict) -> np.ndarray:
    """The BRDF map of a surface at normal incidence in linear sRGB, (size, size, 3), rows from the top down.

    `surface` has parameters of the plugin, `options` those of the method.
    """
    exr = folder / "map.exr"
    sunbeam("brdf-map", "-o", exr, "--size", size, *surface_words({**surface, **options}))
    return read_exr(exr).astype(np.float64)


def peaks(pixels: np.ndarray, spacing_um: float, range_um: tuple[float, float]) -> Peaks:
    """Peaks of order 1 on the +x side of a map's middle row, for a spacing and wavelengths in the range `range_um`.

    The spacing must exceed the shortest wavelength, and no channel may be constant about its peak.
    """
    size = len(pixels)
    row, sine = pixels[size // 2], (np.arange(size) + 0.5) * 2 / size - 1
    # Pixels of the first order, where sin θ = λ/d. A pixel is 2/size wide.
    first = np.flatnonzero((sine > range_um[0] / spacing_um) & (sine < range_um[1] / spacing_um))
    found = []
    for channel in range(3):
        # Index of the brightest pixel of the order.
        top = first[np.argmax(row[first, channel])]
        before, at, after = row[top - 1 : top + 2, channel]
        # Vertex of the parabola through three pixels, as an offset in pixels.
        shift = 0.5 * (before - after) / (before - 2 * at + after)
        found.append(float(sine[top] + shift * 2 / size))
    return Peaks(tuple(found))


def disc_peaks(folder: Path, spacing_um: float, demo_um: float) -> dict:
    """Peak angles of the first order of a compact disc by FLSS, and by GPU Gems' form at three spacings.

    The spacings are `spacing_um` of the tracks, `demo_um` of a public demonstration, and a fitted one: the mean over
    the channels of the spacing that puts the bump on FLSS's peak. The result has

    - `flss_deg`, `flss_nm`: FLSS's peaks, and the wavelengths there by the grating equation;
    - `gems`: a row for each spacing. `degrees` are the peaks, and `equation_deg` the angles of GEMS_CENTRES_UM by the
      grating equation. `largest_off_deg` is the largest difference from FLSS over the channels.
    """
    disc = {"preset": "cd"}
    flss = peaks(brdf_map(folder, disc, PEAKS_SIZE, FLSS), spacing_um, FLSS_RANGE_UM)
    fitted_um = float(np.mean([centre / sine for centre, sine in zip(GEMS_CENTRES_UM, flss.sines)]))
    rows = []
    for name, um in (("the tracks' own", spacing_um), ("a demonstration's", demo_um), ("fitted", fitted_um)):
        pixels = brdf_map(folder, disc, PEAKS_SIZE, {**GEMS, "period_um": um})
        found_deg = peaks(pixels, um, GEMS_RANGE_UM).degrees
        off_deg = np.subtract(found_deg, flss.degrees)
        rows.append(
            {
                "name": name,
                "spacing_um": um,
                "degrees": found_deg,
                "largest_off_deg": float(np.abs(off_deg).max()),
                "equation_deg": np.degrees(np.arcsin(np.array(GEMS_CENTRES_UM) / um)).tolist(),
            }
        )
    wavelengths_nm = [1e3 * spacing_um * sine for sine in flss.sines]
    return {"spacing_um": spacing_um, "flss_deg": flss.degrees, "flss_nm": wavelengths_nm, "gems": rows}


def right_over_left(pixels: np.ndarray) -> float:
    """Ratio of the luminances of a map's right and left halves, without the middle column.

    The map is (rows, columns, 3) in linear sRGB.
    """
    luminance = pixels @ LUMINANCE
    half = pixels.shape[1] // 2
    return float(luminance[:, half + 1 :].sum() / luminance[:, :half].sum())


def symmetry(folder: Path, surfaces: dict[str, dict]) -> list[dict]:
    """`right_over_left` of the maps of each surface, by FLSS and by GPU Gems' form."""
    rows = []
    for title, surface in surfaces.items():
        flss, gems = (right_over_left(brdf_map(folder, surface, SYMMETRY_SIZE, options)) for options in (FLSS, GEMS))
        rows.append({"title": title, "flss": flss, "gems": gems})
    return rows
