"""Part `gratings` of the documentation (page.py): classic efficiency curves by Maxwell's equations.

- d, h, λ, θi: the period, the height, the wavelength and the angle of incidence.
- *Ratio*: λ/d, against which curves are drawn. *Depth*: h/d.
- *Efficiency*: the fraction of the incident power in an order.
- *Littrow mount* in order 1: the diffracted light returns along the incident light, sin θi = λ/(2d). `sunbeam` gives
  the returning order the number −1, since the light comes from −x.
- An order *passes off* where it reaches the horizon. Efficiencies of the other orders then change steeply, in *Wood's
  anomalies*. On metals, surface plasmons shift these.
- TE, TM: the polarisations with the electric and the magnetic field along the grooves.
- Metals are named as Mitsuba's `material`, `Al` or `Ag`; a perfect conductor is `None`.
- *Curve*: a dictionary with lists, efficiencies `te` and `tm` over `ratio` or `height_um`, or `tm` over `theta_deg`.
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
    Relief,
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
# Period of a grating with 1200 grooves per millimetre.
PERIOD_UM = 1 / 1.2
# Numbers of samples of the short facet and of the period of the sawtooth `echelette`. They make a blaze at 17.5° and
# 500 nm: light of this wavelength along the normal of the long facets, at 17.5°, returns in order 1.
ECHELETTE_SAMPLES = (50, 553)
# λ/d at which orders pass off in a Littrow mount in order 1. Here the returning order has the number 1, and order j has
# the direction sine (½ − j)λ/d. It is ±1 for orders 3 and −2 at λ/d = 2/5, and for orders 2 and −1 at 2/3.
PASSING_OFF = (2 / 5, 2 / 3)
# Offsets in λ/d of extra points about PASSING_OFF, where curves are steep. More are positive, since surface plasmons
# shift the anomalies of metals to longer wavelengths.
ANOMALY_OFFSETS = (-0.012, -0.006, -0.003, -0.001, 0.001, 0.003, 0.005, 0.007, 0.009, 0.012, 0.015, 0.018, 0.023, 0.028)


def ratio_grid(first: float, last: float, count: int) -> np.ndarray:
    """Ascending λ/d: `count` equidistant values, and extra ones about the anomalies.

    Values are rounded to six digits, so that values equal up to rounding errors appear once, and 1 is exact.
    """
    extra = [passing_off + offset for passing_off in PASSING_OFF for offset in ANOMALY_OFFSETS]
    return np.unique(np.round([*np.linspace(first, last, count), *extra], 6))


# λ/d of curves in aluminium: 300 to 883 nm, within the range of Mitsuba's data.
ALUMINIUM_RATIOS = ratio_grid(0.36, 1.06, 71)
# λ/d of curves in a perfect conductor.
PERFECT_RATIOS = ratio_grid(0.3, 1.9, 81)
# Half width in λ/d of the fine curve about an anomaly: larger than the anomaly's shift by the plasmon.
ANOMALY_HALF_WIDTH = 0.04
# Number of points of the fine curve about an anomaly.
ANOMALY_POINTS = 41
# Depths h/d of sinusoids: within scalar theory, a common holographic grating, and a deep one.
SINUSOID_DEPTHS = (0.05, 0.14, 0.3)
# Depth h/d of the lamellar grating, whose ridges and grooves are d/2 wide.
LAMELLAR_DEPTH = 0.3
# Height of a lamellar grating over that of the sinusoid with the same first harmonic. A square wave of height H has the
# harmonic amplitude 2H/π, a sinusoid of height h has h/2, so H = πh/4.
EQUIVALENT_HEIGHT = np.pi / 4
# Smallest λ/d at which a lamellar grating and the sinusoid with its first harmonic are compared, beyond the anomaly at
# 2/3.
EQUIVALENT_FROM = 0.8
# λ/d of the lamellar grating's sweep over depth. Its grooves, d/2 wide, are wider than λ/2, so TE light enters them.
LAMELLAR_RATIO = 0.8
# Period of the sinusoids in silver of the plasmon figure.
PLASMON_PERIOD_UM = 0.8
# Wavelength of the plasmon figure, that of a helium-neon laser.
PLASMON_NM = 632.8
# Heights of the sinusoids in silver.
PLASMON_HEIGHTS_UM = (0.01, 0.02, 0.03, 0.04, 0.05, 0.07)
# Heights of two shallow gratings, from whose dips the plasmon's angle at height 0 is extrapolated. Larger heights leave
# the quadratic law; smaller ones have fainter dips.
SHALLOW_UM = (0.002, 0.004)
# Half width in degrees of the fine curve about a plasmon's angle.
DIP_HALF_WIDTH_DEG = 2.0
# Number of points of the fine curve about a plasmon's angle.
DIP_POINTS = 81


def curves_by_medium(relief: Relief) -> dict[str, dict]:
    """Curves of a relief in a Littrow mount: in aluminium, `Al`, and in a perfect conductor, `perfect`."""
    return {
        "Al": littrow_curve(relief, ALUMINIUM_RATIOS, "Al"),
        "perfect": littrow_curve(relief, PERFECT_RATIOS, None),
    }


def steepest_ratio(relief: Relief, metal: str | None, ratio: float) -> float:
    """The λ/d near `ratio` at which the relief's TM curve is steepest, to the step of the fine curve."""
    near = ratio + np.linspace(-ANOMALY_HALF_WIDTH, ANOMALY_HALF_WIDTH, ANOMALY_POINTS)
    tm = littrow_curve(relief, near, metal)["tm"]
    steepest = int(np.argmax(np.abs(np.diff(tm))))
    return float(0.5 * (near[steepest] + near[steepest + 1]))


def blazed(folder: Path) -> dict:
    """A right-angled echelette: curves in both media, efficiencies `at_blaze`, and positions of TM's anomalies.

    - `te_peak`: λ/d and value of TE's maximum by medium.
    - `anomalies`: the expected λ/d, `passing_off` in a perfect conductor and `plasmon` in aluminium, and the λ/d found,
      `perfect` and `Al`.
    - `step`: the resolution in λ/d of `perfect` and `Al`.
    - `slope_deg`, `blaze_ratio`, `blaze_nm`: the slope of the long facets, and λ/d and wavelength of the blaze.

    The heights are written to a file in `folder`.
    """
    relief = echelette(PERIOD_UM, ECHELETTE_SAMPLES, folder / "echelette.npy")
    slope_deg = blaze_angle_deg(ECHELETTE_SAMPLES)
    # λ/d at which light along the normal of the long facets returns: λ/d = 2 sin θi, and θi is their slope.
    blaze = 2 * np.sin(np.radians(slope_deg))
    curves = curves_by_medium(relief)
    at_blaze = {name: littrow(relief, blaze, metal) for name, metal in (("Al", "Al"), ("perfect", None))}
    anomalies = [
        {
            "passing_off": ratio,
            # The plasmon's wave number on flat metal is that of a grazing order times this factor.
            "plasmon": ratio * surface_plasmon(index("Al", 1e3 * PERIOD_UM * ratio)),
            "Al": steepest_ratio(relief, "Al", ratio),
            "perfect": steepest_ratio(relief, None, ratio),
        }
        for ratio in PASSING_OFF
    ]
    return {
        "slope_deg": slope_deg,
        "blaze_ratio": float(blaze),
        "blaze_nm": float(1e3 * PERIOD_UM * blaze),
        "curves": curves,
        "at_blaze": at_blaze,
        # `vertex` needs equidistant points. TE's maximum and its neighbours are no extra points of `ratio_grid`.
        "te_peak": {name: vertex(curve["ratio"], curve["te"]) for name, curve in curves.items()},
        "anomalies": anomalies,
        "step": 2 * ANOMALY_HALF_WIDTH / (ANOMALY_POINTS - 1),
    }


def sinusoidal() -> dict:
    """Sinusoids, or holographic gratings, of three depths, and the shallowest one against its phase screen.

    - `shallow`: the curve of the shallowest grating in a perfect conductor, with the phase screen's efficiency J1² in
      order 1 as `screen`. J1 is the Bessel function.
    - `screen_most`, `screen_most_ratio`: the largest efficiency of the phase screen, and the λ/d where it occurs.
    - `shallow_most`: the largest efficiencies of this curve.
    - `rayleigh`, `rayleigh_slope`: the largest difference from Rayleigh's expansion for the second depth, and the
      sinusoid's steepest slope πh/d.
    """
    shallow_depth, rayleigh_depth = SINUSOID_DEPTHS[:2]

    def relief(depth: float) -> Relief:
        return preset("sinusoidal", PERIOD_UM, depth * PERIOD_UM)

    curves = {str(depth): curves_by_medium(relief(depth)) for depth in SINUSOID_DEPTHS}
    # λ/d far below 1, where the phase screen is a good approximation.
    ratios = np.round(np.linspace(0.1, 0.3, 41), 6)
    # The phase screen's efficiency J1(κh/2)², with the phase rate κ = 4π cos θi/λ for light that returns.
    screen = [bessel(1, 2 * np.pi * shallow_depth / ratio * np.cos(np.arcsin(0.5 * ratio))) ** 2 for ratio in ratios]
    shallow = littrow_curve(relief(shallow_depth), ratios, None)
    return {
        "depths": list(SINUSOID_DEPTHS),
        "curves": curves,
        "shallow": {**shallow, "screen": [float(value) for value in screen]},
        "screen_most": float(max(screen)),
        "screen_most_ratio": float(ratios[int(np.argmax(screen))]),
        "shallow_most": {key: max(shallow[key]) for key in ("te", "tm")},
        "rayleigh": rayleigh_difference(rayleigh_depth, curves[str(rayleigh_depth)]["perfect"]),
        "rayleigh_slope": float(np.pi * rayleigh_depth),
    }


def rayleigh_difference(depth: float, curve: dict) -> float:
    """Largest difference between `curve` and Rayleigh's expansion, in TE and TM.

    `curve` is that of a perfectly conducting sinusoid of this depth in a Littrow mount.
    """
    profile, largest = Sinusoid(PERIOD_UM, depth * PERIOD_UM), 0.0
    for ratio, te, tm in zip(curve["ratio"], curve["te"], curve["tm"]):
        theta_deg = float(np.degrees(np.arcsin(0.5 * ratio)))
        # A sinusoid as steep as the second depth needs more evanescent orders than the default.
        other = sinusoid_rayleigh(profile, 1e3 * PERIOD_UM * ratio, theta_deg, evanescent=12)
        # The expansion gives the returning order the number 1.
        order = other.orders == 1
        largest = max(largest, abs(other.te[order][0] - te), abs(other.tm[order][0] - tm))
    return float(largest)


def lamellar() -> dict:
    """A lamellar grating over λ/d and over depth, and another one against the sinusoid with its first harmonic.

    `most` has the largest efficiencies over depth, each with the depth h/d where it occurs. Under `equivalent`, `te`
    and `tm` are the largest differences of the second lamellar grating from the sinusoid.
    """
    curves = curves_by_medium(preset("lamellar", PERIOD_UM, LAMELLAR_DEPTH * PERIOD_UM))
    # 120 heights from 0.01 µm to 1.2 periods.
    over_height = littrow_against_height("lamellar", PERIOD_UM, LAMELLAR_RATIO, (0.01, 1.2 * PERIOD_UM, 120))
    over_height["height_ratio"] = [height / PERIOD_UM for height in over_height["height_um"]]
    compared = PERFECT_RATIOS[np.greater_equal(PERFECT_RATIOS, EQUIVALENT_FROM)]
    depth = SINUSOID_DEPTHS[1]
    lamella = littrow_curve(preset("lamellar", PERIOD_UM, depth * EQUIVALENT_HEIGHT * PERIOD_UM), compared, None)
    sinusoid = littrow_curve(preset("sinusoidal", PERIOD_UM, depth * PERIOD_UM), compared, None)
    return {
        "depth": LAMELLAR_DEPTH,
        "curves": curves,
        "against_height": over_height,
        "ratio": LAMELLAR_RATIO,
        "most": {
            key: [max(over_height[key]), over_height["height_ratio"][int(np.argmax(over_height[key]))]]
            for key in ("te", "tm")
        },
        "equivalent": {
            "depth": depth,
            "from": EQUIVALENT_FROM,
            "lamellar_depth": float(depth * EQUIVALENT_HEIGHT),
            **{key: float(np.abs(np.subtract(lamella[key], sinusoid[key])).max()) for key in ("te", "tm")},
            "curves": {"lamellar": lamella, "sinusoidal": sinusoid},
        },
    }


def dip(height_um: float, near_deg: float) -> tuple[float, float]:
    """Angle of incidence in degrees and value of the smallest TM efficiency of order 0 near the angle `near_deg`.

    The grating is a sinusoid of this height in silver.
    """
    relief = preset("sinusoidal", PLASMON_PERIOD_UM, height_um)
    span_deg = (near_deg - DIP_HALF_WIDTH_DEG, near_deg + DIP_HALF_WIDTH_DEG, DIP_POINTS)
    curve = mirror_curve(relief, "Ag", PLASMON_NM, span_deg)
    # The minimum of the curve is the maximum of its negative.
    angle_deg, negative = vertex(curve["theta_deg"], -np.array(curve["tm"]))
    return angle_deg, -negative


def plasmons() -> dict:
    """Dips of order 0 of sinusoids in silver, where light excites surface plasmons.

    On a shallow grating order j excites a plasmon where sin θi − jλ/d = ±`wave`.

    - `wave`: the plasmon's wave number on flat silver over that of light in vacuum.
    - `expected_deg`: the θi at which order −1 excites a plasmon (+`wave`) and order 2 does (−`wave`). The keys are "1"
      and "2".
    - `curves`, `dips`: curves of several heights over the angle of incidence, and the first dip of each, by order −1.
    - `limit_deg`: the angle of the first dip as the height tends to 0.
    - `flat_tm`: the reflectance of flat silver at the first expected angle.
    """
    n = index("Ag", PLASMON_NM)
    wave = surface_plasmon(n)
    ratio = PLASMON_NM * 1e-3 / PLASMON_PERIOD_UM
    # sin θi = wave − λ/d for order −1, and 2λ/d − wave for order 2: a sign times (wave − |j| λ/d).
    expected_deg = {
        str(order): float(np.degrees(np.arcsin(sign * (wave - order * ratio)))) for order, sign in ((1, 1), (2, -1))
    }
    # 181 angles from 0° to 45°, in steps of a quarter of a degree.
    curves = {
        str(height): mirror_curve(preset("sinusoidal", PLASMON_PERIOD_UM, height), "Ag", PLASMON_NM, (0, 45, 181))
        for height in PLASMON_HEIGHTS_UM
    }
    dips = []
    for height in PLASMON_HEIGHTS_UM:
        theta_deg, tm = dip(height, expected_deg["1"])
        dips.append({"height_um": height, "theta_deg": theta_deg, "tm": tm})
    # The angle of the dip is linear in the square of the height; two shallow gratings give its value at height 0.
    (low_deg, _), (high_deg, _) = (dip(height, expected_deg["1"]) for height in SHALLOW_UM)
    squares = np.square(SHALLOW_UM)
    limit_deg = low_deg - (high_deg - low_deg) * squares[0] / (squares[1] - squares[0])
    return {
        "period_um": PLASMON_PERIOD_UM,
        "wavelength_nm": PLASMON_NM,
        "index": [n.real, n.imag],
        "wave": wave,
        "expected_deg": expected_deg,
        "curves": curves,
        "dips": dips,
        "limit_deg": float(limit_deg),
        "flat_tm": fresnel_p(n, expected_deg["1"]),
    }


def fresnel_p(n: complex, theta_deg: float) -> float:
    """Fresnel's reflectance of a flat metal with the complex index `n` for p polarised light."""
    cos = np.cos(np.radians(theta_deg))
    # n times the cosine of the refracted angle.
    inside = np.sqrt(n * n - 1 + cos * cos)
    return float(abs((n * n * cos - inside) / (n * n * cos + inside)) ** 2)


def check(made: dict) -> None:
    """Raises SetupError if the numbers `made` of `figures` contradict a statement of the template."""
    for name, curve in made["blazed"]["curves"].items():
        # All ranges of λ/d include 1, which is far beyond the blaze.
        at_one = curve["ratio"].index(1.0)
        insist(PART, curve["tm"][at_one] > curve["te"][at_one], f"beyond the blaze TM stays above TE ({name})")
    step = made["blazed"]["step"]
    for row in made["blazed"]["anomalies"]:
        insist(PART, abs(row["perfect"] - row["passing_off"]) <= step, "a perfect conductor's anomaly is Rayleigh's")
        # Grooves of finite depth shift the plasmon a little beyond its place on a flat metal: here by up to 3 steps.
        between = row["passing_off"] - step <= row["Al"] <= row["plasmon"] + 3 * step
        insist(PART, between, "aluminium's anomaly lies between Rayleigh's and a little beyond the plasmon")
    dips = made["plasmons"]["dips"]
    angles, efficiencies = ([row[key] for row in dips] for key in ("theta_deg", "tm"))
    insist(PART, angles == sorted(angles), "dips of higher gratings are at larger angles")
    deepest = efficiencies.index(min(efficiencies))
    is_between = 0 < deepest < len(efficiencies) - 1
    insist(PART, is_between and efficiencies[deepest] < 0.02, "at one of the heights nearly all light is absorbed")
    off_deg = abs(made["plasmons"]["limit_deg"] - made["plasmons"]["expected_deg"]["1"])
    insist(PART, off_deg < 0.01, "the dip of shallow grooves is the closed form's")
    insist(PART, made["lamellar"]["most"]["tm"][0] > 0.99, "a symmetric grating sends everything back")


def figures() -> dict:
    """All numbers of the part; writes its plots."""
    with tempfile.TemporaryDirectory() as temporary:
        made = {
            "blazed": blazed(Path(temporary)),
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
