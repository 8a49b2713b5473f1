"""Statistics of a picture's colours: mean a* and b*, hues, and dark pixels near highlights.

The documentation's part `renderings-methods` compares published methods by these statistics. Pictures are linear sRGB
with any exposure. Each is exposed by `shown`, so that statistics of different methods compare. Colours are CIELAB's:
lightness L*, and a* and b*, whose polar coordinates are hue and chroma. The half vector is the direction midway between
those to sun and camera; order 0, the *highlight*, is where it is along the normal.
"""

from __future__ import annotations

import numpy as np

from .rgb_against_spectral import LUMINANCE, lab

# Fraction of the non-black pixels that a picture's exposure clips. A larger one makes dim pixels visible, a smaller one
# keeps the hues of bright ones.
CLIPPED = 0.01
# Relative luminance, 1 for white, below which an exposed pixel counts as dark: its hue is hardly seen.
DARK = 0.01
# CIELAB chroma, √(a*² + b*²), above which a pixel counts as coloured: paler colours have no distinct hue.
COLOURED = 10.0
# Width of the bins of hues in degrees. Narrower bins separate more hues and have fewer pixels each.
BIN_DEG = 10
# Range of CIELAB hues that count as blue, in degrees, without its ends.
BLUE_DEG = (240.0, 300.0)
# Range in degrees of the angle between half vector and normal of pixels that count as near a highlight. The highlight
# itself is at smaller angles.
NEAR_DEG = (3.0, 10.0)


def exposure_stops(pixels: np.ndarray) -> float:
    """Exposure in stops that clips the fraction CLIPPED of the linear pixels (..., 3) that are not black.

    Positive exposures brighten. At least one pixel must not be black.
    """
    peak = pixels.max(axis=-1)
    return float(-np.log2(np.quantile(peak[peak > 0], 1 - CLIPPED)))


def shown(pixels: np.ndarray) -> np.ndarray:
    """Linear pixels (..., 3) exposed and clipped to [0, 1]."""
    return np.clip(pixels * 2.0 ** exposure_stops(pixels), 0, 1)


def hue_deg(colours: np.ndarray) -> np.ndarray:
    """Hues in degrees, in [0, 360), of L*a*b* colours (..., 3)."""
    return np.degrees(np.arctan2(colours[..., 2], colours[..., 1])) % 360


def cast(pixels: np.ndarray) -> dict:
    """Colour cast of linear pixels (count, 3): their mean a* and b*."""
    colours = lab(shown(pixels))
    return {"a": float(colours[:, 1].mean()), "b": float(colours[:, 2].mean())}


def blue_means(reference: np.ndarray, pixels: np.ndarray) -> dict:
    """Mean a* and b* of the `pixels` that are coloured and blue in the reference, and the hue of that mean.

    Both arguments are linear pixels (n, 3) of the same scene. `count` is the number of blue pixels; at 0 the means are
    NaN.
    """
    reference_lab, pixels_lab = lab(shown(reference)), lab(shown(pixels))
    hue = hue_deg(reference_lab)
    coloured = np.hypot(reference_lab[:, 1], reference_lab[:, 2]) > COLOURED
    blue = coloured & (hue > BLUE_DEG[0]) & (hue < BLUE_DEG[1])
    mean = pixels_lab[blue].mean(axis=0)
    return {
        "count": int(blue.sum()),
        "a": float(mean[1]),
        "b": float(mean[2]),
        "hue_deg": float(hue_deg(mean)),
    }


def histogram(pixels: np.ndarray) -> np.ndarray:
    """Fractions of hues in bins of BIN_DEG from 0° to 360°, over coloured linear pixels (count, 3) that are not dark.

    Without such pixels all fractions are 0.
    """
    visible = shown(pixels)
    colours = lab(visible)
    counted = (np.hypot(colours[:, 1], colours[:, 2]) > COLOURED) & (visible @ LUMINANCE > DARK)
    counts, _ = np.histogram(hue_deg(colours[counted]), bins=360 // BIN_DEG, range=(0, 360))
    return counts / max(counts.sum(), 1)


def effective_hues(fractions: np.ndarray) -> float:
    """Number of hues in a `histogram`: the exponential of its entropy, which is n for n equally full bins.

    It is 1 for a histogram of zeros.
    """
    filled = fractions[fractions > 0]
    return float(np.exp(-(filled * np.log(filled)).sum()))


def lit(pairs: np.ndarray) -> np.ndarray:
    """Mask of the lit pixels.

    `pairs` (..., 8) is the array of `sunbeam render --pairs`. Its eight numbers for each pixel are the unit vectors to
    sun and camera in the grating's frame, whose z axis is the normal, then 1 where the sun lights the pixel, and the
    cosine of the sun's angle to the normal.
    """
    return pairs[..., 6] > 0


def near_highlight(pairs: np.ndarray) -> np.ndarray:
    """Mask of the lit pixels whose half vector is near the normal but not along it, by NEAR_DEG.

    `pairs` is the array that `lit` describes.
    """
    # The half vector, without its length.
    half = pairs[..., 0:3] + pairs[..., 3:6]
    tilt_deg = np.degrees(np.arctan2(np.hypot(half[..., 0], half[..., 1]), half[..., 2]))
    return lit(pairs) & (tilt_deg > NEAR_DEG[0]) & (tilt_deg < NEAR_DEG[1])


def dark_fraction(pixels: np.ndarray, among: np.ndarray) -> float:
    """Fraction of dark pixels among the linear pixels (count, 3) in the mask `among` (count,).

    The exposure is that of all pixels, not only of those in the mask. An empty mask gives NaN.
    """
    return float((shown(pixels) @ LUMINANCE < DARK)[among].mean())
