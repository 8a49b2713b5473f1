"""Part `validity` of the documentation (page.py): errors of scalar diffraction for gratings, by Maxwell's equations.

Gratings are in a perfect conductor, except in validity_metals.py.

- *Model*: scalar diffraction, the phase screen of docs/model.md, with an obliquity factor (`stam` or `unit`), with or
  without energy conservation. STAM is `stam` without and STAM_LIMITED `stam` with energy conservation.
- *Efficiency*: the fraction of the incident light in an order.
- *Misplaced* power of a model: the fraction of the light that the model puts into wrong orders. It is a mean over
  wavelengths (`mean_error` of validity_sweeps.py).
- *Reach*: a largest angle of incidence, on either side of the normal.
- TE, TM: the polarisations with the electric and the magnetic field along the grooves.

Lengths without a unit in their name are in µm.
"""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np

from mitsuba_scenes.tool import sunbeam
from tests.judges.gratings.boundary_integral import solve
from tests.judges.gratings.profile import Sinusoid
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
from .validity_sweeps import angles_of, compared, mean_error, mean_sum, sawtooth, sinusoid

PART = "validity"
# Gratings of the table and of the overall means: kind, slope in degrees or `None`, and grating. The slope is the
# largest of a sinusoid, or that of a sawtooth's facets.
CASES = (
    *(("sinusoid", slope, sinusoid(2.5, slope)) for slope in (5.0, 10.0, 20.0, 45.0)),
    *(("sawtooth", facet, sawtooth(2.5, facet)) for facet in (3.0, 5.71, 10.0)),
    *(("lamellar", None, Grating("lamellar", period, sweeps.SWEPT_HEIGHT_UM)) for period in (1.25, 2.5, 5.0)),
)
# Misplaced power up to which a model counts as valid on the page.
BOUND = 0.05
# Reaches for which limits of validity are given.
REACHES_DEG = (30.0, 60.0, 75.0)
# Presets whose slopes the page lists beside the limits.
SURFACES = ("blazed", "elaphe", "xenopeltis")
# Coherence lengths at which sums over the orders by STAM_LIMITED are listed. The first is the plugin's default.
COHERENCE_LENGTHS_UM = (65.0, 400.0, 4000.0)


def row(kind: str, slope: float | None, grating: Grating) -> dict:
    """A row of the table: misplaced power of each model, and the `sum` of its orders' powers, by angle of incidence.

    `misplaced_te` and `misplaced_tm` are those of `STAM_LIMITED` in each polarisation.
    """
    angles_deg = angles_of(grating)
    return {
        "kind": kind,
        "slope_deg": slope,
        "period_um": grating.period,
        "height_um": grating.height,
        "angles_deg": list(angles_deg),
        "misplaced": {model.name: [mean_error(grating, model, angle) for angle in angles_deg] for model in MODELS},
        "sum": {model.name: [mean_sum(grating, model, angle) for angle in angles_deg] for model in MODELS},
        "misplaced_te": [mean_error(grating, STAM_LIMITED, angle, "te") for angle in angles_deg],
        "misplaced_tm": [mean_error(grating, STAM_LIMITED, angle, "tm") for angle in angles_deg],
    }


def sweep(make: Callable[[float], Grating], values: tuple[float, ...], side: int = 1) -> dict:
    """Misplaced power on the gratings `make(value)`, for light from +x (`side` 1) or −x (−1).

    `misplaced` is [model][angle][value]. Angles of light from −x are negative.
    """
    gratings = [make(value) for value in values]
    # Adding 0 turns −0 into 0, which JSON would print with its sign.
    angles_deg = [side * angle + 0.0 for angle in sweeps.ANGLES_DEG]
    misplaced = {
        model.name: [[mean_error(grating, model, angle) for grating in gratings] for angle in angles_deg]
        for model in MODELS
    }
    return {"values": list(values), "angles_deg": angles_deg, "misplaced": misplaced}


def all_sweeps() -> dict:
    """Sweeps over the slope of sinusoids, over the facets' slope of sawteeth, and over the period of each kind.

    In light from +x the sawteeth's facets are turned away from it, in light from −x they face it.
    """
    by_period = {
        "sinusoid": sweep(lambda period: sinusoid(period, sweeps.SWEPT_SLOPE_DEG), sweeps.PERIODS_UM),
        "sawtooth": sweep(lambda period: sawtooth(period, sweeps.SWEPT_FACET_DEG), sweeps.PERIODS_UM),
        "lamellar": sweep(lambda period: Grating("lamellar", period, sweeps.SWEPT_HEIGHT_UM), sweeps.PERIODS_UM),
    }
    return {
        "slope": sweep(lambda slope: sinusoid(sweeps.PERIOD_UM, slope), sweeps.SLOPES_DEG),
        "facets_away": sweep(lambda facet: sawtooth(sweeps.PERIOD_UM, facet), sweeps.FACETS_DEG),
        "facets_facing": sweep(lambda facet: sawtooth(sweeps.PERIOD_UM, facet), sweeps.FACETS_DEG, side=-1),
        "period": by_period,
    }


def limits(swept: dict, falling: bool = False) -> dict:
    """For each model and each of REACHES_DEG the end of the range of values with a misplaced power of at most BOUND.

    `swept` is a result of `sweep`. The range begins at the smallest value. With `falling` it begins at the largest, for
    sweeps over the period, since models hold for long periods. The misplaced power is the largest over the angles of a
    reach. The end is `None` if BOUND is exceeded at the beginning of the range, and the last value if BOUND is never
    exceeded (`crossing`).
    """
    found = {}
    for model in MODELS:
        errors = np.array(swept["misplaced"][model.name])
        found[model.name] = []
        for reach_deg in REACHES_DEG:
            largest = errors[np.abs(swept["angles_deg"]) <= reach_deg].max(axis=0).tolist()
            found[model.name].append(sweeps.crossing(swept["values"], largest, BOUND, falling))
    return found


def model_checks() -> dict:
    """Largest differences of efficiencies from closed forms (`closed_form`), and from integrals over lobes (`lobe`).

    A finite coherence length widens each order to a lobe. An efficiency is computed from the value at the centre of its
    lobe. The lobes of three orders are integrated.
    """
    lights = [Light(550.0, angle) for angle in sweeps.ANGLES_DEG]
    closed, lobe = [], []
    for grating in (sinusoid(2.5, 20), sawtooth(2.5, 5.71), Grating("lamellar", 2.5, 0.25)):
        for power, light in zip(efficiencies(grating, STAM, lights), lights):
            closed.append(np.abs(power - closed_form(grating, "stam", light)).max())
    grating, light = sinusoid(2.5, 20), Light(550.0, 60.0)
    orders, _ = propagating(grating.period, light)
    for model in MODELS:
        power = efficiencies(grating, model, [light])[0]
        lobe += [abs(integrated(grating, model, light, order) - power[orders == order][0]) for order in (0, 2, 4)]
    return {"closed_form": float(max(closed)), "lobe": float(max(lobe))}


def sums_with_energy_conservation() -> list[dict]:
    """Sums over the orders of a shallow sinusoid, by `STAM_LIMITED`.

    A row for each coherence length lists sums by angle of incidence, as means over the wavelengths. Exact sums are 1.
    """
    # Period and height in µm.
    grating = Grating("sinusoidal", 1.6, 0.1)
    # All wavelengths of an angle follow each other, so a row of `reshape` has one angle.
    lights = [Light(wavelength, angle) for angle in sweeps.ANGLES_DEG for wavelength in sweeps.WAVELENGTHS_NM]
    rows = []
    for length_um in COHERENCE_LENGTHS_UM:
        sums = np.array([power.sum() for power in efficiencies(grating, STAM_LIMITED, lights, length_um)])
        means = sums.reshape(len(sweeps.ANGLES_DEG), -1).mean(axis=1)
        rows.append({"coherence_length_um": length_um, "sums": means.tolist()})
    return rows


def surfaces() -> list[dict]:
    """Rms slopes of the presets along x and y in degrees, and their peak to valley."""
    rows = []
    for name in SURFACES:
        report = json.loads(sunbeam("height-field", "--preset", name))
        slopes_deg = np.degrees(np.arctan(report["rms_slope"])).tolist()
        rows.append({"name": name, "rms_slope_deg": slopes_deg, "peak_to_valley_um": report["peak_to_valley_um"]})
    return rows


def figures() -> dict:
    """All numbers of the part; writes its plots.

    - `cases`: a `row` for each of CASES.
    - `rms`, `rms_gentle`: rms errors of an order's efficiency over all CASES, and over the gentlest.
    - `largest_sum`: the largest sum of a model's efficiencies over the orders, in any light on any of CASES.
    - `sweeps`, `rules`: the result of `all_sweeps`, and the `limits` of these sweeps.
    - `energy`, `flat`: errors of the rigorous solver, in the power balance and on a mirror.
    - `limiting`: the result of `sums_with_energy_conservation`.
    - `lights`: the number of all lights on CASES.
    """
    folder = images(PART)
    swept = all_sweeps()
    mean_nm = float(np.mean(sweeps.WAVELENGTHS_NM))
    gratings = [grating for _, _, grating in CASES]
    comparisons = [each for grating in gratings for each in compared(grating, angles_of(grating))]
    plots.angles(folder / "angles.svg")
    plots.slopes(folder / "slopes.svg", swept["slope"], swept["facets_away"], swept["facets_facing"], BOUND)
    plots.periods(folder / "periods.svg", swept["period"], mean_nm, BOUND)
    # A grating of height 0 is a mirror and reflects all light, here of 550 nm at 60°.
    flat = solve(Sinusoid(2.5, 0.0), 550.0, 60.0)
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
        "lights": len(comparisons),
        "energy": max(each.rigorous.imbalance for each in comparisons),
        "flat": float(abs(flat.te[flat.orders == 0][0] - 1)),
        "proof": proof(),
        "model_checks": model_checks(),
        "cases": [row(*case) for case in CASES],
        "rms": {
            model.name: [sweeps.rms_per_order(gratings, model, state) for state in ("unpolarised", "te", "tm")]
            for model in MODELS
        },
        # The first two of CASES are the gentlest sinusoids.
        "rms_gentle": {model.name: sweeps.rms_per_order(gratings[:2], model) for model in MODELS},
        "largest_sum": {
            model.name: float(max(each.scalar[model.name].sum() for each in comparisons)) for model in MODELS
        },
        "bound": BOUND,
        "reaches_deg": list(REACHES_DEG),
        "rules": {
            "slope": limits(swept["slope"]),
            "away": limits(swept["facets_away"]),
            "facing": limits(swept["facets_facing"]),
            "period": {kind: limits(kind_sweep, falling=True) for kind, kind_sweep in swept["period"].items()},
        },
        "mean_nm": mean_nm,
        "sweeps": swept,
        "limiting": sums_with_energy_conservation(),
        "surfaces": surfaces(),
        "metals": metals.figures(folder / "metals.svg", BOUND, REACHES_DEG),
    }
