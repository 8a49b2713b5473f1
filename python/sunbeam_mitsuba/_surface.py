"""The BSDF for NumPy, through the C interface ``sunbeam.h`` (crates/c_abi) that the plugin's library exports.

The C functions take batches of items. An array is a pointer to 32-bit floats and a stride in floats between items; the
stride is 0 for one item that serves the whole batch. The functions may run in several threads at once.

Shapes: ``...`` stands for the axes of the batch, ``m`` for the number of wavelengths of each item.
"""

from __future__ import annotations

import ctypes
import json
import math
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from ctypes import POINTER, byref, c_char_p, c_double, c_int, c_size_t, c_ssize_t, c_void_p
from functools import cache
from typing import TYPE_CHECKING, Any, Callable, Union, cast

import numpy as np

from ._errors import SunbeamError
from ._plugin import PLUGIN
from ._relief import is_topography, relief_of_array, relief_of_topography, single_precision

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float32]
    # An object of SurfaceTopography, which has no types.
    Topography = Any
    # A value of a parameter of the plugin.
    Parameter = Union[str, float, bool, os.PathLike[str]]

# Status of a successful call (``sunbeam_status`` of sunbeam.h; no test compares the numbers).
_OK = 0
# Status of a call whose text does not fit into the given buffer (``SUNBEAM_STATUS_BUFFER_TOO_SMALL``).
_BUFFER_TOO_SMALL = 6
# Smallest number of evaluations, items times wavelengths, for each thread. Starting a thread takes as long as some
# hundred evaluations, so smaller values waste time; larger ones leave cores idle.
_EVALUATIONS_PER_THREAD = 2000
# Parts of a batch per thread. Some directions take longer, so more parts balance the load better, but take more calls.
_PARTS_PER_THREAD = 4


class _CFloats(ctypes.Structure):
    """The structures ``sunbeam_floats`` and ``sunbeam_floats_out`` of the C interface; the stride is in floats."""

    _fields_ = (("data", c_void_p), ("stride", c_ssize_t))


@cache
def _library() -> ctypes.CDLL:
    """The plugin's library with the C interface's signatures."""
    # The plugin is linked to Mitsuba's libraries, which must be loaded first. Listing the variants loads them where the
    # import alone has not.
    import mitsuba as mi

    if mi.variant() is None:
        mi.variants()
    library = ctypes.CDLL(str(PLUGIN))
    handle, handle_out = c_void_p, POINTER(c_void_p)
    # Types of the arguments of each function ``sunbeam_NAME``, in the order of sunbeam.h.
    arguments = {
        "surface_new": [c_char_p, handle_out],
        "surface_from_heights": [c_char_p, _CFloats, c_size_t, c_size_t, c_double, c_double, handle_out],
        "surface_describe": [handle, c_void_p, c_size_t, POINTER(c_size_t)],
        "surface_eval": [handle, c_size_t, _CFloats, _CFloats, c_size_t, _CFloats, _CFloats],
        "surface_pdf": [handle, c_size_t, _CFloats, _CFloats, c_size_t, _CFloats, _CFloats],
        "surface_eval_pdf": [handle, c_size_t, _CFloats, _CFloats, c_size_t, _CFloats, _CFloats, _CFloats],
        "surface_sample": [handle, c_size_t, _CFloats, c_size_t, *[_CFloats] * 5],
    }
    for name, types in arguments.items():
        function = getattr(library, f"sunbeam_{name}")
        function.argtypes, function.restype = types, c_int
    library.sunbeam_surface_free.argtypes, library.sunbeam_surface_free.restype = [handle], None
    for name in ("sunbeam_last_error", "sunbeam_version"):
        getattr(library, name).restype = c_char_p
    return library


def library_version() -> str:
    """The version of the native library, such as ``0.1.0``."""
    return cast("bytes", _library().sunbeam_version()).decode()


def _check(status: int) -> None:
    """Raises :class:`SunbeamError` with the library's message unless the status is _OK."""
    if status != _OK:
        raise SunbeamError(_library().sunbeam_last_error().decode())


class _Items:
    """An input array of the C interface.

    ``values`` has the shape ``[width]``, one item for the whole batch, or a shape that broadcasts to
    ``[*batch, width]``.
    """

    def __init__(self, values: Floats, batch: tuple[int, ...]):
        width = values.shape[-1]
        self._stride = 0 if values.ndim == 1 else width
        if values.ndim > 1:
            values = np.broadcast_to(values, (*batch, width))
        self._values = np.ascontiguousarray(values, dtype=np.float32)

    def at(self, first: int) -> _CFloats:
        """The C structure of the array from item ``first`` of the batch on; valid while this object lives."""
        return _CFloats(self._values.ctypes.data + self._values.itemsize * first * self._stride, self._stride)


class _Results(_Items):
    """An output array of the C interface, ``values`` of shape ``[*batch, width]``, not initialised."""

    # Replaces the constructor of `_Items`, which may copy its array: the C functions must write into `values` itself.
    def __init__(self, batch: tuple[int, ...], width: int):
        self.values = self._values = np.empty((*batch, width), dtype=np.float32)
        self._stride = width


def _numbers(name: str, values: ArrayLike) -> Floats:
    """The values as 32-bit floats. Raises :class:`SunbeamError` for masked values, whose mask NumPy would drop."""
    masked = int(np.count_nonzero(np.ma.getmaskarray(np.ma.asarray(values))))
    if masked:
        raise SunbeamError(f"{name} has {masked} masked values; leave them out")
    return np.asarray(values, dtype=np.float32)


def _triples(name: str, values: ArrayLike) -> Floats:
    """Directions or random numbers ``[..., 3]`` as 32-bit floats. Raises :class:`SunbeamError` for another shape."""
    array = _numbers(name, values)
    if array.shape[-1:] != (3,):
        raise SunbeamError(f"{name} has the shape {array.shape}, but its last axis must have 3 numbers")
    return array


def _config(parameters: Mapping[str, object]) -> bytes:
    """The parameters as JSON; NumPy scalars and paths as Python's numbers and texts."""

    def plain(value: object) -> object:
        return value.item() if isinstance(value, np.generic) else os.fsdecode(cast(Any, value))

    for name, value in parameters.items():
        try:
            json.dumps(value, default=plain)
        except (TypeError, ValueError) as error:
            raise SunbeamError(f"{name} is neither a number, a text, a truth value nor a path: {value!r}") from error
    return json.dumps(parameters, default=plain).encode()


class Surface:
    """A diffracting surface with its tables, which the constructor builds or reads from the cache.

    Parameters have the plugin's names and meanings, with lengths in µm. The relief is one of

    - ``preset``, with ``period`` and ``height``, or with ``region_size`` and ``region_spread``;
    - ``filename``, with ``pixel_size``, ``max_height``, ``channel`` and ``fill``;
    - ``heights_um``, an array ``[iy, ix]`` with ix along +x and iy along +y, with ``pixel_um``: the edge of a pixel in
      µm, or a pair of edges along x and y;
    - ``heights_um``, a ``SurfaceTopography.Topography``, which has its own size and unit.

    Heights that are NaN, infinite or masked are holes, and refused unless ``fill`` is ``laplace`` or ``mean``.

    The other parameters are ``level``, ``tiling``, ``scale``, ``depth``, ``theory``, ``coherence_length``, ``model``,
    ``obliquity``, ``conserve_energy``, ``shadowing``, ``tolerance``, ``build_limit``, ``transmission``, and the numbers
    ``eta``, ``k`` and ``cover_eta``. docs/plugin.md explains all of them.

    Directions are in the surface's frame: z is the normal and x the direction of the relief's rows. ``wi`` and ``wo``
    both point away from the surface and have unit length to 1e-3. Wavelengths are in nm, from 360 to 830.

    Raises :class:`SunbeamError` where a parameter is not accepted.
    """

    def __init__(
        self,
        heights_um: ArrayLike | Topography | None = None,
        pixel_um: float | tuple[float, float] | None = None,
        **parameters: Parameter,
    ):
        config = _config(parameters)
        handle = c_void_p()
        self._handle = None
        if heights_um is None:
            if pixel_um is not None:
                raise SunbeamError("pixel_um needs heights_um")
            _check(_library().sunbeam_surface_new(config, byref(handle)))
        else:
            if is_topography(heights_um):
                if pixel_um is not None:
                    raise SunbeamError("pixel_um is given, but a topography tells its size itself; leave it out")
                relief = relief_of_topography(heights_um)
            else:
                relief = relief_of_array(heights_um, pixel_um)
            heights = single_precision(relief.heights_um)
            (ny, nx), (dx, dy) = heights.shape, relief.pixel_um
            # Items are rows of `nx` heights. The library copies them.
            rows = _CFloats(heights.ctypes.data, nx)
            _check(_library().sunbeam_surface_from_heights(config, rows, nx, ny, dx, dy, byref(handle)))
        self._handle = handle

    def __del__(self) -> None:
        # The attribute is missing, or None, if the constructor has failed.
        if getattr(self, "_handle", None):
            _library().sunbeam_surface_free(self._handle)
            self._handle = None

    def __repr__(self) -> str:
        given = json.dumps(self.describe()["config"])
        return f"Surface({given})"

    def describe(self) -> dict[str, Any]:
        """The configuration, and the tables' origin (built or from the cache), size and measured error."""
        # The first call, with an empty buffer, returns the size of the text.
        needed = c_size_t()
        status = _library().sunbeam_surface_describe(self._handle, None, 0, byref(needed))
        if status != _BUFFER_TOO_SMALL:
            _check(status)
        text = ctypes.create_string_buffer(needed.value)
        _check(_library().sunbeam_surface_describe(self._handle, text, needed, byref(needed)))
        return cast("dict[str, Any]", json.loads(text.value))

    def eval(self, wi: ArrayLike, wo: ArrayLike, wavelength_nm: ArrayLike) -> Floats:
        """The BSDF f_r in 1/sr, without the cosine.

        With ``transmission``, directions may lie below the surface. The result is then the power of light from ``wi``
        to ``wo`` per solid angle and absolute cosine. Directions below an interface are those in the medium.

        ``wi`` and ``wo`` have the shape ``[..., 3]`` and broadcast against each other. ``wavelength_nm`` is one number,
        or an array ``[m]`` or ``[..., m]``. The result has the shape ``[...]`` for one number, else ``[..., m]``.
        """
        return self._evaluate("eval", wi, wo, wavelength_nm)[0]

    def pdf(self, wi: ArrayLike, wo: ArrayLike, wavelength_nm: ArrayLike) -> Floats:
        """The density per solid angle, in 1/sr, with which :meth:`sample` draws ``wo`` for the given wavelengths.

        Arguments are those of :meth:`eval`. The result has the shape ``[...]``: the mean over an item's wavelengths.
        """
        return self._evaluate("pdf", wi, wo, wavelength_nm)[0]

    def eval_pdf(self, wi: ArrayLike, wo: ArrayLike, wavelength_nm: ArrayLike) -> tuple[Floats, Floats]:
        """The results of :meth:`eval` and :meth:`pdf`, in the time of :meth:`pdf` alone."""
        f, pdf = self._evaluate("eval_pdf", wi, wo, wavelength_nm)
        return f, pdf

    def _evaluate(self, function: str, wi: ArrayLike, wo: ArrayLike, wavelength_nm: ArrayLike) -> list[Floats]:
        """Results of ``sunbeam_surface_FUNCTION``, where ``function`` is ``eval``, ``pdf`` or ``eval_pdf``."""
        wi, wo = _triples("wi", wi), _triples("wo", wo)
        nm, is_single = _wavelengths(wavelength_nm)
        batch = np.broadcast_shapes(wi.shape[:-1], wo.shape[:-1], nm.shape[:-1])
        wavelength_count = nm.shape[-1]
        inputs = [_Items(array, batch) for array in (wi, wo, nm)]
        widths = {"eval": [wavelength_count], "pdf": [1], "eval_pdf": [wavelength_count, 1]}[function]
        results = [_Results(batch, width) for width in widths]
        call = getattr(_library(), f"sunbeam_surface_{function}")

        def work(first: int, count: int) -> None:
            wi_at, wo_at, nm_at = (array.at(first) for array in inputs)
            results_at = (array.at(first) for array in results)
            _check(call(self._handle, count, wi_at, wo_at, wavelength_count, nm_at, *results_at))

        _in_parallel(work, math.prod(batch), wavelength_count)
        # A density has no axis for the wavelengths, and a value has none for a single number.
        has_no_axis = {"eval": [is_single], "pdf": [True], "eval_pdf": [is_single, True]}[function]
        return [array.values[..., 0] if drop else array.values for array, drop in zip(results, has_no_axis)]

    def sample(self, wi: ArrayLike, wavelength_nm: ArrayLike, u: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Draws outgoing directions. Returns ``wo`` ``[..., 3]``, ``pdf`` ``[...]`` in 1/sr, and ``weight``.

        ``u`` are random numbers in [0, 1), ``[..., 3]``. ``wi`` and ``wavelength_nm`` are those of :meth:`eval`; all
        broadcast against each other. The weight is ``f |cosθo| / pdf``, ``[...]`` for one wavelength given as a number,
        else ``[..., m]``. A sample of a surface that only reflects has zeros in all three arrays if ``wi`` or the drawn
        direction lies below the horizon.
        """
        wi, u = _triples("wi", wi), _triples("u", u)
        nm, is_single = _wavelengths(wavelength_nm)
        batch = np.broadcast_shapes(wi.shape[:-1], u.shape[:-1], nm.shape[:-1])
        wavelength_count = nm.shape[-1]
        inputs = [_Items(array, batch) for array in (wi, nm, u)]
        results = [_Results(batch, width) for width in (3, 1, wavelength_count)]

        def work(first: int, count: int) -> None:
            wi_at, nm_at, u_at = (array.at(first) for array in inputs)
            results_at = (array.at(first) for array in results)
            call = _library().sunbeam_surface_sample
            _check(call(self._handle, count, wi_at, wavelength_count, nm_at, u_at, *results_at))

        _in_parallel(work, math.prod(batch), wavelength_count)
        wo, pdf, weight = (array.values for array in results)
        return wo, pdf[..., 0], weight[..., 0] if is_single else weight


def _wavelengths(wavelength_nm: ArrayLike) -> tuple[Floats, bool]:
    """The wavelengths in nm, ``[..., m]``, and whether they were a single number, to which the axis was added."""
    nm = _numbers("wavelength_nm", wavelength_nm)
    return (nm.reshape(1), True) if nm.ndim == 0 else (nm, False)


def _threads() -> int:
    """The library's number of threads: ``RAYON_NUM_THREADS``, or one per core."""
    named = os.environ.get("RAYON_NUM_THREADS", "")
    return int(named) if named.isdecimal() and int(named) > 0 else os.cpu_count() or 1


def _in_parallel(work: Callable[[int, int], None], count: int, wavelength_count: int) -> None:
    """Calls ``work(first, items)`` for parts of a batch of ``count`` items, in several threads if it is large.

    Threads run at once, since ctypes releases Python's lock during a call. A part may be empty.
    """
    threads = min(_threads(), max(1, count * wavelength_count // _EVALUATIONS_PER_THREAD))
    if threads == 1:
        work(0, count)
        return
    edges = np.linspace(0, count, _PARTS_PER_THREAD * threads + 1).astype(int)
    with ThreadPoolExecutor(threads) as pool:
        # The list waits for all parts and raises the first error.
        list(pool.map(lambda first, end: work(int(first), int(end - first)), edges[:-1], edges[1:]))
