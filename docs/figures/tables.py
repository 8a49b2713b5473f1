"""The part `tables`: size, build time, measured error and mean albedo of the tables of scans and presets."""

from __future__ import annotations

import json

from mitsuba_scenes.crosscheck.cases import SCANS
from mitsuba_scenes.environment import cache_off
from mitsuba_scenes.tool import sunbeam

from .speed_error import processor

PRESETS = ("blazed", "sinusoidal", "lamellar", "cd", "elaphe", "xenopeltis")


def figures() -> dict:
    """Builds each surface twice, with and without the albedo's table."""
    sources = {f"scan of {species}": ("--height-field", path) for species, path in SCANS.items() if path.exists()}
    sources |= {preset: ("--preset", preset) for preset in PRESETS}
    with cache_off():
        surfaces = {name: surface_figures(*source) for name, source in sources.items()}
    return {"cpu": processor(), "surfaces": surfaces}


def surface_figures(*source) -> dict:
    """The numbers of one surface, a preset or a file as words of the command line."""
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
