"""Mueller matrices of Mitsuba's BSDFs, and their frames of reference.

Arrays `wi` and `wo` have the shape (pairs, 3). Vectors `forward` are directions of travel. A frame of reference is
given by its first axis, a unit vector across the direction of travel.
"""

import drjit as dr
import mitsuba as mi
import numpy as np
from batches import interactions, is_scalar, one_by_one, random_directions

# Wavelengths of every pair in nm, as many as a path carries in Mitsuba.
WAVELENGTHS = [450.0, 520.0, 590.0, 660.0]
# Largest error of a matrix element relative to the first. Chosen: single precision, with rotations of frames.
ROUNDING = 3e-5
# Largest error between two formulas of one quantity, in which different digits cancel.
FORMULA = 5e-4


def elements(spectrum):
    """A Mueller spectrum as an array `[channel, ..., row, column]`."""
    # One kernel computes all elements.
    dr.eval(spectrum)
    rows = [[np.array(spectrum[i, j]) for j in range(4)] for i in range(4)]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1)).astype(float)


def evaluated(bsdf, wi, wo, mode=None):
    """Mueller matrices `[pair, channel, row, column]` for light from `wo` to `wi`, times the cosine of `wo`.

    This is Mitsuba's default mode, Radiance.
    In the `mode` TransportMode.Importance, the light goes from `wi` to `wo`.
    """
    ctx = mi.BSDFContext() if mode is None else mi.BSDFContext(mode)
    nm = np.broadcast_to(np.float32(WAVELENGTHS), (len(wi), 4))
    if is_scalar():
        return np.array([elements(bsdf.eval(ctx, si, o)) for si, o in zip(one_by_one(wi, nm), wo.tolist())])
    found = elements(bsdf.eval(ctx, interactions(wi, nm), mi.Vector3f(np.ascontiguousarray(wo.T))))
    return np.moveaxis(found, 0, 1)


def mirrored(bsdf, wi):
    """Mueller matrices `[pair, channel, row, column]` of a smooth mirror's sample."""
    ctx, nm = mi.BSDFContext(), np.broadcast_to(np.float32(WAVELENGTHS), (len(wi), 4))
    if is_scalar():
        return np.array([elements(bsdf.sample(ctx, si, 0.5, [0.5, 0.5])[1]) for si in one_by_one(wi, nm)])
    return np.moveaxis(elements(bsdf.sample(ctx, interactions(wi, nm), 0.5, mi.Point2f(0.5, 0.5))[1]), 0, 1)


def normalised(matrices):
    """Matrices over their first element, which is the value for unpolarised light."""
    return matrices / matrices[..., :1, :1]


def basis(forward):
    """First axis of Mitsuba's frame of reference for light that travels along `forward[..., 3]`.

    The formula is that of Duff et al., JCGT 6(1), 2017.
    """
    x, y, z = np.moveaxis(np.asarray(forward, float), -1, 0)
    sign = np.where(z >= 0, 1.0, -1.0)
    a = -1 / (sign + z)
    return np.stack([1 + sign * x * x * a, sign * x * y * a, -sign * x], -1)


def turned(forward, start, end):
    """Matrices that rotate Stokes vectors of light along `forward` from the frame `start` to the frame `end`."""
    angle = np.arctan2((forward * np.cross(start, end)).sum(-1), (start * end).sum(-1))
    c, s, zero, one = np.cos(2 * angle), np.sin(2 * angle), 0 * angle, 1 + 0 * angle
    rows = [[one, zero, zero, zero], [zero, c, s, zero], [zero, -s, c, zero], [zero, zero, zero, one]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def between_states(matrices, source, target):
    """Matrices `[pair, channel, row, column]` for light from `source` to `target`, in the frames of s and p.

    `matrices` are in Mitsuba's frames. `source` and `target` point away from the surface, but not along the normal. s
    is along z × k, where k is the direction of travel.
    """
    across = [np.stack([-k[:, 1], k[:, 0], 0 * k[:, 0]], -1) for k in (-source, target)]
    s = [v / np.linalg.norm(v, axis=-1, keepdims=True) for v in across]
    into, out = turned(-source, basis(-source), s[0]), turned(target, basis(target), s[1])
    return out[:, None] @ matrices @ np.swapaxes(into, -1, -2)[:, None]


def pairs(count, seed=5, lowest=0.02):
    """`count` random pairs of directions `[wi, wo]` whose cosines with the normal exceed `lowest`."""
    rng = np.random.default_rng(seed)
    # Twice the count, of which at most half are left out for `lowest` up to 0.2.
    both = [random_directions(rng, 2 * count) for _ in range(2)]
    kept = np.minimum(both[0][:, 2], both[1][:, 2]) > lowest
    return [w[kept][:count] for w in both]


def coherency(matrices):
    """Hermitian coherency matrices; mixtures of Jones matrices have non-negative eigenvalues (Cloude 1986)."""
    pauli = np.array([[[1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, 1j], [-1j, 0]]])
    kron = np.einsum("iab,jcd->ijacbd", pauli, pauli.conj()).reshape(4, 4, 4, 4)
    return 0.25 * np.einsum("...ij,ijab->...ab", matrices, kron)


def reversed_path(matrices, wi, wo):
    """Matrices for light from `wi` to `wo`, by reciprocity from those for `wo` to `wi`, in Mitsuba's frames."""
    # Reversal of the path transposes a matrix and changes the sign of the third Stokes component.
    flip = np.diag([1.0, 1.0, -1.0, 1.0])
    backwards = flip @ np.swapaxes(matrices, -1, -2) @ flip
    # Rotations from Mitsuba's frames of light from `wi` to `wo` to those of the reversed light. The transpose of a
    # rotation is its inverse.
    into, out = turned(-wi, basis(-wi), basis(wi)), turned(wo, basis(wo), basis(-wo))
    return np.swapaxes(out, -1, -2)[:, None] @ backwards @ into[:, None]
