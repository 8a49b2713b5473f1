"""Reliefs in memory: heights and pixel sizes, from arrays or from objects of the library SurfaceTopography.

Arrays of heights are ``[iy, ix]``, with ix along +x and iy along +y. A hole is a point without a height.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ._errors import SunbeamError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

# Ratio of the largest height to the peak-to-valley height above which the mean is subtracted. 32-bit floats have a
# relative rounding error of 6e-8; at this ratio the error is 16 · 6e-8 = 1e-6 of the relief.
_OFFSET_MAX = 16.0
# Length of each of SurfaceTopography's units in µm.
_UM_PER = {
    "Gm": 1e15,
    "Mm": 1e12,
    "km": 1e9,
    "m": 1e6,
    "mm": 1e3,
    "µm": 1.0,
    "μm": 1.0,
    "um": 1.0,
    "nm": 1e-3,
    "Å": 1e-4,
    "A": 1e-4,
    "pm": 1e-6,
    "fm": 1e-9,
}


@dataclass(frozen=True)
class Relief:
    """Heights ``heights_um[iy, ix]``, with ix along +x and iy along +y; and pixel edges along x and y, all in µm.

    Points without a height are NaN.
    """

    heights_um: NDArray[np.float64]
    pixel_um: tuple[float, float]

    @property
    def holes(self) -> int:
        """Number of points without a height."""
        return int(np.count_nonzero(~np.isfinite(self.heights_um)))

    @property
    def peak_to_valley_um(self) -> float:
        """Range of the heights in µm; 0 if all points are holes."""
        finite = self.heights_um[np.isfinite(self.heights_um)]
        return float(np.ptp(finite)) if finite.size else 0.0


def single_precision(heights: NDArray[np.float64]) -> NDArray[np.float32]:
    """Heights as 32-bit floats. A large mean is subtracted to keep digits; reflected light does not depend on it."""
    finite = heights[np.isfinite(heights)]
    if finite.size and np.abs(finite).max() > _OFFSET_MAX * np.ptp(finite) > 0:
        heights = heights - finite.mean()
    # Overflow becomes an infinity, which counts as a hole.
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(heights, dtype=np.float32)


def relief_of_array(heights_um: ArrayLike, pixel_um: float | tuple[float, float] | None) -> Relief:
    """Converts an array ``[iy, ix]`` of heights in µm; masked points have no height.

    Raises :class:`SunbeamError` for another number of axes, for complex numbers, and where ``pixel_um`` is missing.
    """
    if np.iscomplexobj(heights_um):
        raise SunbeamError("heights_um holds complex numbers; give real heights in µm")
    heights = np.ma.filled(np.ma.asarray(heights_um, dtype=np.float64), np.nan)
    if heights.ndim != 2 or pixel_um is None:
        raise SunbeamError(f"heights_um has the shape {heights.shape}; it must be [iy, ix], with pixel_um given")
    dx, dy = np.broadcast_to(np.asarray(pixel_um, dtype=float), 2)
    return Relief(heights, (float(dx), float(dy)))


def is_topography(given: object) -> bool:
    """Whether the object has the attributes of a ``SurfaceTopography.Topography``."""
    return all(hasattr(given, name) for name in ("heights", "physical_sizes", "unit", "dim"))


def relief_of_topography(topography: Any, unit: str | None = None, top_first: bool | None = None) -> Relief:
    """Converts a ``SurfaceTopography.Topography`` with its heights, size and unit; undefined points have no height.

    ``unit`` serves a topography without a unit; otherwise the two must agree. ``top_first`` tells whether index 0 along
    y is the largest y. By default it follows from the topography's origin (:func:`top_is_first`).

    Raises :class:`SunbeamError` for a line scan, and where the unit or the size is missing.
    """
    if topography.dim != 2:
        raise SunbeamError("the topography is a line scan; a surface needs a map, with heights along x and y")
    if getattr(topography, "is_domain_decomposed", False):
        raise SunbeamError("the topography is a part of one that several processes share; give the whole")
    own = topography.unit
    if own is None and unit is None:
        raise SunbeamError("the topography has no unit; make it with unit='µm' or another length")
    factor = um_per(unit if own is None else own)
    if unit is not None and um_per(unit) != factor:
        raise SunbeamError(f"unit is given as {unit}, but the heights are in {own}")
    sizes = topography.physical_sizes
    if sizes is None or any(size is None for size in sizes):
        raise SunbeamError("the topography has no physical_sizes; make it with them, in its unit")
    heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan).T * factor
    dx, dy = (float(size) * factor / count for size, count in zip(sizes, heights.shape[::-1]))
    if top_is_first(topography.info) if top_first is None else top_first:
        heights = heights[::-1]
    return Relief(heights, (dx, dy))


def is_length(unit: object) -> bool:
    """Whether ``unit`` is one of SurfaceTopography's units of length."""
    return isinstance(unit, str) and unit in _UM_PER


def um_per(unit: object) -> float:
    """Length of the unit in µm. Raises :class:`SunbeamError` where it is no unit of length."""
    if not isinstance(unit, str) or unit not in _UM_PER:
        raise SunbeamError(f"the unit {unit!r} is no length; accepted are {', '.join(_UM_PER)}")
    return _UM_PER[unit]


def top_is_first(info: Mapping[str, Any]) -> bool:
    """Whether index 0 along y of a topography is the top of the picture, judged by its ``info``.

    In topographies made from arrays the index grows along +y, as in ``positions()``. Readers of files store the file's
    header or instrument in ``info`` and put the top of the picture first. The readers of X3P and of surface data files
    store neither, and count along +y.
    """
    header = info.get("raw_metadata") or {}
    counts_up = "Record1" in header or "ManufacID" in header
    return bool(header or info.get("instrument")) and not counts_up
