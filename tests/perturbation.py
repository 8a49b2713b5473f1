"""Light on a slightly rough interface, from Maxwell's boundary conditions to first order in the height (Rice 1951).

The method is independent of the tested closed forms. The tangential fields of both sides are equated on the surface
and expanded about the plane; the outgoing waves follow. Fields are proportional to exp(-iωt).

The medium below has the refractive index n. Wave vectors k are over the wave number in vacuum, and `flat` is their
tangential part (kx, ky). Directions `wi` and `wo` point away from the surface. Fields are pairs (e, h) of vectors.
"""

import numpy as np


def states(k, n):
    """Fields (e, h) of s and p for plane waves `k[..., 3]` in a medium of index n; the impedance of free space is 1."""
    length = np.linalg.norm(k[..., :2].real, axis=-1)
    s = np.stack([-k[..., 1], k[..., 0], np.zeros_like(length)], -1) / length[..., None]
    p = np.cross(k, s) / n
    return [(e, np.cross(k, e)) for e in (s, p)]


def wave(flat, n, sign):
    """The wave vector in a medium of index n that leaves upwards (`sign` 1) or downwards (−1)."""
    return np.concatenate([flat, sign * np.sqrt(n * n - (flat**2).sum(-1, keepdims=True) + 0j)], -1)


def tangential(fields):
    """Tangential components (ex, ey, hx, hy) of fields, `[..., 4]`."""
    return np.concatenate([fields[0][..., :2], fields[1][..., :2]], -1)


def outgoing(flat, n, jump):
    """Amplitudes of reflected and transmitted s and p waves with the given jump of tangential fields, and these waves.

    A jump is the field above the surface minus that below, so transmitted waves are returned with their signs reversed.
    """
    up, down = wave(flat, 1.0, 1), wave(flat, n, -1)
    waves = [(f, up) for f in states(up, 1.0)] + [((-e, -h), down) for e, h in states(down, n)]
    matrix = np.stack([tangential(f) for f, _ in waves], -1)
    return np.linalg.solve(matrix, jump[..., None])[..., 0], waves


def first_order(wi, wo, n):
    """Jones matrices `[..., out, in]` of s and p, divided by ka, of a relief a·exp(iK·x) between `wi` and `wo`.

    Squared elements are powers. With k the direction of travel, s is z × k and p is k × s, so no direction may be the
    normal.
    """
    wi, wo = np.asarray(wi, float), np.asarray(wo, float)
    start, end = -wi[..., :2], wo[..., :2]
    down = wave(start, 1.0, -1)
    columns = []
    for arriving in states(down, 1.0):
        amplitudes, waves = outgoing(start, n, -tangential(arriving))
        # Change of the tangential field from the plane to the surface z = ζ, to first order in ζ: ζ ∂z of the field,
        # and the slope of ζ times its normal component. The slope of exp(iK·x) is i K with K = end − start. The waves
        # of first order cancel this change.
        jump = 0
        for (e, h), k, amplitude in [(arriving, down, np.ones_like(start[..., 0]))] + [
            (fields, k, amplitudes[..., i]) for i, (fields, k) in enumerate(waves)
        ]:
            slope = np.concatenate([(end - start) * e[..., 2:], (end - start) * h[..., 2:]], -1)
            jump = jump - 1j * (k[..., 2:] * tangential((e, h)) + slope) * amplitude[..., None]
        columns.append(outgoing(end, n, jump)[0][..., :2])
    return np.stack(columns, -1) * np.sqrt(wo[..., 2] / wi[..., 2])[..., None, None]


def fresnel(cos, n):
    """Jones matrices of a plane mirror, in the states of s and p."""
    inside = np.sqrt(n * n - 1 + cos**2 + 0j)
    s, p = (cos - inside) / (cos + inside), (n * n * cos - inside) / (n * n * cos + inside)
    return np.stack([np.stack([s, 0 * s], -1), np.stack([0 * p, p], -1)], -2)


def mueller(jones):
    """Mueller matrices `[..., 4, 4]` of Jones matrices, where the fourth Stokes component is 2 Im(x y*)."""
    pauli = np.array([[[1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, 1j], [-1j, 0]]])
    return 0.5 * np.einsum("iab,...bc,jcd,...ad->...ij", pauli, jones, pauli, jones.conj()).real
