"""CIEDE2000 between pictures of linear sRGB (Sharma, Wu and Dalal 2005), as shown on a screen.

L, a and b are CIELAB's coordinates, C the chroma and h the hue in degrees. T, S_L, S_C, S_H and R_T are the weights of
the paper.
"""

import numpy as np

# Matrix from linear sRGB to CIE XYZ for D65 (IEC 61966-2-1).
TO_XYZ = np.array(
    [[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923], [0.0193308, 0.1191948, 0.9505322]]
)


def lab(linear):
    """CIE L*a*b* of linear sRGB colours (..., 3), relative to the white of sRGB."""
    xyz = linear @ TO_XYZ.T / TO_XYZ.sum(axis=1)
    small = (6 / 29) ** 3
    f = np.where(xyz > small, np.cbrt(xyz), xyz / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1)


def delta_e(first, second):
    """CIEDE2000 of pairs of colours (..., 3) in L*a*b*."""
    (l1, a1, b1), (l2, a2, b2) = np.moveaxis(first, -1, 0), np.moveaxis(second, -1, 0)
    mean_chroma = (np.hypot(a1, b1) + np.hypot(a2, b2)) / 2
    # The factor 1 + G on a.
    stretch = 1.5 - 0.5 * np.sqrt(mean_chroma**7 / (mean_chroma**7 + 25.0**7))
    a1, a2 = stretch * a1, stretch * a2
    c1, c2 = np.hypot(a1, b1), np.hypot(a2, b2)
    h1, h2 = np.degrees(np.arctan2(b1, a1)) % 360, np.degrees(np.arctan2(b2, a2)) % 360
    # Without chroma there is no hue.
    grey = c1 * c2 == 0
    turn = np.where(grey, 0, (h2 - h1 + 180) % 360 - 180)
    # The formula puts opposite hues at +180°.
    turn = np.where(turn == -180, 180, turn)
    # Differences ΔL, ΔC and ΔH, and means.
    dl, dc, dh = l2 - l1, c2 - c1, 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn / 2))
    lightness, chroma = (l1 + l2) / 2, (c1 + c2) / 2
    far = np.abs(h1 - h2) > 180
    hue = np.where(grey, h1 + h2, np.where(far, (h1 + h2 + np.where(h1 + h2 < 360, 360, -360)) / 2, (h1 + h2) / 2))
    t = 1 - 0.17 * cos(hue - 30) + 0.24 * cos(2 * hue) + 0.32 * cos(3 * hue + 6) - 0.20 * cos(4 * hue - 63)
    sl = 1 + 0.015 * (lightness - 50) ** 2 / np.sqrt(20 + (lightness - 50) ** 2)
    sc, sh = 1 + 0.045 * chroma, 1 + 0.015 * chroma * t
    around_blue = 30 * np.exp(-(((hue - 275) / 25) ** 2))
    rt = -2 * np.sqrt(chroma**7 / (chroma**7 + 25.0**7)) * np.sin(np.radians(2 * around_blue))
    return np.sqrt((dl / sl) ** 2 + (dc / sc) ** 2 + (dh / sh) ** 2 + rt * (dc / sc) * (dh / sh))


def cos(degrees):
    return np.cos(np.radians(degrees))


def shown_difference(first, second, stops):
    """CIEDE2000 of each pixel of two pictures that are brightened by `stops` and clipped."""
    return delta_e(*(lab(np.clip(np.asarray(p, float) * 2.0**stops, 0, 1)) for p in (first, second)))
