"""Order efficiencies of lamellar gratings of real metals by NIST's SCATMECH, the package `pySCATMECH`.

The method is rigorous coupled waves, in conical mounts, too. The error is inverse to the number of waves, so two
truncations tell the convergence.
"""

from __future__ import annotations

import numpy as np

from mitsuba_scenes.environment import REPOSITORY, SetupError

REQUIREMENTS = REPOSITORY / "requirements-judges.lock"
# Largest order that propagates for periods of up to 15 wavelengths.
ORDERS = 30
# First two Stokes parameters of s and p.
STATES = np.array([[1, 1], [1, -1]])


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
    """Efficiencies of propagating orders of a grating of duty 1/2: powers of s and p, `[out, in]`.

    `waves` are kept on either side of order 0. The grating is turned by `azimuth_deg` about its normal; order m
    leaves at the sine of `theta_i_deg` along the grating's vector plus m·wavelength/period. Light and orders are in a
    medium of the index `above`, in which the angle is measured; the wavelength is that in vacuum.
    """
    try:
        from pySCATMECH.rcw import RCW_Model
    except ImportError as error:
        raise SetupError(f"needs pySCATMECH: run `.venv/bin/pip install -r {REQUIREMENTS.name}`") from error
    medium = f"({index.real!r},{index.imag!r})"
    lines = {
        None: "Single_Line_Grating",
        "period": repr(period_um),
        "height": repr(height_um),
        "topwidth": repr(period_um / 2),
        "bottomwidth": repr(period_um / 2),
        "offset": "0",
        "nlevels": "1",
        "medium_i": f"({above!r},0)",
        "space": f"({above!r},0)",
        "medium_t": medium,
        "material": medium,
    }
    model = RCW_Model(
        {
            None: "RCW_Model",
            "order": str(waves),
            "type": "0",
            "lambda": repr(wavelength_nm * 1e-3),
            "thetai": repr(theta_i_deg),
            "rotation": repr(azimuth_deg),
            "grating": lines,
        }
    )
    found = {}
    for order in range(-ORDERS, ORDERS + 1):
        mueller = np.array(model.DiffractionEfficiency(order))
        if mueller[0, 0] > 0:
            found[order] = 0.5 * STATES @ mueller[:2, :2] @ STATES
    return found
