"""Values at pixel centres: Mitsuba traces a ray through each, and the plugin's BSDF is evaluated at its hit point.

There is no sampling and no filter, so both renderers must give equal values. A colour is the sum over the wavelengths
of `Quadrature`: Σ π f_r(wi, wo, λ) cos θo · weight(λ), where f_r is the BSDF in 1/sr. π is the sun's irradiance
(light.py), so a white diffuse plane facing the sun has colour 1.

The BSDF takes the direction to the camera as wi and the direction to the sun as wo, as in a path tracer. Both are unit
vectors in the shading frame of the skin, with z along the normal. θo is the angle of wo with the normal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ..light import Light
from ..scene import View
from .quadrature import Quadrature

# Number of wavelengths that Mitsuba's spectral variants evaluate at once.
WAVELENGTHS_PER_CALL = 4
# Largest angle between the normals of neighbouring pixels on one scale of the snake's skin; across a scale's rim the
# angle is larger. Larger limits would compare pixels across rims, smaller ones would compare fewer pixels.
SMOOTH_ANGLE_DEG = 12.0
# Largest difference between the distances to the camera of neighbouring pixels on one scale, relative to the distance.
# Larger and smaller limits act as for the angle. For the scene's camera it is about a tenth of the body's width.
SMOOTH_DISTANCE = 0.02


@dataclass(frozen=True)
class Points:
    """The points seen through the pixels' centres; arrays of shape (height, width), or (height, width, 3) for vectors.

    Directions are meaningful only where `seen` is set.
    """

    # Unit vectors to the camera and to the sun in the shading frame of the skin.
    to_camera: np.ndarray
    to_sun: np.ndarray
    # Whether the ray hits the skin.
    seen: np.ndarray
    # Whether the point faces the camera and the sun, and the snake does not block the sun.
    lit: np.ndarray
    # Whether the point and its 8 neighbours are lit and on one smooth piece of the surface. Only these points are
    # compared: at an edge, rounding decides which surface a ray hits. Pixels at the picture's border are excluded.
    comparable: np.ndarray


class _Hits(NamedTuple):
    """Results of camera rays: Mitsuba's arrays, Python scalars in a scalar variant, or NumPy arrays of pixels."""

    # Whether the ray hits the skin.
    seen: object
    # Distance along the ray in cm; infinite for a miss.
    distance: object
    # Unit vectors to the camera and to the sun in the shading frame.
    to_camera: object
    to_sun: object
    # Shading normal in the scene's frame.
    normal: object
    # Whether the snake blocks the sun.
    shadowed: object


def trace_points(scene: mi.Scene, light: Light, view: View) -> Points:
    """Traces a ray through the centre of each pixel of `view`, and from its hit point a shadow ray to the sun.

    The scene must hold the skin alone. Its camera must have the position, field of view and proportions of `view`; its
    resolution may differ.
    """
    rows, columns = np.mgrid[: view.height, : view.width]
    x, y = (columns.ravel() + 0.5) / view.width, (rows.ravel() + 0.5) / view.height
    if mi.variant().startswith("scalar"):
        by_ray = [_trace(scene, light, mi.Point2f(*film_point)) for film_point in zip(x.tolist(), y.tolist())]
        arrays = [np.array([np.array(value) for value in values]) for values in zip(*by_ray)]
    else:
        film_points = mi.Point2f(x.astype(np.float32), y.astype(np.float32))
        # Dr.Jit's arrays of vectors have the components first.
        arrays = [np.array(value).T for value in _trace(scene, light, film_points)]
    hits = _Hits(*(array.reshape(view.height, view.width, *array.shape[1:]) for array in arrays))
    lit = hits.seen & ~hits.shadowed & (hits.to_camera[..., 2] > 0) & (hits.to_sun[..., 2] > 0)
    comparable = _eroded(lit) & _is_smooth(hits.seen, hits.distance, hits.normal)
    return Points(hits.to_camera, hits.to_sun, hits.seen, lit, comparable)


def _trace(scene: mi.Scene, light: Light, film_point: mi.Point2f) -> _Hits:
    """Traces rays through points of the film, in [0, 1]² from its top left corner, and from their hits to the sun."""
    # Time, sample of the wavelength, position on the film, sample of the aperture.
    ray, _ = scene.sensors()[0].sample_ray(0.0, 0.5, film_point, mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    to_sun = mi.Vector3f(*light.to_sun().tolist())
    shadowed = scene.ray_test(si.spawn_ray(to_sun), si.is_valid())
    return _Hits(si.is_valid(), si.t, si.wi, si.to_local(to_sun), si.sh_frame.n, shadowed)


def _windows(values: np.ndarray) -> np.ndarray:
    """The 3 × 3 neighbourhoods of all pixels except the outermost.

    Maps (height, width, …) to (height − 2, width − 2, …, 3, 3).
    """
    return np.lib.stride_tricks.sliding_window_view(values, (3, 3), axis=(0, 1))


def _eroded(mask: np.ndarray) -> np.ndarray:
    """The pixels whose whole 3 × 3 neighbourhood is set."""
    out = np.zeros_like(mask)
    out[1:-1, 1:-1] = _windows(mask).all(axis=(-2, -1))
    return out


def _is_smooth(seen: np.ndarray, distance: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The pixels whose 3 × 3 neighbourhood lies on one smooth piece of the surface."""
    centre = normal[1:-1, 1:-1, :, None, None]
    # Axis 2 has the components of the normals.
    smallest_cosine = (_windows(normal) * centre).sum(axis=2).min(axis=(-2, -1))
    is_bent = smallest_cosine < math.cos(math.radians(SMOOTH_ANGLE_DEG))
    # A miss has an infinite distance. Any finite value avoids ∞ − ∞; the pixel is excluded in any case.
    finite = np.where(np.isfinite(distance), distance, 1e9)
    is_stepped = np.ptp(_windows(finite), axis=(-2, -1)) > SMOOTH_DISTANCE * finite[1:-1, 1:-1]
    out = _eroded(seen)
    out[1:-1, 1:-1] &= ~is_bent & ~is_stepped
    return out


def radiance(bsdf: mi.BSDF, points: Points, quadrature: Quadrature) -> np.ndarray:
    """Linear sRGB, (height, width, 3), of the lit points, black elsewhere. Requires a spectral variant."""
    wi, wo = points.to_camera[points.lit], points.to_sun[points.lit]
    all_nm = quadrature.wavelengths_nm
    colour = np.zeros((len(wi), 3))
    for first in range(0, len(all_nm), WAVELENGTHS_PER_CALL):
        nm = all_nm[first : first + WAVELENGTHS_PER_CALL]
        # `resize` fills the last batch by repetition; the values of the repeated wavelengths are dropped.
        values = _values(bsdf, wi, wo, np.resize(nm, WAVELENGTHS_PER_CALL))[:, : len(nm)]
        colour += math.pi * values @ quadrature.weights[first : first + WAVELENGTHS_PER_CALL]
    return _picture(points, colour)


def colours(bsdf: mi.BSDF, points: Points) -> np.ndarray:
    """Linear sRGB as from `radiance`, in an RGB variant, whose BSDF has integrated over the spectrum already."""
    wi, wo = points.to_camera[points.lit], points.to_sun[points.lit]
    return _picture(points, math.pi * _values(bsdf, wi, wo, np.empty(0)))


def _picture(points: Points, colour: np.ndarray) -> np.ndarray:
    """A black picture with the colours, (lit points, 3), at the pixels of the lit points."""
    picture = np.zeros((*points.lit.shape, 3))
    picture[points.lit] = colour
    return picture


def _values(bsdf: mi.BSDF, wi: np.ndarray, wo: np.ndarray, nm: np.ndarray) -> np.ndarray:
    """f_r times the cosine of wo, for pairs of unit vectors `wi` and `wo`, both of shape (points, 3).

    In a spectral variant `nm` has four wavelengths, and the result has the shape (points, 4). In an RGB variant `nm` is
    empty, and the result has the shape (points, 3): red, green and blue.
    """
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


def mirrored(points: Points, rotation_deg: float) -> Points:
    """The points with both directions mirrored at the plane x = 0 of a relief with this rotation: a negative control.

    The sign of u changes, the x component of wi + wo, as if the relief were h(−x, y).
    """
    angle = math.radians(rotation_deg)
    # The relief's x axis in the shading frame.
    x_axis = np.array([math.cos(angle), math.sin(angle), 0.0])

    def reflected(directions: np.ndarray) -> np.ndarray:
        """Unit vectors (height, width, 3) with the sign of their component along the relief's x axis changed."""
        return (directions - 2 * (directions @ x_axis)[..., None] * x_axis).astype(directions.dtype)

    return replace(points, to_camera=reflected(points.to_camera), to_sun=reflected(points.to_sun))
