"""Efficiencies of gratings by rigorous coupled-wave analysis, the package `meent`, for light across the grooves.

`theta_i_deg` is the angle θi of the direction to the light, whose x is sin θi. Order j leaves at x = jλ/period − sin
θi. TE has the electric field along the grooves, TM the magnetic field. A perfect conductor is the limit of a metal of
index i·extinction for a large extinction; efficiencies differ by about 1/extinction. The field in the metal decays
within λ/(2π·extinction), so a larger extinction needs more harmonics.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mitsuba_scenes.environment import REPOSITORY, SetupError

REQUIREMENTS = REPOSITORY / "requirements-validity.lock"
# Samples of the period for the package's Fourier series. Chosen: an even number gives `lamellar` a duty of exactly 1/2;
# fewer place the edges of other profiles less exactly.
SAMPLES = 1024
# The package's numbers of the two polarisations.
TE, TM = 0, 1


def solved(
    layers: np.ndarray,
    layer_um: float,
    period_um: float,
    wavelength_nm: float,
    theta_i_deg: float,
    index: complex,
    harmonics: int,
    polarisation: int,
) -> Any:
    """The package's result for one polarisation, TE or TM.

    Its `de_ri` and `de_ti` are the reflected and transmitted efficiencies of the orders −harmonics … harmonics.
    `layers` has refractive indices, (number of layers, 1, SAMPLES), from the top down and along x; each layer is
    `layer_um` high. Light comes from air above, and `index` is the refractive index of the medium below. More
    `harmonics` are more exact and take longer. Raises SetupError without the package.
    """
    try:
        import meent
    except ImportError as error:
        raise SetupError(
            f"the page validity needs the package meent: run `.venv/bin/pip install -r {REQUIREMENTS.name}`"
        ) from error
    # The package's angle has the opposite sign of θi, and its lengths are in nm. Backend 0 is NumPy. The grating has no
    # harmonics (`fto`) along y, so its period along y, 1000 nm, has no effect.
    solver = meent.call_mee(
        backend=0,
        pol=polarisation,
        n_top=1.0,
        n_bot=index,
        theta=np.radians(-theta_i_deg),
        phi=0.0,
        fto=[harmonics, 0],
        period=[period_um * 1e3, 1e3],
        wavelength=wavelength_nm,
        thickness=[layer_um * 1e3] * len(layers),
        ucell=layers,
        type_complex=np.complex128,
    )
    return solver.conv_solve()


def lamellar(
    period_um: float, height_um: float, wavelength_nm: float, theta_i_deg: float, extinction: float, harmonics: int
) -> tuple[np.ndarray, np.ndarray]:
    """Reflected TE and TM efficiencies of the orders −harmonics … harmonics for a metal of index i·extinction.

    The metal is lossless, since its permittivity is real. Ridges and grooves are half a period wide.
    """
    metal = 1j * extinction
    layer = np.array([[[metal] * (SAMPLES // 2) + [1.0] * (SAMPLES // 2)]], dtype=complex)
    light = (wavelength_nm, theta_i_deg)
    te, tm = (
        solved(layer, height_um, period_um, *light, metal, harmonics, polarisation).de_ri for polarisation in (TE, TM)
    )
    return np.asarray(te).ravel(), np.asarray(tm).ravel()
