"""What the tables of the presets take and keep: bytes, seconds, their measured error, and the albedo."""

from __future__ import annotations

import json
from pathlib import Path

from ..crosscheck.cases import SCAN
from ..environment import cache_off
from ..tool import sunbeam
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


def figures(scan: Path = SCAN) -> dict:
    """Builds each surface twice, with and without the albedo's table."""
    with cache_off():
        surfaces = {preset: surface_figures("--preset", preset) for preset in PRESETS}
        scanned = surface_figures("--height-field", scan) if scan.exists() else None
    for preset, surface in surfaces.items():
        surface["albedo_before"] = SCALED_BEFORE[preset]
    return {"cpu": processor(), "surfaces": surfaces, "scan": scanned}


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
