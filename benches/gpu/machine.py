"""Description of the machine: card, driver, processor, and versions of the software."""

from __future__ import annotations

import ctypes
import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from mitsuba_scenes import tool

# Fields of nvidia-smi and their keys in the results. Values are texts with units, such as `81559 MiB` of memory.
CARD_FIELDS = {
    "name": "card",
    "driver_version": "driver",
    "memory.total": "memory",
    "compute_cap": "compute_capability",
}


def card() -> dict | None:
    """The first NVIDIA card that `nvidia-smi` lists, under the result keys of CARD_FIELDS; `None` if that fails."""
    query = ["nvidia-smi", f"--query-gpu={','.join(CARD_FIELDS)}", "--format=csv,noheader"]
    try:
        done = subprocess.run(query, capture_output=True, text=True, timeout=30)
    except (OSError, subprocess.TimeoutExpired):
        return None
    if done.returncode != 0 or not done.stdout.strip():
        return None
    values = [value.strip() for value in done.stdout.splitlines()[0].split(",")]
    return dict(zip(CARD_FIELDS.values(), values))


def described(found: dict | None) -> dict:
    """The card `found` by `card()`, the processor, and the versions of the software.

    `optix` is whether the OptiX library can be loaded, by Dr.Jit's variable or else its default name. Raises SetupError
    if the command `sunbeam` is missing.
    """
    return {
        "card": None,
        **(found or {}),
        "processor": processor(),
        "cores": os.cpu_count(),  # logical cores
        "python": platform.python_version(),
        **{name: installed(name) for name in ("mitsuba", "drjit", "numpy")},
        "sunbeam": tool.sunbeam("--version").split()[-1],
        "optix": loads(os.environ.get("DRJIT_LIBOPTIX_PATH") or "libnvoptix.so.1"),
    }


def installed(package: str) -> str:
    """The version of a package; `unknown` without its metadata."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def loads(library: str) -> bool:
    """Whether the dynamic linker can load a library."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def processor() -> str:
    """The model of the CPU from /proc/cpuinfo; `unknown CPU` where it names none."""
    file = Path("/proc/cpuinfo")
    lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown CPU")
