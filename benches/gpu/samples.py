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
INCIDENCES_DEG = ((0, 70), (30, 70), (60, 70))
# Rotation in degrees of the wrong density, the negative control.
WRONG_TURN_DEG = 1.0
# Number of samples of a test. More samples would detect the error of the test's own quadrature: with 200,000 samples,
# the smallest p of 18 tests was 0.0015.
SAMPLES = 100_000
# Additional parameters for RGB variants, with the coherence length in µm. In these variants the integral over
# wavelengths widens orders, but within the plane of incidence only. The short coherence length widens them
# perpendicular to that plane, too, so that the test's grid resolves them.
WIDE = {"coherence_length": 10.0}


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """One test per kind of variant (such as `rgb`), surface and incidence, and the negative control."""
    cases = [(kind, name, angles_deg) for kind in plan.kinds for name in plan.sampled for angles_deg in INCIDENCES_DEG]
    for kind, name, angles_deg in cases:
        check = partial(follows, plan.variant(kind), name, angles_deg, len(cases))
        yield f"{plan.variant(kind)}, {name}, {angles_deg[0]}°", check
    kind, name = plan.kinds[-1], plan.sampled[0]
    yield f"{plan.variant(kind)}, {name}, wrong density", partial(wrong, plan.variant(kind), name)


@cache
def rotated_bsdf(variant: str, name: str, turned_deg: float) -> mi.BSDF:
    """The BSDF of a surface with its relief rotated by `turned_deg`, cached."""
    use(variant)
    width = {} if mi.is_spectral else WIDE
    return mi.load_dict({"type": "diffraction", **surface(name), **width, "rotation": turned_deg})


def direction(theta_deg: float, phi_deg: float) -> list[float]:
    """A unit vector from its angles: `theta_deg` with the normal z, and the azimuth `phi_deg` from x towards y."""
    theta, phi = np.radians(theta_deg), np.radians(phi_deg)
    return [float(np.sin(theta) * np.cos(phi)), float(np.sin(theta) * np.sin(phi)), float(np.cos(theta))]


def chi_square(variant: str, name: str, angles_deg: tuple, turned_deg: float = 0.0):
    """A `ChiSquareTest`, not yet run, of a surface's samples against its density after a rotation by `turned_deg`.

    `angles_deg` are those of the incident light.
    """
    use(variant)
    bsdf, other = rotated_bsdf(variant, name, 0.0), rotated_bsdf(variant, name, turned_deg)
    return bsdf_test(bsdf, direction(*angles_deg), pdf_of=other, sample_count=SAMPLES)


def follows(variant: str, name: str, angles_deg: tuple, count: int) -> dict:
    """Tests the samples against the BSDF's density, as one of `count` tests."""
    test = chi_square(variant, name, angles_deg)
    return {"passed": bool(test.run(SIGNIFICANCE, count, quiet=True)), "p": float(test.p_value)}


def wrong(variant: str, name: str) -> dict:
    """The negative control: at one of INCIDENCES_DEG, a rotated density must be rejected."""
    test = chi_square(variant, name, INCIDENCES_DEG[1], turned_deg=WRONG_TURN_DEG)
    return {"passed": not test.run(SIGNIFICANCE, 1, quiet=True), "p": float(test.p_value)}
