"""Metals in the documentation's part `validity`: three theories against independent solvers, and their limits.

The theories of tests/judges/gratings/theories.py are

- SCALAR: the phase screen times Fresnel's reflectance;
- FRESNEL: a perfect conductor by Maxwell's equations, times Fresnel's reflectance;
- EXACT: Maxwell's equations with the metal's index.

Independent solvers, the *judges* (tests/judges/gratings), give the true powers of the orders. A *power* is the fraction
of unpolarised light in an order.

- *Setting*: a grating in a medium, and a light. Settings are random. *Answer*: a judge's result for one of them.
- *Misplaced* power: the fraction of the light that a theory puts into wrong orders. It is half the sum of the absolute
  differences of all orders' powers.
- *Table*: efficiencies of a grating's orders over wavelength and direction of the light, which the plugin interpolates.
- Media are named as Mitsuba's `material`; "none" is a perfect conductor. Fields `metal` have such a name.

`insist` raises SetupError if the numbers contradict a sentence of the page.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant
from tests.judges.gratings.drawn import METALS, SETTLED, SHAPES, Judged, Setting, left_out, load, settings
from tests.judges.gratings.metals import index
from tests.judges.gratings.scalar import STAM_LIMITED, Grating, Light, misplaced, propagating
from tests.judges.gratings.theories import (
    EXACT,
    FRESNEL,
    SCALAR,
    fresnel,
    medium_arguments,
    mueller_errors,
    orders,
    powers,
    tabulated,
)

from . import validity_sweeps as sweeps
from .bsdf_calls import call_ns
from .page import insist
from .svg import save
from .validity_sweeps import angles_of, compared, sawtooth, sinusoid

PART = "validity"
# Names of the media on the page.
NAMES = {"none": "perfect conductor", "Al": "aluminium", "Ag": "silver", "Au": "gold"}
# The judge of perfect conductors.
PERFECT_JUDGE = "boundary integral"
# The judges of metals by shape; sawteeth in metals have none.
METAL_JUDGES = {"sinusoidal": "coordinate transform", "lamellar": "SCATMECH"}
# Theories in the order of the page.
THEORIES = (SCALAR, FRESNEL, EXACT)
# Largest accepted ratio of the time of a BSDF call with `theory = rigorous` to one with `scalar`; the page states it.
COST_MAX = 1.5
# Period and height in µm of the timed sinusoid.
TIMED_UM = (0.8, 0.12)
# Wavelength at which a metal's index is taken for tables and timed calls, which have one index for all wavelengths.
INDEX_NM = 550.0
# Number of random lights at which a grating's table of efficiencies is compared with the solver. More find rarer
# errors.
TABLED_LIGHTS = 30
# Seed of the random lights, an arbitrary number.
SEED = 5
# Largest accepted rms and 99th percentile of the errors of tables in silver; measured are 0.0043 and 0.0105. Silver's
# surface plasmons make steep changes of efficiency, which interpolation follows less well. Larger values would accept a
# worse interpolation.
TABLE_MAX_SILVER = (0.008, 0.03)
# Largest accepted rms and 99th percentile of the errors of tables in each of the other media; the largest measured are
# 0.0022 and 0.0088.
TABLE_MAX = (0.004, 0.015)
# Periods of the swept gratings.
PERIODS_UM = (1.25, 2.5, 5.0)
# Period of the plotted gratings.
PLOTTED_UM = 2.5
# Functions from the period in µm to a grating, by the kind of grating, for sweeps over the period.
FAMILIES = {
    "sinusoid": lambda period: sinusoid(period, sweeps.SWEPT_SLOPE_DEG),
    "sawtooth": lambda period: sawtooth(period, sweeps.SWEPT_FACET_DEG),
    "lamellar": lambda period: Grating("lamellar", period, sweeps.SWEPT_HEIGHT_UM),
}
# METALS without the perfect conductor.
REAL_METALS = tuple(metal for metal in METALS if metal != "none")
# Colours of the metals in the plot.
COLOURS = {"Al": "tab:blue", "Ag": "tab:green", "Au": "tab:orange"}


def summary(errors: np.ndarray) -> dict:
    """Rms, 99th percentile and largest magnitude of errors."""
    absolute = np.abs(errors)
    rms, p99 = float(np.sqrt(np.mean(absolute**2))), float(np.quantile(absolute, 0.99))
    return {"rms": rms, "p99": p99, "worst": float(absolute.max())}


def errors_of(theory: str, group: list[tuple[Judged, dict]]) -> np.ndarray:
    """Errors of a theory in all orders of a `group`, pairs of a judge's answer and the result of `powers` for it.

    `powers` (theories.py) gives the orders' powers by theory.
    """
    return np.concatenate([found[theory] - answer.power for answer, found in group])


def by_shape(judged: list[tuple[Judged, dict]]) -> list[dict]:
    """A row for each medium and shape: errors and misplaced power of each theory against the judge.

    `judged` has pairs as the `group` of `errors_of`. `unsettled` is the largest change of a power between the judge's
    two resolutions.
    """
    groups: dict[tuple[str, str], list[tuple[Judged, dict]]] = {}
    for answer, found in judged:
        groups.setdefault((answer.setting.metal, answer.setting.shape), []).append((answer, found))
    rows = []
    for (metal, shape), group in groups.items():
        theories = {}
        for name in THEORIES:
            fractions = [misplaced(found[name], answer.power) for answer, found in group]
            theories[name] = {
                **summary(errors_of(name, group)),
                "misplaced": float(np.mean(fractions)),
                "misplaced_worst": max(fractions),
            }
        rows.append(
            {
                "metal": metal,
                "shape": shape,
                "judge": PERFECT_JUDGE if metal == "none" else METAL_JUDGES[shape],
                "settings": len(group),
                "orders": sum(len(answer.orders) for answer, _ in group),
                "unsettled": max(answer.unsettled for answer, _ in group),
                "theories": theories,
            }
        )
    return rows


def by_metal(judged: list[tuple[Judged, dict]]) -> dict:
    """Errors of each theory in each medium, over all shapes."""
    found = {}
    for metal in METALS:
        group = [pair for pair in judged if pair[0].setting.metal == metal]
        found[metal] = {theory: summary(errors_of(theory, group)) for theory in THEORIES}
    return found


def tabled_gratings() -> list[Setting]:
    """The gratings of `tables`: the first random one of each shape in each medium, with the index at INDEX_NM.

    Where a medium has no random gratings of a shape, the first one in a perfect conductor is taken in this medium.
    """
    first: dict[tuple[str, str], Setting] = {}
    for setting in settings():
        first.setdefault((setting.metal, setting.shape), setting)
    return [
        replace(first.get((metal, shape), first["none", shape]), metal=metal, index_nm=INDEX_NM)
        for metal in METALS
        for shape in SHAPES
    ]


def tables() -> dict:
    """Errors of tables of efficiencies against the solver at random lights, by grating (`rows`) and by medium.

    Raises SetupError if the errors in a medium exceed their bounds.
    """
    rng = np.random.default_rng(SEED)
    rows: list[dict] = []
    errors_by_metal: dict[str, list[np.ndarray]] = {}
    for grating in tabled_gratings():
        lights = [
            replace(
                grating,
                wavelength_nm=round(float(rng.uniform(400, 700)), 2),
                theta_deg=round(float(rng.uniform(0, 75)), 2),
                phi_deg=round(float(rng.uniform(0, 360)), 2),
            )
            for _ in range(TABLED_LIGHTS)
        ]
        read, solved = tabulated(lights)
        errors = np.concatenate(read) - np.concatenate(solved)
        errors_by_metal.setdefault(grating.metal, []).append(errors)
        size = {"period_um": grating.period_um, "height_um": grating.height_um}
        rows.append({"metal": grating.metal, "shape": grating.shape, **size, **summary(errors)})
    by_medium = {metal: summary(np.concatenate(errors)) for metal, errors in errors_by_metal.items()}
    for metal, found in by_medium.items():
        rms, p99 = TABLE_MAX_SILVER if metal == "Ag" else TABLE_MAX
        insist(PART, found["rms"] <= rms and found["p99"] <= p99, f"tables keep their bounds in {metal}")
    return {"rows": rows, "by_metal": by_medium}


def truth(grating: Grating, metal: str, light: Light) -> np.ndarray:
    """Powers of the propagating orders of a grating in a metal, by Maxwell's equations."""
    # A light at a negative angle comes from −x, at the azimuth 180°.
    theta_deg, phi_deg = abs(light.theta_i_deg), 0.0 if light.theta_i_deg >= 0 else 180.0
    setting = Setting(metal, grating.preset, grating.period, grating.height, light.wavelength_nm, theta_deg, phi_deg)
    by_order = orders(setting, "--theory", "rigorous", *medium_arguments(setting))
    return np.array([by_order[order]["mean"] for order in propagating(grating.period, light)[0].tolist()])


def swept() -> dict:
    """Misplaced power of SCALAR and FRESNEL against EXACT: [kind][metal][period in µm][angle in degrees][theory].

    SCALAR conserves energy here, unlike in the rest of the module (the model `stam, limited`). Periods and angles are
    text, as JSON requires of keys.
    """
    return {
        kind: {
            metal: {str(period_um): misplaced_by_angle(family(period_um), metal) for period_um in PERIODS_UM}
            for metal in REAL_METALS
        }
        for kind, family in FAMILIES.items()
    }


def misplaced_by_angle(grating: Grating, metal: str) -> dict[str, dict[str, float]]:
    """Misplaced power of SCALAR and FRESNEL by angle of incidence as text, mean over the wavelengths.

    `compared` gives the powers of both theories in a perfect conductor. Each power is multiplied by Fresnel's
    reflectance at the half vector of the directions to the light and along the order.
    """
    by_angle: dict[str, dict[str, list[float]]] = {}
    for each in compared(grating, angles_of(grating)):
        light = each.light
        # `sines` are x of the unit vectors along the orders, which lie in the plane of incidence y = 0.
        _, sines = propagating(grating.period, light)
        sine = np.sin(np.radians(light.theta_i_deg))
        wi = np.array([sine, 0, np.sqrt(1 - sine**2)])
        wo = np.stack([sines, 0 * sines, np.sqrt(1 - sines**2)], axis=-1)
        reflectance = fresnel(index(metal, light.wavelength_nm), wi, wo)
        expected = truth(grating, metal, light)
        found = by_angle.setdefault(str(light.theta_i_deg), {SCALAR: [], FRESNEL: []})
        found[SCALAR].append(misplaced(each.scalar[STAM_LIMITED.name] * reflectance, expected))
        found[FRESNEL].append(misplaced(each.rigorous.unpolarised * reflectance, expected))
    return {
        angle: {theory: float(np.mean(values)) for theory, values in found.items()} for angle, found in by_angle.items()
    }


def smallest_period_um(by_period: dict, theory: str, reach_deg: float, bound: float) -> float | None:
    """The smallest of PERIODS_UM from which a theory is within the bound at all angles up to `reach_deg`, or `None`.

    `by_period` is `swept` of one kind and metal, and `bound` the accepted misplaced power.
    """
    smallest = None
    # From the largest period down to the first one that exceeds the bound.
    for period_um in sorted(PERIODS_UM, reverse=True):
        by_angle = by_period[str(period_um)]
        if max(found[theory] for angle, found in by_angle.items() if abs(float(angle)) <= reach_deg) > bound:
            break
        smallest = period_um
    return smallest


def cost() -> dict:
    """Time of BSDF calls with `rigorous` relative to `scalar`, in aluminium, by call.

    Raises SetupError if a ratio exceeds COST_MAX.
    """
    use_variant("llvm_ad_spectral", fall_back=False)
    n = index("Al", INDEX_NM)
    period_um, height_um = TIMED_UM
    relief = {"preset": "sinusoidal", "period": period_um, "height": height_um}
    grating = {"type": "diffraction", **relief, "eta": n.real, "k": n.imag}
    bsdfs = {theory: mi.load_dict({**grating, "theory": theory}) for theory in ("scalar", "rigorous")}
    ns = {call: call_ns(bsdfs, call) for call in ("eval", "sample")}
    ratios = {call: float(by_theory["rigorous"] / by_theory["scalar"]) for call, by_theory in ns.items()}
    insist(PART, max(ratios.values()) <= COST_MAX, "rigorous costs about as much as scalar")
    return ratios


def figures(path: Path, bound: float, reaches_deg: tuple[float, ...]) -> dict:
    """All numbers on metals; writes the plot to `path`.

    - `drawn`, `left_out`: the numbers of random settings, and of those left out because their judge has not converged.
      `settled` is the largest change of a power between resolutions of a converged judge.
    - `rows`, `by_metal`: the results of `by_shape` and `by_metal`.
    - `mueller`: errors of all elements of the orders' Mueller matrices by EXACT, where the judge gives amplitudes. They
      are relative to the largest reflectance of an order in unpolarised light.
    - `limits`: the result of `smallest_period_um` for each kind, metal and theory, at each of `reaches_deg`. `bound` is
      the accepted misplaced power.

    Raises SetupError if the numbers contradict the page.
    """
    answers = load()
    judged = [(answer, powers(answer)) for answer in answers]
    muellers = np.concatenate([mueller_errors(answer) for answer in answers if answer.jones is not None])
    sweep = swept()
    limits = [
        {
            "kind": kind,
            "metal": metal,
            "theory": theory,
            "periods_um": [smallest_period_um(sweep[kind][metal], theory, reach, bound) for reach in reaches_deg],
        }
        for kind in FAMILIES
        for metal in REAL_METALS
        for theory in (SCALAR, FRESNEL)
    ]
    # An error below a tenth of the phase screen's counts as right.
    by_medium = by_metal(judged)
    for metal, theories in by_medium.items():
        insist(PART, theories[EXACT]["rms"] < 0.1 * theories[SCALAR]["rms"], f"exact is right in {metal}")
    draw(path, sweep)
    unconverged = left_out()
    return {
        "names": NAMES,
        "theories": list(THEORIES),
        "settled": SETTLED,
        "drawn": len(answers) + len(unconverged),
        "left_out": len(unconverged),
        "rows": by_shape(judged),
        "by_metal": by_medium,
        "mueller": summary(muellers),
        "tables": tables(),
        "timed_um": list(TIMED_UM),
        "tabled_lights": TABLED_LIGHTS,
        "swept": sweep,
        "periods_um": list(PERIODS_UM),
        "limits": limits,
        "cost": {**cost(), "most": COST_MAX},
    }


def draw(path: Path, sweep: dict) -> None:
    """Draws misplaced power against the angle of incidence at the period PLOTTED_UM, from the result of `swept`."""
    figure, axes = plt.subplots(1, len(sweep), figsize=(11, 3.6), sharey=True)
    for ax, (kind, metals) in zip(axes, sweep.items()):
        for metal, by_period in metals.items():
            by_angle = by_period[str(PLOTTED_UM)]
            angles = sorted(by_angle, key=float)
            theta_i_deg = [float(angle) for angle in angles]
            for theory, line in ((SCALAR, "-"), (FRESNEL, "--")):
                percent = [100 * by_angle[angle][theory] for angle in angles]
                label = f"{NAMES[metal]}, {theory}"
                ax.plot(theta_i_deg, percent, line, color=COLOURS[metal], marker="o", ms=2.5, lw=1.2, label=label)
        ax.set(title=f"{kind}, {PLOTTED_UM:g} µm", xlabel="θi in degrees", yscale="log", ylim=(0.05, 100))
    axes[0].set_ylabel("misplaced power in %")
    axes[0].legend(fontsize=7, frameon=False)
    save(figure, path)
