"""Order efficiencies of a perfectly conducting grating by boundary integral equations of the second kind.

The field u is E in TE and H in TM, along the grooves; u_inc is the incident one, and n the normal into the air. In TE u
is 0 on the metal, and ψ = ∂u/∂n obeys ψ/2 + K'ψ = ∂u_inc/∂n. In TM ∂u/∂n is 0 on the metal, and u/2 − Ku = u_inc. K
and K' are the double layer potential of the quasi-periodic Green's function (green.py) and its adjoint. The equations
are discretised by Nyström's method on the nodes of the profile. Kernels are smooth except for r² ln r in the distance
r, so the error falls as the cube of the distance between nodes. α and β are the x and z components of orders' wave
vectors. An order of amplitude A has the fraction |A|² β/β_0 of the power. Lengths are in µm, wave numbers in rad/µm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .green import Lattice
from .profile import Polygon, Sinusoid

# Smallest accepted cosine of an order, chosen. The Green's function has a pole where an order grazes the surface.
GRAZING_COSINE = 1e-5


@dataclass(frozen=True)
class Resolution:
    """Numbers of nodes and of evanescent orders. The defaults are chosen; results of a `finer` one show their error."""

    # Nodes for each wavelength of arc.
    nodes_per_wavelength: float = 14
    # Smallest numbers of nodes, in all and for each corner.
    nodes_min: int = 120
    nodes_per_corner: int = 60
    # Evanescent orders of the Green's function to either side.
    evanescent: int = 80

    def finer(self, factor: float) -> Resolution:
        """The resolution with all numbers multiplied by a factor."""
        counts = (self.nodes_min, self.nodes_per_corner, self.evanescent)
        return Resolution(self.nodes_per_wavelength * factor, *(round(count * factor) for count in counts))


@dataclass(frozen=True)
class Efficiencies:
    """Indices of the propagating orders, cosines of their angles, and fractions of the power in TE and in TM."""

    orders: np.ndarray
    cosines: np.ndarray
    te: np.ndarray
    tm: np.ndarray

    @property
    def unpolarised(self) -> np.ndarray:
        """Fractions of the power for unpolarised light."""
        return 0.5 * (self.te + self.tm)

    @property
    def imbalance(self) -> float:
        """Deviation of the sum of the orders from 1, the larger of both polarisations."""
        return float(max(abs(self.te.sum() - 1), abs(self.tm.sum() - 1)))


def solve(
    profile: Sinusoid | Polygon, wavelength_nm: float, theta_i_deg: float, resolution: Resolution = Resolution()
) -> Efficiencies:
    """Efficiencies of all propagating orders, for light from above and, at a positive angle, from +x.

    Raises ValueError if an order grazes the surface.
    """
    k = 2e3 * np.pi / wavelength_nm
    alpha0, beta0 = -k * np.sin(np.radians(theta_i_deg)), k * np.cos(np.radians(theta_i_deg))
    # Upper bound of |m| for orders m that propagate: |α_0 + 2πm/period| < k, and |α_0| ≤ k.
    order_max = int(2 * k * profile.period / (2 * np.pi)) + 1
    lattice = Lattice(profile.period, k, alpha0, order_max + resolution.evanescent)
    if np.abs(lattice.beta).min() < GRAZING_COSINE * k:
        raise ValueError(f"an order grazes the surface at {wavelength_nm} nm and {theta_i_deg} degrees")

    # Length of the profile's arc, for which 64 nodes suffice.
    arc = profile.nodes(64).weight.sum()
    corners = len(profile.corners) if isinstance(profile, Polygon) else 0
    nodes_min = max(resolution.nodes_min, resolution.nodes_per_corner * corners)
    nodes = profile.nodes(max(nodes_min, int(resolution.nodes_per_wavelength * arc * k / (2 * np.pi))))
    along_x, along_z = off_diagonal(lattice, nodes.x[:, None] - nodes.x, nodes.z[:, None] - nodes.z)
    # Kernels of K and K', [point, source]: the gradient along the normal at the source and at the point.
    double_layer = -(nodes.normal_x * along_x + nodes.normal_z * along_z)
    adjoint = nodes.normal_x[:, None] * along_x + nodes.normal_z[:, None] * along_z
    # Limits at the source: curvature/4π from its own field, and the x gradient of the field of its periodic images.
    np.fill_diagonal(double_layer, nodes.curvature / (4 * np.pi) - nodes.normal_x * lattice.self_term())
    np.fill_diagonal(adjoint, nodes.curvature / (4 * np.pi) + nodes.normal_x * lattice.self_term())

    incident = np.exp(1j * (alpha0 * nodes.x - beta0 * nodes.z))
    incident_flux = 1j * (nodes.normal_x * alpha0 - nodes.normal_z * beta0) * incident
    half = 0.5 * np.eye(len(nodes.x))
    # TE: ψ times the nodes' weights (arc in µm), which stays finite at corners. TM: u.
    weighted_flux = np.linalg.solve(half + nodes.weight[:, None] * adjoint, nodes.weight * incident_flux)
    field = np.linalg.solve(half - double_layer * nodes.weight, incident)

    propagates = lattice.beta.imag == 0
    alpha, beta = lattice.alpha[propagates], lattice.beta[propagates].real
    # Amplitudes of the orders in TE and TM, from the Green's function at large z.
    outgoing = np.exp(-1j * (np.outer(alpha, nodes.x) + np.outer(beta, nodes.z)))
    te = outgoing @ weighted_flux / (2j * profile.period * beta)
    along_normal = np.outer(alpha, nodes.normal_x) + np.outer(beta, nodes.normal_z)
    tm = (along_normal * outgoing) @ (field * nodes.weight) / (2 * profile.period * beta)
    flow = beta / beta0
    return Efficiencies(lattice.orders[propagates], beta / k, flow * np.abs(te) ** 2, flow * np.abs(tm) ** 2)


def off_diagonal(lattice: Lattice, x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """The Green's function's gradient, (2, n, n), for every pair of different nodes; the diagonal is 0.

    `x` and `z` are the differences of the nodes' positions, (n, n).
    """
    rows, columns = np.triu_indices(len(x), 1)
    result = np.zeros((2, *x.shape), complex)
    # The gradients at (x, z) and at (−x, −z): those of a pair and of the reversed pair.
    there, back = lattice.gradient(x[rows, columns], z[rows, columns])
    result[:, rows, columns], result[:, columns, rows] = there, back
    return result
