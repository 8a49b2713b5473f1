"""Measurements for the documentation's text about BRDF maps; `check` raises an error if they contradict the text.

- FLSS, NMM, PQ: the realtime methods of M. Single's thesis, Single 2014 (docs/realtime.md).
- *Map*: a picture of the BRDF over outgoing directions. Its pixels are direction sines (x, y) in [−1, 1]², and its disc
  is the hemisphere. A pixel is *lit* where the displayed reference map is not black.
- *Panel*: a map of a surface with the options of a method, and its caption (map_panels.py).
- λ, d, s: the wavelength, the period, and the coherence window's standard deviation, a quarter of the coherence length.
- *Lobe* of an order: the Gaussian about its direction. Its standard deviation is λ/(2√2·πs) in direction sines.
"""

from __future__ import annotations

import json
import math
import random
from pathlib import Path

import numpy as np
from PIL import Image

from mitsuba_scenes.environment import SetupError
from mitsuba_scenes.tool import sunbeam

from .map_panels import REFERENCE_SPECTRUM, Maps, Panel, disc, sines
from .map_surfaces import PERIOD_UM, TILE_UM, Surface
from .page import insist
from .rgb_against_spectral import lab
from .taylor_sums import SIZE, WAVELENGTH_UM, Sums

# Number of random pairs of direction and wavelength at which the reference is compared with the direct sum. The sum is
# slow; more pairs would find rarer errors.
PAIRS = 24
# Smallest ΔE2000 that an eye notices.
NOTICED_DELTA_E = 1.0
# Wavelength of the checks at one wavelength.
CHECKED_NM = 550.0
# Shortest and longest of the wavelengths that the methods sum.
VISIBLE_UM = (0.38, 0.78)
# Radius in direction sines of the excluded disc about the mirror direction. A larger one excludes more diffracted
# light, a smaller one includes the lobe of the mirror reflection.
MIRROR_RADIUS = 0.15
# Number of directions at which the amplitudes of Taylor's series are compared with the direct sum.
COMPARED_DIRECTIONS = 8
# Half height in direction sines of the strip about y = 0 whose light counts as that of orders along x. A higher strip
# includes more light between orders.
STRIP = 0.1


def lobe_length_um(surface: Surface) -> float:
    """2√2·πs in µm: λ over this length is the standard deviation of an order's lobe in direction sines."""
    return 2 * math.sqrt(2) * math.pi * surface.coherence_um / 4


def responses(surface: Surface, queries: list[dict], *options) -> np.ndarray:
    """f_r in 1/sr by `sunbeam eval` with these options.

    A query is {"wi": [x, y, z], "wo": [x, y, z], "wavelength": nm} with unit vectors away from the surface. The command
    returns one value for each.
    """
    printed = sunbeam("eval", *surface.arguments, *options, stdin="\n".join(map(json.dumps, queries)) + "\n")
    return np.array([json.loads(line)["f"] for line in printed.splitlines()])


def along_x(surface: Surface, x: np.ndarray, *options) -> np.ndarray:
    """f_r in 1/sr at CHECKED_NM for light along the normal, at the direction sines (x, 0)."""
    queries = [
        {"wi": [0, 0, 1], "wo": [sine, 0, math.sqrt(1 - sine * sine)], "wavelength": CHECKED_NM}
        for sine in map(float, x)
    ]
    return responses(surface, queries, *options)


def reference(surface: Surface) -> dict:
    """Largest difference of REFERENCE_SPECTRUM from the direct sum in double precision, as `worst`.

    The difference is relative to the largest value of the sum. Values are compared at PAIRS random pairs of direction
    and wavelength, for light along the normal.
    """
    generator = random.Random(1)

    def direction() -> list[float]:
        """A random direction, uniform over the disc as a map's pixels are; the factor 0.99 avoids the horizon.

        The square root makes equal areas equally likely.
        """
        radius, azimuth = math.sqrt(generator.random()) * 0.99, generator.uniform(0, 2 * math.pi)
        x, y = radius * math.cos(azimuth), radius * math.sin(azimuth)
        return [x, y, math.sqrt(1 - x * x - y * y)]

    shortest_nm, longest_nm = (1e3 * um for um in VISIBLE_UM)
    queries = [
        {"wi": [0, 0, 1], "wo": direction(), "wavelength": generator.uniform(shortest_nm, longest_nm)}
        for _ in range(PAIRS)
    ]
    exact = responses(surface, queries, "--method", "exact", "--model", "patch")
    found = responses(surface, queries, *REFERENCE_SPECTRUM)
    return {"pairs": PAIRS, "worst": float(abs(exact - found).max() / exact.max())}


def steps(maps: Maps, panels: list[Panel], steps_nm: tuple) -> dict:
    """Mean ΔE₂₀₀₀ to the reference map over the pixels of the first orders, for each step between wavelengths.

    The pixels of the first orders have |x| = λ/d for a visible λ and |y| < STRIP, and are lit. `panels` has a panel for
    each of `steps_nm`, which ascend. The result has

    - `period_um`: the dominant period d along x;
    - `line_nm`: λd/(2√2·πs) at CHECKED_NM, the standard deviation in nm of the wavelengths that order 1 sends into one
      direction. By the grating equation a difference of direction sines times d is a difference of wavelengths;
    - `delta_e`: the errors by step in nm;
    - `first_seen`: the smallest step with a visible error, or `None`.
    """
    surface = panels[0].surface
    period_um = json.loads(sunbeam("height-field", *surface.arguments))["periods"]["x"]["period_um"]
    sine = abs(sines(panels[0].size))
    visible = (sine > VISIBLE_UM[0] / period_um) & (sine < VISIBLE_UM[1] / period_um)
    orders = visible[None, :] & (sine < STRIP)[:, None] & maps.lit(panels[0])
    errors = [maps.compare(panel, orders)["delta_e_2000"]["mean"] for panel in panels]
    return {
        "period_um": period_um,
        "line_nm": CHECKED_NM * period_um / lobe_length_um(surface),
        "delta_e": dict(zip(map(str, steps_nm), errors)),
        "first_seen": next((nm for nm, error in zip(steps_nm, errors) if error >= NOTICED_DELTA_E), None),
    }


def white_spot(maps: Maps, panels: list[Panel]) -> dict:
    """Mean CIELAB chroma by FLSS and by NMM within a radius about the centre, where NMM has a white spot.

    The radius is that of order 1 of the tile at the shortest wavelength. NMM sums over the wavelengths that diffract
    into a direction; within the radius there are none, and NMM returns white. Each map is exposed so that its largest
    value is 1. The panels are recognised by their captions.
    """
    radius = VISIBLE_UM[0] / TILE_UM
    found = {"radius": radius}
    for panel in panels:
        name = {"(a) FLSS, centre": "flss", "(b) NMM, centre": "nmm"}.get(panel.caption)
        if name:
            exposure = maps.drawn(panel.arguments()).exposure
            # The default exposure clips the brightest 1 % of the pixels that are not black. A thousandth of it clips
            # none unless the peak is a thousand times as bright as the dimmest of these. The division by the largest
            # value brightens the map.
            linear = decoded(maps.drawn(panel.arguments(), exposure / 1000).png)
            linear /= linear.max()
            # A pixel's side is 2/size. The radius is reduced by half a side, so that pixels are inside as a whole.
            inside = distance(panel.size, 0.0) < radius - 1 / panel.size
            a, b = lab(linear[inside])[:, 1:].T
            found[name] = float(np.hypot(a, b).mean())
    return found


def distance(size: int, x: float) -> np.ndarray:
    """Distance of each pixel from the point (x, 0), in direction sines."""
    return np.hypot(sines(size)[None, :] - x, sines(size)[:, None])


def decoded(png: Path) -> np.ndarray:
    """The displayed picture `png` in linear sRGB, (rows, columns, 3), by the inverse of sRGB's gamma curve."""
    encoded = np.asarray(Image.open(png).convert("RGB")) / 255.0
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def spread(surface: Surface) -> dict:
    """Fractions of order −1's light at CHECKED_NM beyond 3 standard deviations of its lobe, by FLSS and PQ.

    The light is summed along x, from half the direction sine of order −1 to one and a half times it. `deviation` is the
    lobe's standard deviation in direction sines.
    """
    order = -CHECKED_NM / 1e3 / PERIOD_UM
    deviation = CHECKED_NM / 1e3 / lobe_length_um(surface)
    # Steps far below the lobe's standard deviation, so that sums over x are accurate.
    x = np.linspace(1.5 * order, 0.5 * order, 4001)
    beyond = abs(x - order) > 3 * deviation
    fractions = {}
    for method in ("flss", "pq"):
        response = along_x(surface, x, "--method", method)
        fractions[method] = float(response[beyond].sum() / response.sum())
    return {"deviation": deviation, **fractions}


def valleys(surface: Surface, sigmas_um: tuple) -> list[dict]:
    """Smallest response between orders −1 and −2 at CHECKED_NM, relative to the weaker order: a row for each σs.

    σs, one of `sigmas_um`, is the width of the coherence window in Single 2014. The thesis can be read in two ways: σs
    is the coherence length (`window`), or the window's standard deviation (`deviation`). `periods` is σs in periods.
    """
    order = -CHECKED_NM / 1e3 / PERIOD_UM
    # From order −2 to order −1, which are the ends of the responses.
    x = np.linspace(2 * order, order, 401)
    rows = []
    for sigma_um in sigmas_um:
        row = {"sigma_um": sigma_um, "periods": sigma_um / PERIOD_UM}
        for name, coherence_um in (("window", sigma_um), ("deviation", 4 * sigma_um)):
            response = along_x(surface.with_coherence(coherence_um), x, "--method", "flss")
            row[name] = float(response.min() / min(response[0], response[-1]))
        rows.append(row)
    return rows


def terms_seen(rows: list[dict]) -> dict:
    """For each series of terms the least N such that no map with N or more terms has a visible error where it is lit.

    It is `None` if there is none. `rows` has the errors of panels, one for each series and N, in ascending N. A
    caption is, for example, "N = 24, about the base". Keys of the result are `base`, `middle` and `chebyshev`, the
    last words of the captions.
    """
    found = {}
    for series in ("about the base", "about the middle", "Chebyshev"):
        least = None
        for row in reversed([row for row in rows if row["caption"].endswith(series)]):
            if row["delta_e_lit"] >= NOTICED_DELTA_E:
                break
            least = int(row["caption"].removeprefix("N = ").split(",")[0])
        found[series.split()[-1].lower()] = least
    return found


def right_side(maps: Maps, panels: list[Panel]) -> dict:
    """CIELAB chroma in the right half of maps, x > 0, without the mirror direction, by angle of incidence.

    Light comes from the side of +x. `share` is the fraction of the disc's chroma that is in the right half, and `mean`
    the mean chroma of the right half. The chroma near the mirror direction counts as 0. `grows` tells whether `share`
    and `mean` increase with the angle.
    """
    rows = []
    for panel in panels:
        a, b = np.moveaxis(lab(decoded(maps.map_of(panel).png))[..., 1:], -1, 0)
        mirror = -math.sin(math.radians(panel.theta_i_deg))
        chroma = np.where(disc(panel.size) & (distance(panel.size, mirror) > MIRROR_RADIUS), np.hypot(a, b), 0)
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


def check(made: dict) -> None:
    """Raises SetupError if the measured numbers contradict the text of the page into which they are inserted.

    `made` has the results of the functions above by name. Under `sheets` it has, for each sheet of panels, the caption
    and the errors of each panel.
    """
    errors = {
        surface: {row["caption"]: row["delta_e_lit"] for row in made["sheets"][f"taylor-{surface}"]["panels"]}
        for surface in ("blazed", "xenopeltis-procedural")
    }
    about_the_base = [f"N = {n}, about the base" for n in (24, 26)]
    line_nm = {name: found["line_nm"] for name, found in made["steps"].items()}
    sentences = {
        "the blazed grating has converged with 24 and 26 terms": all(
            errors["blazed"][caption] < NOTICED_DELTA_E for caption in about_the_base
        ),
        "Xenopeltis has not converged with 24 and 26 terms": all(
            errors["xenopeltis-procedural"][caption] >= NOTICED_DELTA_E for caption in about_the_base
        ),
        # `parts` has the numbers of terms at which four partial sums of Taylor's series (taylor_sums.py) converge.
        "the four partial sums converge within 3 terms of each other": all(
            max(found["parts"]) - min(found["parts"]) <= 3 for found in made["sums"]
        ),
        "lines of the blazed grating are wider than those of Elaphe": line_nm["blazed"] > line_nm["elaphe-procedural"],
        # Orders are apart if the response between them falls below 1 % of the weaker one.
        "σs as the standard deviation keeps orders apart": all(row["deviation"] < 0.01 for row in made["valleys"]),
        "NMM is whiter than FLSS at the centre": made["white_spot"]["nmm"] < made["white_spot"]["flss"],
        "PQ spreads the first order": made["spread"]["pq"] > made["spread"]["flss"],
    }
    for sentence, holds in sentences.items():
        insist("brdf-maps", holds, sentence)


def check_against_direct_sum(found: Sums, surface: Surface) -> None:
    """Raises SetupError unless the amplitudes of Taylor's series agree with the direct sum in the brightest directions.

    An amplitude P (taylor_sums.py) gives f_r = O·4πs²|P|²/λ² (docs/model.md). At normal incidence the obliquity factor
    O is 1/cos θo. The tolerance is 1e-6 of the largest value, about as large as the window's tails beyond the summed
    orders.
    """
    # The last of `limits` is the converged sum of the whole series.
    power = abs(found.limits[-1]) ** 2
    brightest = np.argsort(np.nan_to_num(power))[-COMPARED_DIRECTIONS:]
    queries, expected = [], []
    for pixel in brightest:
        # Pixels are numbered row by row from the top, where y is largest.
        x, y = float(sines(SIZE)[pixel % SIZE]), float(-sines(SIZE)[pixel // SIZE])
        cos_o = math.sqrt(1 - x * x - y * y)
        queries.append({"wi": [0, 0, 1], "wo": [x, y, cos_o], "wavelength": 1e3 * WAVELENGTH_UM})
        expected.append(4 * math.pi * (surface.coherence_um / 4) ** 2 * power[pixel] / WAVELENGTH_UM**2 / cos_o)
    exact = responses(surface, queries, "--method", "exact", "--model", "patch")
    off = float(abs(exact - expected).max() / exact.max())
    if off > 1e-6:
        raise SetupError(f"Taylor's series is off from the direct sum by {off:.1e}")
