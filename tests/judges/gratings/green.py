"""The gradient of the quasi-periodic Green's function of the Helmholtz equation in the plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Coefficients ζ(2 − m) (−1)^m / m! of the dilogarithm's expansion below, m from 0, without m = 1.
_BERNOULLI_EVEN = (1 / 6, -1 / 30, 1 / 42, -1 / 30, 5 / 66, -691 / 2730, 7 / 6, -3617 / 510, 43867 / 798, -174611 / 330)


def dilogarithm(mu: np.ndarray) -> np.ndarray:
    """Li₂(e^−μ) for Re μ >= 0 and |Im μ| <= π, to about 1e-8."""
    mu = np.asarray(mu, complex)
    result = np.empty_like(mu)
    near = mu.real < 2.5
    small = mu[near]
    with np.errstate(divide="ignore", invalid="ignore"):
        log = np.where(small == 0, 0, np.log(small))
    # ζ(2) − μ(1 − ln μ) − μ²/4 + Σ B_2k μ^(2k+1) / (2k (2k+1)!)
    value = np.pi**2 / 6 - small * (1 - log) - small**2 / 4
    factor = small.copy()
    for k, bernoulli in enumerate(_BERNOULLI_EVEN, start=1):
        factor = factor * small**2 / (2 * k * (2 * k + 1))
        value = value + bernoulli / (2 * k) * factor
    result[near] = value
    w = np.exp(-mu[~near])
    result[~near] = sum(w**n / n**2 for n in range(1, 9))
    return result


@dataclass(frozen=True)
class Lattice:
    """A wave of wavenumber `k` (rad/um) over a grating: the orders n = −count … count.

    `alpha` and `beta` (rad/um) are the components of the wave vectors along x and z; β is positive or positive
    imaginary.
    """

    period: float
    k: float
    alpha0: float
    count: int

    @property
    def orders(self) -> np.ndarray:
        return np.arange(-self.count, self.count + 1)

    @property
    def alpha(self) -> np.ndarray:
        return self.alpha0 + 2 * np.pi / self.period * self.orders

    @property
    def beta(self) -> np.ndarray:
        return np.sqrt((self.k**2 - self.alpha**2).astype(complex))

    def gradient(self, x: np.ndarray, z: np.ndarray) -> tuple[tuple, tuple]:
        """(∂G/∂x, ∂G/∂z) of G = Σ_n exp(iα_n x + iβ_n |z|) i/(2 period β_n), in 1/um, away from the sources: at (x, z)
        and at (−x, −z), where all but the waves that propagate is the conjugate.

        The sum over orders converges slowly for small z. Its terms' asymptotes up to n⁻² are subtracted, and their sum
        is added in closed form (Kummer's transformation), so that the error falls as count⁻².
        """
        d, k, alpha0 = self.period, self.k, self.alpha0
        turns = np.round(x / d)
        x = x - d * turns
        sign, y = np.sign(z), np.abs(z)
        step = np.exp(2j * np.pi / d * x)
        carrier = np.exp(1j * alpha0 * x)
        decay = np.exp(-2 * np.pi / d * y)
        tilt = {side: np.exp(-side * alpha0 * y) for side in (1, -1)}
        # Sums of terms with real amplitudes, and of the others at both points; along x and z.
        real = np.array(self._limits(x, y, carrier, tilt))
        there, back = np.zeros_like(real), np.zeros_like(real)
        power, fall = np.ones_like(step), np.ones_like(decay)
        for n in range(self.count + 1):
            for side in (1, -1) if n else (1,):
                alpha = alpha0 + side * 2 * np.pi * n / d
                evanescent = abs(alpha) > k
                gamma = np.sqrt(alpha**2 - k**2) if evanescent else -1j * np.sqrt(k**2 - alpha**2)
                wave = np.exp(-gamma * y)
                in_x, in_z = alpha / gamma * wave, wave
                if n:
                    q = 2 * np.pi * n / d
                    limit = fall * tilt[side]
                    first = limit * (1 + k**2 / (2 * q) * y)
                    in_z = in_z - first
                    in_x = in_x - side * (first + k**2 / (2 * q**2) * limit)
                phase = carrier * (power if side > 0 else np.conj(power))
                for i, part in enumerate((in_x, in_z)):
                    if evanescent:
                        real[i] += part * phase
                    else:
                        there[i] += part * phase
                        back[i] += part * np.conj(phase)
            power, fall = power * step, fall * decay
        shift = np.exp(1j * alpha0 * d * turns)
        there, back = (there + real) * shift, (back + np.conj(real)) * np.conj(shift)
        towards_x, towards_z = 0.5j / d, -0.5 / d * sign
        return (towards_x * there[0], towards_z * there[1]), (towards_x * back[0], -towards_z * back[1])

    def _limits(self, x, y, carrier, tilt) -> tuple[np.ndarray, np.ndarray]:
        """Sums over all orders of the terms' asymptotes, along x and z, without their factors."""
        d, k = self.period, self.k
        mu = 2 * np.pi / d * (y - 1j * x)
        # Σ w^n, Σ w^n/n and Σ w^n/n² of w = exp(−μ), over n from 1; the other side has the conjugates.
        first = -np.exp(-mu) / np.expm1(-mu) - k**2 * d / (4 * np.pi) * y * np.log(-np.expm1(-mu))
        second = k**2 * d**2 / (8 * np.pi**2) * dilogarithm(mu)
        up, down = carrier * tilt[1], carrier * tilt[-1]
        towards_x = up * (first + second) - down * np.conj(first + second)
        return towards_x, up * first + down * np.conj(first)

    def self_term(self) -> complex:
        """Limit of ∂G/∂x at the source without the source's own field, in 1/um; the limit of ∂G/∂z is zero."""
        orders, alpha = self.orders, self.alpha
        gamma = -1j * self.beta
        total = np.sum(alpha / gamma - np.sign(orders))
        return 0.5j / self.period * total - 0.5j * self.alpha0 / np.pi
