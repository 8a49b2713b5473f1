"""Sweeps: figures and pictures of many surfaces under many settings, on one machine or many.

A specification (``spec``) is a TOML file with three parts:

- *surfaces*: reliefs with their parameters, such as a file of heights and a coherence length;
- *settings*: the direction of the light, and parameters that vary for every surface;
- *wants*: groups of figures, such as those of the colour, and pictures, such as a rendered scene.

A surface under a setting is a *case*, and a row of the resulting table. From the command line::

    python -m sunbeam_mitsuba.sweep species.toml

and from Python::

    from sunbeam_mitsuba import sweep

    if __name__ == "__main__":
        outcome = sweep.run(sweep.read_spec("species.toml"))

The condition keeps worker processes, which import the script, from starting sweeps of their own.
The extra ``sweep`` (``pip install "sunbeam-mitsuba[sweep]"``) installs its dependencies, among them Dask and PyArrow.

Modules, in the order of the data:

- ``limits``, ``sampling`` and ``spec``: the specification, and the cases that it defines;
- ``wants/``: the wanted figures, computed with ``reflector`` (BSDF and albedo), ``colours``, ``pictures`` and
  ``command`` (the command ``sunbeam``);
- ``work``: computes cases in the workers, with ``tables`` (memory of surfaces) and ``instruments`` (files in formats of
  measuring instruments), and writes the results into the ``store``;
- ``cluster`` and ``drive``: start the workers, processes of a Dask cluster, and distribute the cases among them;
- ``report`` and ``sheet``: read the store, and write the tables and the contact sheet;
- ``run`` and ``command_line``: the whole sweep, with ``progress`` on stderr.
"""

from __future__ import annotations

# Packages of the extra; their absence is told here, before a module of this package imports one.
try:
    import distributed as _distributed  # noqa: F401
    import filelock as _filelock  # noqa: F401
    import pyarrow as _pyarrow  # noqa: F401
    import tqdm as _tqdm  # noqa: F401
except ModuleNotFoundError as _error:
    raise ImportError(
        f'sunbeam_mitsuba.sweep needs {_error.name}, which is not installed: pip install "sunbeam-mitsuba[sweep]"'
    ) from None

from .errors import SweepError
from .run import Outcome, Plan, plan, run
from .spec import Spec, make_spec, read_spec

__all__ = ["Outcome", "Plan", "Spec", "SweepError", "make_spec", "plan", "read_spec", "run"]
