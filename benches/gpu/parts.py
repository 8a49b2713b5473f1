"""The parts of a run of `python -m benches.gpu`: name, module, expected time and time limit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from .plan import Plan

# Name and function of a check. The function returns a dictionary of figures, with `passed` unless it only measures.
Check = tuple[str, Callable[[], dict]]


@dataclass(frozen=True)
class Part:
    """A part: the function `checks(plan, folder, *arguments)` of `module`, a file of this folder, yields its checks.

    `title` describes the part in one line. `estimate_s` is the time on an H100 with 16 cores and empty caches, and
    `limit_s` the time limit, both in seconds.
    """

    title: str
    module: str
    arguments: tuple[str, ...]
    estimate_s: int
    limit_s: int

    def checks(self, plan: Plan, folder: Path) -> Iterator[Check]:
        """The checks in their order. `folder` is the folder for pictures."""
        return import_module(f".{self.module}", __package__).checks(plan, folder, *self.arguments)


# The parts in the order of a run: checks first, timings last. "Reference": the variant compared with (variants.py).
# "Frozen": recorded once by `dr.freeze` and replayed.
PARTS: dict[str, Part] = {
    "adapter": Part("shaders compile, and a lost device is an error", "adapter", (), 8, 30),
    "agree-rgb": Part("answers of the RGB variant beside its reference", "agreement", ("rgb",), 25, 60),
    "agree-spectral": Part("answers of the spectral variant", "agreement", ("spectral",), 30, 60),
    "agree-mono": Part("answers of the mono variant", "agreement", ("mono",), 25, 60),
    "agree-polarized": Part("answers of the polarised variant", "agreement", ("spectral_polarized",), 55, 100),
    "samples": Part("samples follow the density: chi-square at three incidences", "samples", (), 20, 60),
    "derivatives": Part("derivatives beside central differences", "derivatives", (), 20, 60),
    "kernels": Part("several BSDFs and scenes in a process, changed and frozen", "kernels", (), 30, 60),
    "freeze-changed": Part("a frozen render of a changed coherence length", "freeze_changed", (), 10, 30),
    "snake": Part("the path-traced snake beside its reference", "snake", (), 25, 60),
    "without-optix": Part("calls of a BSDF where OptiX is missing", "without_optix", (), 8, 30),
    "pictures": Part("maps and pictures of the realtime renderer beside CPU and software", "pictures", (), 35, 90),
    "realtime": Part("times of the realtime renderer's frames", "realtime", (), 40, 90),
    "renders": Part("renders of the benchmark scenes beside roughconductor", "renders", (), 70, 120),
    "calls": Part("nanoseconds of a call beside roughconductor", "calls", (), 30, 60),
    "inspection": Part("registers and memory of kernels, memory of tables", "inspection", (), 20, 60),
}
