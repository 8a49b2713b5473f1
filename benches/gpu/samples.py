"""Mitsuba's χ² test of samples against the BSDF's density, with a wrong density as the negative control."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path

import mitsuba as mi
import numpy as np

from mitsuba_scenes.chi_square import bsdf_test

from .parts import Check
from .plan import Plan
from .surfaces import surface
from .variants import use

# Significance level of all tests of a run together. The test's method `run` corrects it for their number.
SIGNIFICANCE = 0.01
# Incident light in degrees: (angle with the normal, azimuth). The azimuth lies off both axes of the relief, so that an
# exchange of the axes would show.
INCIDENCES = ((0, 70), (30, 70), (60, 70))
# Rotation in degrees of the wrong density, the negative control.
WRONG_TURN = 1.0
# Number of samples of a test. More samples would detect the error of the test's own quadrature: with 200,000 samples,
# the smallest p of 18 tests was 0.0015.
SAMPLES = 100_000
# Additional parameters for RGB variants, with the coherence length in µm. Their integral over wavelengths widens orders
# within the plane of incidence only. The short coherence length widens them perpendicular to that plane, too, so that
# the test's grid resolves them.
WIDE = {"coherence_length": 10.0}


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """One test per kind of variant (such as `rgb`), surface and incidence, and the negative control."""
    cases = [(kind, name, angles) for kind in plan.kinds for name in plan.sampled for angles in INCIDENCES]
    for kind, name, angles in cases:
        check = partial(follows, plan.variant(kind), name, angles, len(cases))
        yield f"{plan.variant(kind)}, {name}, {angles[0]}°", check
    kind, name = plan.kinds[-1], plan.sampled[0]
    yield f"{plan.variant(kind)}, {name}, wrong density", partial(wrong, plan.variant(kind), name)


@cache
def made(variant: str, name: str, turned: float = 0.0) -> mi.BSDF:
    """The BSDF, cached; `turned` is its rotation in degrees."""
    use(variant)
    width = {} if mi.is_spectral else WIDE
    return mi.load_dict({"type": "diffraction", **surface(name), **width, "rotation": turned})


def direction(theta: float, phi: float) -> list[float]:
    """A unit vector from its angles in degrees: `theta` with the normal z, and the azimuth `phi` from x towards y."""
    theta, phi = np.radians(theta), np.radians(phi)
    return [float(np.sin(theta) * np.cos(phi)), float(np.sin(theta) * np.sin(phi)), float(np.cos(theta))]


def chi_square(variant: str, name: str, angles: tuple, turned: float = 0.0):
    """A `ChiSquareTest`, not yet run, of a surface's samples against its density after a rotation by `turned` degrees.

    `angles` are those of the incident light, in degrees.
    """
    use(variant)
    bsdf, other = made(variant, name), made(variant, name, turned)
    return bsdf_test(bsdf, direction(*angles), pdf_of=other, sample_count=SAMPLES)


def follows(variant: str, name: str, angles: tuple, count: int) -> dict:
    """Tests the samples against the BSDF's density, as one of `count` tests."""
    test = chi_square(variant, name, angles)
    return {"passed": bool(test.run(SIGNIFICANCE, count, quiet=True)), "p": float(test.p_value)}


def wrong(variant: str, name: str) -> dict:
    """The negative control: at one of INCIDENCES, a rotated density must be rejected."""
    test = chi_square(variant, name, INCIDENCES[1], turned=WRONG_TURN)
    return {"passed": not test.run(SIGNIFICANCE, 1, quiet=True), "p": float(test.p_value)}
