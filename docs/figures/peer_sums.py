"""The reflectance of one coherent patch by a direct sum, and the same sum with approximations put in one at a time.

The sums are plain numpy in double precision and know neither the library nor the program that they judge. Conventions
and units are those of docs/model.md: heights `[iy, ix]` and lengths in µm, unit obliquity, a reflectance of 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# The window is summed so many standard deviations s far: its amplitude there is 1.5e-8.
REACH = 6.0


@dataclass(frozen=True)
class Patch:
    """What one patch of a relief is asked: the window's deviation s in µm, the direction of light, the wavelength."""

    window_um: float
    theta_i_deg: float
    phi_i_deg: float
    wavelength_um: float

    @property
    def wi(self) -> np.ndarray:
        """The unit vector towards the light."""
        theta, phi = np.radians([self.theta_i_deg, self.phi_i_deg])
        return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])

    def question(self, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """κ in rad/µm and the frequencies f in cycles/µm, `[n]` and `[n, 2]`, of directions `[n, 3]`."""
        between = self.wi + wo
        return 2 * np.pi / self.wavelength_um * between[:, 2], between[:, :2] / self.wavelength_um


def direct_sum(heights: np.ndarray, pixel_um: float, patch: Patch, wo: np.ndarray) -> np.ndarray:
    """`f_r` in 1/sr of the directions `[n, 3]`, by the sum over every pixel within reach of the tile's middle pixel.

    The tile repeats where the window is wider than it is.
    """
    places, heights = within(REACH * patch.window_um, heights, pixel_um)
    window = np.exp(-(places**2 + places[:, None] ** 2) / (2 * patch.window_um**2))
    answer = np.empty(len(wo))
    kappa, frequency = patch.question(wo)
    # Directions at one angle from the normal share κ, and with it the exponentials of the heights.
    for value in np.unique(kappa.round(12)):
        screen = window * np.exp(1j * value * heights)
        for i in np.flatnonzero(kappa.round(12) == value):
            along_x, along_y = (np.exp(2j * np.pi * f * places) for f in frequency[i])
            answer[i] = abs(along_y @ screen @ along_x) ** 2
    return answer * pixel_um**4 / (np.pi * patch.window_um**2 * patch.wavelength_um**2)


@dataclass(frozen=True)
class Approximations:
    """What Yan et al. 2018 do otherwise than the direct sum; each can be put in alone.

    - `half_floats`: heights over the pixel's edge are kept in 16 bits.
    - `window_cut`: pixels farther than 3 s from the middle are left out.
    - `gabor_texels`: a pixel is no point, but a Gaussian whose deviation is half its edge and whose phase is linear,
      with the slope by central differences.
    - `texels_cut`: of such a Gaussian's transform, what lies beyond three deviations is left out.

    `curved_texels` is not theirs: the Gaussian's phase is quadratic, with the curvature by differences. What it mends
    is what linear phases cost.
    """

    half_floats: bool = False
    window_cut: bool = False
    gabor_texels: bool = False
    texels_cut: bool = False
    curved_texels: bool = False


# What the program does, all of it.
ALL = Approximations(half_floats=True, window_cut=True, gabor_texels=True, texels_cut=True)


def approximate_sum(
    heights: np.ndarray, pixel_um: float, patch: Patch, wo: np.ndarray, chosen: Approximations
) -> np.ndarray:
    """`direct_sum` with the approximations chosen, in 1/sr."""
    if chosen.half_floats:
        heights = in_half_floats(heights, pixel_um)
    reach = (3 if chosen.window_cut else REACH) * patch.window_um
    places, heights, *derived = within(reach, heights, pixel_um, *derivatives(heights, pixel_um))
    x, y = np.meshgrid(places, places)
    inside = np.hypot(x, y) <= reach
    x, y, heights, *derived = (each[inside] for each in (x, y, heights, *derived))
    slope, curvature = np.array(derived[:2]), derived[2:]
    window = np.exp(-(x**2 + y**2) / (2 * patch.window_um**2))
    deviation = pixel_um / 2
    answer = np.empty(len(wo))
    for i, (kappa, frequency) in enumerate(zip(*patch.question(wo))):
        terms = window * np.exp(1j * (kappa * heights + 2 * np.pi * (frequency[0] * x + frequency[1] * y)))
        # The gradient of the phase: zero where a plane of this slope sends its light.
        qx, qy = 2 * np.pi * frequency[:, None] + kappa * slope
        if chosen.gabor_texels or chosen.curved_texels:
            bend = 1j * kappa * deviation**2 * (np.array(curvature) if chosen.curved_texels else np.zeros((3, 1)))
            terms *= gaussian_texel(deviation, qx, qy, *bend)
        if chosen.texels_cut:
            terms[np.hypot(qx, qy) * deviation > 3] = 0
        answer[i] = abs(terms.sum()) ** 2
    return answer * pixel_um**4 / (np.pi * patch.window_um**2 * patch.wavelength_um**2)


def in_half_floats(heights: np.ndarray, pixel_um: float) -> np.ndarray:
    """The heights in µm after they were kept in units of a pixel's edge in 16 bits."""
    return (heights / pixel_um).astype(np.float16).astype(np.float64) * pixel_um


def gaussian_texel(
    deviation_um: float, qx: np.ndarray, qy: np.ndarray, bend_xx: np.ndarray, bend_yy: np.ndarray, bend_xy: np.ndarray
) -> np.ndarray:
    """The integral of a Gaussian of unit weight whose phase has the gradient q in rad/µm, and curvature.

    That is `exp(−½ τ² q·A⁻¹q) / √det A` with `A = 1 − i κ τ² ∇∇h`, whose last term is the `bend`.
    """
    xx, yy, xy = 1 - bend_xx, 1 - bend_yy, -bend_xy
    determinant = xx * yy - xy**2
    inverse = (yy * qx**2 - 2 * xy * qx * qy + xx * qy**2) / determinant
    return np.exp(-(deviation_um**2) * inverse / 2) / np.sqrt(determinant)


def derivatives(heights: np.ndarray, pixel_um: float) -> tuple[np.ndarray, ...]:
    """By central differences on a tile that repeats: the slopes along x and y, and in 1/µm h_xx, h_yy and h_xy."""

    def slope(of: np.ndarray, axis: int) -> np.ndarray:
        return (np.roll(of, -1, axis) - np.roll(of, 1, axis)) / (2 * pixel_um)

    def curvature(axis: int) -> np.ndarray:
        return (np.roll(heights, -1, axis) - 2 * heights + np.roll(heights, 1, axis)) / pixel_um**2

    x, y = slope(heights, 1), slope(heights, 0)
    return x, y, curvature(1), curvature(0), slope(x, 0)


def within(reach_um: float, tile: np.ndarray, pixel_um: float, *more: np.ndarray) -> tuple[np.ndarray, ...]:
    """Places in µm along either axis about the middle pixel, as far as the reach, and what the square tiles hold there.

    The tiles repeat.
    """
    count = int(np.ceil(reach_um / pixel_um))
    steps = np.arange(-count, count + 1)
    rows, columns = ((steps + size // 2) % size for size in tile.shape)
    return (steps * pixel_um, *(each[np.ix_(rows, columns)] for each in (tile, *more)))


def hemisphere(size: int) -> tuple[np.ndarray, np.ndarray]:
    """The unit vectors `[n, 3]` of a map of the hemisphere seen from above, and which pixels `[iy, ix]` have one.

    The map's pixels are equally large in direction cosines, so the mean of `f_r` over them is in proportion to the
    power.
    """
    place = (np.arange(size) + 0.5) * 2 / size - 1
    x, y = np.meshgrid(place, place)
    lit = np.hypot(x, y) < 1
    return np.stack([x[lit], y[lit], np.sqrt(1 - x[lit] ** 2 - y[lit] ** 2)], axis=1), lit
