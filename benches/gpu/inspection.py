"""Registers, stack and operations of the BSDFs' kernels, and the memory of their tables.

The CUDA driver reports registers and stack of each kernel that it compiles, in Dr.Jit's log at the level Trace. Cached
kernels are not compiled, and other backends report nothing.
"""

from __future__ import annotations

import gc
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryFile

import drjit as dr
import mitsuba as mi
import numpy as np

from .parts import Check
from .plan import Plan
from .questions import Questions, drawn, interactions, random_numbers
from .surfaces import surface
from .variants import use

# Calls whose kernels are inspected.
CALLS = ("eval_pdf", "sample")
# Number of questions (questions.py), each one set of arguments of a call. Any number and seed give the same kernel.
COUNT = 1 << 12
# Patterns of the driver's report, such as "Used 56 registers, 4096 bytes cmem[0]" and "8 bytes stack frame, 4 bytes
# spill stores, 4 bytes spill loads".
REPORTED = {
    "registers": re.compile(r"Used (\d+) registers"),
    "stack_bytes": re.compile(r"(\d+) bytes stack frame"),
    "spill_store_bytes": re.compile(r"(\d+) bytes spill stores"),
    "spill_load_bytes": re.compile(r"(\d+) bytes spill loads"),
}
# Bytes by unit, as `dr.whos` prints sizes.
UNITS = {"B": 1, "KiB": 1 << 10, "MiB": 1 << 20, "GiB": 1 << 30}


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """One inspection per kind of variant, such as `rgb`, and surface. No file is written to `folder`."""
    for kind in plan.kinds:
        for name in plan.inspected:
            yield f"{plan.variant(kind)}, {name}", partial(inspected, plan.variant(kind), name)


def inspected(variant: str, name: str) -> dict:
    """Memory `table_mb` of a surface's tables in MB, and the results of `kernel` by call."""
    use(variant)
    asked = drawn(np.random.default_rng(3), COUNT)
    before = storage_bytes()
    bsdf = mi.load_dict({"type": "diffraction", **surface(name)})
    tables = storage_bytes() - before
    return {"table_mb": tables / 1e6, **{call: kernel(partial(answer, bsdf, call, asked)) for call in CALLS}}


def answer(bsdf: mi.BSDF, call: str, asked: Questions) -> list:
    """The unevaluated result of a call."""
    ctx, si = mi.BSDFContext(), interactions(asked)
    if call == "eval_pdf":
        return list(bsdf.eval_pdf(ctx, si, mi.Vector3f(asked.wo)))
    sample, weight = bsdf.sample(ctx, si, *random_numbers(asked))
    return [sample.wo, sample.pdf, weight]


def kernel(call: Callable[[], list]) -> dict:
    """Compiles and runs the kernels of a call, and describes the one with the most operations.

    `operations` are counted by Dr.Jit, and `source_kb` is the size of its intermediate code in kB. `compiled_s` is the
    compilation time in s, and `cached` says whether a cache had the kernel. `reported` adds the driver's numbers, the
    largest over all kernels of the call.
    """
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        with logged() as log:
            dr.eval(call())
            dr.sync_thread()
        history = dr.kernel_history([dr.KernelType.JIT])
    largest = max(history, key=lambda entry: entry["operation_count"])
    return {
        "operations": largest["operation_count"],
        "source_kb": len(largest["ir"].getvalue()) / 1e3,
        # Dr.Jit measures in ms.
        "compiled_s": largest["backend_time"] / 1e3,
        "cached": bool(largest["cache_hit"] or largest["cache_disk"]),
        **reported(log()),
    }


@contextmanager
def logged() -> Iterator[Callable[[], str]]:
    """Captures the process's standard output and standard error while Dr.Jit logs everything.

    The file descriptors are redirected, because Dr.Jit and the driver write from C. The yielded function returns the
    captured text; it is empty until the context ends.
    """
    captured, level, streams = "", dr.log_level(), (sys.stdout, sys.stderr)
    with TemporaryFile() as file:
        kept = [os.dup(stream.fileno()) for stream in streams]
        for stream in streams:
            stream.flush()
            os.dup2(file.fileno(), stream.fileno())
        dr.set_log_level(dr.LogLevel.Trace)
        try:
            yield lambda: captured
        finally:
            dr.set_log_level(level)
            for stream, original in zip(streams, kept):
                stream.flush()
                os.dup2(original, stream.fileno())
                os.close(original)
            file.seek(0)
            captured = file.read().decode(errors="replace")


def reported(log: str) -> dict:
    """The largest of each number of REPORTED in the driver's report; `None` if it is missing."""
    found = {name: [int(number) for number in pattern.findall(log)] for name, pattern in REPORTED.items()}
    return {name: max(numbers, default=None) for name, numbers in found.items()}


def storage_bytes() -> float:
    """Bytes of evaluated arrays that Dr.Jit holds on the device; NaN if its report has no such line."""
    gc.collect()
    dr.sync_thread()
    found = re.search(r"Storage\s*:\s*([\d.]+) (\w+) on device", dr.whos(as_string=True))
    return float(found[1]) * UNITS[found[2]] if found else float("nan")
