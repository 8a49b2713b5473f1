"""The part `lab`: the laboratory set-up, figure 2.19 of Single 2014, and its spots against the grating equation."""

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

# Pixels per mm of pictures for measurement, for a screen 1 mm away.
FINE_PIXELS = 400.0
# Height in mm of pictures for measurement, for a screen 1 mm away.
MEASURED_HEIGHT = 0.1
# Number of paths of a picture for measurement.
MEASURED_PATHS = 500_000
# Number of paths of a picture for the page.
PICTURE_PATHS = 3_000_000
# Wavelengths of the measured spots.
WAVELENGTHS_NM = (450.0, 550.0, 650.0)
# Colours of the marks by wavelength, sRGB bytes.
MARKED_NM = {450.0: (90, 120, 255), 550.0: (80, 230, 80), 650.0: (255, 80, 70)}
# Standard deviation of an ensemble's lobe in cycles per µm, 1/(2√2 π s), at the coherence length of 65 µm.
LOBE_PER_UM = 1 / (2 * math.sqrt(2) * math.pi * 65 / 4)
# Width of a scan, whose finite size widens the orders, too.
SCAN_UM = 6.5
# Standard deviation of a scan's lobe in cycles per µm. Chosen.
SCAN_LOBE_PER_UM = 0.05
# Fraction of the lit pixels that the exposure clips in pictures of scans. Chosen.
CLIPPED = 0.01
# Fraction of the lit pixels that the exposure clips in pictures of sharp spots. Chosen.
CLIPPED_SPOTS = 0.2
# Start and end of the marks, in pixels from the row of spots.
MARKS_PIXELS = (14, 22)
# Factor on the period of the negative control.
WRONG_PERIOD = 1.02
# The set-up of figure 2.19, where the mirrored beam meets the screen at a right angle. Xenopeltis sends most light to
# orders below 0, which meet the screen when the beam comes from the other side.
DRAWN = Bench(theta_i_deg=45.0, tilt_deg=45.0, distance_mm=60.0, width_mm=130.0, height_mm=62.5, pixels_per_mm=6.0)
DRAWN_FROM_LEFT = replace(DRAWN, theta_i_deg=-45.0, tilt_deg=-45.0)
# The wider screen for the blazed grating, whose orders lie in one row.
LOW = Bench(height_mm=120.0)
# The wider screen for skins.
HIGH = Bench()


@dataclass(frozen=True)
class Sample:
    """A surface on the bench.

    `window` is the standard deviation of the weight of a spot's centroid, in cycles per µm. `axis` is the axis of the
    heights whose period the rotation turns into the plane of incidence.
    """

    name: str
    title: str
    skin: dict
    bench: Bench
    orders: tuple[int, ...]
    window: float = LOBE_PER_UM
    marked: tuple[int, ...] = (-2, -1, 1, 2)
    clipped: float = CLIPPED
    axis: str = "x"

    @property
    def is_scan(self) -> bool:
        return "filename" in self.skin


def samples() -> list[Sample]:
    """Scans, if present, and presets, in the set-up of figure 2.19 and before the wider screen."""
    skins = scans()
    for name in ("Elaphe", "Xenopeltis"):
        skins.append(Sample(name.lower(), f"{name}, procedural", {"preset": name.lower()}, HIGH, (-1, 1)))
    blazed = Sample("blazed", "Blazed", {"preset": "blazed"}, LOW, (-2, -1, 1, 2), clipped=CLIPPED_SPOTS)
    return [
        *map(drawn, skins),
        *skins,
        replace(blazed, marked=(-3, -2, -1, 1, 2, 3)),
        replace(
            blazed,
            name="blazed-30",
            title="Blazed, beam at 30°",
            bench=replace(LOW, theta_i_deg=30.0),
            orders=(-1, 1, 2),
            marked=(-1, 0, 1, 2, 3),
        ),
    ]


def drawn(sample: Sample) -> Sample:
    """The surface in the set-up of figure 2.19, with its brighter first order on the screen."""
    from_left = "Xenopeltis" in sample.title
    bench, order = (DRAWN_FROM_LEFT, -1) if from_left else (DRAWN, 1)
    return replace(sample, name=f"{sample.name}-drawn", bench=bench, orders=(order,), marked=(order, 2 * order))


def scans() -> list[Sample]:
    """The scans, if present, turned so that the waves of a chosen period lie in the plane of incidence."""
    found = []
    for name, path, axis in (("Elaphe", SCANS["elaphe"], "y"), ("Xenopeltis", SCANS["xenopeltis"], "x")):
        if not path.exists():
            print(f"NOT MEASURED: no scan at {path}, so there is no measured {name} on the bench", flush=True)
            continue
        skin = scanned_skin(path)
        skin["rotation"] = -period(skin, axis)["direction_deg"]
        found.append(Sample(f"{path.stem}-scan", f"{name}, scan", skin, HIGH, (-1, 1), SCAN_LOBE_PER_UM, axis=axis))
    return found


def period(skin: dict, axis: str) -> dict:
    """The dominant period of the heights along an axis in µm, and the direction of its waves in degrees."""
    relief = {name: value for name, value in skin.items() if name != "rotation"}
    return json.loads(sunbeam("height-field", *surface_words(relief)))["periods"][axis]


def measured(sample: Sample, bsdf: mi.BSDF, spacing: float) -> list[dict]:
    """Spots of each order at each wavelength, with positions in mm and degrees."""
    distance_mm = sample.bench.distance_mm
    bench = replace(sample.bench, pixels_per_mm=FINE_PIXELS / distance_mm, height_mm=MEASURED_HEIGHT * distance_mm)
    rows = []
    for seed, wavelength_nm in enumerate(WAVELENGTHS_NM):
        picture = photograph(bsdf, bench, line(wavelength_nm), MEASURED_PATHS, seed=seed)
        for order in sample.orders:
            found = spot_mm(bench, picture, spacing, order, wavelength_nm, sample.window)
            if found is None:
                continue
            expected = bench.position_mm(spacing, order, wavelength_nm)
            sine = math.sin(math.radians(float(bench.angle_deg(found)))) + math.sin(math.radians(bench.theta_i_deg))
            rows.append(
                {
                    "order": order,
                    "wavelength_nm": wavelength_nm,
                    "expected_mm": expected,
                    "expected_deg": float(bench.angle_deg(expected)),
                    "measured_mm": found,
                    "measured_deg": float(bench.angle_deg(found)),
                    "spacing_um": order * wavelength_nm / 1e3 / sine,
                }
            )
    return rows


def photographed(sample: Sample, bsdf: mi.BSDF, spacing: float, path: Path) -> None:
    """Writes the screen in white light, with marks at the grating equation's positions of three wavelengths."""
    bench = sample.bench
    pixels = photograph(bsdf, bench, {"type": "d65"}, PICTURE_PATHS).astype(np.float32)
    check(pixels / pixels.mean(), sample.name)
    stops = -np.log2(np.quantile(pixels.max(axis=-1)[pixels.max(axis=-1) > 0], 1 - sample.clipped))
    image = Image.fromarray(tone_mapped(pixels, float(stops)))
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(size=13)

    def place(x_mm, up_pixels):
        return (x_mm / bench.width_mm + 0.5) * bench.size[0], 0.5 * bench.size[1] - up_pixels

    for order in sample.marked:
        seen = []
        for wavelength_nm, colour in MARKED_NM.items():
            x = bench.position_mm(spacing, order, wavelength_nm)
            if x is None or abs(x) > 0.5 * bench.width_mm:
                continue
            seen.append(x)
            for side in (1, -1):
                draw.line([place(x, side * MARKS_PIXELS[0]), place(x, side * MARKS_PIXELS[1])], fill=colour, width=2)
        if seen:
            label = f"{order:+d}" if order else "0"
            draw.text(place(np.mean(seen), MARKS_PIXELS[1] + 4), label, fill=(230, 230, 230), font=font, anchor="ms")
    image.save(path, quality=88)


def figures() -> dict:
    """Positions of every spot; writes the pictures of the screens."""
    folder, chosen = images("lab"), []
    use_variant()
    bsdfs: dict[str, mi.BSDF] = {}
    for sample in samples():
        key = json.dumps(sample.skin)
        if key not in bsdfs:
            bsdfs[key] = mi.load_dict({"type": "diffraction", **sample.skin})
        spacing = period(sample.skin, sample.axis)["period_um"]
        photographed(sample, bsdfs[key], spacing, folder / f"{sample.name}.jpg")
        chosen.append(summary(sample, spacing, measured(sample, bsdfs[key], spacing)))
        print(f"{sample.name}: within {chosen[-1]['worst_mm']:.2f} mm", flush=True)
    return {
        "distance_mm": HIGH.distance_mm,
        "width_mm": HIGH.width_mm,
        "drawn": {name: getattr(DRAWN, name) for name in ("theta_i_deg", "tilt_deg", "distance_mm", "width_mm")},
        "beam_mm": 2 * HIGH.beam_radius_mm,
        "paths": MEASURED_PATHS,
        "wavelengths_nm": list(WAVELENGTHS_NM),
        "wrong_period_percent": 100 * (WRONG_PERIOD - 1),
        "lobe_mm": 0.55 * LOBE_PER_UM * HIGH.distance_mm,
        "scan_um": SCAN_UM,
        "scan_window": SCAN_LOBE_PER_UM,
        "samples": chosen,
    }


def summary(sample: Sample, spacing: float, spots: list[dict]) -> dict:
    """The sample's spots, and their distances from the positions of the grating equation."""
    off_mm = [abs(spot["measured_mm"] - spot["expected_mm"]) for spot in spots]
    wrong_mm = []
    for spot in spots:
        moved = sample.bench.position_mm(WRONG_PERIOD * spacing, spot["order"], spot["wavelength_nm"])
        wrong_mm.append(abs(moved - spot["expected_mm"]))
    by_order = []
    for order in sorted({spot["order"] for spot in spots}):
        found = [spot["spacing_um"] for spot in spots if spot["order"] == order]
        by_order.append({"order": order, "spacing_um": float(np.mean(found))})
    return {
        "name": sample.name,
        "title": sample.title,
        "is_scan": sample.is_scan,
        "is_drawn": sample.bench in (DRAWN, DRAWN_FROM_LEFT),
        "theta_i_deg": sample.bench.theta_i_deg,
        "spacing_um": spacing,
        # Longest wavelength whose first order on the other side of the mirrored beam is above the horizon.
        "horizon_nm": 1e3 * spacing * (1 - math.sin(math.radians(abs(sample.bench.theta_i_deg)))),
        "measured_spacing_um": float(np.mean([spot["spacing_um"] for spot in spots])),
        "by_order": by_order,
        "spots": spots,
        "worst_mm": max(off_mm),
        "worst_deg": max(abs(spot["measured_deg"] - spot["expected_deg"]) for spot in spots),
        "rms_mm": float(np.sqrt(np.mean(np.square(off_mm)))),
        "wrong_period_mm": min(wrong_mm),
    }
