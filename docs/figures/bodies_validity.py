"""Part `bodies-validity` of the documentation (page.py): transmitted orders of gratings against other solvers.

The gratings are the boundary of a transparent *body*, a film or an interface (docs/model.md#bodies-that-transmit).
tests/judges/gratings/transmitted.py has the gratings, lights and stored results of the independent solvers, the
*judges*. An order's power is a fraction of the incident light. *Misplaced* power is the fraction of the transmitted
light that a theory puts into wrong orders. A *table* holds the orders' efficiencies over wavelength and direction of
the light, which the plugin interpolates.
"""

from __future__ import annotations

import re

import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant
from tests.judges.gratings import transmitted

from .page import insist

PART = "bodies-validity"
# Functions from a setting (grating, wavelength and light) to the powers of its transmitted orders, by theory. "limited"
# is the small-slope theory with energy conservation, and "rigorous" Maxwell's equations.
THEORIES = {
    "small slope": transmitted.small_slope,
    "limited": lambda setting: transmitted.small_slope(setting, limited=True),
    "phase screen": transmitted.phase_screen,
    "rigorous": transmitted.rigorous,
}

# Names and gratings whose tables are measured: those with periods of up to 2 µm. Wider ones have more orders and take
# longer to build.
TABULATED = [(name, grating) for name, grating in transmitted.GRATINGS if grating.period <= 2.0]
# Pattern of the tables' description in the text of a rigorous BSDF: megabytes, seconds to build, and rms error of an
# order.
TABLES = re.compile(r"tables of ([\d.]+) MB.*\(([\d.]+) s to build\).*error of an order ([\d.e-]+)")


def table_errors(grating: transmitted.Grating) -> dict:
    """Size, build time and error of the grating's tables as a film and as an interface.

    `rms` is the root mean square error of an order's efficiency against the solver that filled the tables, over random
    incidences and wavelengths.
    """
    found = {"period_um": grating.period, "height_um": grating.height}
    for body in ("film", "interface"):
        relief = {"preset": grating.preset, "period": grating.period, "height": grating.height}
        # Ten times the plugin's limits of building, so that no table is refused.
        surface = {"type": "diffraction", **relief, "eta": transmitted.ETA, "theory": "rigorous", "build_limit": 10.0}
        described = str(mi.load_dict({**surface, "transmission": body}))
        match = TABLES.search(described)
        insist(PART, match is not None, "the plugin describes its tables")
        # For type checkers, which do not know that `insist` raises.
        assert match is not None
        megabytes, seconds, rms = map(float, match.groups())
        found[body] = {"megabytes": megabytes, "seconds": seconds, "rms": rms}
    return found


def tabulated() -> list[dict]:
    """`table_errors` of each grating of TABULATED, with its `name`."""
    use_variant(fall_back=False)
    return [{"name": name, **table_errors(grating)} for name, grating in TABULATED]


def figures() -> dict:
    """Misplaced power of each theory, errors of `rigorous` and of the judges, and errors of tables.

    - `rows`: an entry for each grating. `misplaced` has a list for each theory: the means over the wavelengths, one for
      each of `lights_deg`, pairs of angle of incidence and azimuth.
    - `error`: the rms difference of an order's power between `rigorous` and the judge.
    - `unsettled`: by preset, the largest change of an order's power between a judge's two resolutions.
    - `tables`: the result of `tabulated`.

    Raises SetupError if the numbers contradict the page.
    """
    judged = transmitted.load()
    rows, rigorous_errors = [], []
    for name, grating in transmitted.GRATINGS:
        misplaced: dict[str, list[float]] = {theory: [] for theory in THEORIES}
        for light in transmitted.LIGHTS_DEG:
            settings = [transmitted.Setting(name, grating, nm, *light) for nm in transmitted.WAVELENGTHS_NM]
            expected = [judged[setting] for setting in settings]
            for theory, powers_of in THEORIES.items():
                powers = [powers_of(setting) for setting in settings]
                misplaced[theory].append(float(np.mean([*map(transmitted.misplaced, powers, expected)])))
                if theory == "rigorous":
                    rigorous_errors += [power - true for power, true in zip(powers, expected)]
        rows.append({"name": name, "period_um": grating.period, "height_um": grating.height, "misplaced": misplaced})
    for row in rows:
        limited, screen = row["misplaced"]["limited"], row["misplaced"]["phase screen"]
        if row["name"] == "sinusoid":
            insist(PART, all(a < b for a, b in zip(limited, screen)), "small slope is better on sinusoids")
        # Sawteeth whose facets face the light.
        if row["name"] == transmitted.FACING:
            insist(PART, all(a > b for a, b in zip(limited, screen)), "the phase screen is better on facing facets")
    return {
        "eta": transmitted.ETA,
        "wavelengths_nm": list(transmitted.WAVELENGTHS_NM),
        "lights_deg": [list(light) for light in transmitted.LIGHTS_DEG],
        "theories": list(THEORIES),
        "rows": rows,
        "unsettled": {name: transmitted.unsettled(name) for name in ("sinusoidal", "lamellar", "blazed")},
        # Sawteeth at angles of incidence of 30° and more; along the normal the coarser resolution is unstable.
        "unsettled_oblique": transmitted.unsettled("blazed", 30.0),
        "tables": tabulated(),
        "error": float(np.sqrt(np.mean(np.concatenate(rigorous_errors) ** 2))),
    }
