"""The surfaces that agreement.py, samples.py and inspection.py check, and a synthetic scan in place of a measured one.

A surface is a set of parameters of `diffraction`. Parameters that are not given have the plugin's defaults: scalar
theory, and a perfect reflector as material.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitsuba_scenes.crosscheck import cases
from mitsuba_scenes.skin import KERATIN

# A grating in a metal, with lengths in µm. Its rigorous solution takes 30 s on one core.
GRATING = {"preset": "blazed", "period": 0.8, "height": 0.1, "material": "Al"}
# A grating in a perfect conductor, with lengths in µm. Its shorter period has fewer orders, so it takes 2 s.
PERFECT_GRATING = {"preset": "sinusoidal", "period": 0.5, "height": 0.05}
# Pixels along each side of the synthetic scan.
SCAN_PIXELS = 100
# Edge of a pixel in µm, about that of the published scans.
SCAN_PIXEL_UM = 0.065
# Difference between the highest and the lowest height in µm, about that of a snake's skin.
SCAN_RANGE_UM = 0.4
# Highest spatial frequency of the synthetic scan along x and along y, in cycles per scan: waves of 0.8 µm. A larger
# one gives a rougher relief.
SCAN_CYCLES = 8
# Seed of the synthetic scan; arbitrary.
SEED = 5


def surface(name: str) -> dict:
    """The parameters of a surface by name.

    The scan is the file `cases.SCAN` below the folder SUNBEAM_DATA. If the measured file is missing, `provide_scan`
    (__main__.py) writes the synthetic scan, and parts get its folder in the variable. KERATIN is a refractive index.
    """
    return {
        # The preset's period is 2.5 µm, its height 0.25 µm.
        "blazed": {"preset": "blazed"},
        "xenopeltis": {"preset": "xenopeltis", "eta": KERATIN},
        # The obliquity factor of the benchmark scenes (renders.py), so that both find the same tables in the cache.
        "scan": {"filename": str(cases.SCAN), "eta": KERATIN, "obliquity": "stam"},
        "aluminium grating": GRATING,
        "rigorous grating": {**GRATING, "theory": "rigorous"},
        "perfect grating": {**PERFECT_GRATING, "theory": "rigorous"},
    }[name]


def write_synthetic_scan(folder: Path) -> None:
    """Writes a smooth random relief in metres under the name of the measured scan, `xenopeltis.gsf`."""
    rng = np.random.default_rng(SEED)
    waves = np.fft.rfft2(rng.normal(size=(SCAN_PIXELS, SCAN_PIXELS)))
    # Row and column are the frequencies along y and x in cycles per scan. Negative rows are counted from the end, and
    # negative columns follow from the others, since heights are real.
    waves[SCAN_CYCLES + 1 : -SCAN_CYCLES] = 0
    waves[:, SCAN_CYCLES + 1 :] = 0
    relief = np.fft.irfft2(waves, s=(SCAN_PIXELS, SCAN_PIXELS))
    heights_m = (SCAN_RANGE_UM * 1e-6 * relief / np.ptp(relief)).astype("<f4")
    extent_m = SCAN_PIXELS * SCAN_PIXEL_UM * 1e-6
    header = (
        "Gwyddion Simple Field 1.0\n"
        f"XRes = {SCAN_PIXELS}\nYRes = {SCAN_PIXELS}\nXReal = {extent_m:.9g}\nYReal = {extent_m:.9g}\n"
        "XYUnits = m\nZUnits = m\nTitle = synthetic relief\n"
    ).encode()
    # The header ends with zeros up to a multiple of four bytes, at least one.
    header += b"\0" * (4 - len(header) % 4)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / cases.SCAN.name).write_bytes(header + heights_m.tobytes())
