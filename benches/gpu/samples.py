"""Samples follow the density that a BSDF reports, by Mitsuba's χ² test, and a wrong density is rejected."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path

import mitsuba as mi
import numpy as np

from mitsuba_scenes.chi_square import vectorised

from .parts import Check
from .plan import Plan
from .surfaces import surface
from .variants import use

# Level of all tests of a run together.
SIGNIFICANCE = 0.01
# Angle with the normal and azimuth of the incident light, in degrees.
INCIDENCES = ((0, 70), (30, 70), (60, 70))
# A density that is turned by so many degrees is wrong.
WRONG_TURN = 1.0
# More of them would see what the test's own quadrature is off by: with 200,000 the least p of 18 tests was 0.0015.
SAMPLES = 100_000
# An RGB variant integrates over the wavelengths, which smears orders along the plane of incidence alone: they have to
# be wide across it for the test's grid, which is as fine as spectral variants need.
WIDE = {"coherence_length": 10.0}


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    cases = [(kind, name, angles) for kind in plan.kinds for name in plan.sampled for angles in INCIDENCES]
    for kind, name, angles in cases:
        check = partial(follows, plan.variant(kind), name, angles, len(cases))
        yield f"{plan.variant(kind)}, {name}, {angles[0]}°", check
    kind, name = plan.kinds[-1], plan.sampled[0]
    yield f"{plan.variant(kind)}, {name}, wrong density", partial(wrong, plan.variant(kind), name)


@cache
def made(variant: str, name: str, turned: float = 0.0) -> mi.BSDF:
    """The BSDF, made once a process; `turned` by so many degrees."""
    use(variant)
    width = {} if mi.is_spectral else WIDE
    return mi.load_dict({"type": "diffraction", **surface(name), **width, "rotation": turned})


def direction(theta: float, phi: float) -> list[float]:
    """A unit vector from its angles in degrees."""
    theta, phi = np.radians(theta), np.radians(phi)
    return [float(np.sin(theta) * np.cos(phi)), float(np.sin(theta) * np.sin(phi)), float(np.cos(theta))]


def chi_square(variant: str, name: str, angles: tuple, turned: float = 0.0):
    """The test of the samples against the density of the surface that is turned by so many degrees."""
    use(variant)
    bsdf, other = made(variant, name), made(variant, name, turned)
    return vectorised(bsdf, direction(*angles), pdf_of=other, sample_count=SAMPLES)


def follows(variant: str, name: str, angles: tuple, count: int) -> dict:
    test = chi_square(variant, name, angles)
    return {"passed": bool(test.run(SIGNIFICANCE, count, quiet=True)), "p": float(test.p_value)}


def wrong(variant: str, name: str) -> dict:
    """The negative control."""
    test = chi_square(variant, name, INCIDENCES[1], turned=WRONG_TURN)
    return {"passed": not test.run(SIGNIFICANCE, 1, quiet=True), "p": float(test.p_value)}
