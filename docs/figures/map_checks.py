"""Measurements behind the sentences of the page of BRDF maps; `hold` raises an error if a sentence is false.

A map's pixels are direction sines (x, y) in [−1, 1]², and the disc is the hemisphere. Symbols: s is the coherence
window's standard deviation, a quarter of the coherence length; an order's lobe has the standard deviation λ/(2√2πs) in
sines.
"""

from __future__ import annotations

import json
import math
import random

import numpy as np
from PIL import Image

from mitsuba_scenes.environment import SetupError
from mitsuba_scenes.tool import sunbeam

from .map_panels import REFERENCE, Maps, Panel, disc
from .map_surfaces import PERIOD_UM, TILE_UM, Surface
from .rgb_against_spectral import lab
from .taylor_sums import SIZE, WAVELENGTH_UM, Sums

# Number of random directions and wavelengths for the comparison of the reference with the direct sum.
CHECKS = 24
# Smallest ΔE2000 that an eye notices.
SEEN = 1.0
# Wavelength of the checks at one wavelength.
NM = 550.0
# Radius about the mirror direction that is left out as the reflection itself, in direction sines.
MIRROR = 0.15


def responses(surface: Surface, lines: list[dict], *options) -> np.ndarray:
    """f_r in 1/sr by `sunbeam eval` with these options, for the directions and wavelengths of `lines`."""
    asked = "\n".join(map(json.dumps, lines)) + "\n"
    answered = sunbeam("eval", *surface.words, *options, stdin=asked)
    return np.array([json.loads(line)["f"] for line in answered.splitlines()])


def along_x(surface: Surface, sines: np.ndarray, *options) -> np.ndarray:
    """f_r at 550 nm in the plane of incidence, the light along the normal."""
    lines = [{"wi": [0, 0, 1], "wo": [x, 0, math.sqrt(1 - x * x)], "wavelength": NM} for x in map(float, sines)]
    return responses(surface, lines, *options)


def reference(surface: Surface) -> dict:
    """Largest difference of the reference from the direct double-precision sum, relative to the largest value."""
    draw_one = random.Random(1)

    def direction() -> list[float]:
        # Uniform over the projected hemisphere, as the pixels of a map.
        radius, azimuth = math.sqrt(draw_one.random()) * 0.99, draw_one.uniform(0, 2 * math.pi)
        x, y = radius * math.cos(azimuth), radius * math.sin(azimuth)
        return [x, y, math.sqrt(1 - x * x - y * y)]

    lines = [{"wi": [0, 0, 1], "wo": direction(), "wavelength": draw_one.uniform(380, 780)} for _ in range(CHECKS)]
    exact = responses(surface, lines, "--method", "exact", "--model", "patch")
    # Spectra need no step between wavelengths.
    found = responses(surface, lines, *REFERENCE[:4])
    return {"pairs": CHECKS, "worst": float(abs(exact - found).max() / exact.max())}


def steps(maps: Maps, panels: list[Panel], steps_nm: tuple) -> dict:
    """Mean errors in the first orders by step between wavelengths, and the smallest visible step.

    The first orders are where λ/d lies along x, to a tenth of the radius to either side; `line_nm` is the standard
    deviation of their power over the wavelength in one direction, λd/(2√2πs).
    """
    surface = panels[0].surface
    period_um = json.loads(sunbeam("height-field", *surface.words))["periods"]["x"]["period_um"]
    sine = (np.arange(panels[0].size) + 0.5) * 2 / panels[0].size - 1
    # λ/d for 380 to 780 nm.
    first_orders = (abs(sine) > 0.38 / period_um) & (abs(sine) < 0.78 / period_um)
    orders = first_orders[None, :] & (abs(sine) < 0.1)[:, None] & maps.lit(panels[0])
    errors = [maps.compared(panel, orders)["delta_e_2000"]["mean"] for panel in panels]
    return {
        "period_um": period_um,
        "line_nm": NM * period_um / (2 * math.sqrt(2) * math.pi * surface.coherence_um / 4),
        "delta_e": dict(zip(map(str, steps_nm), errors)),
        "first_seen": next((nm for nm, error in zip(steps_nm, errors) if error >= SEEN), None),
    }


def white_spot(maps: Maps, panels: list[Panel]) -> dict:
    """Mean CIELAB chroma of FLSS and NMM where NMM has no wavelength, with the largest value of each map as white."""
    radius = 0.38 / TILE_UM
    found = {"radius": radius}
    for panel in panels:
        name = {"(a) FLSS, centre": "flss", "(b) NMM, centre": "nmm"}.get(panel.caption)
        if name:
            _, exposure = maps.drawn(panel.words())
            # A thousandth of the exposure that clips 1 % clips nothing.
            exr, _ = maps.drawn(panel.words(), exposure / 1000)
            linear = decoded(exr.with_suffix(".png"))
            linear /= linear.max()
            # Half a pixel less, so that all these pixels are white by definition.
            inside = distance(panel.size, 0.0) < radius - 1 / panel.size
            found[name] = float(np.hypot(*lab(linear[inside])[:, 1:].T).mean())
    return found


def distance(size: int, x: float) -> np.ndarray:
    """Distance of each pixel from a point on the x axis, in direction sines."""
    sine = (np.arange(size) + 0.5) * 2 / size - 1
    return np.hypot(sine[None, :] - x, sine[:, None])


def decoded(png) -> np.ndarray:
    """The displayed picture in linear sRGB."""
    encoded = np.asarray(Image.open(png).convert("RGB")) / 255.0
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def spread(surface: Surface) -> dict:
    """Fraction of the first order's light at 550 nm beyond 3σ of the window's lobe, by FLSS and PQ."""
    sine = NM / 1e3 / PERIOD_UM
    deviation = NM / 1e3 / (2 * math.sqrt(2) * math.pi * surface.coherence_um / 4)
    sines = np.linspace(-1.5 * sine, -0.5 * sine, 4001)
    beyond = abs(sines + sine) > 3 * deviation
    made = {"deviation": deviation}
    for name in ("flss", "pq"):
        response = along_x(surface, sines, "--method", name)
        made[name] = float(response[beyond].sum() / response.sum())
    return made


def valleys(surface: Surface, sigmas_um: tuple) -> list[dict]:
    """Minimum between orders −1 and −2 at 550 nm, relative to the weaker order, by Single 2014's σs.

    σs is read in two ways: as the coherence length (`window`), and as the window's standard deviation (`deviation`).
    """
    sine = NM / 1e3 / PERIOD_UM
    sines = np.linspace(-2 * sine, -sine, 401)
    rows = []
    for sigma_um in sigmas_um:
        row = {"sigma_um": sigma_um, "periods": sigma_um / PERIOD_UM}
        for name, coherence_um in (("window", sigma_um), ("deviation", 4 * sigma_um)):
            response = along_x(surface.with_coherence(coherence_um), sines, "--method", "flss")
            row[name] = float(response.min() / min(response[0], response[-1]))
        rows.append(row)
    return rows


def terms_seen(rows: list[dict]) -> dict:
    """For each series the smallest number of terms whose map has no visible error where lit, or `None`."""
    made = {}
    for name in ("about the base", "about the middle", "Chebyshev"):
        least = None
        for row in reversed([row for row in rows if row["caption"].endswith(name)]):
            if row["delta_e_lit"] >= SEEN:
                break
            least = int(row["caption"].split()[2].rstrip(","))
        made[name.split()[-1].lower()] = least
    return made


def right_side(maps: Maps, panels: list[Panel]) -> dict:
    """Chroma of the map's right half over that of the disc by angle, without the mirror direction."""
    rows = []
    for panel in panels:
        exr, _ = maps.of(panel)
        a, b = np.moveaxis(lab(decoded(exr.with_suffix(".png")))[..., 1:], -1, 0)
        mirror = -math.sin(math.radians(panel.theta_i_deg))
        chroma = np.where(disc(panel.size) & (distance(panel.size, mirror) > MIRROR), np.hypot(a, b), 0)
        right = chroma[:, panel.size // 2 :]
        rows.append(
            {
                "theta_i_deg": panel.theta_i_deg,
                "share": float(right.sum() / chroma.sum()),
                "mean": float(right.sum() / (disc(panel.size).sum() / 2)),
            }
        )
    return {"rows": rows, "grows": {name: rises([row[name] for row in rows]) for name in ("share", "mean")}}


def rises(values: list[float]) -> bool:
    """Whether the values increase strictly."""
    return all(after > before for before, after in zip(values, values[1:]))


def hold(made: dict) -> None:
    """Raises SetupError if a sentence of the page's template is false for these figures."""
    errors = {
        surface: {row["caption"]: row["delta_e_lit"] for row in made["sheets"][f"taylor-{surface}"]["panels"]}
        for surface in ("blazed", "xenopeltis-procedural")
    }
    two = [f"N = {n}, about the base" for n in (24, 26)]
    parts = [found["parts"] for found in made["sums"]]
    lines_nm = {name: found["line_nm"] for name, found in made["steps"].items()}
    sentences = {
        "the blaze has converged with 24 and 26 terms": all(errors["blazed"][n] < SEEN for n in two),
        "Xenopeltis has not": all(errors["xenopeltis-procedural"][n] >= SEEN for n in two),
        "the four partial sums converge within 3 terms": all(max(four) - min(four) <= 3 for four in parts),
        "the lines of the blaze are wider than those of Elaphe": lines_nm["blazed"] > lines_nm["elaphe-procedural"],
        "σs as the deviation keeps orders apart": all(row["deviation"] < 0.01 for row in made["valleys"]),
        "NMM is whiter than FLSS at the centre": made["white_spot"]["nmm"] < made["white_spot"]["flss"],
        "PQ spreads the first order": made["spread"]["pq"] > made["spread"]["flss"],
    }
    wrong = [sentence for sentence, true in sentences.items() if not true]
    if wrong:
        raise SetupError(f"the page of BRDF maps says what its figures do not: {'; '.join(wrong)}")


def hold_against_the_sum(found: Sums, surface: Surface) -> None:
    """Raises unless the amplitudes agree with the direct sum: `f_r = O·4πs²|P|²/λ²`, with O = 1/cosθo here.

    The tolerance is 1e-6 of the largest value, the size of the window's weight beyond the orders summed.
    """
    power = abs(found.limits[4]) ** 2
    brightest = np.argsort(np.nan_to_num(power))[-8:]
    place = (np.arange(SIZE) + 0.5) * 2 / SIZE - 1
    lines, expected = [], []
    for pixel in brightest:
        x, y = float(place[pixel % SIZE]), float(-place[pixel // SIZE])
        z = math.sqrt(1 - x * x - y * y)
        lines.append({"wi": [0, 0, 1], "wo": [x, y, z], "wavelength": 1e3 * WAVELENGTH_UM})
        expected.append(4 * math.pi * (surface.coherence_um / 4) ** 2 * power[pixel] / WAVELENGTH_UM**2 / z)
    exact = responses(surface, lines, "--method", "exact", "--model", "patch")
    off = float(abs(exact - expected).max() / exact.max())
    if off > 1e-6:
        raise SetupError(f"Taylor's series is off from the direct sum by {off:.1e}")
