"""Atomic-force scans of two snakes' skins: strips of them, and heights and slopes against those of the presets.

A *preset* is a procedural relief of `sunbeam` that imitates a skin. A *skin* is named by its species. Heights are in
µm, indexed [iy, ix] with y = 0 first. Scans and presets are squares of square pixels.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitsuba_scenes.crosscheck.cases import SCANS

from .heights import height_field

# Species with a scan and a preset.
SKINS = ("xenopeltis", "elaphe")
# Edge of a crop of a preset, equal to that of the scans.
CROP_UM = 6.5
# Number of strips into which a scan is cut. The periods measured in them (periodicity.py) show the variation within the
# scan. More strips show more of it, but each is narrower and its period less certain.
STRIPS = 5
# Number of random crops of a preset. More crops make the quantiles of their sizes more certain.
CROPS = 400
# Seed of the crops' positions, an arbitrary number.
SEED = 20140


def scans_present() -> bool:
    """Whether the scans of both skins are present; prints a line if not."""
    missing = [skin for skin in SKINS if not SCANS[skin].exists()]
    if missing:
        folder = SCANS[missing[0]].parent
        print(f"NOT MEASURED: no scan of {' or '.join(missing)} in {folder}, so the page lacks its rows", flush=True)
    return not missing


def read(*arguments) -> tuple[np.ndarray, float]:
    """Heights and edge of a pixel in µm, without levelling, of the surface that the `arguments` of `sunbeam` select."""
    heights_um, report = height_field(*arguments, "--level", "none")
    return heights_um, report["pixel_um"][0]


def scan(skin: str) -> tuple[np.ndarray, float]:
    """Heights and edge of a pixel of a skin's scan, with the dominant period along x.

    Table 1.1 of M. Single's thesis lists this period. In *Elaphe* the period is the distance between long parallel
    ridges, the fingers. The file has the fingers along x and the period along y, so the scan is transposed.
    """
    heights_um, pixel_um = read("--height-field", SCANS[skin])
    return (heights_um.T if skin == "elaphe" else heights_um), pixel_um


def write_heights(heights_um: np.ndarray, pixel_um: float, path: Path) -> tuple:
    """Writes heights to the .npy file `path`; returns the arguments of `sunbeam` that read them."""
    np.save(path, np.ascontiguousarray(heights_um))
    return ("--height-field", path, "--pixel-size", pixel_um)


def strips(heights_um: np.ndarray) -> list[np.ndarray]:
    """The scan cut into STRIPS parts, one above the other along y, each as long as the scan along x."""
    return np.array_split(heights_um, STRIPS, axis=0)


def sizes(heights_um: np.ndarray, pixel_um: float) -> dict:
    """Peak to valley in µm, and after subtracting the best plane the rms height in µm and the rms slopes along x and y.

    Peak to valley is that of the heights as given, tilt included. A slope is the difference of neighbouring pixels over
    their distance. Finer pixels give larger slopes on a rough relief; those of scans and presets are nearly equal, 65
    and 64 nm.
    """
    level_um = levelled(heights_um)
    return {
        "peak_to_valley_um": float(np.ptp(heights_um)),
        "rms_um": float(np.sqrt(np.mean(level_um**2))),
        "slope_x": float(np.sqrt(np.mean((np.diff(level_um, axis=1) / pixel_um) ** 2))),
        "slope_y": float(np.sqrt(np.mean((np.diff(level_um, axis=0) / pixel_um) ** 2))),
    }


def levelled(heights: np.ndarray) -> np.ndarray:
    """The heights minus the plane a + b·ix + c·iy that fits them best."""
    iy, ix = np.indices(heights.shape)
    basis = np.stack([np.ones(heights.size), ix.ravel(), iy.ravel()], axis=1)
    fitted = basis @ np.linalg.lstsq(basis, heights.ravel(), rcond=None)[0]
    return heights - fitted.reshape(heights.shape)


def size_rows() -> list[dict]:
    """A row for each skin and each key of `sizes`: the scan's value, and those of random crops of the preset.

    - `what`, `scan`: the key in `sizes`, and its value on the scan.
    - `crops`, `low`, `high`: the mean, the 5 % quantile and the 95 % quantile over crops as large as the scan.
    - `tile`: the peak to valley of the preset's whole tile, `None` for other sizes.
    """
    rows = []
    for skin in SKINS:
        heights_um, pixel_um = read("--preset", skin)
        # Edge of a crop in pixels.
        edge = round(CROP_UM / pixel_um)
        random = np.random.default_rng(SEED)
        # Lower left corners (y, x) of the crops.
        corners = random.integers(0, heights_um.shape[0], size=(CROPS, 2))
        # The preset repeats, so crops may extend over its edge.
        twice = np.tile(heights_um, (2, 2))
        crops = [sizes(twice[y : y + edge, x : x + edge], pixel_um) for y, x in corners]
        measured = sizes(*scan(skin))
        for name in measured:
            values = np.array([crop[name] for crop in crops])
            rows.append(
                {
                    "skin": skin,
                    "what": name,
                    "scan": measured[name],
                    "crops": float(values.mean()),
                    "low": float(np.quantile(values, 0.05)),
                    "high": float(np.quantile(values, 0.95)),
                    "tile": float(np.ptp(heights_um)) if name == "peak_to_valley_um" else None,
                }
            )
    return rows
