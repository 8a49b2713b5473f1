"""The page `lab`: spots on the screen of the laboratory set-up against the grating equation."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path

import mitsuba as mi
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ..crosscheck.cases import SCAN
from ..crosscheck.realtime import surface_words
from ..environment import use_variant
from ..laboratory import Bench, line, photograph, spot_mm
from ..picture import check, tone_mapped
from ..skin import scanned_skin
from ..tool import sunbeam
from .page import images

# Pixels of a millimetre of the pictures with which positions are measured.
FINE_PIXELS_PER_MM, MEASURED_HEIGHT_MM = 2.0, 20.0
MEASURED_PATHS, PICTURE_PATHS = 500_000, 3_000_000
WAVELENGTHS_NM = (450.0, 550.0, 650.0)
MARKED_NM = {450.0: (90, 120, 255), 550.0: (80, 230, 80), 650.0: (255, 80, 70)}
# Deviation of a lobe of the ensemble in cycles per um, 1/(2√2 π s), at the coherence length of 65 um.
LOBE_PER_UM = 1 / (2 * math.sqrt(2) * math.pi * 65 / 4)
# The spectrum of the scan, so many um wide, is blurred as much more.
SCAN_UM = 6.5
SCAN_LOBE_PER_UM = 0.05
# Share of the pixels that are not black that are left to clip: more of few sharp spots, so that the faint ones show.
CLIPPED, CLIPPED_SPOTS = 0.01, 0.2
# Where the marks stand, in mm from the row of spots.
MARKS_MM = (14.0, 22.0)
# How wrong the period is of the negative control.
WRONG_PERIOD = 1.02


@dataclass(frozen=True)
class Sample:
    """A surface on the bench; `window` is the deviation of the weight of a spot's centroid, in cycles per um."""

    name: str
    skin: dict
    bench: Bench
    orders: tuple[int, ...]
    window: float = LOBE_PER_UM
    marked: tuple[int, ...] = (-2, -1, 1, 2)
    clipped: float = CLIPPED


def samples() -> list[Sample]:
    """The presets, and a measured scan where it is present."""
    low, high = Bench(height_mm=120.0), Bench()
    chosen = [
        Sample(
            "blazed", {"preset": "blazed"}, low, (-2, -1, 1, 2), marked=(-3, -2, -1, 1, 2, 3), clipped=CLIPPED_SPOTS
        ),
        Sample(
            "blazed-30",
            {"preset": "blazed"},
            replace(low, theta_i_deg=30.0),
            (-1, 1, 2),
            marked=(-1, 0, 1, 2, 3),
            clipped=CLIPPED_SPOTS,
        ),
        Sample("elaphe", {"preset": "elaphe"}, high, (-1, 1)),
        Sample("xenopeltis", {"preset": "xenopeltis"}, high, (-1, 1)),
    ]
    if SCAN.exists():
        chosen.append(Sample("xenopeltis-scan", scanned_skin(SCAN), high, (-1, 1), SCAN_LOBE_PER_UM))
    else:
        print(f"NOT MEASURED: no scan at {SCAN}, so there is no measured height field on the bench", flush=True)
    return chosen


def spacing_um(sample: Sample) -> float:
    """The dominant period along x of the heights, which knows nothing of light."""
    relief = {name: value for name, value in sample.skin.items() if name != "rotation"}
    return json.loads(sunbeam("height-field", *surface_words(relief)))["periods"]["x"]["period_um"]


def measured(sample: Sample, bsdf: mi.BSDF, spacing: float) -> list[dict]:
    """The spots of each order in each light, with positions in mm and degrees."""
    bench = replace(sample.bench, pixels_per_mm=FINE_PIXELS_PER_MM, height_mm=MEASURED_HEIGHT_MM)
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
    """The screen in white light as a picture, with marks where the grating equation puts three wavelengths."""
    bench = sample.bench
    pixels = photograph(bsdf, bench, {"type": "d65"}, PICTURE_PATHS).astype(np.float32)
    check(pixels / pixels.mean(), sample.name)
    stops = -np.log2(np.quantile(pixels.max(axis=-1)[pixels.max(axis=-1) > 0], 1 - sample.clipped))
    image = Image.fromarray(tone_mapped(pixels, float(stops)))
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(size=13)

    def place(x_mm, y_mm):
        return (
            (x_mm / bench.width_mm + 0.5) * bench.size[0],
            (0.5 - y_mm / bench.height_mm) * bench.size[1],
        )

    for order in sample.marked:
        seen = []
        for wavelength_nm, colour in MARKED_NM.items():
            x = bench.position_mm(spacing, order, wavelength_nm)
            if x is None or abs(x) > 0.5 * bench.width_mm:
                continue
            seen.append(x)
            for side in (1, -1):
                draw.line([place(x, side * MARKS_MM[0]), place(x, side * MARKS_MM[1])], fill=colour, width=2)
        if seen:
            label = f"{order:+d}" if order else "0"
            draw.text(place(np.mean(seen), MARKS_MM[1] + 4), label, fill=(230, 230, 230), font=font, anchor="ms")
    image.save(path, quality=88)


def figures() -> dict:
    """Positions of every spot; the photographs are written beside the page."""
    folder, chosen = images("lab"), []
    use_variant()
    bsdfs = {}
    for sample in samples():
        key = json.dumps(sample.skin)
        bsdf = bsdfs.setdefault(key, None) or mi.load_dict({"type": "diffraction", **sample.skin})
        bsdfs[key] = bsdf
        spacing = spacing_um(sample)
        spots = measured(sample, bsdf, spacing)
        photographed(sample, bsdf, spacing, folder / f"{sample.name}.jpg")
        off_mm = [abs(spot["measured_mm"] - spot["expected_mm"]) for spot in spots]
        off_deg = [abs(spot["measured_deg"] - spot["expected_deg"]) for spot in spots]
        wrong_mm = []
        for spot in spots:
            moved = sample.bench.position_mm(WRONG_PERIOD * spacing, spot["order"], spot["wavelength_nm"])
            wrong_mm.append(abs(moved - spot["expected_mm"]))
        chosen.append(
            {
                "name": sample.name,
                "theta_i_deg": sample.bench.theta_i_deg,
                "spacing_um": spacing,
                "measured_spacing_um": float(np.mean([spot["spacing_um"] for spot in spots])),
                "spots": spots,
                "worst_mm": max(off_mm),
                "worst_deg": max(off_deg),
                "rms_mm": float(np.sqrt(np.mean(np.square(off_mm)))),
                "wrong_period_mm": min(wrong_mm),
            }
        )
    bench = Bench()
    return {
        "distance_mm": bench.distance_mm,
        "width_mm": bench.width_mm,
        "beam_mm": 2 * bench.beam_radius_mm,
        "paths": MEASURED_PATHS,
        "wavelengths_nm": list(WAVELENGTHS_NM),
        "wrong_period_percent": 100 * (WRONG_PERIOD - 1),
        "lobe_mm": 0.55 * LOBE_PER_UM * bench.distance_mm,
        "scan_um": SCAN_UM,
        "scan_window": SCAN_LOBE_PER_UM,
        "samples": chosen,
    }
