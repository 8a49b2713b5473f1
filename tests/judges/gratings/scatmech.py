"""Powers of gratings' orders by NIST's SCATMECH (the package `pySCATMECH`), a rigorous coupled-wave analysis.

The mount may be conical. In metals the error is inverse to the number of waves, so two truncations show the
convergence.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mitsuba_scenes.environment import REPOSITORY, SetupError

REQUIREMENTS = REPOSITORY / "requirements-judges.lock"
# No higher order propagates in air for periods of up to 15 wavelengths, at any angle of incidence.
ORDERS = 30
# Stokes parameters I and Q of s and of p.
STATES = np.array([[1, 1], [1, -1]])
# The package's values of `type` for reflected and for transmitted orders.
REFLECTED, TRANSMITTED = 0, 1


def grating_model(
    profile: dict,
    period_um: float,
    wavelength_nm: float,
    index: complex,
    theta_i_deg: float,
    azimuth_deg: float,
    waves: int,
    above: float = 1.0,
    side: int = REFLECTED,
) -> Any:
    """The package's model of a grating with the parameters `profile`, such as those of `lamellae`.

    `waves` are kept on either side of order 0. The grating, of the refractive index `index` = η + ik, is turned by
    `azimuth_deg` about its normal, in either sense: it is symmetric in y. Light comes from a medium of the index
    `above`, in which `theta_i_deg` is measured; a profile's `above` must equal it. The wavelength is that in vacuum.
    `side` is REFLECTED or TRANSMITTED. Numbers are Python's, not NumPy's, whose `repr` the package cannot read. Raises
    SetupError without the package.
    """
    try:
        from pySCATMECH.rcw import RCW_Model
    except ImportError as error:
        raise SetupError(f"needs pySCATMECH: run `.venv/bin/pip install -r {REQUIREMENTS.name}`") from error
    upper, lower = f"({above!r},0)", f"({index.real!r},{index.imag!r})"
    grating = {**profile, "period": repr(period_um), "medium_i": upper, "medium_t": lower, "material": lower}
    light = {"lambda": repr(wavelength_nm * 1e-3), "thetai": repr(theta_i_deg), "rotation": repr(azimuth_deg)}
    # The package takes the name of a model from the key `None`.
    return RCW_Model({None: "RCW_Model", "order": str(waves), "type": str(side), **light, "grating": grating})


def lamellae(period_um: float, height_um: float, above: float = 1.0) -> dict:
    """The package's parameters of a lamellar profile of duty 1/2, with a medium of the index `above` in the grooves."""
    half = repr(period_um / 2)
    shape = {"height": repr(height_um), "topwidth": half, "bottomwidth": half, "offset": "0", "nlevels": "1"}
    return {None: "Single_Line_Grating", **shape, "space": f"({above!r},0)"}


def powers(model: Any, orders: int) -> dict[int, np.ndarray]:
    """Powers of s and p over the incident power, `[out, in]`, of the orders −orders … orders that propagate.

    The package gives Mueller matrices M. Light of a state has the Stokes parameters (1, ±1), and a state's part of I, Q
    is (I ± Q)/2.
    """
    found = {}
    for order in range(-orders, orders + 1):
        mueller = np.array(model.DiffractionEfficiency(order))
        if mueller[0, 0] > 0:
            found[order] = 0.5 * STATES @ mueller[:2, :2] @ STATES
    return found


def lamellar(
    period_um: float,
    height_um: float,
    wavelength_nm: float,
    index: complex,
    theta_i_deg: float,
    azimuth_deg: float,
    waves: int,
    above: float = 1.0,
) -> dict[int, np.ndarray]:
    """The `powers` of the reflected orders of a lamellar grating; arguments are those of `grating_model`.

    In the medium above, order m leaves at `wo.x = m·wavelength/(above·period) − wi.x`, as in all judges (__init__.py).
    """
    profile = lamellae(period_um, height_um, above)
    light = (theta_i_deg, azimuth_deg)
    return powers(grating_model(profile, period_um, wavelength_nm, index, *light, waves, above), ORDERS)
