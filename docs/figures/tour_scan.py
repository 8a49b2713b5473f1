"""Part `tour-scan` of the documentation (page.py): effect of the tip of an atomic-force microscope.

Reliefs of gratings and skins are imaged by tips of several radii (tip.py). The image is compared with the relief
itself: the orders, the period, and the colours of the BRDF map, a picture of the BRDF over outgoing directions. Reliefs
repeat, and heights are indexed [iy, ix] with y = 0 first.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from mitsuba_scenes.tool import sunbeam

from .appearance import read_exr
from .heights import height_field
from .page import insist
from .rgb_against_spectral import LUMINANCE
from .tip import seen_profile, seen_tile

PART = "tour-scan"
# Radii of the tips in ascending order. Blunter tips than the last fill more of the relief's valleys.
RADII_NM = (5, 10, 30)
# Presets that are gratings.
GRATINGS = ("blazed", "lamellar")
# Presets that are skins.
SKINS = ("elaphe", "xenopeltis")
# Period of the gratings.
PERIOD_UM = 2.5
# Heights of the gratings from groove to ridge.
HEIGHT_UM = {"blazed": 0.25, "lamellar": 0.125}
# Distance between a grating's samples, a tenth of the smallest tip's radius; 5000 samples make a period.
STEP_UM = 0.0005
# Number of equal rows of a grating's height field, which is constant along y; one row would do as well.
ROWS = 4
# Wavelength of the efficiencies.
WAVELENGTH_NM = 550
# Angle of incidence of the maps.
THETA_I_DEG = 30
# Side of a map in pixels.
SIZE = 128
# Coherence length of the maps. With a larger one orders would be narrower than a pixel.
COHERENCE_UM = 10
# Quantile of the luminance of a map's non-black pixels that counts as white.
WHITE = 0.99
# Fraction of white above which a pixel of a map counts as lit. A smaller one counts colours too dark to be noticed.
LIT = 0.01
# Half width of the window of spatial frequencies that counts as an order of a skin, relative to the first order's. The
# period of a skin varies, so its orders are wide; a larger window would include other light.
WINDOW = 0.25


@dataclass(frozen=True)
class Tile:
    """A relief: the name of its preset, heights, and the side of a square pixel."""

    name: str
    heights_um: np.ndarray
    pixel_um: float

    def imaged(self, radius_um: float) -> Tile:
        """The relief as imaged by a tip of this radius."""
        if self.name in GRATINGS:
            profile = seen_profile(self.heights_um[0], self.pixel_um, radius_um)
            return Tile(self.name, np.tile(profile, (len(self.heights_um), 1)), self.pixel_um)
        return Tile(self.name, seen_tile(self.heights_um, self.pixel_um, radius_um), self.pixel_um)

    def write(self, folder: Path) -> tuple:
        """Writes the relief; returns the arguments of `sunbeam` that read it."""
        file = folder / f"{self.name}.npy"
        np.save(file, self.heights_um)
        return ("--height-field", file, "--pixel-size", self.pixel_um, "--level", "none", "--tiling", "periodic")


def figures() -> dict:
    """All numbers of the part. Raises SetupError if they contradict the page."""
    with TemporaryDirectory() as folder:
        surfaces = {tile.name: surface_figures(tile, Path(folder)) for tile in tiles()}
    for name, surface in surfaces.items():
        for tip in surface["tips"]:
            insist(PART, abs(tip["period_um"] / surface["period_um"] - 1) < 0.01, f"tips leave the period of {name}")
        changes = [tip["delta_e"] for tip in surface["tips"]]
        insist(PART, changes == sorted(changes), f"a blunter tip changes the colours of {name} more")
    return {
        "radii_nm": list(RADII_NM),
        "wavelength_nm": WAVELENGTH_NM,
        "theta_i_deg": THETA_I_DEG,
        # Pixels of both skins, whose sizes differ by less than 0.1 nm.
        "pixel_nm": surfaces["elaphe"]["pixel_nm"],
        **worst(surfaces),
        "surfaces": surfaces,
    }


def worst(surfaces: dict) -> dict:
    """The largest changes of colour on any surface, ΔE₂₀₀₀.

    `mean_…` and `p99_…` are the largest mean and 99th percentile over a map. Those with `…_blunt` are of the tip with
    the largest radius, those with `…_fine` of all other tips. Raises SetupError if the finer tips change colours
    noticeably.
    """
    # Tips are in ascending order of their radii.
    finer = [tip for surface in surfaces.values() for tip in surface["tips"][:-1]]
    bluntest = [surface["tips"][-1] for surface in surfaces.values()]
    found = {}
    for kind, tips in (("fine", finer), ("blunt", bluntest)):
        found[f"mean_{kind}"] = max(tip["delta_e"] for tip in tips)
        found[f"p99_{kind}"] = max(tip["delta_e_p99"] for tip in tips)
    # An eye just notices a ΔE of 1.
    insist(PART, found["mean_fine"] < 1, "the change by the finer tips is not noticeable in the mean")
    return found


def tiles() -> Iterator[Tile]:
    """The reliefs of all surfaces."""
    for name in GRATINGS:
        # Position in the period, in [0, 1).
        position = (np.arange(round(PERIOD_UM / STEP_UM)) + 0.5) * STEP_UM / PERIOD_UM
        profile = HEIGHT_UM[name] * (position if name == "blazed" else position < 0.5)
        yield Tile(name, np.tile(profile, (ROWS, 1)), STEP_UM)
    for name in SKINS:
        heights_um, report = height_field("--preset", name)
        yield Tile(name, heights_um, report["pixel_um"][0])


def surface_figures(tile: Tile, folder: Path) -> dict:
    """Orders, period and rms height of a relief itself, and under `tips` as imaged by each tip.

    - `orders`: the two strongest orders of the relief itself. `share` is an order's fraction of the light.
    - `rise_nm`: the mean height of the image above the relief.
    - `delta_e`, `delta_e_p99`: mean and 99th percentile of the change of colour, ΔE₂₀₀₀.
    """
    arguments = tile.write(folder)
    period_um = period_of(arguments)
    # Maps of the relief itself and of an image, which `sunbeam compare` compares.
    reference, imaged = folder / "reference.exr", folder / "imaged.exr"
    draw(arguments, reference)
    mask = write_lit_mask(reference, folder / "lit.png")
    orders = orders_of(tile, arguments, period_um)
    strongest = two_strongest(orders)
    tips = []
    for radius_nm in RADII_NM:
        image = tile.imaged(radius_nm * 1e-3)
        # The image replaces the relief's file, which is not read again.
        arguments = image.write(folder)
        draw(arguments, imaged)
        compared = json.loads(sunbeam("compare", reference, imaged, "--mask", mask))
        imaged_orders = orders_of(image, arguments, period_um)
        tips.append(
            {
                "radius_nm": radius_nm,
                "rise_nm": float((image.heights_um - tile.heights_um).mean() * 1e3),
                "rms_um": float(image.heights_um.std()),
                "orders": [{"order": order, "share": imaged_orders[order]} for order in strongest],
                "period_um": period_of(arguments),
                "delta_e": compared["delta_e_2000"]["mean"],
                "delta_e_p99": compared["delta_e_2000"]["p99"],
            }
        )
    return {
        "pixel_nm": tile.pixel_um * 1e3,
        "period_um": period_um,
        "rms_um": float(tile.heights_um.std()),
        "orders": [{"order": order, "share": orders[order]} for order in strongest],
        "tips": tips,
    }


def two_strongest(orders: dict[int, float]) -> list[int]:
    """The two strongest of `orders`, which has powers by order.

    Of orders with equal power, such as ±1 of a symmetric grating, only one is taken.
    """
    found: list[int] = []
    for order in sorted(orders, key=orders.get, reverse=True):
        if not any(np.isclose(orders[order], orders[other], rtol=1e-6) for other in found):
            found.append(order)
    return found[:2]


def period_of(arguments: tuple) -> float:
    """The strongest period along x in µm."""
    return json.loads(sunbeam("height-field", *arguments))["periods"]["x"]["period_um"]


def orders_of(tile: Tile, arguments: tuple, period_um: float) -> dict[int, float]:
    """Fractions of the light at normal incidence and WAVELENGTH_NM in orders along x, by scalar diffraction.

    For a grating `sunbeam orders` computes them. Of a skin only orders ±1 are computed: the power of its phase screen
    in a square window about the spatial frequency (±1/`period_um`, 0). WINDOW is the window's half width relative to
    1/`period_um`.
    """
    if tile.name in GRATINGS:
        report = json.loads(sunbeam("orders", *arguments, "--wavelength", WAVELENGTH_NM, "--json"))
        # The mean of both polarisations.
        return {order["order"]: order["mean"] for order in report["orders"]}
    # The phase screen: light travels each height twice, so the phase is 4πh/λ.
    screen = np.exp(4j * np.pi / (WAVELENGTH_NM * 1e-3) * tile.heights_um)
    # The powers of all orders sum to 1, since |screen| = 1.
    power = np.abs(np.fft.fft2(screen) / screen.size) ** 2
    # Spatial frequencies in units of the first order's.
    fx, fy = (np.fft.fftfreq(count, tile.pixel_um) * period_um for count in power.shape[::-1])
    rows = power[np.abs(fy) < WINDOW]
    return {order: float(rows[:, np.abs(fx - order) < WINDOW].sum()) for order in (-1, 1)}


def draw(arguments: tuple, file: Path) -> None:
    """Writes a map of the surface with these arguments of `sunbeam`, lit from THETA_I_DEG."""
    light = ("--theta-i", THETA_I_DEG, "--size", SIZE, "--coherence-length", COHERENCE_UM)
    sunbeam("brdf-map", "-o", file, *arguments, *light)


def write_lit_mask(reference: Path, file: Path) -> Path:
    """Writes a mask of the lit pixels of a map to the PNG `file`, white where its luminance is above LIT of white.

    `reference` is the EXR of the map. Returns `file`.
    """
    luminance = read_exr(reference) @ LUMINANCE
    white = np.quantile(luminance[luminance > 0], WHITE)
    Image.fromarray(((luminance > LIT * white) * 255).astype(np.uint8)).save(file)
    return file
