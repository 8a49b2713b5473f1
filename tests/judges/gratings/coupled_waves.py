"""Order efficiencies of lamellar gratings by rigorous coupled-wave analysis, the package `meent`.

A perfect conductor is the limit of a metal of index iκ for large κ, with a difference of about 1/κ. The field in the
walls decays within λ/2πκ, so a larger κ needs more harmonics.
"""

from __future__ import annotations

import numpy as np

from mitsuba_scenes.environment import REPOSITORY, SetupError

REQUIREMENTS = REPOSITORY / "requirements-validity.lock"
# Samples of the period for the package's Fourier series; an even number gives a duty of exactly 1/2.
SAMPLES = 1024


def lamellar(
    period: float, height: float, wavelength_nm: float, theta_i_deg: float, extinction: float, harmonics: int
) -> tuple[np.ndarray, np.ndarray]:
    """TE and TM efficiencies of the orders −harmonics … harmonics for a lossless metal of index i·extinction."""
    try:
        import meent
    except ImportError as error:
        raise SetupError(
            f"the page validity needs the package meent: run `.venv/bin/pip install -r {REQUIREMENTS.name}`"
        ) from error
    metal = 1j * extinction
    cell = np.array([[[metal] * (SAMPLES // 2) + [1.0] * (SAMPLES // 2)]], dtype=complex)
    found = []
    for polarisation in (0, 1):
        # The package's angle has the opposite sign.
        solver = meent.call_mee(
            backend=0,
            pol=polarisation,
            n_top=1.0,
            n_bot=metal,
            theta=np.radians(-theta_i_deg),
            phi=0.0,
            fto=[harmonics, 0],
            period=[period * 1e3, 1e3],
            wavelength=wavelength_nm,
            thickness=[height * 1e3],
            ucell=cell,
            type_complex=np.complex128,
        )
        found.append(np.asarray(solver.conv_solve().de_ri).ravel())
    return found[0], found[1]
