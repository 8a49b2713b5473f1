"""Preloaded by the workers of a measured sweep: cases wait instead of computing.

Importing this module replaces `work.compute`. Cases take SUNBEAM_SWEEP_WAIT_SECONDS each, an environment variable, so
the overhead of the sweep is independent of other programs on the machine.
"""

from __future__ import annotations

import os
import time

from sunbeam_mitsuba.sweep import work


def waiting(job, case, held):
    """Waits; returns the record of a successful case, and no pictures. It has the signature of `work.compute`."""
    start = time.perf_counter()
    time.sleep(float(os.environ["SUNBEAM_SWEEP_WAIT_SECONDS"]))
    record = work.record_of(job, case, "")
    record["time"]["seconds"] = time.perf_counter() - start
    return record, {}


work.compute = waiting
