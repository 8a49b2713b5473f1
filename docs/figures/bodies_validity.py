"""The part `bodies-validity`: transmitted orders of gratings in a dielectric against independent solvers.

Answers of the solvers, the *judges*, are stored (tests/judges/gratings/transmitted.py).
"""

from __future__ import annotations

import numpy as np

from tests.judges.gratings import transmitted

from .page import insist

PART = "bodies-validity"
# Powers of transmitted orders by theory.
THEORIES = {
    "small slope": transmitted.small_slope,
    "limited": lambda setting: transmitted.small_slope(setting, limited=True),
    "phase screen": transmitted.phase_screen,
    "rigorous": transmitted.rigorous,
}


def figures() -> dict:
    """Misplaced power by theory, a mean over the wavelengths: a row for each grating, and a list by light.

    `error` is the rms difference of an order's power between `rigorous` and the judge. `unsettled` has the judge's own
    largest change between two resolutions, by preset. Raises SetupError if the numbers contradict the page.
    """
    true, rows, errors = transmitted.load(), [], []
    for name, grating in transmitted.GRATINGS:
        lights: dict[str, list[float]] = {theory: [] for theory in THEORIES}
        for light in transmitted.LIGHTS_DEG:
            settings = [transmitted.Setting(name, grating, nm, *light) for nm in transmitted.WAVELENGTHS_NM]
            for theory, powers in THEORIES.items():
                found = [powers(setting) for setting in settings]
                off = [transmitted.misplaced(power, true[setting]) for power, setting in zip(found, settings)]
                lights[theory].append(float(np.mean(off)))
                if theory == "rigorous":
                    errors += [power - true[setting] for power, setting in zip(found, settings)]
        rows.append({"name": name, "period_um": grating.period, "height_um": grating.height, "misplaced": lights})
    for row in rows:
        slope, screen = (row["misplaced"][theory] for theory in ("limited", "phase screen"))
        if row["name"] == "sinusoid":
            insist(PART, all(a < b for a, b in zip(slope, screen)), "small slope is the better on sinusoids")
        if row["name"] == transmitted.FACING:
            insist(PART, all(a > b for a, b in zip(slope, screen)), "the phase screen is the better on facing facets")
    return {
        "eta": transmitted.ETA,
        "wavelengths_nm": list(transmitted.WAVELENGTHS_NM),
        "lights_deg": [list(light) for light in transmitted.LIGHTS_DEG],
        "theories": list(THEORIES),
        "rows": rows,
        "unsettled": {name: transmitted.unsettled(name) for name in ("sinusoidal", "lamellar", "blazed")},
        # The coarser resolution of sawteeth is unstable along the normal.
        "unsettled_oblique": transmitted.unsettled("blazed", 30.0),
        "error": float(np.sqrt(np.mean(np.concatenate(errors) ** 2))),
    }
