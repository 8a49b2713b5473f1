"""A module for the workers of a measured sweep, in which cases wait instead of computing.

The overhead of the sweep is then independent of other programs on the machine.
"""

from __future__ import annotations

import os
import time

from sunbeam_mitsuba.sweep import work


def waiting(job, case, held):
    """A record like that of a successful case, after waiting."""
    start = time.perf_counter()
    time.sleep(float(os.environ["SUNBEAM_SWEEP_WAIT_SECONDS"]))
    record = work.record_of(job, case, "")
    record["time"]["seconds"] = time.perf_counter() - start
    return record, {}


work.compute = waiting
