"""An ordinary picture by Mitsuba in bands of wavelengths, summed as the realtime renderer sums."""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np

from ..light import Light
from ..scene import View
from ..snake import SnakeFiles
from .cases import bare_scene
from .points import CARRIED
from .quadrature import Quadrature

# The integral of D65 over a band is the sum over this many points, exact to 1e-6 for a curve made of straight lines.
POINTS_PER_BAND = 101


def film(view: View, quadrature: Quadrature) -> dict:
    """A film with a triangular band around each wavelength, which together interpolate between them.

    The bands are as high as their colours count, since the film draws its wavelengths in that proportion.
    """
    step, heights = quadrature.step_nm, band_heights(quadrature)
    bands = {
        # Mitsuba sorts its properties by name, and numbers in them by their value.
        f"band_{i:04d}": {
            "type": "irregular",
            "wavelengths": f"{nm - step}, {nm}, {nm + step}",
            "values": f"0, {height}, 0",
        }
        for i, (nm, height) in enumerate(zip(quadrature.wavelengths_nm, heights))
    }
    return {
        "type": "specfilm",
        "width": view.width,
        "height": view.height,
        "component_format": "float32",
        "rfilter": {"type": "box"},
        **bands,
    }


def band_heights(quadrature: Quadrature) -> np.ndarray:
    """The height of each band: what its colour counts at most, and not nothing where that is next to nothing."""
    counts = np.abs(quadrature.weights).max(axis=1)
    return np.maximum(counts / counts.max(), 0.02)


def colours(bands: np.ndarray, quadrature: Quadrature) -> np.ndarray:
    """Linear sRGB of a picture in bands: in each one the mean reflectance, lit by D65 as the weights have it."""
    across = np.linspace(-1, 1, POINTS_PER_BAND)
    nm = quadrature.wavelengths_nm[:, None] + quadrature.step_nm * across
    light = np.interp(nm, *_d65()).reshape(nm.shape) * (1 - np.abs(across))
    white = light.sum(axis=1) * quadrature.step_nm * (across[1] - across[0]) * band_heights(quadrature)
    return (bands / white) @ quadrature.weights


def _d65() -> tuple[np.ndarray, np.ndarray]:
    """Mitsuba's illuminant at whole nm, scaled as the light is: a white plane that faces the sun reflects it."""
    nm = np.arange(360.0, 832.0)
    spectrum = mi.load_dict({"type": "d65"})
    si = dr.zeros(mi.SurfaceInteraction3f)
    values = []
    for carried in nm.reshape(-1, CARRIED):
        si.wavelengths = carried.tolist()
        values.append(np.array(spectrum.eval(si)).ravel())
    return nm, np.concatenate(values)


def picture(bsdf: mi.BSDF, files: SnakeFiles, light: Light, view: View, quadrature: Quadrature, spp: int) -> np.ndarray:
    """Linear sRGB (height, width, 3) of the snake in the sun."""
    side = math.ceil(math.sqrt(spp))
    scene = mi.load_dict(bare_scene(bsdf, files, light, view, side**2, film(view, quadrature)))
    return colours(np.array(mi.render(scene), dtype=np.float64), quadrature)
