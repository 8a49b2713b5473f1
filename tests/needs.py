"""Optional parts of the machine that tests run on: how a test skips without one.

`needs.txt` lists the parts. `SUNBEAM_REQUIRE=gpu,scans` names those that this machine has: a test that skips for want
of one of them fails. Other skips are appended to the file that `SUNBEAM_SKIPS` names. `crates/testing` does the same
for Rust.
"""

from __future__ import annotations

import importlib
import os
import shutil
from pathlib import Path
from types import ModuleType

import pytest

# Names of the parts, the first words of the lines.
NEEDS = [line.split()[0] for line in Path(__file__).with_name("needs.txt").read_text(encoding="utf-8").splitlines()]


def required() -> set[str]:
    """The parts that `SUNBEAM_REQUIRE` names; `pytest.UsageError` where one of them is unknown."""
    names = {name.strip() for name in os.environ.get("SUNBEAM_REQUIRE", "").split(",")} - {""}
    if unknown := sorted(names - set(NEEDS)):
        raise pytest.UsageError(f"SUNBEAM_REQUIRE: {unknown[0]!r} is none of {', '.join(NEEDS)}")
    return names


def miss(need: str, tests: str, reason: str) -> None:
    """Reports that the tests named `tests` lack the part `need` and do not run; fails where the part is required."""
    assert need in NEEDS, need
    if need in required():
        pytest.fail(f"SUNBEAM_REQUIRE names {need}: {reason}", pytrace=False)
    if path := os.environ.get("SUNBEAM_SKIPS"):
        with open(path, "a", encoding="utf-8") as file:
            file.write(f"SKIPPED {tests} ({need}): {reason}\n")


def skip(need: str, reason: str, *, module: str = "") -> None:
    """Skips the running test, or the named module while it is imported; fails where the part `need` is required."""
    # pytest names the running test and, after a space, its stage: "tests/test_x.py::test_y (call)".
    running = os.environ.get("PYTEST_CURRENT_TEST", "a test").rsplit(" (", 1)[0]
    miss(need, module or running, reason)
    pytest.skip(f"{need}: {reason}", allow_module_level=bool(module))


def require_program(need: str, program: str) -> None:
    """Skips the running test as `skip` does where the program is not installed."""
    if not shutil.which(program):
        skip(need, f"{program} is not installed")


def require_module(need: str, name: str) -> ModuleType:
    """Imports a module; skips the running test as `skip` does where it cannot be imported."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        skip(need, str(error))
        # Not reached, since `skip` raises.
        raise
