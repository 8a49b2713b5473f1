"""The part `batch`: evaluations a second of the C ABI's batches, on one core and on all."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from mitsuba_scenes.environment import REPOSITORY, SetupError

from .speed_error import processor

LIBRARY = REPOSITORY / "target" / "c_abi"
SOURCE = REPOSITORY / "benches" / "batch.c"


def figures() -> dict:
    """The output of `benches/batch.c`, with the processor's name."""
    if not (LIBRARY / "lib" / "libsunbeam.so").exists():
        raise SetupError("the C library is missing: run `make library`")
    with TemporaryDirectory() as folder:
        program = Path(folder) / "batch"
        lib = LIBRARY / "lib"
        words = [os.environ.get("CC", "cc"), "-std=c11", "-O2", "-I", LIBRARY / "include", SOURCE, "-o", program]
        words += ["-L", lib, "-lsunbeam", f"-Wl,-rpath,{lib}", "-lpthread", "-lm"]
        subprocess.run([str(word) for word in words], check=True)
        done = subprocess.run([str(program)], check=True, capture_output=True, text=True)
    made = json.loads(done.stdout)
    by_call: dict[tuple[str, int], dict] = {}
    for row in made["rows"]:
        by_call.setdefault((row["preset"], row["wavelengths"]), {})[row["call"]] = row
    table = [{"preset": preset, "wavelengths": n, "calls": calls} for (preset, n), calls in by_call.items()]
    return {**made, "processor": processor(), "table": table}
