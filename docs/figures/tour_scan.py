"""The part `tour-scan`: effect of an atomic-force microscope's tip on gratings and skins, and on their colours."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from mitsuba_scenes.tool import sunbeam

from .appearance import read_exr
from .page import insist
from .rgb_against_spectral import XYZ_OF_SRGB
from .tip import seen_profile, seen_tile

PART = "tour-scan"
# Radii of the tips.
RADII_NM = (5, 10, 30)
# Presets that are gratings.
GRATINGS = ("blazed", "lamellar")
# Presets that are skins.
SKINS = ("elaphe", "xenopeltis")
# Period of the gratings.
PERIOD_UM = 2.5
# Heights of the gratings.
HEIGHT_UM = {"blazed": 0.25, "lamellar": 0.125}
# Distance of a grating's samples, a tenth of the smallest tip; 5000 make a period.
STEP_UM = 0.0005
# Wavelength of the efficiencies.
WAVELENGTH_NM = 550
# Angle of incidence.
THETA_I_DEG = 30
# Side of a map in pixels.
SIZE = 128
# Fraction of white above which a pixel counts as lit. Chosen.
LIT = 0.01
# Relative half width of the window of spatial frequencies that counts as a skin's first order.
WINDOW = 0.25


@dataclass(frozen=True)
class Tile:
    """A relief that repeats: heights `[iy, ix]` in µm, and the edges of its pixels."""

    name: str
    heights_um: np.ndarray
    pixel_um: float

    def seen(self, radius_um: float) -> Tile:
        """The relief imaged by a tip."""
        if self.name in GRATINGS:
            profile = seen_profile(self.heights_um[0], self.pixel_um, radius_um)
            return Tile(self.name, np.tile(profile, (len(self.heights_um), 1)), self.pixel_um)
        return Tile(self.name, seen_tile(self.heights_um, self.pixel_um, radius_um), self.pixel_um)

    def write(self, folder: Path) -> tuple:
        """Writes the relief; returns the command's arguments for it."""
        file = folder / f"{self.name}.npy"
        np.save(file, self.heights_um)
        return ("--height-field", file, "--pixel-size", self.pixel_um, "--level", "none", "--tiling", "periodic")


def figures() -> dict:
    """The numbers of all surfaces under all tips."""
    with TemporaryDirectory() as folder:
        surfaces = {name: surface_figures(tile, Path(folder)) for name, tile in tiles(Path(folder))}
    for name, surface in surfaces.items():
        for tip in surface["tips"]:
            insist(PART, abs(tip["period_um"] / surface["period_um"] - 1) < 0.01, f"tips leave the period of {name}")
        changes = [tip["delta_e"] for tip in surface["tips"]]
        insist(PART, changes == sorted(changes), f"a blunter tip changes the colours of {name} more")
    return {
        "radii_nm": list(RADII_NM),
        "wavelength_nm": WAVELENGTH_NM,
        "theta_i_deg": THETA_I_DEG,
        "pixel_nm": surfaces["elaphe"]["pixel_nm"],
        **worst(surfaces),
        "surfaces": surfaces,
    }


def worst(surfaces: dict) -> dict:
    """The largest changes of colour on any surface, by the bluntest tip and by the finer ones."""
    finer = [tip for surface in surfaces.values() for tip in surface["tips"][:-1]]
    bluntest = [surface["tips"][-1] for surface in surfaces.values()]
    keys = {"mean": "delta_e", "p99": "delta_e_p99"}
    kinds = {"fine": finer, "blunt": bluntest}
    found = {
        f"{name}_{kind}": max(tip[key] for tip in tips) for name, key in keys.items() for kind, tips in kinds.items()
    }
    # An eye just notices a ΔE of 1.
    insist(PART, found["mean_fine"] < 1, "what the finer tips change is not noticeable in the mean")
    return found


def tiles(folder: Path):
    """Names and reliefs."""
    for name in GRATINGS:
        at = (np.arange(round(PERIOD_UM / STEP_UM)) + 0.5) * STEP_UM / PERIOD_UM
        profile = HEIGHT_UM[name] * (at if name == "blazed" else at < 0.5)
        # Four rows, since a single row is refused.
        yield name, Tile(name, np.tile(profile, (4, 1)), STEP_UM)
    for name in SKINS:
        file = folder / "preset.npy"
        report = json.loads(sunbeam("height-field", "--preset", name, "-o", file))
        yield name, Tile(name, np.load(file), report["pixel_um"][0])


def surface_figures(tile: Tile, folder: Path) -> dict:
    """Orders, period and colours of the relief itself, and imaged by each tip."""
    words = tile.write(folder)
    period_um = period_of(words)
    reference = folder / "reference.exr"
    draw(words, reference)
    mask = lit(reference, folder / "lit.png")
    orders = orders_of(tile, words, period_um)
    strongest = two_strongest(orders)
    tips = []
    for radius_nm in RADII_NM:
        seen = tile.seen(radius_nm * 1e-3)
        words = seen.write(folder)
        draw(words, folder / "seen.exr")
        compared = json.loads(sunbeam("compare", reference, folder / "seen.exr", "--mask", mask))
        here = orders_of(seen, words, period_um)
        tips.append(
            {
                "radius_nm": radius_nm,
                "rise_nm": float((seen.heights_um - tile.heights_um).mean() * 1e3),
                "rms_um": float(seen.heights_um.std()),
                "orders": [{"order": order, "share": here[order]} for order in strongest],
                "period_um": period_of(words),
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
    """The two strongest orders; of two mirrored orders with equal power, one."""
    found: list[int] = []
    for order in sorted(orders, key=orders.get, reverse=True):
        if not any(np.isclose(orders[order], orders[other], rtol=1e-6) for other in found):
            found.append(order)
    return found[:2]


def period_of(words: tuple) -> float:
    """The strongest period along x in µm."""
    return json.loads(sunbeam("height-field", *words))["periods"]["x"]["period_um"]


def orders_of(tile: Tile, words: tuple, period_um: float) -> dict[int, float]:
    """Fractions of the light at normal incidence in each order along x.

    Those of a grating are by `sunbeam orders`; an order of a skin is a window about its spatial frequency.
    """
    if tile.name in GRATINGS:
        told = json.loads(sunbeam("orders", *words, "--wavelength", WAVELENGTH_NM, "--json"))
        return {order["order"]: order["mean"] for order in told["orders"]}
    screen = np.exp(4j * np.pi / (WAVELENGTH_NM * 1e-3) * tile.heights_um)
    power = np.abs(np.fft.fft2(screen) / screen.size) ** 2
    fx, fy = (np.fft.fftfreq(count, tile.pixel_um) * period_um for count in power.shape[::-1])
    within = {order: np.abs(fx - order) < WINDOW for order in (-1, 1)}
    return {order: float(power[np.abs(fy) < WINDOW][:, at].sum()) for order, at in within.items()}


def draw(words: tuple, file: Path) -> None:
    """Draws a map lit from `THETA_I_DEG`, with a coherence length of 10 µm, so that orders are pixels wide."""
    light = ("--theta-i", THETA_I_DEG, "--size", SIZE, "--coherence-length", 10)
    sunbeam("brdf-map", "-o", file, *words, *light)


def lit(reference: Path, file: Path) -> Path:
    """A mask of the pixels that are lit, where 1 % of the map is white."""
    luminance = read_exr(reference) @ XYZ_OF_SRGB[1]
    white = np.quantile(luminance[luminance > 0], 0.99)
    Image.fromarray(((luminance > LIT * white) * 255).astype(np.uint8)).save(file)
    return file
