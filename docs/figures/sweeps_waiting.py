"""Loaded by the workers of a measured sweep: every case takes so many seconds of waiting, and nothing is computed.

What the sweep itself costs is then measured whatever else the machine does.
"""

from __future__ import annotations

import os
import time

from sunbeam_mitsuba.sweep import work


def waiting(job, case, held):
    """A record like that of a case whose figures were all found."""
    start = time.perf_counter()
    time.sleep(float(os.environ["SUNBEAM_SWEEP_WAIT_SECONDS"]))
    record = work.record_of(job, case, "")
    record["time"]["seconds"] = time.perf_counter() - start
    return record, {}


work.compute = waiting
