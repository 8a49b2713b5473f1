"""Part `batch` of the documentation (page.py): evaluations per second of the C library, on one core and on all.

A *batch* is one call of a C function with many pairs of directions. The program benches/batch.c measures.
"""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from mitsuba_scenes.environment import REPOSITORY, SetupError

from .speed_error import processor

# Folder of the C library, written by `make library`: headers in include/, libsunbeam.so in lib/.
LIBRARY = REPOSITORY / "target" / "c_abi"
# Source of the program that measures and prints one JSON object.
SOURCE = REPOSITORY / "benches" / "batch.c"


def figures() -> dict:
    """The output of `benches/batch.c`, the processor's name, and under `table` the rows of the page's table.

    A row of the table is {preset, wavelengths, calls}; `calls` has the program's row for each call, such as `eval`.
    """
    lib = LIBRARY / "lib"
    if not (lib / "libsunbeam.so").exists():
        raise SetupError("the C library is missing: run `make library`")
    with TemporaryDirectory() as folder:
        program = Path(folder) / "batch"
        command = [os.environ.get("CC", "cc"), "-std=c11", "-O2", "-I", LIBRARY / "include", SOURCE, "-o", program]
        command += ["-L", lib, "-lsunbeam", f"-Wl,-rpath,{lib}", "-lpthread", "-lm"]
        subprocess.run([str(word) for word in command], check=True)
        done = subprocess.run([str(program)], check=True, capture_output=True, text=True)
    report = json.loads(done.stdout)
    # The program has a row for each preset, number of wavelengths and call.
    calls_of: dict[tuple[str, int], dict] = {}
    for row in report["rows"]:
        calls_of.setdefault((row["preset"], row["wavelengths"]), {})[row["call"]] = row
    table = [{"preset": preset, "wavelengths": count, "calls": calls} for (preset, count), calls in calls_of.items()]
    return {**report, "processor": processor(), "table": table}
