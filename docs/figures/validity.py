"""The part `validity`: errors of scalar diffraction against Maxwell's equations, for gratings.

Error: the *misplaced* power, the fraction of the power that a model puts into wrong orders (tests/judges/gratings).
"""

from __future__ import annotations

import json

import numpy as np

from mitsuba_scenes.tool import sunbeam
from tests.judges.gratings.boundary_integral import solve
from tests.judges.gratings.scalar import (
    COHERENCE_LENGTH_UM,
    MODELS,
    STAM,
    STAM_LIMITED,
    Grating,
    Light,
    closed_form,
    efficiencies,
    integrated,
    propagating,
)

from . import validity_metals as metals
from . import validity_plots as plots
from . import validity_sweeps as sweeps
from .page import images
from .validity_proof import proof
from .validity_sweeps import compared, mean_error, mean_sum, sawtooth, sides, sinusoid

# Gratings of the table and of the overall means.
CASES = (
    *(("sinusoid", slope, sinusoid(2.5, slope)) for slope in (5.0, 10.0, 20.0, 45.0)),
    *(("sawtooth", facet, sawtooth(2.5, facet)) for facet in (3.0, 5.71, 10.0)),
    *(("lamellar", None, Grating("lamellar", period, sweeps.SWEPT_HEIGHT_UM)) for period in (1.25, 2.5, 5.0)),
)
# Misplaced power up to which a model counts as valid. Chosen.
BOUND = 0.05
# Upper ends of the ranges of incidence for which limits are given.
REACHES_DEG = (30.0, 60.0, 75.0)
# Presets whose slopes are listed for comparison.
SURFACES = ("blazed", "elaphe", "xenopeltis")
# Coherence lengths in µm of the sums of the limited model.
COHERENCE_LENGTHS_UM = (65.0, 400.0, 4000.0)


def row(kind: str, slope: float | None, grating: Grating) -> dict:
    """A row of the table: misplaced power of each model at each angle, and the model's sum over orders."""
    return {
        "kind": kind,
        "slope_deg": slope,
        "period_um": grating.period,
        "height_um": grating.height,
        "angles_deg": list(sides(grating)),
        "misplaced": {m.name: [mean_error(grating, m, angle) for angle in sides(grating)] for m in MODELS},
        "sum": {m.name: [mean_sum(grating, m, angle) for angle in sides(grating)] for m in MODELS},
        "misplaced_te": [mean_error(grating, STAM_LIMITED, angle, "te") for angle in sides(grating)],
        "misplaced_tm": [mean_error(grating, STAM_LIMITED, angle, "tm") for angle in sides(grating)],
    }


def sweep(make, values, side: int = 1) -> dict:
    """Misplaced power along a sweep: `[model][angle][value]`."""
    angles = [side * angle + 0.0 for angle in sweeps.ANGLES_DEG]
    return {
        "values": list(values),
        "angles_deg": angles,
        "misplaced": {m.name: [[mean_error(make(v), m, angle) for v in values] for angle in angles] for m in MODELS},
    }


def rule(swept: dict, falling: bool = False) -> dict:
    """For each model and reach the value up to which (`falling`: from which) the bound holds at all angles."""
    found = {}
    for model in MODELS:
        errors = np.array(swept["misplaced"][model.name])
        within = [errors[np.abs(swept["angles_deg"]) <= reach].max(axis=0).tolist() for reach in REACHES_DEG]
        found[model.name] = [sweeps.reaches(swept["values"], errors, BOUND, falling) for errors in within]
    return found


def model_checks() -> dict:
    """Errors of the model's efficiencies against closed forms, and against the integral of a lobe."""
    lights = [Light(550.0, angle) for angle in sweeps.ANGLES_DEG]
    closed, lobe = [], []
    for grating in (sinusoid(2.5, 20), sawtooth(2.5, 5.71), Grating("lamellar", 2.5, 0.25)):
        values = efficiencies(grating, STAM, lights)
        closed += [np.abs(v - closed_form(grating, "stam", light)).max() for v, light in zip(values, lights)]
    grating, light = sinusoid(2.5, 20), Light(550.0, 60.0)
    orders, _ = propagating(grating.period, light)
    for model in MODELS:
        values = efficiencies(grating, model, [light])[0]
        lobe += [abs(integrated(grating, model, light, order) - values[orders == order][0]) for order in (0, 2, 4)]
    return {"closed_form": float(max(closed)), "lobe": float(max(lobe))}


def limiting() -> list[dict]:
    """Sums over the orders of a shallow sinusoid with conserved energy, by coherence length and angle."""
    grating = Grating("sinusoidal", 1.6, 0.1)
    lights = [Light(wavelength, angle) for angle in sweeps.ANGLES_DEG for wavelength in sweeps.WAVELENGTHS_NM]
    rows = []
    for length in COHERENCE_LENGTHS_UM:
        sums = np.array([e.sum() for e in efficiencies(grating, STAM_LIMITED, lights, length)])
        means = sums.reshape(len(sweeps.ANGLES_DEG), -1).mean(axis=1)
        rows.append({"coherence_length_um": length, "sums": means.tolist()})
    return rows


def surfaces() -> list[dict]:
    """Rms slopes of the presets along both axes, in degrees."""
    rows = []
    for name in SURFACES:
        told = json.loads(sunbeam("height-field", "--preset", name))
        slopes = np.degrees(np.arctan(told["rms_slope"])).tolist()
        rows.append({"name": name, "rms_slope_deg": slopes, "peak_to_valley_um": told["peak_to_valley_um"]})
    return rows


def figures() -> dict:
    """All numbers of the part; writes its plots."""
    folder = images("validity")
    slopes = sweep(lambda slope: sinusoid(sweeps.PERIOD_UM, slope), sweeps.SLOPES_DEG)
    away = sweep(lambda facet: sawtooth(sweeps.PERIOD_UM, facet), sweeps.FACETS_DEG)
    facing = sweep(lambda facet: sawtooth(sweeps.PERIOD_UM, facet), sweeps.FACETS_DEG, side=-1)
    by_period = {
        "sinusoid": sweep(lambda period: sinusoid(period, sweeps.SWEPT_SLOPE_DEG), sweeps.PERIODS_UM),
        "sawtooth": sweep(lambda period: sawtooth(period, sweeps.SWEPT_FACET_DEG), sweeps.PERIODS_UM),
        "lamellar": sweep(lambda period: Grating("lamellar", period, sweeps.SWEPT_HEIGHT_UM), sweeps.PERIODS_UM),
    }
    mean_nm = float(np.mean(sweeps.WAVELENGTHS_NM))
    gratings = [grating for _, _, grating in CASES]
    compared_all = [c for grating in gratings for c in compared(grating, sides(grating))]
    plots.angles(folder / "angles.svg")
    plots.slopes(folder / "slopes.svg", slopes, away, facing, BOUND)
    plots.periods(folder / "periods.svg", by_period, mean_nm, BOUND)
    flat = solve(sweeps.Sinusoid(2.5, 0.0), 550.0, 60.0)
    return {
        "wavelengths_nm": list(sweeps.WAVELENGTHS_NM),
        "angles_deg": list(sweeps.ANGLES_DEG),
        "coherence_length_um": COHERENCE_LENGTH_UM,
        "period_um": sweeps.PERIOD_UM,
        "swept": {
            "slope_deg": sweeps.SWEPT_SLOPE_DEG,
            "facet_deg": sweeps.SWEPT_FACET_DEG,
            "height_um": sweeps.SWEPT_HEIGHT_UM,
        },
        "models": [model.name for model in MODELS],
        "lights": len(compared_all),
        "energy": max(c.rigorous.imbalance for c in compared_all),
        "flat": float(abs(flat.te[flat.orders == 0][0] - 1)),
        "proof": proof(),
        "model_checks": model_checks(),
        "cases": [row(*case) for case in CASES],
        "rms": {m.name: [sweeps.rms_per_order(gratings, m, p) for p in ("unpolarised", "te", "tm")] for m in MODELS},
        "rms_gentle": {m.name: sweeps.rms_per_order(gratings[:2], m) for m in MODELS},
        "largest_sum": {m.name: float(max(c.scalar[m.name].sum() for c in compared_all)) for m in MODELS},
        "bound": BOUND,
        "reaches_deg": list(REACHES_DEG),
        "rules": {
            "slope": rule(slopes),
            "away": rule(away),
            "facing": rule(facing),
            "period": {kind: rule(swept, falling=True) for kind, swept in by_period.items()},
        },
        "mean_nm": mean_nm,
        "sweeps": {"slope": slopes, "facets_away": away, "facets_facing": facing, "period": by_period},
        "limiting": limiting(),
        "surfaces": surfaces(),
        "metals": metals.figures(folder / "metals.svg", BOUND, REACHES_DEG),
    }
