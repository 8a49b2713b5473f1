"""Other solutions of Maxwell's equations for some profiles, to test the boundary integral."""

from __future__ import annotations

import numpy as np

from .boundary_integral import Efficiencies
from .green import Lattice
from .profile import Sinusoid


def _waves(period: float, wavelength_nm: float, theta_i_deg: float, evanescent: int) -> Lattice:
    k = 2e3 * np.pi / wavelength_nm
    return Lattice(period, k, -k * np.sin(np.radians(theta_i_deg)), int(k * period / np.pi) + 1 + evanescent)


def _efficiencies(waves: Lattice, te: np.ndarray, tm: np.ndarray) -> Efficiencies:
    open_ = waves.beta.imag == 0
    beta = waves.beta[open_].real
    share = beta / beta[waves.orders[open_] == 0]
    return Efficiencies(
        waves.orders[open_], beta / waves.k, share * np.abs(te[open_]) ** 2, share * np.abs(tm[open_]) ** 2
    )


def lamellar_modes(
    period: float, height: float, wavelength_nm: float, theta_i_deg: float, evanescent: int = 400
) -> Efficiencies:
    """The modal method for a lamellar grating of duty 1/2.

    The field in a groove is a sum of modes of a waveguide with metal walls and bottom, in closed form. Fourier
    coefficients match it to plane waves at the height of the ridges. The number of modes is half of the orders', as
    the groove is half of the period.
    """
    waves = _waves(period, wavelength_nm, theta_i_deg, evanescent)
    width, alpha, beta, k = 0.5 * period, waves.alpha, waves.beta, waves.k
    count = len(alpha) // 2
    mirror = waves.orders == 0
    beta0 = beta[mirror][0]

    def along(rates):
        """∫ exp(i rate s) ds over the groove, s from its left wall."""
        return width * np.exp(0.5j * rates * width) * np.sinc(rates * width / (2 * np.pi))

    def modes(first):
        m = np.arange(first, first + count)
        mu = m * np.pi / width
        rates = np.sqrt((k**2 - mu**2).astype(complex))
        plus, minus = along(alpha[:, None] + mu), along(alpha[:, None] - mu)
        return m, rates, plus, minus

    # TE: u = Σ_m a_m sin(μ_m s) sin(r_m (z + height)) / sin(r_m height) in the groove, u = 0 on the ridge: u is
    # continuous over the period, ∂u/∂z over the groove.
    _, rates, plus, minus = modes(1)
    project = (plus - minus) / 2j  # ∫ exp(iα_n s) sin(μ_m s) ds
    slopes = rates / np.tan(rates * height)
    # u_n = −δ_n0 + Σ_m conj(project)_nm a_m / period ; Σ_n iβ_n u_n project_nm − iβ_0 project_0m = a_m slope_m width/2
    back = np.conj(project) / period
    system = project.T @ (1j * beta[:, None] * back) - np.diag(0.5 * width * slopes)
    a = np.linalg.solve(system, 2j * beta0 * project[mirror][0])
    te = back @ a - mirror

    # TM: u = Σ_m a_m cos(μ_m s) cos(r_m (z + height)), ∂u/∂z = 0 on the ridge: the two change places.
    m, rates, plus, minus = modes(0)
    project = (plus + minus) / 2
    slopes = -rates * np.tan(rates * height)
    norm = width * np.where(m == 0, 1, 0.5)
    # iβ_n u_n = iβ_0 δ_n0 + Σ_m slope_m conj(project)_nm a_m / period ; Σ_n u_n project_nm + project_0m = a_m norm_m
    back = np.conj(project) * slopes / (1j * beta[:, None] * period)
    system = project.T @ back - np.diag(norm)
    a = np.linalg.solve(system, -2 * project[mirror][0])
    tm = back @ a + mirror
    return _efficiencies(waves, te, tm)


def sinusoid_rayleigh(
    profile: Sinusoid, wavelength_nm: float, theta_i_deg: float, evanescent: int = 8, points: int = 200
) -> Efficiencies:
    """Rayleigh's expansion on a sinusoid: upward plane waves, matched on the profile by least squares.

    It converges for slopes of up to 0.448 (Petit and Cadilhac 1966; Millar 1971), 24°.
    """
    waves = _waves(profile.period, wavelength_nm, theta_i_deg, evanescent)
    keep = np.abs(waves.alpha) < waves.k + 2 * np.pi / profile.period * evanescent
    at = profile.nodes(points)
    z = at.z - 0.5 * profile.height
    up = np.exp(1j * (np.outer(at.x, waves.alpha) + np.outer(z, waves.beta)))[:, keep]
    down = np.exp(1j * (waves.alpha0 * at.x - waves.beta[waves.orders == 0] * z))
    # Evanescent waves have unit amplitude at the ridges, so that columns are of equal size.
    scale = np.exp(-waves.beta.imag * 0.5 * profile.height)[keep]
    flux_up = np.outer(at.normal_x, waves.alpha[keep]) + np.outer(at.normal_z, waves.beta[keep])
    flux_down = at.normal_x * waves.alpha0 - at.normal_z * waves.beta[waves.orders == 0]
    te, tm = np.zeros((2, len(keep)), complex)
    te[keep] = np.linalg.lstsq(up * scale, -down, rcond=None)[0] * scale
    tm[keep] = np.linalg.lstsq(flux_up * up * scale, -flux_down * down, rcond=None)[0] * scale
    return _efficiencies(waves, te, tm)
