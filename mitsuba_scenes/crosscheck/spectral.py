"""Renders by Mitsuba with a film whose spectral bands reproduce the realtime renderer's quadrature.

The quadrature (quadrature.py) is a weighted sum over discrete wavelengths λᵢ of spacing Δ; a path tracer samples λ
continuously. A *band* is a channel of the film with a response over the wavelength. Each λᵢ therefore becomes a
triangle of half width Δ and height 1. A band's response is a weighted sum of these triangles, so it is linear between
the λᵢ.
"""

from __future__ import annotations

import math

import mitsuba as mi
import numpy as np

from ..light import Light
from ..scene import View
from ..snake import SnakeFiles
from .cases import bare_scene
from .quadrature import Quadrature

# Nodes of the numerical integral of D65 over a triangle. With this number its relative error is about 1e-6.
NODES_PER_TRIANGLE = 101


def film(view: View, quadrature: Quadrature) -> dict:
    """A `specfilm` with the bands of `_responses`."""
    step, nm = quadrature.step_nm, quadrature.wavelengths_nm
    # The outermost triangles end one step beyond the first and the last wavelength.
    nodes = [nm[0] - step, *nm, nm[-1] + step]
    bands = {
        # Mitsuba sorts the bands by name. There are at most six, so the names "band_0" to "band_5" keep their order.
        f"band_{i}": {
            "type": "irregular",
            "wavelengths": ", ".join(map(str, nodes)),
            "values": ", ".join(map(str, [0.0, *response, 0.0])),
        }
        for i, (_, response) in enumerate(_responses(quadrature))
    }
    return {
        "type": "specfilm",
        "width": view.width,
        "height": view.height,
        "component_format": "float32",
        "rfilter": {"type": "box"},
        **bands,
    }


def colours(bands: np.ndarray, quadrature: Quadrature) -> np.ndarray:
    """Linear sRGB, (height, width, 3), of a picture in the bands of `film`, (height, width, bands)."""
    return bands @ np.array([signs for signs, _ in _responses(quadrature)])


def _responses(quadrature: Quadrature) -> list[tuple[np.ndarray, np.ndarray]]:
    """For each band its contribution to linear sRGB, and its responses ≥ 0 at the wavelengths, (n,).

    The contribution, (3,), is 1 or −1 in one channel and 0 in the others.

    Mitsuba's bands may not be negative, so the positive and the negative weights of a channel are two bands. Bands
    without a weight are left out.

    The weights multiply reflectances, but the film measures radiance under D65. A response is therefore the magnitude
    of the weight, divided by the integral of D65 times the triangle at its wavelength.
    """
    # Positions in a triangle, in units of its half width.
    offset = np.linspace(-1, 1, NODES_PER_TRIANGLE)
    # All arrays are (wavelengths, positions).
    nm = quadrature.wavelengths_nm[:, None] + quadrature.step_nm * offset
    d65_times_triangle = np.interp(nm, *_d65()) * (1 - np.abs(offset))
    # The trapezium rule; the integrand is 0 at both ends.
    integral = d65_times_triangle.sum(axis=1) * quadrature.step_nm * (offset[1] - offset[0])
    # (channels, wavelengths).
    weights = quadrature.weights.T / integral
    signed = [(sign * np.eye(3)[c], np.maximum(sign * weights[c], 0.0)) for c in range(3) for sign in (1, -1)]
    return [(signs, response) for signs, response in signed if response.any()]


def _d65() -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths in nm and values of Mitsuba's D65, piecewise linear: the radiance of a white plane facing the sun."""
    spectrum = mi.traverse(mi.load_dict({"type": "d65"}))
    values = np.array(spectrum["values"])
    return np.linspace(*spectrum["range"], len(values)), values


def picture(bsdf: mi.BSDF, files: SnakeFiles, light: Light, view: View, quadrature: Quadrature, spp: int) -> np.ndarray:
    """Linear sRGB, (height, width, 3), of the snake in the sun, without the ground.

    `spp` is rounded up to a square, since the sampler may round up other numbers of samples per pixel.
    """
    side = math.ceil(math.sqrt(spp))
    scene = mi.load_dict(bare_scene(bsdf, files, light, view, side**2, film(view, quadrature)))
    return colours(np.array(mi.render(scene), dtype=np.float64), quadrature)
