"""Other solutions of Maxwell's equations for two profiles in a perfect conductor, to test the boundary integral.

The field u along the grooves, E in TE and H in TM, is exp(iα_0 x − iβ_0 z) + Σ_n u_n exp(iα_n x + iβ_n z) above the
grooves. α_n and ±β_n are the x and z components of wave vectors, and u_n is the amplitude of order n. δ_n0 is 1 for
n = 0 and else 0. Periods and heights are in µm, wave numbers in rad/µm.
"""

from __future__ import annotations

import numpy as np

from .boundary_integral import Efficiencies
from .green import Lattice
from .profile import Sinusoid


def _waves(period: float, wavelength_nm: float, theta_i_deg: float, evanescent: int) -> Lattice:
    """The plane waves that represent the field, with at least `evanescent` evanescent ones to either side.

    Light arrives from the direction `theta_i_deg` towards +x, so α_0 = −k sinθ_i.
    """
    k = 2e3 * np.pi / wavelength_nm
    # Orders −count … count propagate at most, at any angle of incidence, with count = 2·period/λ.
    return Lattice(period, k, -k * np.sin(np.radians(theta_i_deg)), int(k * period / np.pi) + 1 + evanescent)


def _efficiencies(waves: Lattice, te: np.ndarray, tm: np.ndarray) -> Efficiencies:
    """Efficiencies of the orders that propagate, from the amplitudes u_n of all orders in TE and in TM."""
    kept = waves.beta.imag == 0
    orders, beta = waves.orders[kept], waves.beta[kept].real
    share = beta / beta[orders == 0]
    return Efficiencies(orders, beta / waves.k, share * np.abs(te[kept]) ** 2, share * np.abs(tm[kept]) ** 2)


def lamellar_modes(
    period: float, height: float, wavelength_nm: float, theta_i_deg: float, evanescent: int = 400
) -> Efficiencies:
    """The modal method for a lamellar grating of duty 1/2.

    The field in a groove is a sum of modes of a waveguide with metal walls and bottom, in closed form. Mode m has the
    wave number μ_m = mπ/width across the groove, r_m = √(k² − μ_m²) along z, and the amplitude a_m. Fourier
    coefficients match the modes to the plane waves at the top of the ridges, z = 0. s is the distance from the groove's
    left wall, the origin of x. There are half as many modes as orders, since the groove is half of the period. No order
    may graze (β_n = 0), nor a mode resonate in TE (sin(r_m height) = 0) or TM (cos(r_m height) = 0).
    """
    waves = _waves(period, wavelength_nm, theta_i_deg, evanescent)
    width, alpha, beta, k = 0.5 * period, waves.alpha, waves.beta, waves.k
    count = len(alpha) // 2
    mirror = waves.orders == 0
    beta0 = beta[mirror][0]

    def integral(wave_number):
        """∫ exp(i·wave_number·s) ds over the groove."""
        return width * np.exp(0.5j * wave_number * width) * np.sinc(wave_number * width / (2 * np.pi))

    def modes(first):
        """m from `first` on, r_m, and the integrals over the groove of exp(i(α_n ± μ_m)s), indexed [n, m]."""
        m = np.arange(first, first + count)
        mu = m * np.pi / width
        r = np.sqrt((k**2 - mu**2).astype(complex))
        return m, r, integral(alpha[:, None] + mu), integral(alpha[:, None] - mu)

    # TE: u = Σ_m a_m sin(μ_m s) sin(r_m (z + height)) / sin(r_m height) in the groove, u = 0 on the ridge. u is
    # continuous over the period, ∂u/∂z over the groove.
    _, r, plus, minus = modes(1)
    # ∫ exp(iα_n s) sin(μ_m s) ds.
    project = (plus - minus) / 2j
    # ∂u/∂z of mode m at z = 0, over a_m sin(μ_m s).
    slopes = r / np.tan(r * height)
    # u_n = −δ_n0 + Σ_m conj(project)_nm a_m / period; Σ_n iβ_n u_n project_nm − iβ_0 project_0m = a_m slopes_m width/2.
    back = np.conj(project) / period
    system = project.T @ (1j * beta[:, None] * back) - np.diag(0.5 * width * slopes)
    a = np.linalg.solve(system, 2j * beta0 * project[mirror][0])
    te = back @ a - mirror

    # TM: u = Σ_m a_m cos(μ_m s) cos(r_m (z + height)) / cos(r_m height), ∂u/∂z = 0 on the ridge. ∂u/∂z is continuous
    # over the period, u over the groove.
    m, r, plus, minus = modes(0)
    # ∫ exp(iα_n s) cos(μ_m s) ds.
    project = (plus + minus) / 2
    # ∂u/∂z of mode m at z = 0, over a_m cos(μ_m s).
    slopes = -r * np.tan(r * height)
    # ∫ cos²(μ_m s) ds.
    norm = width * np.where(m == 0, 1, 0.5)
    # iβ_n u_n = iβ_0 δ_n0 + Σ_m slopes_m conj(project)_nm a_m / period; Σ_n u_n project_nm + project_0m = a_m norm_m.
    back = np.conj(project) * slopes / (1j * beta[:, None] * period)
    system = project.T @ back - np.diag(norm)
    a = np.linalg.solve(system, -2 * project[mirror][0])
    tm = back @ a + mirror
    return _efficiencies(waves, te, tm)


def sinusoid_rayleigh(
    profile: Sinusoid, wavelength_nm: float, theta_i_deg: float, evanescent: int = 8, points: int = 200
) -> Efficiencies:
    """Rayleigh's expansion on a sinusoid: upward plane waves that obey the boundary condition by least squares.

    The condition is u = 0 in TE and ∂u/∂ν = 0 in TM, with ν the normal, at `points` nodes. The expansion converges for
    slopes of up to 0.448, or 24° (Petit and Cadilhac 1966; Millar 1971).
    """
    waves = _waves(profile.period, wavelength_nm, theta_i_deg, evanescent)
    # `evanescent` evanescent orders to either side, without the further ones of `_waves`.
    keep = np.abs(waves.alpha) < waves.k + 2 * np.pi / profile.period * evanescent
    at = profile.nodes(points)
    # Height above the profile's middle.
    z = at.z - 0.5 * profile.height
    up = np.exp(1j * (np.outer(at.x, waves.alpha) + np.outer(z, waves.beta)))[:, keep]
    down = np.exp(1j * (waves.alpha0 * at.x - waves.beta[waves.orders == 0] * z))
    # Scales of the columns: evanescent waves get unit amplitude at the bottom, where they are largest.
    scale = np.exp(-waves.beta.imag * 0.5 * profile.height)[keep]
    # ∂/∂ν of each wave, over i times the wave.
    derivative_up = np.outer(at.normal_x, waves.alpha[keep]) + np.outer(at.normal_z, waves.beta[keep])
    derivative_down = at.normal_x * waves.alpha0 - at.normal_z * waves.beta[waves.orders == 0]
    te, tm = np.zeros((2, len(keep)), complex)
    te[keep] = np.linalg.lstsq(up * scale, -down, rcond=None)[0] * scale
    tm[keep] = np.linalg.lstsq(derivative_up * up * scale, -derivative_down * down, rcond=None)[0] * scale
    return _efficiencies(waves, te, tm)
