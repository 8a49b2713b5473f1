"""Checks of the graphics adapter: every shader compiles, and work on a lost device is an error."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from mitsuba_scenes.tool import sunbeam

from .parts import Check
from .plan import Plan


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """The only check."""
    yield "shaders and a lost device", partial(described, plan)


def described(plan: Plan) -> dict:
    """Runs `sunbeam adapter`, which fails if a shader does not compile or work on a lost device returns a result.

    Returns `adapter` (its name), `backend` (graphics interface), `driver`, `software` (a software adapter), `clock`
    (source of GPU times), `lost_device` (error message of a lost device), and `shader_ms`, compilation times in ms.
    """
    found = json.loads(sunbeam("adapter", "--adapter", plan.adapter))
    return {
        # A run with a card must not measure the software adapter; a dry run uses no other.
        "passed": found["software"] == plan.dry and bool(found["lost_device"]),
        **{name: found[name] for name in ("adapter", "backend", "driver", "software", "clock", "lost_device")},
        "shader_ms": {shader["name"]: shader["ms"] for shader in found["shaders"]},
    }
