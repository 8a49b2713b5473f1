"""Light on a slightly rough interface, from Maxwell's boundary conditions to first order in the height (Rice 1951).

The method is independent of the tested closed forms. The tangential fields of both sides are equated on the surface
and expanded about the plane z = 0; the outgoing waves follow. Fields are proportional to exp(-iωt).

Air lies above; the medium below has the refractive index n, which may be complex. k0 is the wave number in vacuum. Wave
vectors k have the direction of travel and are in units of k0; `flat` is their tangential part (kx, ky). Fields are
pairs (e, h) of vectors. The state s has e along z × k, and p along k × s, so no wave may travel along the normal.
"""

import numpy as np


def states(k, n):
    """Fields (e, h) of s and of p, for plane waves `k[..., 3]` in a medium of index n.

    For real k the vectors e have length 1. The impedance of free space is 1.
    """
    length = np.linalg.norm(k[..., :2].real, axis=-1)
    s = np.stack([-k[..., 1], k[..., 0], np.zeros_like(length)], -1) / length[..., None]
    p = np.cross(k, s) / n
    return [(e, np.cross(k, e)) for e in (s, p)]


def wave(flat, n, sign):
    """The wave vector in a medium of index n that leaves upwards (`sign` 1) or downwards (−1), as complex numbers."""
    return np.concatenate([flat, sign * np.sqrt(n * n - (flat**2).sum(-1, keepdims=True) + 0j)], -1)


def tangential(fields):
    """Tangential components (ex, ey, hx, hy) of fields, `[..., 4]`."""
    return np.concatenate([fields[0][..., :2], fields[1][..., :2]], -1)


def outgoing(flat, n, jump):
    """Outgoing waves whose tangential fields above the plane minus those below equal `jump[..., 4]`.

    Returns the amplitudes `[..., 4]` of reflected s and p and transmitted s and p, and the four waves (fields, k) of
    amplitude 1. The transmitted waves are below the plane, so their fields, not their amplitudes, are negated.
    """
    up, down = wave(flat, 1.0, 1), wave(flat, n, -1)
    waves = [(f, up) for f in states(up, 1.0)] + [((-e, -h), down) for e, h in states(down, n)]
    matrix = np.stack([tangential(f) for f, _ in waves], -1)
    return np.linalg.solve(matrix, jump[..., None])[..., 0], waves


def first_order(wi, wo, n):
    """Jones matrices `[..., out, in]` of s and p, divided by k0·a, for reflection by a relief a·exp(iK·x).

    Unit vectors `wi` to the light and `wo` to the viewer, `[..., 3]`, are above the surface; K is k0·(wi + wo) in x and
    y. A squared magnitude is the outgoing power over the incident power.
    """
    wi, wo = np.asarray(wi, float), np.asarray(wo, float)
    start, end = -wi[..., :2], wo[..., :2]
    down = wave(start, 1.0, -1)
    # K over k0.
    relief_k = end - start

    def change(fields, k):
        """Change of a wave's tangential field from the plane to the surface z = ζ, to first order in ζ, over k0·ζ.

        It is ∂z of the field, and the slope of ζ times the normal component. The slope of exp(iK·x) is iK.
        """
        e, h = fields
        slope = np.concatenate([relief_k * e[..., 2:], relief_k * h[..., 2:]], -1)
        return 1j * (k[..., 2:] * tangential(fields) + slope)

    columns = []
    for arriving in states(down, 1.0):
        # Waves at a plane surface: the tangential fields of both sides are equal.
        amplitudes, waves = outgoing(start, n, -tangential(arriving))
        # Waves of first order leave along `end`. Their jump cancels the change of all waves at the plane.
        jump = 0 - change(arriving, down)
        for i, (fields, k) in enumerate(waves):
            jump = jump - change(fields, k) * amplitudes[..., i, None]
        reflected = outgoing(end, n, jump)[0][..., :2]
        columns.append(reflected)
    # Power per area of the surface: squared amplitude times the cosine with the normal.
    return np.stack(columns, -1) * np.sqrt(wo[..., 2] / wi[..., 2])[..., None, None]


def fresnel(cos, n):
    """Jones matrices `[..., out, in]` of reflection by the plane, for the cosines `cos` of incidence in air."""
    inside = np.sqrt(n * n - 1 + cos**2 + 0j)
    s, p = (cos - inside) / (cos + inside), (n * n * cos - inside) / (n * n * cos + inside)
    return np.stack([np.stack([s, 0 * s], -1), np.stack([0 * p, p], -1)], -2)


def mueller(jones):
    """Mueller matrices `[..., 4, 4]` of Jones matrices between fields (x, y), such as (s, p).

    The Stokes components are |x|² + |y|², |x|² − |y|², 2 Re(x y*) and 2 Im(x y*).
    """
    pauli = np.array([[[1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, 1j], [-1j, 0]]])
    return 0.5 * np.einsum("iab,...bc,jcd,...ad->...ij", pauli, jones, pauli, jones.conj()).real
