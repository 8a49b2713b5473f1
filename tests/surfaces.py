"""The surfaces that several test files share, so that each is built once a variant."""

PRESETS = ["flat", "sinusoidal", "blazed", "lamellar", "cd", "elaphe", "xenopeltis"]
# Quick to build: energy not conserved, few orders.
QUICK = {"preset": "blazed", "coherence_length": 10.0, "conserve_energy": False}
