"""The part `covers-validity`: gratings under a clear cover against independent solvers.

The solvers, the *judges* (tests/judges/gratings), solve for light and orders in a medium of the cover's index. A power
is the fraction of unpolarised light from air in an order that leaves into air. *Misplaced* power is the fraction of the
leaving light that a theory puts into wrong orders. Light *to and fro* is reflected by the flat side back to the grating
before it leaves; the project leaves it out.
"""

from __future__ import annotations

import json

import numpy as np

from mitsuba_scenes.tool import sunbeam
from tests.judges.gratings import covers
from tests.judges.gratings.boundary_integral import Resolution
from tests.judges.gratings.covers import transmittances
from tests.judges.gratings.drawn import (
    COVER_ETAS,
    COVERED,
    COVERED_PERIODS_UM,
    DIELECTRIC,
    DIELECTRIC_ETA,
    Judged,
    Setting,
    leaving,
    left_out,
    load,
    perfect,
)
from tests.judges.gratings.metals import index
from tests.judges.gratings.scalar import MODELS, STAM_LIMITED, Grating, Light, efficiencies, misplaced
from tests.judges.gratings.theories import EXACT, SCALAR

from . import validity_sweeps as sweeps
from .page import insist
from .validity import CASES
from .validity_metals import METAL_JUDGES, NAMES, summary
from .validity_sweeps import angles_of

PART = "covers-validity"
# Index of polycarbonate at 589 nm. At 1.58 orders of the page's gratings would graze the surface inside.
POLYCARBONATE = 1.585
# Largest accepted rms error of an order's power by `rigorous`.
EXACT_RMS_MAX = 1e-3
# Ends of the ranges of angles of incidence in which misplaced power of random settings is averaged.
REACHES_DEG = (30.0, 60.0, 75.0)
# Metal of the gratings between which light goes to and fro.
TO_AND_FRO_METAL = "Al"
# Gratings of the table of light to and fro: kind and grating; the first is a mirror.
TO_AND_FRO = (
    ("flat", Grating("sinusoidal", 2.5, 1e-4)),
    ("sinusoid", sweeps.sinusoid(2.5, 10.0)),
    ("sawtooth", sweeps.sawtooth(2.5, 5.71)),
    ("lamellar", Grating("lamellar", 2.5, 0.125)),
    ("lamellar", Grating("lamellar", 1.25, 0.125)),
)


def relative(found: np.ndarray, true: np.ndarray) -> float:
    """Misplaced power as a fraction of the light that leaves."""
    return misplaced(found, true) / float(true.sum())


def compared(answer: Judged) -> dict:
    """A setting's powers: by each theory, by the judge with both ways through the flat side, and without the cover."""
    bare = {theory: covers.powers(answer, theory, cover_eta=1.0) for theory in (SCALAR, EXACT)}
    return {
        "answer": answer,
        SCALAR: covers.powers(answer, SCALAR),
        EXACT: covers.powers(answer, EXACT),
        "means": covers.through_means(answer),
        "states": covers.through_states(answer),
        "bare": relative(bare[SCALAR], bare[EXACT]),
    }


def errors(group: list[dict], theory: str, truth: str) -> dict:
    return summary(np.concatenate([each[theory] - each[truth] for each in group]))


def by_reach(made: list[dict]) -> list[dict]:
    """Mean misplaced power of the phase screen, bare and covered, by shape and for metals or dielectric.

    `spans` has the ranges of angles that end at REACHES_DEG.
    """
    rows = []
    for dielectric in (False, True):
        for shape in METAL_JUDGES:
            settings = [each["answer"].setting for each in made]
            group = [e for e, s in zip(made, settings) if s.shape == shape and (s.metal == DIELECTRIC) == dielectric]
            spans = []
            for chosen in in_spans(group):
                covered = [relative(each[SCALAR], each["means"]) for each in chosen]
                bare = [each["bare"] for each in chosen]
                means = {"bare": float(np.mean(bare)), "covered": float(np.mean(covered))}
                spans.append({"settings": len(chosen), **means})
            rows.append({"shape": shape, "dielectric": dielectric, "spans": spans})
    return rows


def in_spans(made: list[dict]) -> list[list[dict]]:
    """The settings of each range of angles that ends at REACHES_DEG."""
    ranges = zip((0.0, *REACHES_DEG), REACHES_DEG)
    return [[each for each in made if low <= each["answer"].setting.theta_deg < high] for low, high in ranges]


def drawn() -> dict:
    """Errors on the random gratings: rows by medium and shape, and those of mean transmittances by angle.

    `unsettled` is the judge's own largest error. Raises SetupError if `rigorous` is off by more than EXACT_RMS_MAX.
    """
    made = [compared(answer) for answer in load(COVERED)]
    groups: dict[tuple[str, str], list[dict]] = {}
    for each in made:
        setting = each["answer"].setting
        groups.setdefault((setting.metal, setting.shape), []).append(each)
    rows = []
    for (medium, shape), group in groups.items():
        exact = errors(group, EXACT, "means")
        insist(PART, exact["rms"] < EXACT_RMS_MAX, f"exact is right in {medium}, {shape}")
        rows.append(
            {
                "medium": medium,
                "shape": shape,
                "judge": METAL_JUDGES[shape],
                "settings": len(group),
                "orders": sum(len(each["answer"].orders) for each in group),
                "unsettled": max(each["answer"].unsettled for each in group),
                "scalar": errors(group, SCALAR, "means"),
                "exact": exact,
            }
        )
    return {
        "rows": rows,
        "misplaced": by_reach(made),
        "exact": errors(made, EXACT, "means"),
        "states": [errors(chosen, EXACT, "states") for chosen in in_spans(made)],
        "settings": len(made),
        "left_out": len(left_out(COVERED)),
    }


def answered(grating: Grating, light: Light) -> Judged:
    """The orders of a perfect conductor under polycarbonate by the boundary integral."""
    theta_deg, phi_deg = abs(light.theta_i_deg), 0.0 if light.theta_i_deg >= 0 else 180.0
    size = (grating.period, grating.height)
    setting = Setting("none", grating.preset, *size, light.wavelength_nm, theta_deg, phi_deg, cover_eta=POLYCARBONATE)
    return leaving(setting, perfect(setting, Resolution()), 0.0)


def case(kind: str, slope_deg: float | None, grating: Grating) -> dict:
    """Misplaced power on a perfect conductor by model and angle of incidence, bare and under polycarbonate.

    A mean over the wavelengths. `exact` is the largest error of an order's power by `rigorous` under the cover.
    """
    angles_deg = angles_of(grating)
    lights = [Light(nm, angle) for angle in angles_deg for nm in sweeps.WAVELENGTHS_NM]
    judged = [answered(grating, light) for light in lights]
    true = [covers.through_means(answer) for answer in judged]
    off = [np.abs(covers.powers(answer, EXACT) - power).max() for answer, power in zip(judged, true)]
    covered = {}
    for model in MODELS:
        found = efficiencies(grating, model, lights, cover_eta=POLYCARBONATE)
        by_light = np.array([relative(a, b) for a, b in zip(found, true)])
        covered[model.name] = by_light.reshape(len(angles_deg), -1).mean(axis=1).tolist()
    return {
        "kind": kind,
        "slope_deg": slope_deg,
        "period_um": grating.period,
        "height_um": grating.height,
        "angles_deg": list(angles_deg),
        "bare": [sweeps.mean_error(grating, STAM_LIMITED, angle) for angle in angles_deg],
        "covered": covered,
        "exact": float(max(off)),
    }


def inside(grating: Grating, nm: float, sine: float) -> dict[int, tuple[float, float]]:
    """Efficiencies of s and p of the orders inside polycarbonate, for light across the grooves at a sine inside.

    Light in a cover of index n meets the grating as that n times as large in air, with indices relative to n.
    """
    n, metal = POLYCARBONATE, index(TO_AND_FRO_METAL, nm) / POLYCARBONATE
    words = ["--preset", grating.preset, "--period", n * grating.period, "--height", n * grating.height]
    words += ["--eta", metal.real, "--k", metal.imag, "--theory", "rigorous", "--wavelength", nm, "--json"]
    light = ["--theta-i", float(np.degrees(np.arcsin(abs(sine)))), "--phi-i", 0 if sine >= 0 else 180]
    return {
        order["order"]: (order["te"], order["tm"]) for order in json.loads(sunbeam("orders", *words, *light))["orders"]
    }


def to_and_fro(grating: Grating, light: Light) -> tuple[float, float]:
    """Fractions of unpolarised light that leave after one reflection by the grating, and after more.

    Powers add up, since a cover is much thicker than light is coherent. Orders keep their direction cosines along x in
    the flat side's reflection, so that all light is in the orders j of `sines`, which are those in air.
    """
    rate, sine = light.wavelength_nm * 1e-3 / grating.period, np.sin(np.radians(light.theta_i_deg))
    most = int((POLYCARBONATE + 1) / rate) + 1
    numbers = np.arange(-most, most + 1)
    numbers = numbers[np.abs(numbers * rate - sine) < POLYCARBONATE]
    sines = numbers * rate - sine
    place = {int(number): i for i, number in enumerate(numbers)}
    count = len(numbers)
    # Efficiencies [state, to, from], for light that comes down from the flat side along each order.
    again = np.zeros((2, count, count))
    for i, number in enumerate(numbers):
        for step, pair in inside(grating, light.wavelength_nm, -sines[i] / POLYCARBONATE).items():
            again[:, place[int(number) + step], i] = pair
    through = np.zeros((2, count))
    out = np.abs(sines) < 1
    through[:, out] = transmittances(POLYCARBONATE, np.sqrt(1 - sines[out] ** 2)).T
    arriving = transmittances(POLYCARBONATE, np.cos(np.radians(light.theta_i_deg)))
    once, later = 0.0, 0.0
    for state in range(2):
        # The incident light arrives as if along order 0 from the flat side.
        first = arriving[state] * again[state][:, place[0]]
        every = np.linalg.solve(np.eye(count) - again[state] * (1 - through[state]), first)
        once += 0.5 * float(through[state] @ first)
        later += 0.5 * float(through[state] @ (every - first))
    return once, later


def left_in(kind: str, grating: Grating) -> dict:
    """Light that leaves polycarbonate over aluminium: fractions of the incident, means over the wavelengths, by angle.

    `once` leaves after one reflection by the grating and `later` after more.
    """
    rows = [
        np.mean([to_and_fro(grating, Light(nm, angle)) for nm in sweeps.WAVELENGTHS_NM], axis=0)
        for angle in sweeps.ANGLES_DEG
    ]
    once, later = np.array(rows).T
    size = {"period_um": grating.period, "height_um": grating.height}
    return {"kind": kind, **size, "once": once.tolist(), "later": later.tolist()}


def figures() -> dict:
    """All numbers of the part."""
    return {
        "names": {**NAMES, DIELECTRIC: "dielectric"},
        "dielectric_eta": DIELECTRIC_ETA,
        "periods_um": list(COVERED_PERIODS_UM),
        "cover_etas": list(COVER_ETAS),
        "polycarbonate": POLYCARBONATE,
        "critical_deg": float(np.degrees(np.arcsin(1 / POLYCARBONATE))),
        "wavelengths_nm": list(sweeps.WAVELENGTHS_NM),
        "angles_deg": list(sweeps.ANGLES_DEG),
        "reaches_deg": list(REACHES_DEG),
        "models": [model.name for model in MODELS],
        "drawn": drawn(),
        "cases": [case(*each) for each in CASES],
        "to_and_fro": [left_in(*each) for each in TO_AND_FRO],
    }
