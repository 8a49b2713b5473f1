"""The gradient of the quasi-periodic Green's function of the Helmholtz equation in the plane.

With the period d and the wave number k the function is G(x, z) = Σ_n i/(2d β_n) exp(iα_n x + iβ_n |z|), where
α_n = α_0 + 2πn/d and β_n = √(k² − α_n²), positive or positive imaginary, not 0. Lengths are in µm, wave numbers in
rad/µm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Bernoulli numbers B_2 to B_20.
_BERNOULLI_EVEN = (1 / 6, -1 / 30, 1 / 42, -1 / 30, 5 / 66, -691 / 2730, 7 / 6, -3617 / 510, 43867 / 798, -174611 / 330)


# Re μ from which `dilogarithm` sums powers of e^−μ, below it powers of μ. Chosen where both converge fast.
_SWITCH = 2.5


def dilogarithm(mu: np.ndarray) -> np.ndarray:
    """Li₂(e^−μ) for Re μ >= 0 and |Im μ| <= π, to 1e-6, and to 1e-8 for Re μ <= 1."""
    mu = np.asarray(mu, complex)
    result = np.empty_like(mu)
    near = mu.real < _SWITCH
    small = mu[near]
    with np.errstate(divide="ignore", invalid="ignore"):
        log = np.where(small == 0, 0, np.log(small))
    # ζ(2) − μ(1 − ln μ) − μ²/4 + Σ_m B_2m μ^(2m+1) / (2m (2m+1)!)
    value = np.pi**2 / 6 - small * (1 - log) - small**2 / 4
    # μ^(2m+1)/(2m+1)!
    factor = small.copy()
    for m, bernoulli in enumerate(_BERNOULLI_EVEN, start=1):
        factor = factor * small**2 / (2 * m * (2 * m + 1))
        value = value + bernoulli / (2 * m) * factor
    result[near] = value
    # The definition Σ w^n/n², which converges fast for small w.
    w = np.exp(-mu[~near])
    result[~near] = sum(w**n / n**2 for n in range(1, 9))
    return result


@dataclass(frozen=True)
class Lattice:
    """The orders n = −count … count of a wave over a grating, with the symbols of the module.

    They include every order that propagates (|α_n| < k).
    """

    # d in µm, k and α_0 in rad/µm.
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
        """(∂G/∂x, ∂G/∂z) in 1/µm at (x, z) and at (−x, −z), away from the sources at x = pd, z = 0 with whole p.

        The sum over orders converges slowly for small z. Its terms' asymptotes up to n⁻² are subtracted, and their sum
        is added in closed form (Kummer's transformation), so that the error falls as count⁻².
        """
        d, k, alpha0 = self.period, self.k, self.alpha0
        # Moves x into the period around 0; the factor `shift` below moves the result back.
        periods = np.round(x / d)
        x = x - d * periods
        sign, abs_z = np.sign(z), np.abs(z)
        # With n ≥ 0 and the sign `side` of the order, exp(iα_n x) is carrier · step^(side n), and exp(−γ_n |z|) tends
        # to tilt[side] · decay^n.
        step = np.exp(2j * np.pi / d * x)
        carrier = np.exp(1j * alpha0 * x)
        decay = np.exp(-2 * np.pi / d * abs_z)
        tilt = {side: np.exp(-side * alpha0 * abs_z) for side in (1, -1)}
        # Sums `[component]` for ∂G/∂x and ∂G/∂z without common factors. Asymptotes and evanescent terms at (−x, −z) are
        # the conjugates of those at (x, z). Waves that propagate are summed at (x, z) in `there`, and at (−x, −z) in
        # `back`.
        conjugate = np.array(self._asymptotes(x, abs_z, carrier, tilt))
        there, back = np.zeros_like(conjugate), np.zeros_like(conjugate)
        # step^n and decay^n.
        turn, fall = np.ones_like(step), np.ones_like(decay)
        for n in range(self.count + 1):
            for side in (1, -1) if n else (1,):
                alpha = alpha0 + side * 2 * np.pi * n / d
                evanescent = abs(alpha) > k
                # γ = −iβ.
                gamma = np.sqrt(alpha**2 - k**2) if evanescent else -1j * np.sqrt(k**2 - alpha**2)
                wave = np.exp(-gamma * abs_z)
                in_x, in_z = alpha / gamma * wave, wave
                if n:
                    # Asymptotes for large q, from γ ≈ q + side·α_0 − k²/(2q). `shared` is in both components.
                    q = 2 * np.pi * n / d
                    leading = fall * tilt[side]
                    shared = leading * (1 + k**2 / (2 * q) * abs_z)
                    in_z = in_z - shared
                    in_x = in_x - side * (shared + k**2 / (2 * q**2) * leading)
                phase = carrier * (turn if side > 0 else np.conj(turn))
                for i, part in enumerate((in_x, in_z)):
                    if evanescent:
                        conjugate[i] += part * phase
                    else:
                        there[i] += part * phase
                        back[i] += part * np.conj(phase)
            turn, fall = turn * step, fall * decay
        shift = np.exp(1j * alpha0 * d * periods)
        there, back = (there + conjugate) * shift, (back + np.conj(conjugate)) * np.conj(shift)
        towards_x, towards_z = 0.5j / d, -0.5 / d * sign
        return (towards_x * there[0], towards_z * there[1]), (towards_x * back[0], -towards_z * back[1])

    def _asymptotes(
        self, x: np.ndarray, abs_z: np.ndarray, carrier: np.ndarray, tilt: dict[int, np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Sums over all n ≠ 0 of the asymptotes that `gradient` subtracts, for ∂G/∂x and for ∂G/∂z."""
        d, k = self.period, self.k
        mu = 2 * np.pi / d * (abs_z - 1j * x)
        # From Σ w^n, Σ w^n/n and Σ w^n/n² with w = exp(−μ), over n from 1. Negative n have the conjugates.
        shared = -np.exp(-mu) / np.expm1(-mu) - k**2 * d / (4 * np.pi) * abs_z * np.log(-np.expm1(-mu))
        only_x = k**2 * d**2 / (8 * np.pi**2) * dilogarithm(mu)
        up, down = carrier * tilt[1], carrier * tilt[-1]
        towards_x = up * (shared + only_x) - down * np.conj(shared + only_x)
        return towards_x, up * shared + down * np.conj(shared)

    def self_term(self) -> complex:
        """Limit of ∂G/∂x along z = 0 at the source, without the source's own field, in 1/µm; that of ∂G/∂z is 0.

        The asymptotes sign(n) of the terms are subtracted. Their sum i·cot(πx/d)·exp(iα_0 x) is id/(πx) − α_0 d/π up to
        terms in x. Its first part is the source's own field.
        """
        orders, alpha = self.orders, self.alpha
        gamma = -1j * self.beta
        total = np.sum(alpha / gamma - np.sign(orders))
        return 0.5j / self.period * total - 0.5j * self.alpha0 / np.pi
