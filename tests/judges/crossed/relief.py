"""Reliefs that repeat along x and y, as trigonometric polynomials through their samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Relief:
    """Heights over one period in µm, `[iy, ix]`, and the periods along x and y in µm."""

    heights: np.ndarray
    period: tuple[float, float]

    def sampled(self, nx: int, ny: int) -> Relief:
        """The polynomial without its mean at `nx` and `ny` samples; fewer samples keep only the lower harmonics."""
        old_y, old_x = self.heights.shape
        spectrum = np.fft.fft2(self.heights - self.heights.mean()) / self.heights.size
        jx, jy = harmonics(old_x), harmonics(old_y)
        # Harmonic n/2 of an even number n of samples stands for both signs, and is omitted.
        keep_x = np.abs(jx) <= (min(nx, old_x) - 1) // 2
        keep_y = np.abs(jy) <= (min(ny, old_y) - 1) // 2
        resampled = np.zeros((ny, nx), complex)
        resampled[np.ix_(jy[keep_y] % ny, jx[keep_x] % nx)] = spectrum[np.ix_(keep_y, keep_x)]
        return Relief(np.fft.ifft2(resampled).real * nx * ny, self.period)

    def slopes(self) -> tuple[np.ndarray, np.ndarray]:
        """Slopes of the polynomial along x and y at the samples, whose numbers are odd."""
        ny, nx = self.heights.shape
        spectrum = np.fft.fft2(self.heights)
        slopes = []
        # Frequencies of the harmonics in cycles per µm.
        for frequency in (harmonics(nx)[None, :] / self.period[0], harmonics(ny)[:, None] / self.period[1]):
            slopes.append(np.fft.ifft2(2j * np.pi * frequency * spectrum).real)
        return slopes[0], slopes[1]

    def rms_slopes(self) -> tuple[float, float]:
        """Root mean square slopes of the polynomial along x and y."""
        ny, nx = self.heights.shape
        # The squares have twice the harmonics. With this many samples their means are exact.
        along_x, along_y = self.sampled(4 * nx + 1, 4 * ny + 1).slopes()
        return float(np.sqrt((along_x**2).mean())), float(np.sqrt((along_y**2).mean()))

    def scaled(self, factor: float) -> Relief:
        """The relief with its heights multiplied by a factor."""
        return Relief(self.heights * factor, self.period)


def harmonics(count: int) -> np.ndarray:
    """Numbers of the harmonics of `count` samples, in the order of the FFT."""
    return np.rint(np.fft.fftfreq(count, 1 / count)).astype(int)


# Periods of the synthetic skin along x and y.
SYNTHETIC_UM = (1.7, 1.9)
# Cosine waves of the synthetic skin: harmonic jx and jy, amplitude in nm, phase in turns. Chosen.
SYNTHETIC = (
    (1, 0, 26.0, 0.10),
    (0, 1, 48.0, 0.35),
    (1, 1, 24.0, 0.80),
    (1, -1, 16.0, 0.55),
    (2, 1, 11.0, 0.20),
    (0, 2, 30.0, 0.65),
    (1, 3, 10.0, 0.40),
    (2, -2, 7.0, 0.95),
    (0, 4, 6.0, 0.15),
)


def synthetic() -> Relief:
    """A synthetic relief like a skin's, with pixels of 50 nm, for tests without a scan."""
    columns, rows = (round(period_um / 0.05) for period_um in SYNTHETIC_UM)
    # Positions of the pixels in periods.
    x = np.arange(columns)[None, :] / columns
    y = np.arange(rows)[:, None] / rows
    waves = [1e-3 * nm * np.cos(2 * np.pi * (jx * x + jy * y + turns)) for jx, jy, nm, turns in SYNTHETIC]
    return Relief(np.sum(waves, axis=0), SYNTHETIC_UM)
