"""Part `tables` of the documentation (page.py): the plugin's tables by surface.

A *table* holds precomputed values of the BSDF's diffraction (docs/tables.md). The numbers are the tables' size, build
time and measured error, and the surface's mean albedo.
"""

from __future__ import annotations

import json

from mitsuba_scenes.crosscheck.cases import SCANS
from mitsuba_scenes.environment import cache_off
from mitsuba_scenes.tool import sunbeam

from .speed_error import processor

# Presets whose tables are measured, besides those of the scans.
PRESETS = ("blazed", "sinusoidal", "lamellar", "cd", "elaphe", "xenopeltis")


def figures() -> dict:
    """The processor, and under `surfaces` the numbers of each scan that is present and of each preset, by name."""
    sources = {f"scan of {species}": ("--height-field", path) for species, path in SCANS.items() if path.exists()}
    sources |= {preset: ("--preset", preset) for preset in PRESETS}
    # Tables from the cache would have no build time.
    with cache_off():
        surfaces = {name: surface_figures(*source) for name, source in sources.items()}
    return {"cpu": processor(), "surfaces": surfaces}


def surface_figures(*source) -> dict:
    """The numbers of one surface, given by the arguments `source` of `sunbeam height-field`.

    - `build_s`, `bare_s`: build times in seconds. `build_s` includes the table of the albedo, which energy conservation
      needs; `bare_s` does not.
    - `mb`: the size of all tables in megabytes.
    - `error`: the measured relative error of the spectral table, the tabulated power spectrum.
    - `taps`: the numbers of nodes that a look-up in the spectral table reads along x and y.
    - `albedo`, `albedo_kept`: albedos without and with energy conservation. They are means over wavelengths, and over
      incident directions weighted by the cosine.
    """
    report, bare = (
        json.loads(sunbeam("height-field", *source, "--tables", "--conserve-energy", conserves))
        for conserves in ("true", "false")
    )
    tables = report["tables"]
    return {
        "pixels": report["pixels"],
        "extent_um": report["extent_um"],
        "mb": tables["bytes"] / 1e6,
        "build_s": tables["build_seconds"],
        "bare_s": bare["tables"]["build_seconds"],
        "error": tables["table"]["relative_error"],
        "taps": tables["table"]["taps"],
        "albedo": tables["energy"]["albedo_mean_unscaled"],
        "albedo_kept": tables["energy"]["albedo_mean_scaled"],
    }
