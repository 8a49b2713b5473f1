"""The part `gratings`: classic efficiency curves by Maxwell's equations, with closed forms and published figures.

Symbols: d is the period and λ the wavelength; curves are drawn against λ/d. In a *Littrow mount* in order 1 the
diffracted light returns along the incident light, sin θi = λ/(2d). An order *passes off* where it reaches the horizon.
TE and TM are the polarisations with the electric and the magnetic field along the grooves.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from tests.judges.gratings.independent import sinusoid_rayleigh
from tests.judges.gratings.metals import index, surface_plasmon
from tests.judges.gratings.profile import Sinusoid
from tests.judges.gratings.scalar import bessel

from . import gratings_plots as plots
from .gratings_curves import (
    blaze_angle_deg,
    echelette,
    littrow,
    littrow_against_height,
    littrow_curve,
    mirror_curve,
    preset,
    vertex,
)
from .page import images, insist

PART = "gratings"
# Period of 1200 grooves a millimetre.
PERIOD_UM = 1 / 1.2
# Samples of the short facet and of the period, for a blaze at 17.5° and 500 nm.
ECHELETTE = (50, 553)
# Orders 2 and −1 of a Littrow mount in order 1 pass off at λ/d = 2/3, 3 and −2 at 2/5.
PASSING_OFF = (2 / 5, 2 / 3)
# Offsets in λ/d of extra points about an anomaly (Wood's anomaly, where an order passes off). Chosen.
ANOMALY = (-0.012, -0.006, -0.003, -0.001, 0.001, 0.003, 0.005, 0.007, 0.009, 0.012, 0.015, 0.018, 0.023, 0.028)


def ratios(first: float, last: float, count: int) -> np.ndarray:
    """Equidistant λ/period, and extra points where orders pass off."""
    more = [passing + apart for passing in PASSING_OFF for apart in ANOMALY]
    return np.unique(np.round([*np.linspace(first, last, count), *more], 6))


# λ/period in aluminium, from 300 to 885 nm, the range of Mitsuba's data.
ALUMINIUM = ratios(0.36, 1.06, 71)
# λ/period in a perfect conductor.
PERFECT = ratios(0.3, 1.9, 81)
# Half width in λ/d of the fine curve about an anomaly.
NEAR = 0.04
# Number of points of the fine curve.
NEAR_POINTS = 41
# Height over period of a grating within scalar theory, of a common holographic grating, and of a deep one.
SINUSOIDS = (0.05, 0.14, 0.3)
# Height over period of the lamellar grating.
LAMELLAR = 0.3
# Height of a lamellar grating over that of the sinusoid with the same first harmonic.
EQUIVALENT = np.pi / 4
# Smallest λ/d of the comparison, past the anomaly.
EQUIVALENT_FROM = 0.8
# λ/d of the depth sweep: grooves are 0.625 wavelengths wide, so TE light propagates in them.
LAMELLAR_RATIO = 0.8
# Period of the silver grating of the plasmon figure.
PLASMON_PERIOD_UM = 0.8
# Wavelength of the plasmon figure in nm, that of a helium-neon laser.
PLASMON_NM = 632.8
# Heights of the silver grating.
PLASMON_HEIGHTS_UM = (0.01, 0.02, 0.03, 0.04, 0.05, 0.07)
# Heights of two shallow gratings, from whose dips the plasmon's angle at height 0 is extrapolated.
SHALLOW_UM = (0.002, 0.004)
# Range in degrees of the fine curve about a plasmon's angle.
FINE_DEG = 2.0
# Number of points of the fine curve.
FINE_POINTS = 81


def sharpest(relief, metal: str | None, ratio: float) -> float:
    """The λ/d near `ratio` at which TM is steepest."""
    near = ratio + np.linspace(-NEAR, NEAR, NEAR_POINTS)
    tm = littrow_curve(relief, near, metal)["tm"]
    steepest = int(np.argmax(np.abs(np.diff(tm))))
    return float(0.5 * (near[steepest] + near[steepest + 1]))


def blazed(folder: Path) -> dict:
    """A right-angled echelette: curves, their peaks, and positions of TM's anomalies."""
    relief = echelette(PERIOD_UM, ECHELETTE, folder / "echelette.npy")
    slope_deg = blaze_angle_deg(ECHELETTE)
    blaze = 2 * np.sin(np.radians(slope_deg))
    curves = {"Al": littrow_curve(relief, ALUMINIUM, "Al"), "perfect": littrow_curve(relief, PERFECT, None)}
    at_blaze = {name: littrow(relief, blaze, metal) for name, metal in (("Al", "Al"), ("perfect", None))}
    anomalies = [
        {
            "passing_off": ratio,
            "plasmon": ratio * surface_plasmon(index("Al", 1e3 * PERIOD_UM * ratio)),
            "Al": sharpest(relief, "Al", ratio),
            "perfect": sharpest(relief, None, ratio),
        }
        for ratio in PASSING_OFF
    ]
    return {
        "slope_deg": slope_deg,
        "blaze_ratio": float(blaze),
        "blaze_nm": float(1e3 * PERIOD_UM * blaze),
        "curves": curves,
        "at_blaze": at_blaze,
        "te_peak": {name: vertex(curve["ratio"], curve["te"]) for name, curve in curves.items()},
        "anomalies": anomalies,
        "step": 2 * NEAR / (NEAR_POINTS - 1),
    }


def sinusoidal() -> dict:
    """Holographic gratings of three heights; the shallowest in a perfect conductor, whose phase screen has J1²."""
    curves = {
        str(depth): {
            "Al": littrow_curve(preset("sinusoidal", PERIOD_UM, depth * PERIOD_UM), ALUMINIUM, "Al"),
            "perfect": littrow_curve(preset("sinusoidal", PERIOD_UM, depth * PERIOD_UM), PERFECT, None),
        }
        for depth in SINUSOIDS
    }
    shallow = np.round(np.linspace(0.1, 0.3, 41), 6)
    screen = [bessel(1, 2 * np.pi * SINUSOIDS[0] / ratio * np.cos(np.arcsin(0.5 * ratio))) ** 2 for ratio in shallow]
    found = littrow_curve(preset("sinusoidal", PERIOD_UM, SINUSOIDS[0] * PERIOD_UM), shallow, None)
    return {
        "depths": list(SINUSOIDS),
        "curves": curves,
        "shallow": {**found, "screen": [float(value) for value in screen]},
        "screen_most": float(max(screen)),
        "screen_most_ratio": float(shallow[int(np.argmax(screen))]),
        "shallow_most": {key: max(found[key]) for key in ("te", "tm")},
        "rayleigh": from_rayleigh(SINUSOIDS[1], curves[str(SINUSOIDS[1])]["perfect"]),
        "rayleigh_slope": float(np.pi * SINUSOIDS[1]),
    }


def from_rayleigh(depth: float, curve: dict) -> float:
    """Largest difference of a perfect conductor's curve from Rayleigh's expansion."""
    profile, apart = Sinusoid(PERIOD_UM, depth * PERIOD_UM), 0.0
    for ratio, te, tm in zip(curve["ratio"], curve["te"], curve["tm"]):
        theta_deg = float(np.degrees(np.arcsin(0.5 * ratio)))
        # This steep sinusoid needs more evanescent orders than the default.
        other = sinusoid_rayleigh(profile, 1e3 * PERIOD_UM * ratio, theta_deg, evanescent=12)
        order = other.orders == 1
        apart = max(apart, abs(other.te[order][0] - te), abs(other.tm[order][0] - tm))
    return float(apart)


def lamellar() -> dict:
    """A lamellar grating against λ/d and depth, and against the sinusoid with the same first harmonic."""
    relief = preset("lamellar", PERIOD_UM, LAMELLAR * PERIOD_UM)
    curves = {"Al": littrow_curve(relief, ALUMINIUM, "Al"), "perfect": littrow_curve(relief, PERFECT, None)}
    against = littrow_against_height("lamellar", PERIOD_UM, LAMELLAR_RATIO, (0.01, 1.2 * PERIOD_UM, 120))
    against["height_ratio"] = [height / PERIOD_UM for height in against["height_um"]]
    beyond = PERFECT[np.greater_equal(PERFECT, EQUIVALENT_FROM)]
    same = littrow_curve(preset("lamellar", PERIOD_UM, SINUSOIDS[1] * EQUIVALENT * PERIOD_UM), beyond, None)
    other = littrow_curve(preset("sinusoidal", PERIOD_UM, SINUSOIDS[1] * PERIOD_UM), beyond, None)
    return {
        "depth": LAMELLAR,
        "curves": curves,
        "against_height": against,
        "ratio": LAMELLAR_RATIO,
        "most": {
            key: [max(against[key]), against["height_ratio"][int(np.argmax(against[key]))]] for key in ("te", "tm")
        },
        "equivalent": {
            "depth": SINUSOIDS[1],
            "from": EQUIVALENT_FROM,
            "lamellar_depth": float(SINUSOIDS[1] * EQUIVALENT),
            **{key: float(np.abs(np.subtract(same[key], other[key])).max()) for key in ("te", "tm")},
            "curves": {"lamellar": same, "sinusoidal": other},
        },
    }


def dip(height_um: float, near_deg: float) -> tuple[float, float]:
    """Angle in degrees and value of the smallest TM efficiency of order 0 near an angle of incidence."""
    relief = preset("sinusoidal", PLASMON_PERIOD_UM, height_um)
    span = (near_deg - FINE_DEG, near_deg + FINE_DEG, FINE_POINTS)
    curve = mirror_curve(relief, "Ag", PLASMON_NM, span)
    angle, most = vertex(curve["theta_deg"], -np.array(curve["tm"]))
    return angle, -most


def plasmons() -> dict:
    """Silver's dips: curves of several depths, the first dip of each, and its limit for shallow grooves."""
    n = index("Ag", PLASMON_NM)
    wave = surface_plasmon(n)
    ratio = PLASMON_NM * 1e-3 / PLASMON_PERIOD_UM
    expected = {
        str(order): float(np.degrees(np.arcsin(sign * (wave - order * ratio)))) for order, sign in ((1, 1), (2, -1))
    }
    curves = {
        str(height): mirror_curve(preset("sinusoidal", PLASMON_PERIOD_UM, height), "Ag", PLASMON_NM, (0, 45, 181))
        for height in PLASMON_HEIGHTS_UM
    }
    dips = [
        dict(zip(("height_um", "theta_deg", "tm"), (height, *dip(height, expected["1"]))))
        for height in PLASMON_HEIGHTS_UM
    ]
    # The angle of the dip is linear in the square of the height.
    (low, _), (high, _) = (dip(height, expected["1"]) for height in SHALLOW_UM)
    squares = np.square(SHALLOW_UM)
    limit = low - (high - low) * squares[0] / (squares[1] - squares[0])
    return {
        "period_um": PLASMON_PERIOD_UM,
        "wavelength_nm": PLASMON_NM,
        "index": [n.real, n.imag],
        "wave": wave,
        "expected_deg": expected,
        "curves": curves,
        "dips": dips,
        "limit_deg": float(limit),
        "flat_tm": fresnel_p(n, expected["1"]),
    }


def fresnel_p(n: complex, theta_deg: float) -> float:
    """Reflectance of a flat metal for p polarised light."""
    cos = np.cos(np.radians(theta_deg))
    inside = np.sqrt(n * n - 1 + cos * cos)
    return float(abs((n * n * cos - inside) / (n * n * cos + inside)) ** 2)


def check(made: dict) -> None:
    """Raises an error where a statement of the template is not true of the numbers."""
    for name, curve in made["blazed"]["curves"].items():
        long = curve["ratio"].index(1.0)
        insist(PART, curve["tm"][long] > curve["te"][long], f"beyond the blaze TM stays above TE ({name})")
    for row in made["blazed"]["anomalies"]:
        step = made["blazed"]["step"]
        insist(PART, abs(row["perfect"] - row["passing_off"]) <= step, "a perfect conductor's anomaly is Rayleigh's")
        inside = row["passing_off"] - step <= row["Al"] <= row["plasmon"] + 3 * step
        insist(PART, inside, "aluminium's anomaly lies about the plasmon")
    dips = made["plasmons"]["dips"]
    angles, depths = ([row[key] for row in dips] for key in ("theta_deg", "tm"))
    insist(PART, angles == sorted(angles), "dips move to larger angles")
    least = depths.index(min(depths))
    insist(PART, 0 < least < len(depths) - 1 and depths[least] < 0.02, "one depth takes nearly everything")
    apart = abs(made["plasmons"]["limit_deg"] - made["plasmons"]["expected_deg"]["1"])
    insist(PART, apart < 0.01, "the dip of shallow grooves is the closed form's")
    insist(PART, made["lamellar"]["most"]["tm"][0] > 0.99, "a symmetric grating sends everything back")


def figures() -> dict:
    """All numbers of the part; writes its plots."""
    with tempfile.TemporaryDirectory() as folder:
        made = {
            "blazed": blazed(Path(folder)),
            "sinusoidal": sinusoidal(),
            "lamellar": lamellar(),
            "plasmons": plasmons(),
        }
    check(made)
    folder = images(PART)
    plots.blazed(folder / "blazed.svg", made["blazed"], PASSING_OFF)
    plots.sinusoidal(folder / "sinusoidal.svg", made["sinusoidal"], PASSING_OFF)
    plots.lamellar(folder / "lamellar.svg", made["lamellar"], PASSING_OFF)
    plots.plasmons(folder / "plasmons.svg", made["plasmons"])
    return {"period_um": PERIOD_UM, **made}
