"""Maxwell's equations for light in a clear medium, such as air, on a relief that repeats along x and y.

The relief h(x, y), without its mean, is the interface to another medium. A change of coordinates makes it flat:
z = Z(x, y, s) = s + h(x, y)·(1 − |s|/a) for |s| ≤ a, and z = s beyond. The interface is s = 0. The layer of height a on
either side of it is a *panel*; each has its own a. (Chandezon, Raoult and Maystre, J. Opt. 11, 1980, shift the whole of
space.) Zx, Zy and Zs are the derivatives of Z, and c = (1 + Zx² + Zy²)/Zs.

In the coordinates (x, y, s) Maxwell's equations keep their form, and ε and μ become tensors. ex … hs are covariant
components of E and H; D^x … B^s are contravariant components of D and B, times Zs. Fields vary as e^(−iωt). k is the
wave number in vacuum, and (kx, ky) that of a harmonic of the fields along x and y:

    ∂s ex = i kx es + i k B^y      ∂s hx = i kx hs − i k D^y
    ∂s ey = i ky es − i k B^x      ∂s hy = i ky hs + i k D^x
    es = (D^s/ε + Zx ex + Zy ey)/c,  D^s = −(kx hy − ky hx)/k,  D^x = ε (Zs ex − Zx es),  D^y = ε (Zs ey − Zy es)
    hs = (B^s + Zx hx + Zy hy)/c,    B^s =  (kx ey − ky ex)/k,  B^x = Zs hx − Zx hs,      B^y = Zs hy − Zy hs

Along x and y fields are Fourier series, whose products are computed on samples. Along s they are a polynomial in each
panel, which obeys the equations at Gauss points. With Zs, 1/c and similar coefficients replaced by their means over x
and y, each harmonic has a small system of its own, its *mean system*. The inverses of these precondition GMRES, whose
unknowns are the mean systems' sources. The relief is not approximated by steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .gmres import gmres
from .panels import Panels, panels
from .relief import Relief, harmonics

# Height a of a panel over the relief's largest height or depth. At 1 the coordinates would fold. Chosen: larger values
# need more nodes, smaller ones come closer to the fold.
REACH = 2.0
# Lower bound on that height or depth, so that the panels of a flat relief have a height.
REACH_MIN_UM = 2e-3
# Number of mean systems that are inverted at once. A larger number is faster and needs more memory.
CHUNK = 128


@dataclass(frozen=True)
class Resolution:
    """Largest frequency of harmonics in cycles/µm, nodes in each panel, and limits at which GMRES ends.

    The limits are the residual, relative to the right side, and the number of steps.
    """

    cutoff_per_um: float = 8.0
    nodes: int = 10
    tolerance: float = 1e-6
    steps_max: int = 200

    def counts(self, period: tuple[float, float]) -> tuple[int, int]:
        """Numbers of harmonics along x and y, which are odd, for the periods in µm."""
        nx, ny = (2 * int(self.cutoff_per_um * length) + 1 for length in period)
        return nx, ny


@dataclass(frozen=True)
class Orders:
    """Fractions `s` and `p` of the power in each propagating reflected order (jx, jy), for s or p polarised light.

    `jones` has amplitudes `[order, out, in]` of s and p. Their squared moduli are fractions of the power, and their
    phases are those at the mean height. s is along z × k and p along k × s, where k is the direction of travel. For an
    order along the normal, s is that of the incident light. `balance` checks solutions for media without loss: the
    deviation of the reflected and transmitted power from 1. `residual` is that of GMRES. Both are the larger value of
    the states s and p.
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
        """Fractions of the power for unpolarised light."""
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
    """Efficiencies of all propagating reflected orders of a relief on a medium with the refractive index `index`.

    Light and orders are in a medium with the real index `above`; Im `index` ≥ 0. The wavelength is that in vacuum.
    `theta_deg` (< 90) from +z and the azimuth `phi_deg` from +x give the direction towards the light.
    """
    problem = Problem(relief, wavelength_nm, theta_deg, phi_deg, index, resolution, above)
    jx, jy = np.meshgrid(problem.jx, problem.jy)
    leaves = (problem.beta_above.imag == 0).ravel()
    powers, amplitudes, balances, residuals = [], [], [], []
    for state in "sp":
        up, down, residual = problem.solve(state)
        arriving = abs(flux(problem.incident(state)[None])[0])
        reflected, transmitted = flux(up) / arriving, -flux(down) / arriving
        powers.append(reflected[leaves])
        amplitudes.append(problem.amplitudes(up)[leaves])
        balances.append(abs(reflected[leaves].sum() + transmitted.sum() - 1))
        residuals.append(residual)
    jones = np.stack(amplitudes, axis=-1)
    return Orders(jx.ravel()[leaves], jy.ravel()[leaves], *powers, jones, float(max(balances)), max(residuals))


def direction(theta_deg: float, phi_deg: float) -> np.ndarray:
    """Unit vector at the angle θ from +z, with the azimuth φ from +x."""
    theta, phi = np.radians([theta_deg, phi_deg])
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def flux(fields: np.ndarray) -> np.ndarray:
    """Twice the mean of Poynting's vector along z, for each row (ex, ey, hx, hy) of amplitudes."""
    ex, ey, hx, hy = fields.T
    return (ex * hy.conj() - ey * hx.conj()).real


class Problem:
    """The equations of one light on one relief: coefficients at the points, and inverses of the mean systems.

    Harmonics are numbered (jy, jx) in the order of the FFT, also flattened to one axis. The components of a field are
    ex, ey, hx, hy. Wave numbers are in rad/µm: `k` in vacuum, `k_above` in the medium of the light, `beta_above` and
    `beta_below` along z of a harmonic in both media, which must not be 0. The arguments are those of `solve`;
    `index_above` is its `above`.
    """

    def __init__(self, relief, wavelength_nm, theta_deg, phi_deg, index, resolution, index_above):
        self.resolution = resolution
        self.k = k = 2e3 * np.pi / wavelength_nm
        self.index_above = index_above
        self.k_above = index_above * k
        nx, ny = resolution.counts(relief.period)
        self.shape = (ny, nx)
        self.jx, self.jy = harmonics(nx), harmonics(ny)
        self.wi = direction(theta_deg, phi_deg)
        self.phi = np.radians(phi_deg)
        step_x, step_y = (2 * np.pi / length for length in relief.period)
        kx = self.jx[None, :] * step_x - self.k_above * self.wi[0]
        ky = self.jy[:, None] * step_y - self.k_above * self.wi[1]
        self.kx, self.ky = (np.broadcast_to(a, self.shape) for a in (kx, ky))
        tangential_squared = self.kx**2 + self.ky**2
        self.beta_above = np.sqrt(self.k_above**2 - tangential_squared + 0j)
        self.beta_below = np.sqrt((index * k) ** 2 - tangential_squared + 0j)
        sampled = relief.sampled(nx, ny)
        highest, lowest = sampled.heights.max(), -sampled.heights.min()
        height_below, height_above = (REACH * max(extreme, REACH_MIN_UM) for extreme in (lowest, highest))
        self.panels = panels(height_below, height_above, resolution.nodes)
        self._metric(sampled, index)
        self._invert()

    def _metric(self, relief: Relief, index: complex) -> None:
        """Zs, Zx, Zy and 1/c at the panels' Gauss points, `[point, iy, ix]`, and ε, `[point, 1, 1]`."""
        at = self.panels
        # 1 − |s|/a, and its derivative by s.
        fade = np.where(at.upper, 1 - at.points / at.above, 1 + at.points / at.below)[:, None, None]
        fade_s = np.where(at.upper, -1 / at.above, 1 / at.below)[:, None, None]
        slope_x, slope_y = relief.slopes()
        self.zs = 1 + relief.heights * fade_s
        self.zx, self.zy = slope_x * fade, slope_y * fade
        self.per_c = self.zs / (1 + self.zx**2 + self.zy**2)
        self.eps = np.where(at.upper, self.index_above**2, index**2 + 0j)[:, None, None]

    def _mean_operator(self) -> np.ndarray:
        """Matrices of ∂s (ex, ey, hx, hy) with mean coefficients, `[harmonic, point, row, column]`."""

        def mean(values):
            """Means over x and y, `[point, 1, 1]`."""
            return values.mean(axis=(1, 2))[:, None, None]

        k, kx, ky, eps = self.k, self.kx[None], self.ky[None], self.eps
        per_c = mean(self.per_c)
        along_x = mean(self.zs - self.zx**2 * self.per_c)
        along_y = mean(self.zs - self.zy**2 * self.per_c)
        across = mean(self.zx * self.zy * self.per_c)
        operator = np.zeros((self.panels.count, *self.shape, 4, 4), complex)
        # The module's equations with es, hs, D and B inserted. Rows and columns are ex, ey, hx, hy. The means of Zx/c
        # and Zy/c are left to GMRES.
        operator[..., 0, 2] = 1j * kx * per_c * ky / k / eps - 1j * k * across
        operator[..., 0, 3] = -1j * kx * per_c * kx / k / eps + 1j * k * along_y
        operator[..., 1, 2] = 1j * ky * per_c * ky / k / eps - 1j * k * along_x
        operator[..., 1, 3] = -1j * ky * per_c * kx / k / eps + 1j * k * across
        operator[..., 2, 0] = -1j * kx * per_c * ky / k + 1j * k * eps * across
        operator[..., 2, 1] = 1j * kx * per_c * kx / k - 1j * k * eps * along_y
        operator[..., 3, 0] = -1j * ky * per_c * ky / k + 1j * k * eps * along_x
        operator[..., 3, 1] = 1j * ky * per_c * kx / k - 1j * k * eps * across
        return operator.transpose(1, 2, 0, 3, 4).reshape(-1, self.panels.count, 4, 4)

    def _admittance(self, beta: np.ndarray) -> np.ndarray:
        """Matrices from (ex, ey) of plane waves to (hx, hy), `[harmonic, 2, 2]`; `beta` are wave numbers along z."""
        kx, ky, k = self.kx, self.ky, self.k
        rows = [[-ky * kx / beta, -(ky**2) / beta - beta], [beta + kx**2 / beta, kx * ky / beta]]
        return np.array(rows).transpose(2, 3, 0, 1).reshape(-1, 2, 2) / k

    def _invert(self) -> None:
        """Inverts each harmonic's mean system, whose unknowns are the fields at the nodes, 4·node + component.

        Rows are the equations at the points, outgoing waves above and below, and the continuity of all four components
        at s = 0. The parts of the inverses that are kept give fields from the sources at the points: `to_points` at the
        points, `to_top` and `to_bottom` at the ends. `from_light` gives the fields of harmonic (0, 0) at the nodes from
        the incident light, and `nodes_to_points` interpolates fields at the nodes to the points.
        """
        at: Panels = self.panels
        rows, unknowns = 4 * at.count, 8 * at.nodes
        self.mean_operator = self._mean_operator()
        self.admittance_above = self._admittance(self.beta_above)
        admittance_below = self._admittance(-self.beta_below)
        value, slope = (np.kron(matrix, np.eye(4)) for matrix in (at.value, at.slope))
        # Unknowns of the nodes at the ends, and of those on both sides of s = 0.
        bottom, top = slice(0, 4), slice(unknowns - 4, unknowns)
        under, over = slice(unknowns // 2 - 4, unknowns // 2), slice(unknowns // 2, unknowns // 2 + 4)
        count = len(self.mean_operator)
        self.to_points = np.empty((count, rows, rows), complex)
        self.to_top, self.to_bottom = (np.empty((count, 4, rows), complex) for _ in range(2))
        for first in range(0, count, CHUNK):
            chunk = slice(first, min(first + CHUNK, count))
            mean = self.mean_operator[chunk]
            system = np.zeros((len(mean), unknowns, unknowns), complex)
            # Axes are harmonic h, point p, row r and column c of the operator, and node n.
            at_nodes = np.einsum("hprc,pn->hprnc", mean, at.value)
            system[:, :rows] = slope - at_nodes.reshape(len(mean), rows, unknowns)
            for row, end, admittance in ((rows, top, self.admittance_above), (rows + 2, bottom, admittance_below)):
                # (hx, hy) of an outgoing wave minus the admittance times its (ex, ey) is 0.
                system[:, row : row + 2, end.start + 2 : end.stop] = np.eye(2)
                system[:, row : row + 2, end.start : end.start + 2] = -admittance[chunk]
            system[:, rows + 4 :, under], system[:, rows + 4 :, over] = np.eye(4), -np.eye(4)
            inverse = np.linalg.inv(system)
            self.to_points[chunk] = value @ inverse[:, :, :rows]
            self.to_top[chunk], self.to_bottom[chunk] = inverse[:, top, :rows], inverse[:, bottom, :rows]
            if first == 0:
                # The light drives the first harmonic, (0, 0), through the two rows of the upper end.
                self.from_light = inverse[0, :, rows : rows + 2]
        self.nodes_to_points = value

    def incident(self, state: str) -> np.ndarray:
        """ex, ey, hx, hy of s or p polarised light with unit E, at the upper end s = a."""
        s = np.array([np.sin(self.phi), -np.cos(self.phi), 0.0])
        towards = -self.wi
        electric = s if state == "s" else np.cross(towards, s)
        magnetic = self.index_above * np.cross(towards, electric)
        return np.array([electric[0], electric[1], magnetic[0], magnetic[1]], complex)

    def deviation(self, fields: np.ndarray) -> np.ndarray:
        """∂s of fields minus that with mean coefficients, at the points; both are `[harmonic, 4·point + component]`."""
        count, modes = self.panels.count, self.kx.size
        by_mode = fields.reshape(modes, count, 4)
        f = by_mode.transpose(1, 2, 0).reshape(count, 4, *self.shape)
        k, kx, ky = self.k, self.kx, self.ky
        # Fourier coefficients of ex, ey, hx, hy, D^s and B^s.
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
        mean = np.matmul(self.mean_operator, by_mode[..., None])[..., 0]
        return (whole - mean).reshape(modes, -1)

    def solve(self, state: str) -> tuple[np.ndarray, np.ndarray, float]:
        """Outgoing fields at the upper and the lower end, `[harmonic, component]`, and GMRES's residual.

        Fields are `direct`, by the light in the mean systems, plus `to_points` times the sources. The sources equal the
        `deviation` of these fields.
        """
        incident = self.incident(state)
        # The wave above, fields minus the incident light, is outgoing.
        at_nodes = self.from_light @ (incident[2:] - self.admittance_above[0] @ incident[:2])
        direct = np.zeros((self.kx.size, 4 * self.panels.count), complex)
        direct[0] = self.nodes_to_points @ at_nodes

        def apply(sources):
            """The sources minus the deviation of their fields."""
            sources = sources.reshape(direct.shape)
            fields = np.matmul(self.to_points, sources[..., None])[..., 0]
            return (sources - self.deviation(fields)).ravel()

        resolution = self.resolution
        sources, residual = gmres(apply, self.deviation(direct).ravel(), resolution.tolerance, resolution.steps_max)
        sources = sources.reshape(direct.shape)[..., None]
        top, bottom = (np.matmul(matrix, sources)[..., 0] for matrix in (self.to_top, self.to_bottom))
        top[0] += at_nodes[-4:] - incident
        bottom[0] += at_nodes[:4]
        return top, bottom, residual

    def amplitudes(self, up: np.ndarray) -> np.ndarray:
        """Amplitudes of s and p as in `Orders.jones`, `[harmonic, out]`, from the upper end's fields of `solve`."""
        kx, ky, beta = self.kx.ravel(), self.ky.ravel(), self.beta_above.ravel()
        tangential = np.hypot(kx, ky)
        is_normal = tangential < 1e-9 * self.k_above
        length = np.where(is_normal, 1, tangential)
        # Unit vector (x, y) along (kx, ky).
        x, y = np.where(is_normal, -np.cos(self.phi), kx / length), np.where(is_normal, -np.sin(self.phi), ky / length)
        # s = (−y, x, 0); the horizontal part of p = k × s is −(x, y) β/k.
        s = -y * up[:, 0] + x * up[:, 1]
        p = -(x * up[:, 0] + y * up[:, 1]) * self.k_above / beta
        # From s = a to the mean height, z = 0, for the order and for the light.
        phase = np.exp(-1j * (beta + self.k_above * self.wi[2]) * self.panels.above)
        # Squares of amplitudes are fluxes of power along z.
        weight = np.sqrt(beta / (self.k_above * self.wi[2]))
        return np.stack([s, p], axis=-1) * (weight * phase)[:, None]
