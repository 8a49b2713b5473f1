"""BSDF and albedo of a surface, by the C interface (``Surface``) or by the plugin's BSDF in Mitsuba.

Mitsuba evaluates surfaces with parameters that only its BSDF has, such as ``material``. The C interface evaluates all
others and needs no Mitsuba variant. Mitsuba is compiled in *variants*, combinations of a backend and a representation
of colour. A process uses one at a time, which :func:`use_variant` selects.

Directions are unit vectors in the surface's frame (z is its normal) and point away from the surface: ``wi`` towards the
light, ``wo`` towards the viewer.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from .._surface import Surface
from .limits import BSDF_ONLY, LIGHT, Value

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float32]

# Number of wavelengths that Mitsuba's spectral variants evaluate at once.
_WAVELENGTHS_PER_CALL = 4
# A variant that evaluates many directions in one call.
_VARIANT = "llvm_ad_spectral"


class ReflectorError(ValueError):
    """Refusal by Mitsuba of a surface, scene or variant; the message is one line."""


class Reflector(Protocol):
    """A surface that can be evaluated for the figures (computed numbers and pictures) of a sweep."""

    #: Size of the surface's tables in bytes; 0 where it is unknown.
    table_bytes: float

    def eval(self, wi: Iterable[float], wo: Floats, wavelengths_nm: Iterable[float]) -> Floats:
        """The BSDF ``f_r`` in 1/sr, ``[directions, wavelengths]``, for one ``wi`` and ``wo[directions, 3]``.

        ``wi`` and all ``wo`` are above the horizon (z > 0).
        """

    def albedo(self, wi: Iterable[float], wavelengths_nm: Iterable[float], u: Floats) -> NDArray[np.float64]:
        """The reflected fraction of light from ``wi``, ``[wavelengths]``, for unpolarised light.

        The result is the mean weight (BSDF times cosine over density) of samples drawn with random numbers
        ``u[samples, 3]`` in [0, 1). Samples of transmitted light count as 0.
        """


def make_reflector(parameters: Mapping[str, Value]) -> Reflector:
    """Builds the surface's tables, or reads them from the disk cache. The angles of light in ``LIGHT`` are ignored.

    Parameters in ``BSDF_ONLY`` (``material``, ``rotation``, …) need Mitsuba's BSDF; other surfaces use the C interface.
    Raises ``SunbeamError`` or :class:`ReflectorError` where the surface is refused.
    """
    surface = {name: value for name, value in parameters.items() if name not in LIGHT}
    return _MitsubaReflector(surface) if any(name in BSDF_ONLY for name in surface) else _LibraryReflector(surface)


class _LibraryReflector:
    """A reflector by the C interface."""

    def __init__(self, parameters: Mapping[str, Value]):
        given: dict[str, Any] = dict(parameters)
        self._surface = Surface(**given)
        self.table_bytes = float(self._surface.describe()["bytes"])

    def eval(self, wi: Iterable[float], wo: Floats, wavelengths_nm: Iterable[float]) -> Floats:
        return self._surface.eval(list(wi), wo, list(wavelengths_nm))

    def albedo(self, wi: Iterable[float], wavelengths_nm: Iterable[float], u: Floats) -> NDArray[np.float64]:
        wo, _, weight = self._surface.sample(list(wi), list(wavelengths_nm), u)
        is_reflected = wo[:, 2:] > 0
        mean: NDArray[np.float64] = np.where(is_reflected, weight, 0).astype(np.float64).mean(axis=0)
        return mean


class _MitsubaReflector:
    """A reflector by the plugin's BSDF in Mitsuba's variant _VARIANT."""

    # Unknown: the plugin reports the size of its tables only within a text.
    table_bytes = 0.0

    def __init__(self, parameters: Mapping[str, Value]):
        mi = mitsuba()
        use_variant(_VARIANT)
        try:
            self._bsdf = mi.load_dict({"type": "diffraction", **bsdf_entries(parameters)})
        except RuntimeError as error:
            raise ReflectorError(last_line(error)) from error

    def eval(self, wi: Iterable[float], wo: Floats, wavelengths_nm: Iterable[float]) -> Floats:
        mi = mitsuba()
        use_variant(_VARIANT)
        nm = list(wavelengths_nm)
        result = np.empty((len(wo), len(nm)), dtype=np.float32)
        outgoing = np.ascontiguousarray(wo.T, dtype=np.float32)
        # Mitsuba's values include the cosine of `wo`.
        cosine = wo[:, 2].astype(np.float32)
        for first in range(0, len(nm), _WAVELENGTHS_PER_CALL):
            chosen_nm = nm[first : first + _WAVELENGTHS_PER_CALL]
            si = _interactions(list(wi), chosen_nm, len(wo))
            # Shape [_WAVELENGTHS_PER_CALL, directions].
            value = np.array(self._bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(outgoing)))
            result[:, first : first + len(chosen_nm)] = (value / cosine)[: len(chosen_nm)].T
        return result

    def albedo(self, wi: Iterable[float], wavelengths_nm: Iterable[float], u: Floats) -> NDArray[np.float64]:
        mi = mitsuba()
        use_variant(_VARIANT)
        nm = list(wavelengths_nm)
        means: list[float] = []
        # Rows of one random number each: Mitsuba's `sample1`, and the two of its `sample2`.
        variates = np.ascontiguousarray(u.T, dtype=np.float32)
        for first in range(0, len(nm), _WAVELENGTHS_PER_CALL):
            chosen_nm = nm[first : first + _WAVELENGTHS_PER_CALL]
            si = _interactions(list(wi), chosen_nm, len(u))
            # The weight has the shape [_WAVELENGTHS_PER_CALL, samples].
            sample, weight = self._bsdf.sample(mi.BSDFContext(), si, mi.Float(variates[0]), mi.Point2f(variates[1:]))
            reflected = np.where(np.array(sample.wo)[2] > 0, np.array(weight), 0)
            means += reflected.astype(np.float64).mean(axis=1)[: len(chosen_nm)].tolist()
        return np.array(means)


def mitsuba() -> Any:
    """The module ``mitsuba``, untyped, since its type stubs describe a single variant."""
    return importlib.import_module("mitsuba")


def _interactions(wi: list[float], chosen_nm: list[float], count: int) -> Any:
    """``count`` equal interactions of Mitsuba, lit from ``wi``, with _WAVELENGTHS_PER_CALL wavelengths in nm.

    ``chosen_nm`` has at least one wavelength. If it has fewer than _WAVELENGTHS_PER_CALL, the last is repeated, and
    callers drop the results of the repetitions.
    """
    import drjit as dr

    mi = mitsuba()
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(np.repeat(np.array(wi, dtype=np.float32)[:, None], count, axis=1))
    padded = chosen_nm + [chosen_nm[-1]] * (_WAVELENGTHS_PER_CALL - len(chosen_nm))
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
        raise ReflectorError(f"the variant {name} does not run here: {last_line(error)}") from error


@contextmanager
def one_thread() -> Iterator[None]:
    """Limits Mitsuba to one thread: a worker has one core, and a picture's sums over samples keep their order.

    Only for rendering: on one thread Mitsuba never finishes writing an OpenEXR file.
    """
    dr = importlib.import_module("drjit")
    before = dr.thread_count()
    dr.set_thread_count(1)
    try:
        yield
    finally:
        # Waits for kernels that still run.
        dr.sync_thread()
        dr.set_thread_count(before)


def bsdf_entries(parameters: Mapping[str, Value]) -> dict[str, Any]:
    """Entries of Mitsuba's BSDF dictionary for the parameters. ``LIGHT`` is left out; reflectances become spectra."""
    spectra = ("specular_reflectance", "specular_transmittance", "diffuse_reflectance")
    entries: dict[str, Any] = {name: value for name, value in parameters.items() if name not in (*spectra, *LIGHT)}
    for name in spectra:
        if name in parameters:
            entries[name] = {"type": "uniform", "value": parameters[name]}
    return entries


def last_line(error: BaseException) -> str:
    """The last line of an error's message, in which Mitsuba names the fault."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__


def with_full_path(parameters: Mapping[str, Value], folder: Path) -> dict[str, Value]:
    """The parameters, in which a relative ``filename``, if any, is joined to ``folder``."""
    named = dict(parameters)
    if "filename" in named:
        named["filename"] = str(folder / str(named["filename"]))
    return named
