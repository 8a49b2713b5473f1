"""The part `bodies-validity`: transmitted orders of gratings in a dielectric against independent solvers.

tests/judges/gratings/transmitted.py has the gratings, lights and stored results of the solvers, the *judges*. Misplaced
power is the fraction of the transmitted light that a theory puts into wrong orders.
"""

from __future__ import annotations

import numpy as np

from tests.judges.gratings import transmitted

from .page import insist

PART = "bodies-validity"
# Functions from a setting to the powers of its transmitted orders, by theory. `limited` is the small-slope theory with
# energy conservation.
THEORIES = {
    "small slope": transmitted.small_slope,
    "limited": lambda setting: transmitted.small_slope(setting, limited=True),
    "phase screen": transmitted.phase_screen,
    "rigorous": transmitted.rigorous,
}


def figures() -> dict:
    """Misplaced power of each theory, and errors of `rigorous` and of the judges.

    `rows` has an entry for each grating. Its `misplaced` has a list for each theory: the means over the wavelengths,
    one for each of LIGHTS_DEG. `error` is the rms difference of an order's power between `rigorous` and the judge.
    `unsettled` has by preset the largest change of an order's power between a judge's two resolutions. Raises
    SetupError if the numbers contradict the page.
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
        "error": float(np.sqrt(np.mean(np.concatenate(rigorous_errors) ** 2))),
    }
