"""Reliefs in memory: heights with their pixels, from arrays and from objects of the library SurfaceTopography."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ._errors import SunbeamError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

# Offset over peak to valley beyond which the mean is taken off: 32-bit floats have a relative error of 6e-8, and the
# relief keeps one of 1e-6.
_OFFSET_MAX = 16.0
# µm in one of each unit of length that SurfaceTopography's objects can have.
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
    """A relief in µm: ``heights_um[iy, ix]``, whose rows lie along x and grow along +y, NaN where there is no height;
    and the edges of its pixels along x and y."""

    heights_um: NDArray[np.float64]
    pixel_um: tuple[float, float]

    @property
    def holes(self) -> int:
        """Number of points without a height."""
        return int(np.count_nonzero(~np.isfinite(self.heights_um)))

    @property
    def peak_to_valley_um(self) -> float:
        """Highest less lowest height in µm; 0 where there are only holes."""
        known = self.heights_um[np.isfinite(self.heights_um)]
        return float(np.ptp(known)) if known.size else 0.0


def single_precision(heights: NDArray[np.float64]) -> NDArray[np.float32]:
    """Heights as 32-bit floats, less their mean where that would cost the relief its digits: no light depends on it."""
    known = heights[np.isfinite(heights)]
    if known.size and np.abs(known).max() > _OFFSET_MAX * np.ptp(known) > 0:
        heights = heights - known.mean()
    # Too large a number becomes an infinity, which is a hole.
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(heights, dtype=np.float32)


def relief_of_array(heights_um: ArrayLike, pixel_um: float | tuple[float, float] | None) -> Relief:
    """A relief from an array ``[iy, ix]``; points that are masked in it have no height.

    Raises :class:`SunbeamError` for another number of axes, for complex numbers, and without ``pixel_um``.
    """
    if np.iscomplexobj(heights_um):
        raise SunbeamError("heights_um holds complex numbers; give real heights in µm")
    heights = np.ma.filled(np.ma.asarray(heights_um, dtype=np.float64), np.nan)
    if heights.ndim != 2 or pixel_um is None:
        raise SunbeamError(f"heights_um has the shape {heights.shape}; it must be [iy, ix], with pixel_um given")
    dx, dy = np.broadcast_to(np.asarray(pixel_um, dtype=float), 2)
    return Relief(heights, (float(dx), float(dy)))


def is_topography(given: object) -> bool:
    """Whether this is an object of SurfaceTopography, or one that looks like it."""
    return all(hasattr(given, name) for name in ("heights", "physical_sizes", "unit", "dim"))


def relief_of_topography(topography: Any, unit: str | None = None, top_first: bool | None = None) -> Relief:
    """A relief from a ``SurfaceTopography.Topography``: its heights, size and unit; undefined points have no height.

    ``unit`` is for a topography without one, and must agree with one that has. ``top_first`` says whether index 0 along
    y is the largest y; unless given, it follows from where the topography came from (:func:`top_is_first`).

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
    """Whether this is a unit of length, as SurfaceTopography spells them."""
    return isinstance(unit, str) and unit in _UM_PER


def um_per(unit: object) -> float:
    """µm in one of the unit. Raises :class:`SunbeamError` for what is no length."""
    if not isinstance(unit, str) or unit not in _UM_PER:
        raise SunbeamError(f"the unit {unit!r} is no length; accepted are {', '.join(_UM_PER)}")
    return _UM_PER[unit]


def top_is_first(info: Mapping[str, Any]) -> bool:
    """Whether index 0 along y of a topography's heights is the top, by its ``info``.

    In objects that were made of arrays the index grows along +y, as ``positions()`` says. Readers of files leave the
    file's header or instrument in the info, and put the top of the picture first. Those of X3P and of surface data
    files do not: they keep to the file, which counts along +y.
    """
    header = info.get("raw_metadata") or {}
    counts_up = "Record1" in header or "ManufacID" in header
    return bool(header or info.get("instrument")) and not counts_up
