"""What the tables of the presets take and keep: bytes, seconds, their measured error, and the albedo."""

from __future__ import annotations

import json

from mitsuba_scenes.crosscheck.cases import SCANS
from mitsuba_scenes.environment import cache_off
from mitsuba_scenes.tool import sunbeam

from .speed_error import processor

PRESETS = ("blazed", "sinusoidal", "lamellar", "cd", "elaphe", "xenopeltis")
# Mean albedos that the search for factors left, which was used until 2026-11.
SCALED_BEFORE = {
    "blazed": 0.851,
    "sinusoidal": 0.954,
    "lamellar": 0.919,
    "cd": 0.963,
    "elaphe": 0.944,
    "xenopeltis": 0.813,
}


def figures() -> dict:
    """Builds each surface twice, with and without the albedo's table."""
    sources = {f"scan of {species}": ("--height-field", path) for species, path in SCANS.items() if path.exists()}
    sources |= {preset: ("--preset", preset) for preset in PRESETS}
    with cache_off():
        surfaces = {name: surface_figures(*source) for name, source in sources.items()}
    for name, surface in surfaces.items():
        surface["albedo_before"] = SCALED_BEFORE.get(name)
    return {"cpu": processor(), "surfaces": surfaces}


def surface_figures(*source) -> dict:
    made, bare = (
        json.loads(sunbeam("height-field", *source, "--tables", "--conserve-energy", kept))
        for kept in ("true", "false")
    )
    tables = made["tables"]
    return {
        "pixels": made["pixels"],
        "extent_um": made["extent_um"],
        "mb": tables["bytes"] / 1e6,
        "build_s": tables["build_seconds"],
        "bare_s": bare["tables"]["build_seconds"],
        "error": tables["table"]["relative_error"],
        "taps": tables["table"]["taps"],
        "albedo": tables["energy"]["albedo_mean_unscaled"],
        "albedo_kept": tables["energy"]["albedo_mean_scaled"],
    }
