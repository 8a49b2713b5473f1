"""Replacement of the computation in a measured sweep: each case waits for a fixed time.

A *sweep* computes many cases in parallel; a *case* is a surface with one set of parameters. Dask loads this module in
each worker (sweeps_scale.py), and the import replaces `work.compute`. The environment variable
SUNBEAM_SWEEP_WAIT_SECONDS has the seconds that each case waits. The sweep's time beyond the waits is its overhead.
Unlike a computation, a wait takes no longer when other programs run.
"""

from __future__ import annotations

import os
import time

from sunbeam_mitsuba.sweep import work


def waiting(job, case, held):
    """Waits; returns the record of a successful case, and no pictures. Its signature is that of `work.compute`.

    `held`, the surfaces that a worker keeps for later cases, is not used.
    """
    start = time.perf_counter()
    time.sleep(float(os.environ["SUNBEAM_SWEEP_WAIT_SECONDS"]))
    record = work.record_of(job, case, "")
    record["time"]["seconds"] = time.perf_counter() - start
    return record, {}


work.compute = waiting
