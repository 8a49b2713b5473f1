"""Replacement of the computation in a measured sweep: each case waits for a fixed time.

A *case* is a surface in one setting. Dask loads this module in each worker (sweeps_scale.py), and the import replaces
`work.compute`. Cases take SUNBEAM_SWEEP_WAIT_SECONDS each, an environment variable. The time of the sweep beyond these
waits is then the sweep's overhead, whatever other programs do.
"""

from __future__ import annotations

import os
import time

from sunbeam_mitsuba.sweep import work


def waiting(job, case, held):
    """Waits; returns the record of a successful case, and no pictures. It has the signature of `work.compute`.

    `held` has the surfaces that a worker keeps for later cases; it is not used.
    """
    start = time.perf_counter()
    time.sleep(float(os.environ["SUNBEAM_SWEEP_WAIT_SECONDS"]))
    record = work.record_of(job, case, "")
    record["time"]["seconds"] = time.perf_counter() - start
    return record, {}


work.compute = waiting
