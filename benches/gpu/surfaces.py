"""The surfaces that are checked, as parameters of `diffraction`, and a scan where no measured one is at hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitsuba_scenes.crosscheck import cases
from mitsuba_scenes.skin import KERATIN

# Solving the metal takes half a minute of one core, the perfect conductor of a shorter period two seconds.
GRATING = {"preset": "blazed", "period": 0.8, "height": 0.1, "material": "Al"}
PERFECT_GRATING = {"preset": "sinusoidal", "period": 0.5, "height": 0.05}
# The synthetic scan: pixels of the published scans, 65 nm, and heights of a skin.
SCAN_PIXELS, SCAN_PIXEL_UM, SCAN_RANGE_UM = 100, 0.065, 0.4
SEED = 5


def surface(name: str) -> dict:
    """The parameters of a surface by name. The scan is the one of `cases.SCAN`."""
    return {
        "blazed": {"preset": "blazed"},
        "xenopeltis": {"preset": "xenopeltis", "eta": KERATIN},
        # The obliquity factor of the benchmark scenes, which so share its tables.
        "scan": {"filename": str(cases.SCAN), "eta": KERATIN, "obliquity": "stam"},
        "aluminium grating": GRATING,
        "rigorous grating": {**GRATING, "theory": "rigorous"},
        "perfect grating": {**PERFECT_GRATING, "theory": "rigorous"},
    }[name]


def write_synthetic_scan(folder: Path) -> None:
    """Writes a smooth random relief under the name of the scan that is missing: `xenopeltis.gsf`, in metres."""
    rng = np.random.default_rng(SEED)
    waves = np.fft.rfft2(rng.normal(size=(SCAN_PIXELS, SCAN_PIXELS)))
    waves[8:-8], waves[:, 10:] = 0, 0
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
