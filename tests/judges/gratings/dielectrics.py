"""Random gratings in dielectrics, with the orders on both sides by coupled waves.

`python -m tests.judges.gratings.dielectrics` writes `crates/rigorous/tests/data/dielectrics.csv`. The judges are

- for light across the grooves the package `meent`, with sinusoids and sawteeth cut into layers;
- for other azimuths, of lamellar gratings, NIST's SCATMECH (`requirements-judges.lock`).

Each judge solves at two resolutions. Answers that have not converged are left out.
"""

from __future__ import annotations

import numpy as np

from mitsuba_scenes.environment import REPOSITORY

from .judged import write

ANSWERS = REPOSITORY / "crates" / "rigorous" / "tests" / "data" / "dielectrics.csv"
SEED, EACH = 23, 6
ETAS, PERIODS_UM, DEPTHS, THETA_MAX_DEG = (1.3, 2.5), (0.4, 4.0), (0.02, 0.4), 75.0
WAVELENGTHS_NM = (450.0, 650.0)
# Largest change of an efficiency between both resolutions of a converged answer.
SETTLED = 1e-3
# Samples of the period for the package's Fourier series.
SAMPLES = 1024
LAYERS = {"sinusoid": 20, "blazed": 20, "lamellar": 1}
HEADER = "shape,eta,period_um,height_um,nm,theta_deg,azimuth_deg,side,order,s,p,unsettled"
# Efficiencies for s and for p, by side (1 below) and order.
Answer = dict[tuple[int, int], np.ndarray]


def heights(shape: str, period: float, height: float) -> np.ndarray:
    x = (np.arange(SAMPLES) + 0.5) / SAMPLES
    if shape == "sinusoid":
        return 0.5 * height * (1 + np.sin(2 * np.pi * x))
    return height * x if shape == "blazed" else np.where(x < 0.5, height, 0.0)


def coupled_waves(
    shape: str, eta: float, period: float, height: float, nm: float, theta_deg: float, harmonics: int, layers: int
) -> Answer:
    """Light across the grooves, by `meent`; a relief of `layers` steps, with `harmonics` orders on either side."""
    import meent

    relief = heights(shape, period, height)
    # Layers from the top down.
    levels = height * (1 - (np.arange(layers) + 0.5) / layers)
    cell = np.where(relief[None, None, :] > levels[:, None, None], eta, 1.0).astype(complex)
    found: Answer = {}
    for state in (0, 1):
        # The package's angle has the opposite sign.
        solver = meent.call_mee(
            backend=0,
            pol=state,
            n_top=1.0,
            n_bot=eta,
            theta=np.radians(-theta_deg),
            phi=0.0,
            fto=[harmonics, 0],
            period=[period * 1e3, 1e3],
            wavelength=nm,
            thickness=[height * 1e3 / layers] * layers,
            ucell=cell,
            type_complex=np.complex128,
        )
        result = solver.conv_solve()
        for side, shares in enumerate((result.de_ri, result.de_ti)):
            for order, share in zip(range(-harmonics, harmonics + 1), np.asarray(shares).real.ravel(), strict=True):
                if share > 0:
                    found.setdefault((side, order), np.zeros(2))[state] = share
    return found


def scatmech(
    eta: float, period: float, height: float, nm: float, theta_deg: float, azimuth_deg: float, waves: int
) -> Answer:
    """A lamellar grating at any azimuth, by SCATMECH."""
    from pySCATMECH.rcw import RCW_Model

    medium = f"({eta!r},0)"
    grating = {
        None: "Single_Line_Grating",
        "period": repr(period),
        "height": repr(height),
        "topwidth": repr(period / 2),
        "bottomwidth": repr(period / 2),
        "offset": "0",
        "nlevels": "1",
        "medium_i": "(1,0)",
        "space": "(1,0)",
        "medium_t": medium,
        "material": medium,
    }
    found: Answer = {}
    for side in (0, 1):
        parameters = {
            None: "RCW_Model",
            "order": str(waves),
            "type": str(side),
            "lambda": repr(nm * 1e-3),
            "thetai": repr(theta_deg),
            "rotation": repr(azimuth_deg),
            "grating": grating,
        }
        model = RCW_Model(parameters)
        reach = int(eta * 2e3 * period / nm) + 2
        for order in range(-reach, reach + 1):
            mueller = np.array(model.DiffractionEfficiency(order))
            if mueller[0, 0] > 0:
                found[side, order] = np.array([mueller[0, 0] + mueller[0, 1], mueller[0, 0] - mueller[0, 1]])
    return found


def settled(coarse: Answer, fine: Answer, factor: float) -> tuple[Answer, float]:
    """The answer extrapolated by `factor` times the last change, and the largest change."""
    change = {key: fine[key] - coarse.get(key, 0.0) for key in fine}
    return {key: fine[key] + factor * change[key] for key in fine}, float(max(np.abs(c).max() for c in change.values()))


def main() -> None:
    rng = np.random.default_rng(SEED)
    rows = []
    for name in ("lamellar", "conical", "sinusoid", "blazed"):
        for _ in range(EACH):
            shape = "lamellar" if name == "conical" else name
            period = float(np.exp(rng.uniform(*np.log(PERIODS_UM))))
            drawn = (rng.uniform(*ETAS), period, period * rng.uniform(*DEPTHS), rng.uniform(*WAVELENGTHS_NM))
            eta, period, height, nm = (round(float(x), 4) for x in drawn)
            theta = round(float(rng.uniform(-THETA_MAX_DEG, THETA_MAX_DEG)), 3)
            azimuth = round(float(rng.uniform(10, 90)), 3) if name == "conical" else 0.0
            # Orders that propagate in the medium, and as many again.
            waves = int(eta * 2e3 * period / nm) + 10
            if name == "conical":
                coarse, fine = (scatmech(eta, period, height, nm, abs(theta), azimuth, n * waves) for n in (1, 2))
                answer, unsettled = settled(coarse, fine, 0.0)
                theta = abs(theta)
            else:
                layers = LAYERS[shape]
                more = 1 if layers == 1 else 2
                coarse = coupled_waves(shape, eta, period, height, nm, theta, waves, layers)
                fine = coupled_waves(shape, eta, period, height, nm, theta, 2 * waves, more * layers)
                # The error of steps is inverse to the square of their number.
                answer, unsettled = settled(coarse, fine, 1 / 3 if more > 1 else 0.0)
                unsettled *= 1 / 3 if more > 1 else 1.0
            print(name, eta, period, height, nm, theta, azimuth, f"{unsettled:.1e}", flush=True)
            if unsettled > SETTLED:
                continue
            setting = f"{shape},{eta},{period},{height},{nm},{theta},{azimuth}"
            for (side, order), (s, p) in sorted(answer.items()):
                rows.append(f"{setting},{side},{order},{s:.6f},{p:.6f},{unsettled:.1e}")
            write(ANSWERS, HEADER, rows)


if __name__ == "__main__":
    main()
