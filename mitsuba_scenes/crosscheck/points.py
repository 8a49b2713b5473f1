"""Values at pixel centres: Mitsuba traces a ray through each, and the plugin's BSDF is evaluated at its hit point.

There is no sampling and no filter, so both renderers must give equal values. A colour is the sum over the wavelengths
of `Quadrature`: Σ π f_r(wi, wo, λ) cos θo · weight(λ). A white diffuse plane facing the sun has colour 1.
The camera's direction is passed as wi and the sun's as wo, as a path tracer does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi
import numpy as np

from ..light import Light
from ..scene import View
from .quadrature import Quadrature

# Number of wavelengths that Mitsuba's spectral variants evaluate at once.
CARRIED = 4
# Largest angle between the normals of neighbouring pixels on one scale of the snake; across a scale's rim it is larger.
SMOOTH_DEG = 12.0
# Largest difference of the ray lengths of neighbouring pixels on one scale, relative to the length; about a tenth of
# the body's width.
SMOOTH_DISTANCE = 0.02


@dataclass(frozen=True)
class Points:
    """The points seen through the pixels' centres; arrays of shape (height, width, …)."""

    # Directions to the camera and to the sun in the shading frame of the skin.
    to_camera: np.ndarray
    to_sun: np.ndarray
    # Whether the ray meets the skin.
    seen: np.ndarray
    # Whether the point faces the camera and the sun and is not in shadow.
    lit: np.ndarray
    # Whether the point and its 8 neighbours are lit and on one smooth piece of the surface. Only these are compared: at
    # an edge, rounding decides which surface a ray meets.
    inside: np.ndarray


def points(scene: mi.Scene, light: Light, view: View) -> Points:
    """Traces a ray through the centre of each pixel, and from its hit point a shadow ray to the sun."""
    rows, columns = np.mgrid[: view.height, : view.width]
    x, y = (columns.ravel() + 0.5) / view.width, (rows.ravel() + 0.5) / view.height
    shape = (view.height, view.width)
    if mi.variant().startswith("scalar"):
        found = [_hit(scene, light, mi.Point2f(a, b)) for a, b in zip(x.tolist(), y.tolist())]
        found = [np.array([np.array(hit[i]) for hit in found]) for i in range(6)]
    else:
        film_point = mi.Point2f(x.astype(np.float32), y.astype(np.float32))
        found = [np.array(value).T for value in _hit(scene, light, film_point)]
    valid, distance, to_camera, to_sun, normal, shadowed = (f.reshape(shape + f.shape[1:]) for f in found)
    lit = valid & ~shadowed & (to_camera[..., 2] > 0) & (to_sun[..., 2] > 0)
    return Points(to_camera, to_sun, valid, lit, _eroded(lit) & _is_smooth(valid, distance, normal))


def _hit(scene: mi.Scene, light: Light, film_point: mi.Point2f) -> tuple:
    """Data of one ray: hit or not, distance, local directions to camera and sun, normal, shadowed or not."""
    ray, _ = scene.sensors()[0].sample_ray(0.0, 0.5, film_point, mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    to_sun = mi.Vector3f(*light.to_sun().tolist())
    shadowed = scene.ray_test(si.spawn_ray(to_sun), si.is_valid())
    return si.is_valid(), si.t, si.wi, si.to_local(to_sun), si.sh_frame.n, shadowed


def _windows(values: np.ndarray) -> np.ndarray:
    """The 3 × 3 neighbourhoods of all pixels except the outermost, (height − 2, width − 2, …, 3, 3)."""
    return np.lib.stride_tricks.sliding_window_view(values, (3, 3), axis=(0, 1))


def _eroded(mask: np.ndarray) -> np.ndarray:
    """The pixels whose whole 3 × 3 neighbourhood is set."""
    out = np.zeros_like(mask)
    out[1:-1, 1:-1] = _windows(mask).all(axis=(-2, -1))
    return out


def _is_smooth(valid: np.ndarray, distance: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The pixels whose 3 × 3 neighbourhood lies on one smooth piece of the surface."""
    valid = _eroded(valid)
    centre = normal[1:-1, 1:-1, :, None, None]
    turned = (_windows(normal) * centre).sum(axis=2).min(axis=(-2, -1)) < math.cos(math.radians(SMOOTH_DEG))
    far = np.where(np.isfinite(distance), distance, 1e9)
    stepped = np.ptp(_windows(far), axis=(-2, -1)) > SMOOTH_DISTANCE * far[1:-1, 1:-1]
    out = valid.copy()
    out[1:-1, 1:-1] &= ~turned & ~stepped
    return out


def radiance(bsdf: mi.BSDF, at: Points, quadrature: Quadrature) -> np.ndarray:
    """Linear sRGB, (height, width, 3), of the lit points, black elsewhere. Requires a spectral variant."""
    wi, wo = at.to_camera[at.lit], at.to_sun[at.lit]
    nm = quadrature.wavelengths_nm
    colour = np.zeros((len(wi), 3))
    for first in range(0, len(nm), CARRIED):
        carried = nm[first : first + CARRIED]
        # The last batch is padded by repetition, and the padding is dropped.
        values = _values(bsdf, wi, wo, np.resize(carried, CARRIED))[:, : len(carried)]
        colour += math.pi * values @ quadrature.weights[first : first + CARRIED]
    return _picture(at, colour)


def colours(bsdf: mi.BSDF, at: Points) -> np.ndarray:
    """Linear sRGB as from `radiance`, by an RGB variant, whose BSDF integrates over the spectrum itself."""
    return _picture(at, math.pi * _values(bsdf, at.to_camera[at.lit], at.to_sun[at.lit], np.empty(0)))


def _picture(at: Points, colour: np.ndarray) -> np.ndarray:
    """A black picture with the colours, (lit points, 3), at the pixels of the lit points."""
    picture = np.zeros((*at.lit.shape, 3))
    picture[at.lit] = colour
    return picture


def _values(bsdf: mi.BSDF, wi: np.ndarray, wo: np.ndarray, nm: np.ndarray) -> np.ndarray:
    """f_r times the cosine of wo, (points, wavelengths), or (points, channels) without wavelengths."""
    ctx = mi.BSDFContext()
    if mi.variant().startswith("scalar"):
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wavelengths = nm.tolist()
        values = []
        for i, o in zip(wi.tolist(), wo.tolist()):
            si.wi = i
            values.append(np.array(bsdf.eval(ctx, si, o)))
        return np.array(values)
    si = dr.zeros(mi.SurfaceInteraction3f, len(wi))
    si.wi = mi.Vector3f(np.ascontiguousarray(wi.T))
    if len(nm):
        # Arrays instead of literals, so that all wavelengths share one kernel.
        si.wavelengths = [mi.Float(np.full(len(wi), value, dtype=np.float32)) for value in nm]
    return np.array(bsdf.eval(ctx, si, mi.Vector3f(np.ascontiguousarray(wo.T)))).T


def mirrored(at: Points, rotation_deg: float) -> Points:
    """The points with directions mirrored at x = 0 of a relief with this rotation, as if it were h(−x, y).

    The scattering vector's u changes its sign: a negative control.
    """
    angle = math.radians(rotation_deg)
    x = np.array([math.cos(angle), math.sin(angle), 0.0])

    def turned(directions: np.ndarray) -> np.ndarray:
        return (directions - 2 * (directions @ x)[..., None] * x).astype(directions.dtype)

    return replace(at, to_camera=turned(at.to_camera), to_sun=turned(at.to_sun))
