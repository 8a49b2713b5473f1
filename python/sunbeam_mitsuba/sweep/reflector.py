"""A surface that answers for directions and wavelengths: through the C interface, or through Mitsuba's BSDF."""

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

# Mitsuba's BSDF carries so many wavelengths at a time, and answers for many directions at once in this variant.
_CARRIED, _VARIANT = 4, "llvm_ad_spectral"
# Values of f that are asked for at a time: what a batch keeps in memory.
_VALUES_MAX = 2_000_000


class ReflectorError(ValueError):
    """A surface that Mitsuba refuses; the message is one line."""


class Reflector(Protocol):
    """What figures are computed from. Directions point away from the surface, wavelengths are in nm."""

    #: Memory that the tables take, in bytes.
    table_bytes: float

    def eval(self, wi: Iterable[float], wo: Floats, wavelengths_nm: Iterable[float]) -> Floats:
        """``f_r`` in 1/sr for one direction of light, as ``[directions, wavelengths]``."""

    def albedo(self, wi: Iterable[float], wavelengths_nm: Iterable[float], u: Floats) -> NDArray[np.float64]:
        """The share of light that is reflected at each wavelength, from random numbers ``[samples, 3]``."""


def make_reflector(parameters: Mapping[str, Value]) -> Reflector:
    """Builds the tables, or reads them from the cache.

    What only a scene knows (``material``, ``rotation``, …) takes Mitsuba's BSDF, everything else the C interface.
    Raises ``SunbeamError`` or :class:`ReflectorError` where the surface is refused.
    """
    own = {name: value for name, value in parameters.items() if name not in LIGHT}
    return _OfMitsuba(own) if any(name in SCENE for name in own) else _OfLibrary(own)


class _OfLibrary:
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
    """The largest number of bytes that the description tells, wherever it stands."""
    found = 0.0
    for name, value in described.items():
        if isinstance(value, dict):
            found = max(found, _table_bytes(value))
        elif "bytes" in name and isinstance(value, (int, float)):
            found = max(found, float(value))
    return found


class _OfMitsuba:
    # Its tables are those of the plugin, which tells their size in words alone.
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
            # Mitsuba's values have the cosine in them.
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
    """The module, without types: its stubs are those of one variant, and the variant is chosen as the program runs."""
    return importlib.import_module("mitsuba")


def _interactions(wi: list[float], carried: list[float], count: int) -> Any:
    import drjit as dr

    mi = mitsuba()

    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(np.repeat(np.array(wi, dtype=np.float32)[:, None], count, axis=1))
    padded = carried + [carried[-1]] * (_CARRIED - len(carried))
    si.wavelengths = [mi.Float(np.full(count, nm, dtype=np.float32)) for nm in padded]
    return si


def use_variant(name: str) -> None:
    """Selects a variant of Mitsuba. Raises :class:`ReflectorError` where it does not run here."""
    mi = mitsuba()
    if mi.variant() == name:
        return
    try:
        mi.set_variant(name)
    except (ImportError, RuntimeError, AttributeError) as error:
        raise ReflectorError(f"the variant {name} does not run here: {one_line(error)}") from error


@contextmanager
def one_thread() -> Iterator[None]:
    """Mitsuba computes on one thread: a worker has a core to itself, and sums over a picture come in one order then.

    Only for rendering: with so few threads Mitsuba's files in OpenEXR are never finished.
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
    """The parameters as Mitsuba's dictionaries have them."""
    spectra = ("specular_reflectance", "diffuse_reflectance")
    entries: dict[str, Any] = {name: value for name, value in parameters.items() if name not in (*spectra, *LIGHT)}
    for name in spectra:
        if name in parameters:
            entries[name] = {"type": "uniform", "value": parameters[name]}
    return entries


def one_line(error: BaseException) -> str:
    """The last line of an error's message, which is where Mitsuba says what is wrong."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__


def with_full_path(parameters: Mapping[str, Value], folder: Path) -> dict[str, Value]:
    """The parameters with the file's name made absolute."""
    named = dict(parameters)
    if "filename" in named:
        named["filename"] = str(folder / str(named["filename"]))
    return named
