"""BSDF and albedo of a surface for the figures: by the C interface (`Surface`), or by the plugin's BSDF in Mitsuba.

Mitsuba serves surfaces with parameters that only its BSDF has, such as `material`; all others need no Mitsuba variant.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from .._surface import Surface
from .limits import LIGHT, SCENE, Value

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float32]

# Number of wavelengths that Mitsuba's spectral variants evaluate at once.
_CARRIED = 4
# The variant that evaluates many directions in one call.
_VARIANT = "llvm_ad_spectral"
# Largest number of values of f_r in one call, 4 bytes each. Chosen, to limit the memory to some 10 MB.
_VALUES_MAX = 2_000_000


class ReflectorError(ValueError):
    """Mitsuba refuses the surface; the message is one line."""


class Reflector(Protocol):
    """A surface for figures. Directions point away from the surface; wavelengths are in nm."""

    #: Memory of the tables in bytes; 0 where it is unknown.
    table_bytes: float

    def eval(self, wi: Iterable[float], wo: Floats, wavelengths_nm: Iterable[float]) -> Floats:
        """The BSDF ``f_r`` in 1/sr for one direction of light, ``[directions, wavelengths]``."""

    def albedo(self, wi: Iterable[float], wavelengths_nm: Iterable[float], u: Floats) -> NDArray[np.float64]:
        """The reflected fraction at each wavelength, a mean over samples with random numbers ``u[samples, 3]``."""


def make_reflector(parameters: Mapping[str, Value]) -> Reflector:
    """Builds the surface's tables, or reads them from the cache.

    Parameters in ``SCENE`` (``material``, ``rotation``, …) need Mitsuba's BSDF; other surfaces use the C interface.
    Raises ``SunbeamError`` or :class:`ReflectorError` where the surface is refused.
    """
    surface = {name: value for name, value in parameters.items() if name not in LIGHT}
    return _OfMitsuba(surface) if any(name in SCENE for name in surface) else _OfLibrary(surface)


class _OfLibrary:
    """A reflector by the C interface."""

    def __init__(self, parameters: Mapping[str, Value]):
        given: dict[str, Any] = dict(parameters)
        self._surface = Surface(**given)
        self.table_bytes = _table_bytes(self._surface.describe())

    def eval(self, wi: Iterable[float], wo: Floats, wavelengths_nm: Iterable[float]) -> Floats:
        nm = np.array(list(wavelengths_nm), dtype=np.float32)
        slab = max(1, _VALUES_MAX // len(nm))
        light = list(wi)
        parts = [self._surface.eval(light, wo[first : first + slab], nm) for first in range(0, len(wo), slab)]
        return np.concatenate(parts)

    def albedo(self, wi: Iterable[float], wavelengths_nm: Iterable[float], u: Floats) -> NDArray[np.float64]:
        nm = np.array(list(wavelengths_nm), dtype=np.float32)
        weight = self._surface.sample(list(wi), nm, u)[2]
        mean: NDArray[np.float64] = weight.astype(np.float64).mean(axis=0)
        return mean


def _table_bytes(described: Mapping[str, Any]) -> float:
    """The largest of all numbers of bytes in the surface's description."""
    found = 0.0
    for name, value in described.items():
        if isinstance(value, dict):
            found = max(found, _table_bytes(value))
        elif "bytes" in name and isinstance(value, (int, float)):
            found = max(found, float(value))
    return found


class _OfMitsuba:
    """A reflector by the plugin's BSDF in Mitsuba's variant _VARIANT."""

    # The plugin tells the size of its tables only as text.
    table_bytes = 0.0

    def __init__(self, parameters: Mapping[str, Value]):
        mi = mitsuba()

        self._parameters = dict(parameters)
        use_variant(_VARIANT)
        try:
            self._bsdf = mi.load_dict({"type": "diffraction", **bsdf_entries(parameters)})
        except RuntimeError as error:
            raise ReflectorError(one_line(error)) from error

    def eval(self, wi: Iterable[float], wo: Floats, wavelengths_nm: Iterable[float]) -> Floats:
        mi = mitsuba()

        use_variant(_VARIANT)
        nm = list(wavelengths_nm)
        result = np.empty((len(wo), len(nm)), dtype=np.float32)
        outgoing = np.ascontiguousarray(wo.T, dtype=np.float32)
        cosine = np.where(wo[:, 2] > 0, wo[:, 2], np.inf).astype(np.float32)
        for first in range(0, len(nm), _CARRIED):
            carried = nm[first : first + _CARRIED]
            si = _interactions(list(wi), carried, len(wo))
            value = np.array(self._bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(outgoing)))
            # Mitsuba's values include the cosine.
            result[:, first : first + len(carried)] = (value / cosine)[: len(carried)].T
        return result

    def albedo(self, wi: Iterable[float], wavelengths_nm: Iterable[float], u: Floats) -> NDArray[np.float64]:
        mi = mitsuba()

        use_variant(_VARIANT)
        nm = list(wavelengths_nm)
        found: list[float] = []
        columns = np.ascontiguousarray(u.T, dtype=np.float32)
        for first in range(0, len(nm), _CARRIED):
            carried = nm[first : first + _CARRIED]
            si = _interactions(list(wi), carried, len(u))
            _, weight = self._bsdf.sample(mi.BSDFContext(), si, mi.Float(columns[0]), mi.Point2f(columns[1:]))
            found += np.array(weight).astype(np.float64).mean(axis=1)[: len(carried)].tolist()
        return np.array(found)


def mitsuba() -> Any:
    """The module ``mitsuba``, untyped, since its type stubs describe a single variant."""
    return importlib.import_module("mitsuba")


def _interactions(wi: list[float], carried: list[float], count: int) -> Any:
    """``count`` equal interactions with up to _CARRIED wavelengths; missing ones repeat the last."""
    import drjit as dr

    mi = mitsuba()

    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(np.repeat(np.array(wi, dtype=np.float32)[:, None], count, axis=1))
    padded = carried + [carried[-1]] * (_CARRIED - len(carried))
    si.wavelengths = [mi.Float(np.full(count, nm, dtype=np.float32)) for nm in padded]
    return si


def use_variant(name: str) -> None:
    """Selects a variant of Mitsuba. Raises :class:`ReflectorError` where it does not run on this machine."""
    mi = mitsuba()
    if mi.variant() == name:
        return
    try:
        mi.set_variant(name)
    except (ImportError, RuntimeError, AttributeError) as error:
        raise ReflectorError(f"the variant {name} does not run here: {one_line(error)}") from error


@contextmanager
def one_thread() -> Iterator[None]:
    """Limits Mitsuba to one thread: a worker has one core, and sums over a picture keep their order.

    For rendering only: on one thread Mitsuba never finishes writing an OpenEXR file.
    """
    dr = importlib.import_module("drjit")
    before = dr.thread_count()
    dr.set_thread_count(1)
    try:
        yield
    finally:
        dr.sync_thread()
        dr.set_thread_count(before)


def bsdf_entries(parameters: Mapping[str, Value]) -> dict[str, Any]:
    """The parameters as entries of Mitsuba's dictionary."""
    spectra = ("specular_reflectance", "diffuse_reflectance")
    entries: dict[str, Any] = {name: value for name, value in parameters.items() if name not in (*spectra, *LIGHT)}
    for name in spectra:
        if name in parameters:
            entries[name] = {"type": "uniform", "value": parameters[name]}
    return entries


def one_line(error: BaseException) -> str:
    """The last line of an error's message, in which Mitsuba names the fault."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__


def with_full_path(parameters: Mapping[str, Value], folder: Path) -> dict[str, Value]:
    """The parameters with the file's name made absolute."""
    named = dict(parameters)
    if "filename" in named:
        named["filename"] = str(folder / str(named["filename"]))
    return named
