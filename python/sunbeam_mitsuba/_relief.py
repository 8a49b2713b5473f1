"""Reliefs in memory: heights and pixel sizes, from arrays or from objects of the library SurfaceTopography.

Arrays of heights are ``[iy, ix]``, with ix along +x and iy along +y. A hole is a point without a height: NaN or an
infinity in an array.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ._errors import SunbeamError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

# Largest accepted ratio of a height's magnitude to the peak-to-valley height; beyond it the mean is subtracted. 32-bit
# floats have a relative rounding error of 6e-8, which becomes 1e-6 of the relief at this ratio.
_OFFSET_MAX = 16.0
# Length in µm of each of SurfaceTopography's units. Micro has two signs in Unicode, U+00B5 and the Greek letter U+03BC.
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
    """Heights ``heights_um[iy, ix]`` in µm, not finite at holes; and a pixel's edges along x and y in µm."""

    heights_um: NDArray[np.float64]
    pixel_um: tuple[float, float]

    @property
    def holes(self) -> int:
        """Number of points without a finite height."""
        return int(np.count_nonzero(~np.isfinite(self.heights_um)))

    @property
    def peak_to_valley_um(self) -> float:
        """Range of the heights in µm; 0 if all points are holes."""
        finite = self.heights_um[np.isfinite(self.heights_um)]
        return float(np.ptp(finite)) if finite.size else 0.0


def single_precision(heights: NDArray[np.float64]) -> NDArray[np.float32]:
    """Heights as contiguous 32-bit floats, in the given unit.

    A large mean is subtracted to keep digits (_OFFSET_MAX), unless the relief is flat; the diffraction does not depend
    on the mean.
    """
    finite = heights[np.isfinite(heights)]
    if finite.size and np.abs(finite).max() > _OFFSET_MAX * np.ptp(finite) > 0:
        heights = heights - finite.mean()
    # Overflow becomes an infinity, which counts as a hole.
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(heights, dtype=np.float32)


def relief_of_array(heights_um: ArrayLike, pixel_um: float | tuple[float, float] | None) -> Relief:
    """Converts an array ``[iy, ix]`` of heights in µm; masked points become holes.

    ``pixel_um`` is the edge of a pixel in µm, or a pair of edges along x and y. Raises :class:`SunbeamError` for
    another number of axes, for complex numbers, and where ``pixel_um`` is missing or malformed.
    """
    if np.iscomplexobj(heights_um):
        raise SunbeamError("heights_um holds complex numbers; give real heights in µm")
    heights = np.ma.filled(np.ma.asarray(heights_um, dtype=np.float64), np.nan)
    if heights.ndim != 2 or pixel_um is None:
        raise SunbeamError(f"heights_um has the shape {heights.shape}; it must be [iy, ix], with pixel_um given")
    try:
        dx, dy = np.broadcast_to(np.asarray(pixel_um, dtype=float), 2)
    except (TypeError, ValueError) as error:
        raise SunbeamError(f"pixel_um is {pixel_um!r}; it must be a pixel's edge in µm, or a pair of edges") from error
    return Relief(heights, (float(dx), float(dy)))


def is_topography(given: object) -> bool:
    """Whether the object has the attributes of a ``SurfaceTopography.Topography``."""
    return all(hasattr(given, name) for name in ("heights", "physical_sizes", "unit", "dim"))


def relief_of_topography(topography: Any, unit: str | None = None, top_first: bool | None = None) -> Relief:
    """Converts a ``SurfaceTopography.Topography``, which has its own size and unit; undefined points become holes.

    ``unit`` is for a topography without a unit; where both are given, they must agree. ``top_first`` tells whether
    index 0 along y is the largest y. By default it follows from the topography's origin (:func:`top_is_first`).

    Raises :class:`SunbeamError` for a line scan and for a part of a distributed topography. Also raises it where the
    unit or the size is missing, and where the units differ.
    """
    if topography.dim != 2:
        raise SunbeamError("the topography is a line scan; a surface needs a map, with heights along x and y")
    if getattr(topography, "is_domain_decomposed", False):
        raise SunbeamError("the topography is a part of one that several processes share; give the whole")
    own = topography.unit
    if own is None and unit is None:
        raise SunbeamError("the topography has no unit; make it with unit='µm' or another length")
    unit_um = um_per(unit if own is None else own)
    if unit is not None and um_per(unit) != unit_um:
        raise SunbeamError(f"unit is given as {unit}, but the heights are in {own}")
    sizes = topography.physical_sizes
    if sizes is None or any(size is None for size in sizes):
        raise SunbeamError("the topography has no physical_sizes; make it with them, in its unit")
    # The library's arrays are [ix, iy], and its sizes are along x and y.
    heights = np.ma.filled(np.ma.asarray(topography.heights(), dtype=np.float64), np.nan).T * unit_um
    rows, columns = heights.shape
    size_x, size_y = sizes
    pixel_um = (float(size_x) * unit_um / columns, float(size_y) * unit_um / rows)
    if top_first is None:
        top_first = top_is_first(topography.info)
    if top_first:
        heights = heights[::-1]
    return Relief(heights, pixel_um)


def is_length(unit: object) -> bool:
    """Whether ``unit`` is one of SurfaceTopography's units of length."""
    return isinstance(unit, str) and unit in _UM_PER


def um_per(unit: object) -> float:
    """Length in µm of one of SurfaceTopography's units. Raises :class:`SunbeamError` for anything else."""
    if not isinstance(unit, str) or unit not in _UM_PER:
        raise SunbeamError(f"the unit {unit!r} is no length; accepted are {', '.join(_UM_PER)}")
    return _UM_PER[unit]


def top_is_first(info: Mapping[str, Any]) -> bool:
    """Whether index 0 along y of a topography is the top of the picture, the largest y, judged by its ``info``.

    In a topography made from an array the index grows along +y, as in its ``positions()``. Readers of files store the
    file's header or the instrument in ``info`` and put the top of the picture first, with two exceptions: X3P, whose
    header has ``Record1``, and surface data files (.sdf), whose header has ``ManufacID``, grow along +y.
    """
    header = info.get("raw_metadata") or {}
    is_from_file = bool(header or info.get("instrument"))
    grows_along_y = "Record1" in header or "ManufacID" in header
    return is_from_file and not grows_along_y
