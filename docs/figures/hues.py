"""Statistics of a picture's colours: mean a* and b*, hues, and dark pixels near highlights."""

from __future__ import annotations

import numpy as np

from .rgb_against_spectral import XYZ_OF_SRGB, lab

# Fraction of pixels that the exposure of a picture clips.
CLIPPED = 0.01
# Relative luminance below which an exposed pixel counts as dark.
DARK = 0.01
# Smallest CIELAB chroma of a pixel that counts as coloured. Chosen.
COLOURED = 10.0
# Width of the bins of hues in degrees.
BIN_DEG = 10
# Range of blue hues in the CIELAB plane, in degrees.
BLUE_DEG = (240.0, 300.0)
# Range of the angle between half vector and normal for pixels near a highlight, in degrees.
NEAR_DEG = (3.0, 10.0)


def exposure_stops(pixels: np.ndarray) -> float:
    """Exposure in stops that clips 1 % of the linear pixels (..., 3) that are not black."""
    peak = pixels.max(axis=-1)
    return float(-np.log2(np.quantile(peak[peak > 0], 1 - CLIPPED)))


def shown(pixels: np.ndarray) -> np.ndarray:
    """Linear pixels (..., 3) exposed and clipped to [0, 1]."""
    return np.clip(pixels * 2.0 ** exposure_stops(pixels), 0, 1)


def hue_deg(colours: np.ndarray) -> np.ndarray:
    """Hues in [0, 360) of L*a*b* colours (..., 3)."""
    return np.degrees(np.arctan2(colours[..., 2], colours[..., 1])) % 360


def cast(pixels: np.ndarray) -> dict:
    """Mean a* and b* of linear pixels (count, 3) as shown."""
    colours = lab(shown(pixels))
    return {"a": float(colours[:, 1].mean()), "b": float(colours[:, 2].mean())}


def of_blue(reference: np.ndarray, pixels: np.ndarray) -> dict:
    """Mean a*, b* and hue in degrees of `pixels`, over those that are blue in the reference."""
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
    """Fractions of hues in bins from 0° to 360°, of the linear pixels (count, 3) that are coloured and not dark."""
    visible = shown(pixels)
    colours = lab(visible)
    counts = (np.hypot(colours[:, 1], colours[:, 2]) > COLOURED) & (visible @ XYZ_OF_SRGB[1] > DARK)
    found, _ = np.histogram(hue_deg(colours[counts]), bins=360 // BIN_DEG, range=(0, 360))
    return found / max(found.sum(), 1)


def effective_hues(shares: np.ndarray) -> float:
    """Number of equally full bins with the entropy of these fractions; few for discrete hues."""
    held = shares[shares > 0]
    return float(np.exp(-(held * np.log(held)).sum()))


def near_highlight(pairs: np.ndarray) -> np.ndarray:
    """Mask of the lit pixels of `sunbeam render --pairs` whose half vector is near the normal but not along it."""
    half = pairs[..., 0:3] + pairs[..., 3:6]
    tilt_deg = np.degrees(np.arctan2(np.hypot(half[..., 0], half[..., 1]), half[..., 2]))
    return (pairs[..., 6] > 0) & (tilt_deg > NEAR_DEG[0]) & (tilt_deg < NEAR_DEG[1])


def dark_share(pixels: np.ndarray, among: np.ndarray) -> float:
    """Fraction of dark pixels among the linear pixels (count, 3) of the mask `among`."""
    return float((shown(pixels) @ XYZ_OF_SRGB[1] < DARK)[among].mean())
