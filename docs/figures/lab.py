"""Part `lab` of the documentation (page.py): the laboratory set-up in figure 2.19 of M. Single's thesis, Single 2014.

On a *bench* a beam lights a *sample*, a skin or a grating, and a screen catches the diffracted light. Each sample is
rendered in white light for the page, and at three wavelengths for measurements. A *spot* is an order's light on the
screen; its position is compared with the grating equation.

Symbols as in mitsuba_scenes/laboratory.py: x is the horizontal position on the screen in mm, λ the wavelength, and d
the sample's period. θi and θo are the angles of the beam and of the diffracted light with the sample's normal, positive
towards +x. Order j leaves at sin θo = jλ/d − sin θi.

The plugin's default model, `ensemble` (docs/model.md#coherence), gives orders Gaussian lobes. Their standard deviation
in spatial frequency is 1/(2√2·π·s), where s is a quarter of the coherence length.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path

import mitsuba as mi
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from mitsuba_scenes.crosscheck.cases import SCANS
from mitsuba_scenes.crosscheck.realtime import surface_words
from mitsuba_scenes.environment import use_variant
from mitsuba_scenes.laboratory import Bench, line, photograph, spot_mm
from mitsuba_scenes.picture import check, tone_mapped
from mitsuba_scenes.skin import scanned_skin
from mitsuba_scenes.tool import sunbeam

from .page import images

# Resolution of a measured picture: number of pixels along a length equal to the screen's distance. More pixels resolve
# spots better and get fewer paths each.
MEASURED_PIXELS = 400.0
# Height of a measured picture, as a fraction of the screen's distance. Spots lie in its middle row, so a low picture
# suffices.
MEASURED_HEIGHT = 0.1
# Numbers of paths of a measured picture and of a picture for the page. More paths lower the noise and take longer.
MEASURED_PATHS = 500_000
PICTURE_PATHS = 3_000_000
# Wavelengths of the measured spots.
WAVELENGTHS_NM = (450.0, 550.0, 650.0)
# Colours of the marks in sRGB bytes, by wavelength in nm.
MARK_COLOURS = {450.0: (90, 120, 255), 550.0: (80, 230, 80), 650.0: (255, 80, 70)}
# Standard deviation of a lobe in cycles per µm at the plugin's default coherence length of 65 µm.
LOBE_PER_UM = 1 / (2 * math.sqrt(2) * math.pi * 65 / 4)
# Edge of a scan, which the page states. Its finite size widens the orders further.
SCAN_UM = 6.5
# Standard deviation in cycles per µm of the Gaussian weight about a scan's spot. A narrower one would weight only part
# of the blurred order; a wider one would include neighbouring orders.
SCAN_LOBE_PER_UM = 0.05
# Fraction of the lit pixels that the exposure clips in pictures of skins. A larger one shows weaker light.
CLIPPED = 0.01
# Fraction of the lit pixels that the exposure clips in pictures of sharp spots. With a smaller one the spots, which are
# few pixels wide, would be hard to see.
CLIPPED_SPOTS = 0.2
# Start and end of the marks above and below the spots, in pixels from the picture's middle row.
MARKS_PIXELS = (14, 22)
# Factor on the period in a negative control: the page lists the shifts of spots by a wrong period beside their errors.
WRONG_PERIOD = 1.02
# The set-up of figure 2.19, where the mirror-reflected beam meets the screen at a right angle.
DRAWN = Bench(theta_i_deg=45.0, tilt_deg=45.0, distance_mm=60.0, width_mm=130.0, height_mm=62.5, pixels_per_mm=6.0)
# The mirror image of the set-up DRAWN, for Xenopeltis, which sends most light to negative orders. These meet the screen
# if the beam comes from the left, −x.
DRAWN_FROM_LEFT = replace(DRAWN, theta_i_deg=-45.0, tilt_deg=-45.0)
# The set-up with a screen wider than that of DRAWN, for skins.
SKIN_BENCH = Bench()
# The set-up with a wider screen for the blazed grating. A low screen suffices, since the grating's orders lie in one
# row.
BLAZED_BENCH = Bench(height_mm=120.0)


@dataclass(frozen=True)
class Sample:
    """A surface on the bench.

    - `name`, `title`: the name in file names, and that on the page.
    - `parameters`: those of the plugin.
    - `orders`, `marked`: the measured orders, without order 0, and those marked on the picture.
    - `window_per_um`: the standard deviation in cycles per µm of the Gaussian weight of a spot's centroid.
    - `clipped`: the fraction of lit pixels that the picture's exposure clips.
    - `axis`: the axis of the heights, "x" or "y", whose period lies in the plane of incidence after the rotation by
      `parameters`.
    """

    name: str
    title: str
    parameters: dict
    bench: Bench
    orders: tuple[int, ...]
    window_per_um: float = LOBE_PER_UM
    marked: tuple[int, ...] = (-2, -1, 1, 2)
    clipped: float = CLIPPED
    axis: str = "x"

    @property
    def is_scan(self) -> bool:
        """Whether the surface is a measured height field."""
        return "filename" in self.parameters


def samples() -> list[Sample]:
    """All samples: skins in the set-up of figure 2.19, then skins and the blazed grating before a wider screen.

    Skins are the scans, if present, and the presets that imitate them.
    """
    skins = scans()
    for name in ("Elaphe", "Xenopeltis"):
        preset = {"preset": name.lower()}
        skins.append(Sample(name.lower(), f"{name}, procedural", preset, SKIN_BENCH, orders=(-1, 1)))
    blazed = Sample(
        "blazed", "Blazed", {"preset": "blazed"}, BLAZED_BENCH, orders=(-2, -1, 1, 2), clipped=CLIPPED_SPOTS
    )
    return [
        *map(as_drawn, skins),
        *skins,
        replace(blazed, marked=(-3, -2, -1, 1, 2, 3)),
        replace(
            blazed,
            name="blazed-30",
            title="Blazed, beam at 30°",
            bench=replace(BLAZED_BENCH, theta_i_deg=30.0),
            orders=(-1, 1, 2),
            marked=(-1, 0, 1, 2, 3),
        ),
    ]


def as_drawn(sample: Sample) -> Sample:
    """The skin in the set-up of figure 2.19, with the brighter of its first orders on the screen."""
    from_left = "Xenopeltis" in sample.title
    bench, order = (DRAWN_FROM_LEFT, -1) if from_left else (DRAWN, 1)
    return replace(sample, name=f"{sample.name}-drawn", bench=bench, orders=(order,), marked=(order, 2 * order))


def scans() -> list[Sample]:
    """The scans, if present, turned so that the wave vector of one period lies in the plane of incidence.

    Both skins have rows of fingers, long parallel ridges. The period of Elaphe is that across the fingers, that of
    Xenopeltis the distance between rows.
    """
    found = []
    for name, path, axis in (("Elaphe", SCANS["elaphe"], "y"), ("Xenopeltis", SCANS["xenopeltis"], "x")):
        if not path.exists():
            print(f"NOT MEASURED: no scan at {path}, so there is no measured {name} on the bench", flush=True)
            continue
        parameters = scanned_skin(path)
        parameters["rotation"] = -period(parameters, axis)["direction_deg"]
        found.append(
            Sample(
                f"{path.stem}-scan",
                f"{name}, scan",
                parameters,
                SKIN_BENCH,
                orders=(-1, 1),
                window_per_um=SCAN_LOBE_PER_UM,
                axis=axis,
            )
        )
    return found


def period(parameters: dict, axis: str) -> dict:
    """The dominant period along `axis` of the heights: `period_um`, and `direction_deg` of its wave vector from +x.

    `parameters` are the plugin's; their rotation is ignored.
    """
    relief = {name: value for name, value in parameters.items() if name != "rotation"}
    return json.loads(sunbeam("height-field", *surface_words(relief)))["periods"][axis]


def measured(sample: Sample, bsdf: mi.BSDF, period_um: float) -> list[dict]:
    """A row for each order and wavelength whose spot is on the screen.

    `period_um` is the period of the heights. In a row `expected_mm` and `expected_deg` are the spot's x and θo by the
    grating equation for this period. `measured_mm` and `measured_deg` are those of the picture, and `spacing_um` is the
    period that the grating equation gives for the measured θo.
    """
    distance_mm = sample.bench.distance_mm
    bench = replace(sample.bench, pixels_per_mm=MEASURED_PIXELS / distance_mm, height_mm=MEASURED_HEIGHT * distance_mm)
    rows = []
    # Different seeds make the noise of the wavelengths independent.
    for seed, wavelength_nm in enumerate(WAVELENGTHS_NM):
        picture = photograph(bsdf, bench, line(wavelength_nm), MEASURED_PATHS, seed=seed)
        for order in sample.orders:
            found_mm = spot_mm(bench, picture, period_um, order, wavelength_nm, sample.window_per_um)
            if found_mm is None:
                continue
            expected_mm = bench.position_mm(period_um, order, wavelength_nm)
            theta_o_deg = float(bench.angle_deg(found_mm))
            # sin θo + sin θi = jλ/d.
            sines = math.sin(math.radians(theta_o_deg)) + math.sin(math.radians(bench.theta_i_deg))
            rows.append(
                {
                    "order": order,
                    "wavelength_nm": wavelength_nm,
                    "expected_mm": expected_mm,
                    "expected_deg": float(bench.angle_deg(expected_mm)),
                    "measured_mm": found_mm,
                    "measured_deg": theta_o_deg,
                    "spacing_um": order * wavelength_nm / 1e3 / sines,
                }
            )
    return rows


def write_photograph(sample: Sample, bsdf: mi.BSDF, period_um: float, path: Path) -> None:
    """Writes a picture of the screen in white light to `path`, with marks of three wavelengths at each marked order.

    The marks are at the positions by the grating equation for the period `period_um` of the heights.
    """
    bench = sample.bench
    pixels = photograph(bsdf, bench, {"type": "d65"}, PICTURE_PATHS).astype(np.float32)
    # `check` takes a picture of small values for black, so the mean is scaled to 1.
    check(pixels / pixels.mean(), sample.name)
    brightest = pixels.max(axis=-1)
    # Exposure that brings the fraction `clipped` of the lit pixels to 1 or above.
    stops = -np.log2(np.quantile(brightest[brightest > 0], 1 - sample.clipped))
    image = Image.fromarray(tone_mapped(pixels, float(stops)))
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(size=13)

    def place(x_mm: float, up_pixels: float) -> tuple[float, float]:
        """Pixel at the position x of the screen, `up_pixels` above its middle row."""
        return (x_mm / bench.width_mm + 0.5) * bench.size[0], 0.5 * bench.size[1] - up_pixels

    start, end = MARKS_PIXELS
    for order in sample.marked:
        marked_mm = []
        for wavelength_nm, colour in MARK_COLOURS.items():
            x_mm = bench.position_mm(period_um, order, wavelength_nm)
            if x_mm is None or abs(x_mm) > 0.5 * bench.width_mm:
                continue
            marked_mm.append(x_mm)
            for side in (1, -1):
                draw.line([place(x_mm, side * start), place(x_mm, side * end)], fill=colour, width=2)
        if marked_mm:
            label = f"{order:+d}" if order else "0"
            draw.text(place(np.mean(marked_mm), end + 4), label, fill=(230, 230, 230), font=font, anchor="ms")
    image.save(path, quality=88)


def figures() -> dict:
    """Dimensions of the set-ups, and a `summary` of each sample; writes the pictures of the screens.

    `drawn` has dimensions of figure 2.19's set-up; the others are those of the wider screen.
    """
    folder, summaries = images("lab"), []
    use_variant()
    # BSDFs by parameters. Samples with equal parameters share one, so that its tables are built once.
    bsdfs: dict[str, mi.BSDF] = {}
    for sample in samples():
        key = json.dumps(sample.parameters)
        if key not in bsdfs:
            bsdfs[key] = mi.load_dict({"type": "diffraction", **sample.parameters})
        period_um = period(sample.parameters, sample.axis)["period_um"]
        write_photograph(sample, bsdfs[key], period_um, folder / f"{sample.name}.jpg")
        summaries.append(summary(sample, period_um, measured(sample, bsdfs[key], period_um)))
        print(f"{sample.name}: within {summaries[-1]['worst_mm']:.2f} mm", flush=True)
    return {
        "distance_mm": SKIN_BENCH.distance_mm,
        "width_mm": SKIN_BENCH.width_mm,
        "drawn": {name: getattr(DRAWN, name) for name in ("theta_i_deg", "tilt_deg", "distance_mm", "width_mm")},
        "beam_mm": 2 * SKIN_BENCH.beam_radius_mm,
        "paths": MEASURED_PATHS,
        "wavelengths_nm": list(WAVELENGTHS_NM),
        "wrong_period_percent": 100 * (WRONG_PERIOD - 1),
        # Standard deviation of the lobe on the wider screen near its middle, at λ = 0.55 µm. That of sin θo is λ times
        # that of the spatial frequency, and x is about the distance times sin θo.
        "lobe_mm": 0.55 * LOBE_PER_UM * SKIN_BENCH.distance_mm,
        "scan_um": SCAN_UM,
        "scan_window": SCAN_LOBE_PER_UM,
        "samples": summaries,
    }


def summary(sample: Sample, period_um: float, spots: list[dict]) -> dict:
    """The sample's `spots`, which are rows of `measured`, and their distances from the grating equation.

    There must be at least one spot. With the wrong period, too, each spot must reach the screen's plane.

    - `worst_mm`, `rms_mm`: the largest and the rms distance on the screen. `worst_deg` is the largest difference of
      angles.
    - `wrong_period_mm`: the smallest shift of a spot if the period is WRONG_PERIOD times as large, a negative control.
    - `spacing_um`: the period of the heights. `measured_spacing_um` is the mean of the periods from all spots, and
      `by_order` has their means by order.
    - `is_drawn`: whether the set-up is that of figure 2.19.
    """
    off_mm = [abs(spot["measured_mm"] - spot["expected_mm"]) for spot in spots]
    wrong_mm = []
    for spot in spots:
        moved_mm = sample.bench.position_mm(WRONG_PERIOD * period_um, spot["order"], spot["wavelength_nm"])
        wrong_mm.append(abs(moved_mm - spot["expected_mm"]))
    by_order = []
    for order in sorted({spot["order"] for spot in spots}):
        found_um = [spot["spacing_um"] for spot in spots if spot["order"] == order]
        by_order.append({"order": order, "spacing_um": float(np.mean(found_um))})
    return {
        "name": sample.name,
        "title": sample.title,
        "is_scan": sample.is_scan,
        "is_drawn": sample.bench in (DRAWN, DRAWN_FROM_LEFT),
        "theta_i_deg": sample.bench.theta_i_deg,
        "spacing_um": period_um,
        # Longest wavelength whose first order lies between the mirror-reflected beam and the horizon on its far side.
        "horizon_nm": 1e3 * period_um * (1 - math.sin(math.radians(abs(sample.bench.theta_i_deg)))),
        "measured_spacing_um": float(np.mean([spot["spacing_um"] for spot in spots])),
        "by_order": by_order,
        "spots": spots,
        "worst_mm": max(off_mm),
        "worst_deg": max(abs(spot["measured_deg"] - spot["expected_deg"]) for spot in spots),
        "rms_mm": float(np.sqrt(np.mean(np.square(off_mm)))),
        "wrong_period_mm": min(wrong_mm),
    }
