"""The parts of a run: what each is called, where it is, and how long it may take."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from .plan import Plan

# A check by name: it returns its figures, in which `passed` is false where it failed; a measurement has no `passed`.
Check = tuple[str, Callable[[], dict]]


@dataclass(frozen=True)
class Part:
    """`module` of this package has the function `checks(plan, folder, *arguments)`, which yields the part's checks.

    `estimate_s` is what the part is expected to take on an H100 with 16 cores, and `limit_s` the time after which it is
    ended; both with tables to build and kernels to compile.
    """

    title: str
    module: str
    arguments: tuple[str, ...]
    estimate_s: int
    limit_s: int

    def checks(self, plan: Plan, folder: Path) -> Iterator[Check]:
        """The checks in their order. `folder` is where pictures are kept."""
        return import_module(f".{self.module}", __package__).checks(plan, folder, *self.arguments)


# In the order in which they run: what may be wrong first, what is only slow last.
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
