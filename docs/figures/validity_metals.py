"""Metals in the part `validity`: three theories against independent solvers, and limits of the phase screen.

Theories (tests/judges/gratings/theories.py): SCALAR, the phase screen times Fresnel's reflectance; FRESNEL, a perfect
conductor by Maxwell's equations times Fresnel's reflectance; EXACT, Maxwell's equations with the metal's index.
Independent solvers (*judges*, tests/judges/gratings) give the true powers of the orders for random settings.
*Misplaced* power is the fraction of the power that a theory puts into wrong orders (`misplaced`).
"""

from __future__ import annotations

from dataclasses import replace

import matplotlib
import mitsuba as mi

matplotlib.use("Agg")
import matplotlib.pyplot as plt
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
    mueller_errors,
    optics,
    orders,
    powers,
    tabulated,
)

from . import validity_sweeps as sweeps
from .bsdf_calls import call_ns
from .page import insist
from .validity_sweeps import compared, sawtooth, sides, sinusoid

# Names of the media in the page; "none" is a perfect conductor.
NAMES = {"none": "perfect conductor", "Al": "aluminium", "Ag": "silver", "Au": "gold"}
# Independent solver by medium or shape.
JUDGES = {"none": "boundary integral", "sinusoidal": "coordinate transform", "lamellar": "SCATMECH"}
THEORIES = (SCALAR, FRESNEL, EXACT)
# Largest accepted ratio of the time of a call with `theory = rigorous` to one with `scalar`. Chosen.
COST_MAX = 1.5
# Period and height of the timed sinusoid in µm.
TIMED_UM = (0.8, 0.12)
# Wavelength in nm at which a metal's index is taken for all wavelengths.
INDEX_NM = 550.0
# Number of random lights for the comparison of a table of efficiencies with the solver.
TABLED_LIGHTS = 30
# Seed of the random lights.
SEED = 5
# Largest accepted rms and 99th percentile of a table's errors by medium; silver has sharp plasmon anomalies.
TABLE_MAX = {"Ag": (0.008, 0.03)}
# Largest accepted rms and 99th percentile of a table's errors for the media not in TABLE_MAX.
TABLE_MAX_ELSE = (0.004, 0.015)
# Periods in µm of the swept gratings.
PERIODS_UM = (1.25, 2.5, 5.0)
# Gratings by period in µm, by family.
FAMILIES = {
    "sinusoid": lambda period: sinusoid(period, sweeps.SWEPT_SLOPE_DEG),
    "sawtooth": lambda period: sawtooth(period, sweeps.SWEPT_FACET_DEG),
    "lamellar": lambda period: Grating("lamellar", period, sweeps.SWEPT_HEIGHT_UM),
}
# The media with a finite index.
REAL = tuple(metal for metal in METALS if metal != "none")
# Colours of the media in plots.
COLOURS = {"none": "k", "Al": "tab:blue", "Ag": "tab:green", "Au": "tab:orange"}


def spread(errors: np.ndarray) -> dict:
    """Rms, 99th percentile and largest magnitude of errors of efficiencies."""
    size = np.abs(errors)
    return {"rms": float(np.sqrt(np.mean(size**2))), "p99": float(np.quantile(size, 0.99)), "worst": float(size.max())}


def beside_judges(answers: list[Judged], found: list[dict]) -> list[dict]:
    """A row for each metal and shape: errors of each theory, in `found` by answer, against the solver."""
    groups: dict[tuple, list[int]] = {}
    for i, answer in enumerate(answers):
        groups.setdefault((answer.setting.metal, answer.setting.shape), []).append(i)
    rows = []
    for (metal, shape), group in groups.items():
        theories = {}
        for name in THEORIES:
            fractions = [misplaced(found[i][name], answers[i].power) for i in group]
            errors = np.concatenate([found[i][name] - answers[i].power for i in group])
            theories[name] = {
                **spread(errors),
                "misplaced": float(np.mean(fractions)),
                "misplaced_worst": max(fractions),
            }
        rows.append(
            {
                "metal": metal,
                "shape": shape,
                "judge": JUDGES["none"] if metal == "none" else JUDGES[shape],
                "settings": len(group),
                "orders": int(sum(len(answers[i].orders) for i in group)),
                "unsettled": max(answers[i].unsettled for i in group),
                "theories": theories,
            }
        )
    return rows


def by_metal(answers: list[Judged], found: list[dict]) -> dict:
    """Errors over all shapes of a metal, by theory."""
    made = {}
    for metal in METALS:
        group = [i for i, answer in enumerate(answers) if answer.setting.metal == metal]
        made[metal] = {
            name: spread(np.concatenate([found[i][name] - answers[i].power for i in group])) for name in THEORIES
        }
    return made


def tabled() -> list[Setting]:
    """The first random grating of each shape in each medium; a medium without a shape gets the perfect conductor's."""
    first: dict[tuple, Setting] = {}
    for setting in settings():
        first.setdefault((setting.metal, setting.shape), setting)
    gratings = [first.get((metal, shape), first["none", shape]) for metal in METALS for shape in SHAPES]
    metals = [metal for metal in METALS for _ in SHAPES]
    # The command takes one index for all wavelengths.
    return [replace(grating, metal=metal, index_nm=INDEX_NM) for grating, metal in zip(gratings, metals)]


def tables() -> dict:
    """Errors of tables against the solver at random lights, by grating and by metal."""
    rng = np.random.default_rng(SEED)
    rows: list[dict] = []
    by: dict[str, list[np.ndarray]] = {}
    for first in tabled():
        lights = [
            replace(
                first,
                wavelength_nm=round(float(rng.uniform(400, 700)), 2),
                theta_deg=round(float(rng.uniform(0, 75)), 2),
                phi_deg=round(float(rng.uniform(0, 360)), 2),
            )
            for _ in range(TABLED_LIGHTS)
        ]
        read, solved = tabulated(lights)
        errors = np.concatenate(read) - np.concatenate(solved)
        by.setdefault(first.metal, []).append(errors)
        about = {"metal": first.metal, "shape": first.shape, "period_um": first.period_um, "height_um": first.height_um}
        rows.append({**about, **spread(errors)})
    made = {"rows": rows, "by_metal": {metal: spread(np.concatenate(errors)) for metal, errors in by.items()}}
    for metal, row in made["by_metal"].items():
        rms, p99 = TABLE_MAX.get(metal, TABLE_MAX_ELSE)
        insist("validity", row["rms"] <= rms and row["p99"] <= p99, f"tables keep their bounds in {metal}")
    return made


def truth(grating: Grating, metal: str, light: Light) -> np.ndarray:
    """Powers of the propagating orders, by the solver."""
    theta, phi = abs(light.theta_i_deg), 0.0 if light.theta_i_deg >= 0 else 180.0
    setting = Setting(metal, grating.preset, grating.period, grating.height, light.wavelength_nm, theta, phi)
    by = orders(setting, "--theory", "rigorous", *optics(setting))
    return np.array([by[order]["mean"] for order in propagating(grating.period, light)[0].tolist()])


def swept() -> dict:
    """Misplaced power over period and angle by metal, of the phase screen and of a perfect conductor times Fresnel."""
    made: dict = {}
    for kind, family in FAMILIES.items():
        for period in PERIODS_UM:
            grating = family(period)
            for c in compared(grating, sides(grating)):
                _, towards = propagating(period, c.light)
                sine = np.sin(np.radians(c.light.theta_i_deg))
                wi = np.array([sine, 0, np.sqrt(1 - sine**2)])
                wo = np.stack([towards, 0 * towards, np.sqrt(1 - towards**2)], axis=-1)
                for metal in REAL:
                    setting = Setting(metal, grating.preset, period, grating.height, c.light.wavelength_nm, 0.0, 0.0)
                    mirrored = fresnel(setting.index, wi, wo)
                    expected = truth(grating, metal, c.light)
                    at = made.setdefault(kind, {}).setdefault(metal, {}).setdefault(str(period), {})
                    row = at.setdefault(str(c.light.theta_i_deg), {SCALAR: [], FRESNEL: []})
                    row[SCALAR].append(misplaced(c.scalar[STAM_LIMITED.name] * mirrored, expected))
                    row[FRESNEL].append(misplaced(c.rigorous.unpolarised * mirrored, expected))
    for kinds in made.values():
        for periods in kinds.values():
            for angles in periods.values():
                for angle, row in angles.items():
                    angles[angle] = {name: float(np.mean(values)) for name, values in row.items()}
    return made


def first_within(swept_metal: dict, theory: str, reach_deg: float, bound: float) -> float | None:
    """The smallest period from which a theory is within the bound at all angles up to the reach, or `None`."""
    found = None
    for period in sorted(map(float, swept_metal), reverse=True):
        angles = swept_metal[str(period)]
        if max(row[theory] for angle, row in angles.items() if abs(float(angle)) <= reach_deg) > bound:
            break
        found = period
    return found


def cost() -> dict:
    """Time of BSDF calls with `rigorous` relative to `scalar`, in aluminium."""
    use_variant("llvm_ad_spectral", fall_back=False)
    n = index("Al", INDEX_NM)
    relief = {"type": "diffraction", "preset": "sinusoidal", "period": TIMED_UM[0], "height": TIMED_UM[1]}
    relief = {**relief, "eta": n.real, "k": n.imag}
    bsdfs = {theory: mi.load_dict({**relief, "theory": theory}) for theory in ("scalar", "rigorous")}
    calls = {call: call_ns(bsdfs, call) for call in ("eval", "sample")}
    ratios = {call: float(ns["rigorous"] / ns["scalar"]) for call, ns in calls.items()}
    insist("validity", max(ratios.values()) <= COST_MAX, "rigorous costs about as much as scalar")
    return ratios


def figures(path, bound: float, reaches_deg: tuple) -> dict:
    """All numbers on metals; writes the plot to `path`."""
    answers = load()
    found = [powers(answer) for answer in answers]
    muellers = np.concatenate([mueller_errors(answer) for answer in answers if answer.jones is not None])
    sweep = swept()
    limits = [
        {
            "kind": kind,
            "metal": metal,
            "theory": theory,
            "periods_um": [first_within(sweep[kind][metal], theory, reach, bound) for reach in reaches_deg],
        }
        for kind in FAMILIES
        for metal in REAL
        for theory in (SCALAR, FRESNEL)
    ]
    together = by_metal(answers, found)
    for metal, theories in together.items():
        insist("validity", theories[EXACT]["rms"] < 0.1 * theories[SCALAR]["rms"], f"exact is right in {metal}")
    draw(path, sweep)
    missing = left_out()
    return {
        "names": NAMES,
        "theories": list(THEORIES),
        "settled": SETTLED,
        "drawn": len(answers) + len(missing),
        "left_out": len(missing),
        "rows": beside_judges(answers, found),
        "by_metal": together,
        "mueller": spread(muellers),
        "tables": tables(),
        "timed_um": list(TIMED_UM),
        "tabled_lights": TABLED_LIGHTS,
        "swept": sweep,
        "periods_um": list(PERIODS_UM),
        "limits": limits,
        "cost": {**cost(), "most": COST_MAX},
    }


def draw(path, sweep: dict) -> None:
    """Draws misplaced power against the angle of incidence at one period."""
    figure, axes = plt.subplots(1, len(sweep), figsize=(11, 3.6), sharey=True)
    for ax, (kind, metals) in zip(axes, sweep.items()):
        for metal, periods in metals.items():
            rows = sorted(((float(angle), row) for angle, row in periods[str(2.5)].items()), key=lambda at: at[0])
            for theory, style in ((SCALAR, "-"), (FRESNEL, "--")):
                at = [angle for angle, _ in rows]
                values = [100 * row[theory] for _, row in rows]
                ax.plot(
                    at,
                    values,
                    style,
                    color=COLOURS[metal],
                    marker="o",
                    ms=2.5,
                    lw=1.2,
                    label=f"{NAMES[metal]}, {theory}",
                )
        ax.set(title=f"{kind}, 2.5 µm", xlabel="θi in degrees", yscale="log", ylim=(0.05, 100))
    axes[0].set_ylabel("misplaced power in %")
    axes[0].legend(fontsize=7, frameon=False)
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
