"""Part `covers-validity` of the documentation (page.py): gratings under a clear cover against independent solvers.

`drawn` compares both theories, SCALAR and EXACT, on random gratings. `case` compares the phase screen on perfect
conductors with and without a cover. `to_and_fro` estimates the light that both theories omit.

- A *cover* is a clear layer over the relief, whose upper side is flat.
- The solvers, the *judges* (tests/judges/gratings), solve for light and orders in a medium of the cover's index. Their
  powers are multiplied by the transmittances of the cover's flat side, on the way in and on the way out.
- A *power* is the fraction of unpolarised light from air that leaves into air in one order.
- *Misplaced* power is the fraction of the leaving light that a theory puts into wrong orders.
- SCALAR is the phase screen, EXACT is `theory = rigorous` (tests/judges/gratings/theories.py).
- *Bare* gratings have no cover.
- An *answer* is a judge's result for one setting, a grating with a light: the orders and their powers.
- Light *to and fro* is reflected by the cover's flat side back to the grating before it leaves.

Symbols: n is the cover's index, λ the wavelength in vacuum, d the period and θi the angle of incidence in air. Order j
has the direction cosine q_j = jλ/d − sin θi along x, in units of the wave number in vacuum. It propagates in the cover
if |q_j| < n and in air if |q_j| < 1. Reflection by the flat side leaves q_j unchanged.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

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
# Index of polycarbonate at 589 nm. The rounded 1.58 would let orders of the page's gratings graze the surface inside.
POLYCARBONATE = 1.585
# Largest accepted rms error of an order's power by EXACT. The judges' own errors are up to half as large.
EXACT_RMS_MAX = 1e-3
# Upper ends of the spans, ranges of angles of incidence by which random settings are grouped. The first span begins at
# 0°. No setting has an angle above the last end.
REACHES_DEG = (30.0, 60.0, 75.0)
# Metal of the gratings of TO_AND_FRO.
TO_AND_FRO_METAL = "Al"
# Gratings of the table of light to and fro: the kind's name on the page, and the grating. Numbers are the period in µm,
# and the height in µm or the slope in degrees. The first grating is so shallow that it is a mirror. At 5.71° the
# sawtooth's height is a tenth of its period, as that of the preset `blazed`.
TO_AND_FRO = (
    ("flat", Grating("sinusoidal", 2.5, 1e-4)),
    ("sinusoid", sweeps.sinusoid(2.5, 10.0)),
    ("sawtooth", sweeps.sawtooth(2.5, 5.71)),
    ("lamellar", Grating("lamellar", 2.5, 0.125)),
    ("lamellar", Grating("lamellar", 1.25, 0.125)),
)


@dataclass(frozen=True)
class Compared:
    """Powers of one setting's orders by the theories and by the judge; arrays are (orders,).

    The judge's powers in the cover become powers in air by the transmittances of the flat side.
    """

    answer: Judged
    scalar: np.ndarray
    exact: np.ndarray
    #: The judge's powers with transmittances that are means over s and p, as in the model (docs/model.md).
    by_means: np.ndarray
    #: The judge's powers with the transmittances of each polarisation state, s and p.
    by_states: np.ndarray
    #: Misplaced power of SCALAR under the cover, against `by_means`.
    misplaced_covered: float
    #: Misplaced power of SCALAR without the cover, against EXACT.
    misplaced_bare: float


def compared(answer: Judged) -> Compared:
    """Compares both theories with the judge's answer for one setting."""
    scalar, by_means = covers.powers(answer, SCALAR), covers.through_means(answer)
    bare = {theory: covers.powers(answer, theory, cover_eta=1.0) for theory in (SCALAR, EXACT)}
    return Compared(
        answer=answer,
        scalar=scalar,
        exact=covers.powers(answer, EXACT),
        by_means=by_means,
        by_states=covers.through_states(answer),
        misplaced_covered=misplaced_fraction(scalar, by_means),
        misplaced_bare=misplaced_fraction(bare[SCALAR], bare[EXACT]),
    )


def misplaced_fraction(found: np.ndarray, true: np.ndarray) -> float:
    """Misplaced power of a theory's powers `found` against the judge's powers `true`, over the sum of `true`."""
    return misplaced(found, true) / float(true.sum())


def errors(differences: list[np.ndarray]) -> dict:
    """Rms, 99th percentile and largest magnitude of `differences`, one array (orders,) for each setting."""
    return summary(np.concatenate(differences))


def in_spans(made: list[Compared]) -> list[list[Compared]]:
    """The comparisons in each *span*, a range of angles of incidence that ends at one of REACHES_DEG."""
    ranges = zip((0.0, *REACHES_DEG), REACHES_DEG)
    return [[each for each in made if low <= each.answer.setting.theta_deg < high] for low, high in ranges]


def by_span(made: list[Compared]) -> list[dict]:
    """Mean misplaced power of SCALAR, bare and covered: a row for each shape, in metals and in the dielectric.

    `spans` has an entry for each span, with the number of its `settings`.
    """
    rows = []
    for dielectric in (False, True):
        # Keys of METAL_JUDGES are the shapes.
        for shape in METAL_JUDGES:
            group = [
                each
                for each in made
                if each.answer.setting.shape == shape and (each.answer.setting.metal == DIELECTRIC) == dielectric
            ]
            spans = [
                {
                    "settings": len(chosen),
                    "bare": float(np.mean([each.misplaced_bare for each in chosen])),
                    "covered": float(np.mean([each.misplaced_covered for each in chosen])),
                }
                for chosen in in_spans(group)
            ]
            rows.append({"shape": shape, "dielectric": dielectric, "spans": spans})
    return rows


def drawn() -> dict:
    """The theories' errors on the random gratings. Raises SetupError if a row's rms error of EXACT is too large.

    - `rows`: errors of both theories by medium and shape. `unsettled` is the largest change of a power between the
      judge's two resolutions.
    - `misplaced`: the result of `by_span`.
    - `exact`: the errors of EXACT over all settings.
    - `states`: the errors of EXACT against powers with each state's transmittances (`by_states`), by span.
    - `settings`: the number of settings; `left_out`: the number of further ones whose judge has not converged.
    """
    made = [compared(answer) for answer in load(COVERED)]
    groups: dict[tuple[str, str], list[Compared]] = {}
    for each in made:
        setting = each.answer.setting
        groups.setdefault((setting.metal, setting.shape), []).append(each)
    rows = []
    for (medium, shape), group in groups.items():
        exact = errors([each.exact - each.by_means for each in group])
        insist(PART, exact["rms"] < EXACT_RMS_MAX, f"exact is right in {medium}, {shape}")
        rows.append(
            {
                "medium": medium,
                "shape": shape,
                "judge": METAL_JUDGES[shape],
                "settings": len(group),
                "orders": sum(len(each.answer.orders) for each in group),
                "unsettled": max(each.answer.unsettled for each in group),
                "scalar": errors([each.scalar - each.by_means for each in group]),
                "exact": exact,
            }
        )
    return {
        "rows": rows,
        "misplaced": by_span(made),
        "exact": errors([each.exact - each.by_means for each in made]),
        "states": [errors([each.exact - each.by_states for each in chosen]) for chosen in in_spans(made)],
        "settings": len(made),
        "left_out": len(left_out(COVERED)),
    }


def judged_perfect(grating: Grating, light: Light) -> Judged:
    """Orders and powers of a perfect conductor under polycarbonate by its judge, the boundary integral.

    The judge solves at one resolution, so its numerical error is not known, and `unsettled` is 0.
    """
    # A setting has positive angles; light from the side of −x has the azimuth 180°.
    theta_deg, phi_deg = abs(light.theta_i_deg), 0.0 if light.theta_i_deg >= 0 else 180.0
    size = (grating.period, grating.height)
    # The metal "none" is a perfect conductor.
    setting = Setting("none", grating.preset, *size, light.wavelength_nm, theta_deg, phi_deg, cover_eta=POLYCARBONATE)
    return leaving(setting, perfect(setting, Resolution()), 0.0)


def case(kind: str, slope_deg: float | None, grating: Grating) -> dict:
    """Misplaced power on a perfect conductor, bare and under polycarbonate, as means over the wavelengths.

    `bare` lists the misplaced power of the model `stam, limited` by angle of incidence. `covered` lists it by angle for
    each model, under the model's name. `exact` is the largest error of an order's power by EXACT under the cover.
    `kind` is the grating's name on the page. `slope_deg` is the largest slope of a sinusoid or the slope of a
    sawtooth's facets; None for lamellar gratings.
    """
    angles_deg = angles_of(grating)
    lights = [Light(nm, angle) for angle in angles_deg for nm in sweeps.WAVELENGTHS_NM]
    judged = [judged_perfect(grating, light) for light in lights]
    true = [covers.through_means(answer) for answer in judged]
    exact_errors = [np.abs(covers.powers(answer, EXACT) - power).max() for answer, power in zip(judged, true)]
    covered = {}
    for model in MODELS:
        found = efficiencies(grating, model, lights, cover_eta=POLYCARBONATE)
        by_light = np.array([misplaced_fraction(a, b) for a, b in zip(found, true)])
        # `lights` go through all wavelengths at an angle before the next angle.
        covered[model.name] = by_light.reshape(len(angles_deg), -1).mean(axis=1).tolist()
    return {
        "kind": kind,
        "slope_deg": slope_deg,
        "period_um": grating.period,
        "height_um": grating.height,
        "angles_deg": list(angles_deg),
        "bare": [sweeps.mean_error(grating, STAM_LIMITED, angle) for angle in angles_deg],
        "covered": covered,
        "exact": float(max(exact_errors)),
    }


def reflected_inside(grating: Grating, nm: float, sine: float) -> dict[int, tuple[float, float]]:
    """Efficiencies (s, p) of each order, by its number, when the grating reflects light inside polycarbonate.

    The light comes across the grooves. `sine` is the sine of its angle with the normal inside the cover, positive for
    light from the side of +x. In a cover of index n a grating diffracts like one in air that is n times as large, in a
    metal whose index is divided by n.
    """
    n, metal = POLYCARBONATE, index(TO_AND_FRO_METAL, nm) / POLYCARBONATE
    arguments = ["--preset", grating.preset, "--period", n * grating.period, "--height", n * grating.height]
    arguments += ["--eta", metal.real, "--k", metal.imag, "--theory", "rigorous", "--wavelength", nm, "--json"]
    light = ["--theta-i", float(np.degrees(np.arcsin(abs(sine)))), "--phi-i", 0 if sine >= 0 else 180]
    report = json.loads(sunbeam("orders", *arguments, *light))
    # Across the grooves s is TE and p is TM.
    return {order["order"]: (order["te"], order["tm"]) for order in report["orders"]}


def reflectances_inside(grating: Grating, nm: float, orders: np.ndarray, q: np.ndarray) -> np.ndarray:
    """The matrices R of `to_and_fro`, [state, to, from], for the `orders` that propagate in the cover.

    `q` are their direction cosines.
    """
    position = {int(order): i for i, order in enumerate(orders)}
    reflectance = np.zeros((2, len(orders), len(orders)))
    for i, order in enumerate(orders):
        # Light that comes down along an order with q comes from the side of −q. It leaves in orders that are counted
        # from `order`, by `step`.
        for step, pair in reflected_inside(grating, nm, -q[i] / POLYCARBONATE).items():
            reflectance[:, position[int(order) + step], i] = pair
    return reflectance


def to_and_fro(grating: Grating, light: Light) -> tuple[float, float]:
    """Fractions of unpolarised light that leave after one reflection by the grating, and after more than one.

    Powers add up, since a cover is much thicker than the coherence length of light. In each polarisation state R[j, k]
    is the grating's efficiency into order j for light that comes down along order k. T_j is the flat side's
    transmittance for order j, 0 where the order is totally reflected.

    The power after one reflection is a = T_0 R[:, 0], since incident light comes down along order 0. The flat side
    reflects the part 1 − T back to the grating. The sum over all reflections obeys b = a + R diag(1 − T) b. The
    results are the means over s and p of T·a and T·(b − a).
    """
    # λ/d and sin θi.
    ratio, sine = light.wavelength_nm * 1e-3 / grating.period, np.sin(np.radians(light.theta_i_deg))
    # q_j = jλ/d − sin θi with |q_j| < n bounds |j| by (n + sin θi) d/λ, and sin θi ≤ 1.
    largest_order = int((POLYCARBONATE + 1) / ratio) + 1
    orders = np.arange(-largest_order, largest_order + 1)
    orders = orders[np.abs(orders * ratio - sine) < POLYCARBONATE]
    q = orders * ratio - sine
    reflectance = reflectances_inside(grating, light.wavelength_nm, orders, q)
    # T_j as [state, order].
    transmittance = np.zeros((2, len(orders)))
    in_air = np.abs(q) < 1
    transmittance[:, in_air] = transmittances(POLYCARBONATE, np.sqrt(1 - q[in_air] ** 2)).T
    # The flat side's transmittances for the incident light: T_0 by state.
    arriving = transmittances(POLYCARBONATE, np.cos(np.radians(light.theta_i_deg)))
    # Position of order 0.
    mirror = int(np.flatnonzero(orders == 0)[0])
    once, later = 0.0, 0.0
    for state in range(2):
        a = arriving[state] * reflectance[state][:, mirror]
        b = np.linalg.solve(np.eye(len(orders)) - reflectance[state] * (1 - transmittance[state]), a)
        once += 0.5 * float(transmittance[state] @ a)
        later += 0.5 * float(transmittance[state] @ (b - a))
    return once, later


def to_and_fro_by_angle(kind: str, grating: Grating) -> dict:
    """Light that leaves polycarbonate over aluminium, as fractions of the incident light.

    `once` and `later` list by angle of incidence the results of `to_and_fro`, as means over the wavelengths.
    """
    pairs = [
        np.mean([to_and_fro(grating, Light(nm, angle)) for nm in sweeps.WAVELENGTHS_NM], axis=0)
        for angle in sweeps.ANGLES_DEG
    ]
    once, later = np.array(pairs).T
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
        "to_and_fro": [to_and_fro_by_angle(*each) for each in TO_AND_FRO],
    }
