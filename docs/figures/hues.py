"""What can be said of a picture's colours by number: casts, hues, and dark places near highlights."""

from __future__ import annotations

import numpy as np

from .rgb_against_spectral import XYZ_OF_SRGB, lab

# Share of the pixels that clips, by which every picture is exposed.
CLIPPED = 0.01
# Relative luminance below which a pixel of an exposed picture counts as dark.
DARK = 0.01
# Least chroma of a pixel that counts as coloured, and width in degrees of the bins of hues.
COLOURED, BIN_DEG = 10.0, 10
# Hues in degrees of the CIELAB plane that count as blue.
BLUE_DEG = (240.0, 300.0)
# Pixels near a highlight: the half vector is this far from the normal, in degrees.
NEAR_DEG = (3.0, 10.0)


def exposure_stops(pixels: np.ndarray) -> float:
    """Stops at which 1 % of these linear pixels (..., 3) that are not black clip."""
    peak = pixels.max(axis=-1)
    return float(-np.log2(np.quantile(peak[peak > 0], 1 - CLIPPED)))


def shown(pixels: np.ndarray) -> np.ndarray:
    """Linear pixels (..., 3) as they are shown: exposed, and clipped to [0, 1]."""
    return np.clip(pixels * 2.0 ** exposure_stops(pixels), 0, 1)


def hue_deg(colours: np.ndarray) -> np.ndarray:
    """Hues in [0, 360) of L*a*b* colours (..., 3)."""
    return np.degrees(np.arctan2(colours[..., 2], colours[..., 1])) % 360


def cast(pixels: np.ndarray) -> dict:
    """Mean a* and b* of linear pixels (count, 3), as they are shown."""
    colours = lab(shown(pixels))
    return {"a": float(colours[:, 1].mean()), "b": float(colours[:, 2].mean())}


def of_blue(reference: np.ndarray, pixels: np.ndarray) -> dict:
    """What becomes of the pixels that are blue in the reference: mean a*, b* and hue in degrees, there and here."""
    before, after = lab(shown(reference)), lab(shown(pixels))
    blue = (np.hypot(before[:, 1], before[:, 2]) > COLOURED) & (np.abs(hue_deg(before) - np.mean(BLUE_DEG)) < 30)
    mean = after[blue].mean(axis=0)
    return {
        "count": int(blue.sum()),
        "a": float(mean[1]),
        "b": float(mean[2]),
        "hue_deg": float(hue_deg(mean)),
    }


def histogram(pixels: np.ndarray) -> np.ndarray:
    """Shares of hues, in bins from 0 to 360 degrees, of those linear pixels (count, 3) that are coloured, not dark."""
    visible = shown(pixels)
    colours = lab(visible)
    counts = (np.hypot(colours[:, 1], colours[:, 2]) > COLOURED) & (visible @ XYZ_OF_SRGB[1] > DARK)
    found, _ = np.histogram(hue_deg(colours[counts]), bins=360 // BIN_DEG, range=(0, 360))
    return found / max(found.sum(), 1)


def effective_hues(shares: np.ndarray) -> float:
    """How many equally full bins have the entropy of these shares: the fewer, the more discrete the hues."""
    held = shares[shares > 0]
    return float(np.exp(-(held * np.log(held)).sum()))


def near_highlight(pairs: np.ndarray) -> np.ndarray:
    """Which pixels of `sunbeam render --pairs` are lit and have their half vector near the normal, but not along it."""
    half = pairs[..., 0:3] + pairs[..., 3:6]
    tilt_deg = np.degrees(np.arctan2(np.hypot(half[..., 0], half[..., 1]), half[..., 2]))
    return (pairs[..., 6] > 0) & (tilt_deg > NEAR_DEG[0]) & (tilt_deg < NEAR_DEG[1])


def dark_share(pixels: np.ndarray, among: np.ndarray) -> float:
    """Share of dark pixels among some (a mask) of linear pixels (count, 3)."""
    return float((shown(pixels) @ XYZ_OF_SRGB[1] < DARK)[among].mean())
