"""Surfaces shared by several test files, so that each is built once for each variant."""

PRESETS = ["flat", "sinusoidal", "blazed", "lamellar", "cd", "elaphe", "xenopeltis"]
# Quick to build: few orders, and no albedo table.
QUICK = {"preset": "blazed", "coherence_length": 10.0, "conserve_energy": False}
