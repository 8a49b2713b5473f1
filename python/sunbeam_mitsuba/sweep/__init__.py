"""Sweeps: figures and pictures of many surfaces under many settings, on one machine or many.

A specification names surfaces, settings and the wanted figures. From the command line::

    python -m sunbeam_mitsuba.sweep species.toml

and from Python::

    from sunbeam_mitsuba import sweep

    if __name__ == "__main__":
        outcome = sweep.run(sweep.read_spec("species.toml"))

The extra ``sweep`` (``pip install "sunbeam-mitsuba[sweep]"``) installs its dependencies, among them Dask and PyArrow.

Data flows one way: ``limits`` and ``sampling`` make ``spec``; ``reflector``, ``colours``, ``pictures`` and ``command``
serve ``wants``; ``work`` computes a case with ``tables`` into the ``store``; ``drive`` hands cases to a ``cluster``;
``report`` and ``sheet`` read the store.
"""

from __future__ import annotations

try:
    import distributed as _distributed  # noqa: F401
    import filelock as _filelock  # noqa: F401
    import pyarrow as _pyarrow  # noqa: F401
    import tqdm as _tqdm  # noqa: F401
except ImportError as _error:
    raise ImportError(
        f'sunbeam_mitsuba.sweep needs {_error.name}, which is not installed: pip install "sunbeam-mitsuba[sweep]"'
    ) from None

from .errors import SweepError
from .run import Outcome, Plan, plan, run
from .spec import Spec, make_spec, read_spec

__all__ = ["Outcome", "Plan", "Spec", "SweepError", "make_spec", "plan", "read_spec", "run"]
