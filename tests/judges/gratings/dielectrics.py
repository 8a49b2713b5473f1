"""Random gratings in dielectrics, with the powers of the orders on both sides by coupled waves.

`python -m tests.judges.gratings.dielectrics` writes `crates/rigorous/tests/data/dielectrics.csv`. The judges are

- for light across the grooves the package `meent`, with sinusoids and sawteeth (`blazed`) cut into layers;
- for other azimuths, of lamellar gratings, NIST's SCATMECH (`requirements-judges.lock`).

Each judge solves at two resolutions. Answers that have not converged are left out. Periods and heights are in µm,
wavelengths `nm` in nm. s and p are the powers of an order for incident light of either state. `unsettled` is an
answer's estimated error.
"""

from __future__ import annotations

import numpy as np

from mitsuba_scenes.environment import REPOSITORY

from .coupled_waves import SAMPLES, TE, TM, solved
from .judged import write
from .scatmech import REFLECTED, TRANSMITTED, grating_model, lamellae, powers

ANSWERS = REPOSITORY / "crates" / "rigorous" / "tests" / "data" / "dielectrics.csv"
# Seed of the random gratings, and number of gratings of each kind.
SEED, EACH = 23, 6
# Ranges of the index, the period, and the height over the period; the largest angle of incidence.
ETAS, PERIODS_UM, DEPTHS, THETA_MAX_DEG = (1.3, 2.5), (0.4, 4.0), (0.02, 0.4), 75.0
WAVELENGTHS_NM = (450.0, 650.0)
# Largest `unsettled` of an answer that has converged.
SETTLED = 1e-3
# Number of layers into which a sinusoid or a sawtooth is cut at the coarser resolution.
LAYERS = 20
HEADER = "shape,eta,period_um,height_um,nm,theta_deg,azimuth_deg,side,order,s,p,unsettled"
# Powers [s, p] by (side, order); the side is REFLECTED or TRANSMITTED.
Answer = dict[tuple[int, int], np.ndarray]


def heights(shape: str, height: float) -> np.ndarray:
    """Heights of a relief at SAMPLES points of its period."""
    x = (np.arange(SAMPLES) + 0.5) / SAMPLES
    if shape == "sinusoid":
        return 0.5 * height * (1 + np.sin(2 * np.pi * x))
    return height * x if shape == "blazed" else np.where(x < 0.5, height, 0.0)


def coupled_waves(
    shape: str, eta: float, period: float, height: float, nm: float, theta_deg: float, harmonics: int, layers: int
) -> Answer:
    """The answer for light across the grooves, by `meent`, with the orders from −`harmonics` to `harmonics`."""
    # Heights of the layers' middles, from the top down.
    levels = height * (1 - (np.arange(layers) + 0.5) / layers)
    # Refractive indices, [layer, y, sample], with a single y.
    indices = np.where(heights(shape, height) > levels[:, None, None], eta, 1.0).astype(complex)
    found: Answer = {}
    # TE and TM are s and p, elements 0 and 1 of the powers.
    for state in (TE, TM):
        result = solved(indices, height / layers, period, nm, theta_deg, eta, harmonics, state)
        for side, efficiencies in ((REFLECTED, result.de_ri), (TRANSMITTED, result.de_ti)):
            orders = range(-harmonics, harmonics + 1)
            for order, power in zip(orders, np.asarray(efficiencies).real.ravel(), strict=True):
                # Evanescent orders have no power.
                if power > 0:
                    found.setdefault((side, order), np.zeros(2))[state] = power
    return found


def scatmech(
    eta: float, period: float, height: float, nm: float, theta_deg: float, azimuth_deg: float, waves: int
) -> Answer:
    """The answer of a lamellar grating at any azimuth, by SCATMECH, with the orders from −`waves` to `waves`."""
    found: Answer = {}
    # Beyond the largest order that propagates.
    reach = int(eta * 2e3 * period / nm) + 2
    for side in (REFLECTED, TRANSMITTED):
        light = (theta_deg, azimuth_deg)
        model = grating_model(lamellae(period, height), period, nm, complex(eta), *light, waves, side=side)
        # `states` is [out, in]: sums over both outgoing states.
        found |= {(side, order): states.sum(axis=0) for order, states in powers(model, reach).items()}
    return found


def extrapolated(coarse: Answer, fine: Answer, factor: float) -> tuple[Answer, float]:
    """The finer answer plus `factor` times its change from the coarser one, and the largest change.

    A `factor` of 0 leaves the finer answer as it is.
    """
    change = {key: fine[key] - coarse.get(key, 0.0) for key in fine}
    return {key: fine[key] + factor * change[key] for key in fine}, float(max(np.abs(c).max() for c in change.values()))


def judged(
    kind: str, eta: float, period: float, height: float, nm: float, theta_deg: float, azimuth_deg: float
) -> tuple[Answer, float]:
    """The answer for a kind of grating by its judge, and its `unsettled`."""
    # At least the largest order that propagates in the medium.
    waves = int(eta * 2e3 * period / nm) + 10
    if kind == "conical":
        coarse, fine = (scatmech(eta, period, height, nm, theta_deg, azimuth_deg, n * waves) for n in (1, 2))
        return extrapolated(coarse, fine, 0.0)
    setting = (kind, eta, period, height, nm, theta_deg)
    if kind == "lamellar":
        coarse, fine = (coupled_waves(*setting, n * waves, 1) for n in (1, 2))
        return extrapolated(coarse, fine, 0.0)
    coarse, fine = (coupled_waves(*setting, n * waves, n * LAYERS) for n in (1, 2))
    # The error is inversely proportional to the square of the number of layers, so a third of the change by twice the
    # layers remains.
    answer, change = extrapolated(coarse, fine, 1 / 3)
    return answer, change * (1 / 3)


def main() -> None:
    """Judges random gratings of each kind, and writes the file again after each answer."""
    rng = np.random.default_rng(SEED)
    rows = []
    # "conical" is a lamellar grating with light at an azimuth.
    for kind in ("lamellar", "conical", "sinusoid", "blazed"):
        for _ in range(EACH):
            period = float(np.exp(rng.uniform(*np.log(PERIODS_UM))))
            drawn = (rng.uniform(*ETAS), period, period * rng.uniform(*DEPTHS), rng.uniform(*WAVELENGTHS_NM))
            eta, period, height, nm = (round(float(x), 4) for x in drawn)
            theta = round(float(rng.uniform(-THETA_MAX_DEG, THETA_MAX_DEG)), 3)
            azimuth = 0.0
            if kind == "conical":
                azimuth, theta = round(float(rng.uniform(10, 90)), 3), abs(theta)
            answer, unsettled = judged(kind, eta, period, height, nm, theta, azimuth)
            print(kind, eta, period, height, nm, theta, azimuth, f"{unsettled:.1e}", flush=True)
            if unsettled > SETTLED:
                continue
            shape = "lamellar" if kind == "conical" else kind
            setting = f"{shape},{eta},{period},{height},{nm},{theta},{azimuth}"
            for (side, order), (s, p) in sorted(answer.items()):
                rows.append(f"{setting},{side},{order},{s:.6f},{p:.6f},{unsettled:.1e}")
            write(ANSWERS, HEADER, rows)


if __name__ == "__main__":
    main()
