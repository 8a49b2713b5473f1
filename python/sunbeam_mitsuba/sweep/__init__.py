"""Sweeps: figures and pictures of many surfaces under many settings, on one machine or many.

A specification names surfaces, settings and the wanted figures. From the command line::

    python -m sunbeam_mitsuba.sweep species.toml

and from Python::

    from sunbeam_mitsuba import sweep

    if __name__ == "__main__":
        outcome = sweep.run(sweep.read_spec("species.toml"))

The extra ``sweep`` (``pip install "sunbeam-mitsuba[sweep]"``) installs its dependencies, among them Dask and PyArrow.

Modules, in the order of the data:

- ``limits``, ``sampling`` and ``spec``: the specification, and the cases that it defines;
- ``wants/``: the wanted figures, computed with ``reflector`` (BSDF and albedo), ``colours``, ``pictures`` and
  ``command`` (the command ``sunbeam``);
- ``work``: computes cases in the workers, with ``tables`` (memory of surfaces) and ``instruments`` (their files), and
  writes the results into the ``store``;
- ``cluster`` and ``drive``: start the workers, and distribute the cases among them;
- ``report`` and ``sheet``: read the store, and write the tables and the contact sheet;
- ``run`` and ``command_line``: the whole sweep, with ``progress``.
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
