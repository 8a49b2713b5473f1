"""Maxwell's equations for light in a clear medium, such as air, on a relief that repeats along x and y.

A change of coordinates makes the interface flat: z = s + h(x, y) φ(s) with φ = 1 − |s|/a, so that h acts within a of
s = 0 on either side and nowhere else. (Chandezon, Raoult and Maystre, J. Opt. 11, 1980, shift the whole of space.) In
the new coordinates Maxwell's equations keep their form, and the medium's ε and μ become tensors of the metric. Of the
covariant components of E and H along x and y, with Z = z(x, y, s) and c = (1 + Zx² + Zy²)/Zs:

    ∂s ex = i kx es + i k B^y      ∂s hx = i kx hs − i k D^y
    ∂s ey = i ky es − i k B^x      ∂s hy = i ky hs + i k D^x
    es = (D^s/ε + Zx ex + Zy ey)/c,  D^s = −(kx hy − ky hx)/k,  D^x = ε (Zs ex − Zx es),  D^y = ε (Zs ey − Zy es)
    hs = (B^s + Zx hx + Zy hy)/c,    B^s =  (kx ey − ky ex)/k,  B^x = Zs hx − Zx hs,      B^y = Zs hy − Zy hs

Along x and y fields are Fourier series, with products on the samples. Along s they are polynomials, one in each medium,
collocated at Gauss points. With coefficients replaced by their means over x and y, every harmonic is a small system of
its own; the inverses of these systems precondition GMRES for the rest. The relief is not approximated by steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .gmres import gmres
from .panels import Panels, panels
from .relief import Relief, harmonics

# Ratio of a to the highest point of the relief. At 1 the coordinates would fold.
REACH = 2.0
# Least height of a panel in um, for a flat relief.
REACH_MIN_UM = 2e-3
# Number of harmonics inverted at once, limited by memory.
CHUNK = 128


@dataclass(frozen=True)
class Resolution:
    """Resolution: largest frequency of harmonics, nodes in each panel, residual and steps of GMRES."""

    cutoff_per_um: float = 8.0
    nodes: int = 10
    tolerance: float = 1e-6
    steps_max: int = 200

    def counts(self, period: tuple[float, float]) -> tuple[int, int]:
        """Numbers of harmonics along x and y, which are odd."""
        nx, ny = (2 * int(self.cutoff_per_um * length) + 1 for length in period)
        return nx, ny


@dataclass(frozen=True)
class Orders:
    """Fraction of the power in each propagating reflected order, for incident s and p polarised light.

    `jones` holds amplitudes `[order, out, in]` of s and p, their squares power and their phases those at the mean
    height: s is along z × k and p along k × s, with k where light travels to; along the normal s is as at the
    incidence's azimuth. `balance` is the deviation of all reflected and transmitted power from 1, in a medium without
    loss, the larger of both states; `residual` is the larger residual of GMRES.
    """

    jx: np.ndarray
    jy: np.ndarray
    s: np.ndarray
    p: np.ndarray
    jones: np.ndarray
    balance: float
    residual: float

    @property
    def unpolarised(self) -> np.ndarray:
        return 0.5 * (self.s + self.p)


def solve(
    relief: Relief,
    wavelength_nm: float,
    theta_deg: float,
    phi_deg: float,
    index: complex,
    resolution: Resolution = Resolution(),
    above: float = 1.0,
) -> Orders:
    """Efficiencies of all propagating reflected orders at a medium of the index `index`.

    Light and orders are in a medium of the index `above`, in which `theta_deg` is measured; the wavelength is that in
    vacuum.
    """
    problem = Problem(relief, wavelength_nm, theta_deg, phi_deg, index, resolution, above)
    jx, jy = np.meshgrid(problem.jx, problem.jy)
    leaves = (problem.beta_above.imag == 0).ravel()
    shares, columns, balances, residuals = [], [], [], []
    for state in "sp":
        up, down, residual = problem.solve(state)
        arriving = abs(flux(problem.incident(state)[None])[0])
        reflected, transmitted = flux(up) / arriving, -flux(down) / arriving
        shares.append(reflected[leaves])
        columns.append(problem.amplitudes(up)[leaves])
        balances.append(abs(reflected[leaves].sum() + transmitted.sum() - 1))
        residuals.append(residual)
    jones = np.stack(columns, axis=-1)
    return Orders(jx.ravel()[leaves], jy.ravel()[leaves], *shares, jones, float(max(balances)), max(residuals))


def flux(fields: np.ndarray) -> np.ndarray:
    """Twice Poynting's vector along z of rows ex, ey, hx, hy."""
    ex, ey, hx, hy = fields.T
    return (ex * hy.conj() - ey * hx.conj()).real


class Problem:
    """The system of one light on one relief: coefficients at the points, and inverses of the mean systems.

    Fields are arrays `[point or node, component, jy, jx]`, their components ex, ey, hx, hy. Wave numbers are in 1/um:
    `k` in vacuum, `k_above` in the medium of the light.
    """

    def __init__(self, relief, wavelength_nm, theta_deg, phi_deg, index, resolution, above):
        self.resolution = resolution
        self.k = k = 2e3 * np.pi / wavelength_nm
        self.index_above = above
        self.k_above = above * k
        nx, ny = resolution.counts(relief.period)
        self.shape = (ny, nx)
        self.jx, self.jy = harmonics(nx), harmonics(ny)
        theta, phi = np.radians([theta_deg, phi_deg])
        self.wi = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
        self.phi = phi
        rate_x, rate_y = (2 * np.pi / length for length in relief.period)
        kx = self.jx[None, :] * rate_x - self.k_above * self.wi[0]
        ky = self.jy[:, None] * rate_y - self.k_above * self.wi[1]
        self.kx, self.ky = (np.broadcast_to(a, self.shape) for a in (kx, ky))
        flat = self.kx**2 + self.ky**2
        self.beta_above = np.sqrt(self.k_above**2 - flat + 0j)
        self.beta_below = np.sqrt((index * k) ** 2 - flat + 0j)
        sampled = relief.sampled(nx, ny)
        highest, lowest = sampled.heights.max(), -sampled.heights.min()
        below, above = (REACH * max(extreme, REACH_MIN_UM) for extreme in (lowest, highest))
        self.panels = panels(below, above, resolution.nodes)
        self._metric(sampled, index)
        self._invert()

    def _metric(self, relief: Relief, index: complex) -> None:
        """Zs, Zx, Zy and 1/c at the points, `[point, jy, jx]`, and ε."""
        at = self.panels
        inside = np.where(at.upper, 1 - at.points / at.above, 1 + at.points / at.below)[:, None, None]
        rate = np.where(at.upper, -1 / at.above, 1 / at.below)[:, None, None]
        slope_x, slope_y = relief.slopes()
        self.zs = 1 + relief.heights * rate
        self.zx, self.zy = slope_x * inside, slope_y * inside
        self.per_c = self.zs / (1 + self.zx**2 + self.zy**2)
        self.eps = np.where(at.upper, self.index_above**2, index**2 + 0j)[:, None, None]

    def _mean_operator(self) -> np.ndarray:
        """The right-hand side with mean coefficients, `[harmonic, point, row, column]`."""

        def mean(values):
            return values.mean(axis=(1, 2))[:, None, None]

        k, kx, ky, eps = self.k, self.kx[None], self.ky[None], self.eps
        c = mean(self.per_c)
        along_x = mean(self.zs - self.zx**2 * self.per_c)
        along_y = mean(self.zs - self.zy**2 * self.per_c)
        across = mean(self.zx * self.zy * self.per_c)
        operator = np.zeros((self.panels.count, *self.shape, 4, 4), complex)
        # Rows are ∂s of ex, ey, hx, hy. GMRES accounts for the means of Zx/c and Zy/c.
        operator[..., 0, 2] = 1j * kx * c * ky / k / eps - 1j * k * across
        operator[..., 0, 3] = -1j * kx * c * kx / k / eps + 1j * k * along_y
        operator[..., 1, 2] = 1j * ky * c * ky / k / eps - 1j * k * along_x
        operator[..., 1, 3] = -1j * ky * c * kx / k / eps + 1j * k * across
        operator[..., 2, 0] = -1j * kx * c * ky / k + 1j * k * eps * across
        operator[..., 2, 1] = 1j * kx * c * kx / k - 1j * k * eps * along_y
        operator[..., 3, 0] = -1j * ky * c * ky / k + 1j * k * eps * along_x
        operator[..., 3, 1] = 1j * ky * c * kx / k - 1j * k * eps * across
        return operator.transpose(1, 2, 0, 3, 4).reshape(-1, self.panels.count, 4, 4)

    def _admittance(self, beta: np.ndarray) -> np.ndarray:
        """(hx, hy) of a plane wave from its (ex, ey), `[harmonic, 2, 2]`; `beta` is its wave number along z."""
        kx, ky, k = self.kx, self.ky, self.k
        rows = [[-ky * kx / beta, -(ky**2) / beta - beta], [beta + kx**2 / beta, kx * ky / beta]]
        return np.array(rows).transpose(2, 3, 0, 1).reshape(-1, 2, 2) / k

    def _invert(self) -> None:
        """Inverse of each harmonic's mean system: fields at the points and at both ends from sources at the points.

        The unknowns are the fields at the nodes. Rows are the equations at the points, outgoing waves above and below,
        and the continuity of all four components at s = 0.
        """
        at: Panels = self.panels
        nodes, rows = 2 * at.nodes, 4 * at.count
        unknowns = 4 * nodes
        self.mean = self._mean_operator()
        self.above, self.below = self._admittance(self.beta_above), self._admittance(-self.beta_below)
        value, slope = (np.kron(matrix, np.eye(4)) for matrix in (at.value, at.slope))
        # Indices of the nodes at the ends and on both sides of s = 0.
        bottom, top = slice(0, 4), slice(unknowns - 4, unknowns)
        under, over = slice(unknowns // 2 - 4, unknowns // 2), slice(unknowns // 2, unknowns // 2 + 4)
        count = len(self.mean)
        self.to_points = np.empty((count, rows, rows), complex)
        self.to_top, self.to_bottom = (np.empty((count, 4, rows), complex) for _ in range(2))
        for first in range(0, count, CHUNK):
            chunk = slice(first, min(first + CHUNK, count))
            mean = self.mean[chunk]
            system = np.zeros((len(mean), unknowns, unknowns), complex)
            system[:, :rows] = slope - np.einsum("kgab,gj->kgajb", mean, at.value).reshape(len(mean), rows, unknowns)
            for row, end, admittance in ((rows, top, self.above), (rows + 2, bottom, self.below)):
                system[:, row : row + 2, end.start + 2 : end.stop] = np.eye(2)
                system[:, row : row + 2, end.start : end.start + 2] = -admittance[chunk]
            system[:, rows + 4 :, under], system[:, rows + 4 :, over] = np.eye(4), -np.eye(4)
            inverse = np.linalg.inv(system)
            self.to_points[chunk] = value @ inverse[:, :, :rows]
            self.to_top[chunk], self.to_bottom[chunk] = inverse[:, top, :rows], inverse[:, bottom, :rows]
            if first == 0:
                # The light drives harmonic (0, 0) through the upper boundary's two rows.
                self.lit = inverse[0, :, rows : rows + 2]
        self.value = value

    def incident(self, state: str) -> np.ndarray:
        """ex, ey, hx, hy of light with unit E at s = `above`, s or p polarised."""
        s = np.array([np.sin(self.phi), -np.cos(self.phi), 0.0])
        towards = -self.wi
        electric = s if state == "s" else np.cross(towards, s)
        magnetic = self.index_above * np.cross(towards, electric)
        return np.array([electric[0], electric[1], magnetic[0], magnetic[1]], complex)

    def deviation(self, fields: np.ndarray) -> np.ndarray:
        """Right-hand sides at the points, less those of the mean coefficients, `[harmonic, 4·point + component]`."""
        count, modes = self.panels.count, self.kx.size
        by_mode = fields.reshape(modes, count, 4)
        f = by_mode.transpose(1, 2, 0).reshape(count, 4, *self.shape)
        k, kx, ky = self.k, self.kx, self.ky
        spectra = np.empty((count, 6, *self.shape), complex)
        spectra[:, :4] = f
        spectra[:, 4] = (ky * f[:, 2] - kx * f[:, 3]) / k
        spectra[:, 5] = (kx * f[:, 1] - ky * f[:, 0]) / k
        ex, ey, hx, hy, ds, bs = np.fft.ifft2(spectra).transpose(1, 0, 2, 3)
        es = (ds / self.eps + self.zx * ex + self.zy * ey) * self.per_c
        hs = (bs + self.zx * hx + self.zy * hy) * self.per_c
        products = [es, hs, self.zs * hx - self.zx * hs, self.zs * hy - self.zy * hs]
        products += [self.eps * (self.zs * ex - self.zx * es), self.eps * (self.zs * ey - self.zy * es)]
        es, hs, bx, by, dx, dy = np.fft.fft2(np.stack(products))
        sides = [kx * es + k * by, ky * es - k * bx, kx * hs - k * dy, ky * hs + k * dx]
        whole = 1j * np.stack(sides).transpose(2, 3, 1, 0).reshape(modes, count, 4)
        mean = np.matmul(self.mean, by_mode[..., None])[..., 0]
        return (whole - mean).reshape(modes, -1)

    def solve(self, state: str) -> tuple[np.ndarray, np.ndarray, float]:
        """Outgoing fields at s = `above` and s = −`below` by harmonic, rows ex, ey, hx, hy; and GMRES's residual."""
        incident = self.incident(state)
        lit = self.lit @ (incident[2:] - self.above[0] @ incident[:2])
        alone = np.zeros((self.kx.size, 4 * self.panels.count), complex)
        alone[0] = self.value @ lit

        def apply(sources):
            sources = sources.reshape(alone.shape)
            fields = np.matmul(self.to_points, sources[..., None])[..., 0]
            return (sources - self.deviation(fields)).ravel()

        resolution = self.resolution
        sources, residual = gmres(apply, self.deviation(alone).ravel(), resolution.tolerance, resolution.steps_max)
        sources = sources.reshape(alone.shape)[..., None]
        top, bottom = (np.matmul(matrix, sources)[..., 0] for matrix in (self.to_top, self.to_bottom))
        top[0] += lit[-4:] - incident
        bottom[0] += lit[:4]
        return top, bottom, residual

    def amplitudes(self, up: np.ndarray) -> np.ndarray:
        """Amplitudes of s and p of upward harmonics, `[harmonic, 2]`, relative to the light's at the mean height."""
        kx, ky, beta = self.kx.ravel(), self.ky.ravel(), self.beta_above.ravel()
        flat = np.hypot(kx, ky)
        steep = flat < 1e-9 * self.k_above
        length = np.where(steep, 1, flat)
        x, y = np.where(steep, -np.cos(self.phi), kx / length), np.where(steep, -np.sin(self.phi), ky / length)
        # s = (−y, x, 0); the part of p = k × s in the plane is −(x, y) β/k.
        s = -y * up[:, 0] + x * up[:, 1]
        p = -(x * up[:, 0] + y * up[:, 1]) * self.k_above / beta
        # The light's phase is also taken at s = `above`.
        phase = np.exp(-1j * (beta + self.k_above * self.wi[2]) * self.panels.above)
        weight = np.sqrt(beta / (self.k_above * self.wi[2]))
        return np.stack([s, p], axis=-1) * (weight * phase)[:, None]
