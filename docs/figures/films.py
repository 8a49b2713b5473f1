"""The part `films`: pictures of transparent films, lines on the spectrometer's screen, and films in a white furnace.

Figures 1.1 and 1.2 of Single 2014 are the spectrometer's. Order m of a line is at x = D tan(asin(mλ/d)), where D is
SCREEN_CM.
"""

from __future__ import annotations

import math
from dataclasses import replace

import mitsuba as mi
import numpy as np
from PIL import Image

from mitsuba_scenes.environment import use_variant
from mitsuba_scenes.films import (
    AXIS_CM,
    MERCURY,
    PERIOD_UM,
    SCREEN_CM,
    SPECTACLES_VIEW,
    SPECTROMETER_VIEW,
    WINDOW_VIEW,
    WING_VIEW,
    film,
    spectacles_scene,
    spectrometer_scene,
    window_scene,
    wing_scene,
)
from mitsuba_scenes.picture import check, render_scene, tone_mapped
from mitsuba_scenes.scene import View

from .page import images, insist

PART = "films"
# Width and height of the pictures in pixels.
SIZE = (480, 320)
# Wavelength and period of figure 1.2's drawing in periodicity.md.
DRAWN = (550.0, 1.25)
# Half width of the part of the screen that is measured.
HALF_SCREEN_CM = 25.0
# Edge of a measured pixel on the screen. The slit's image is two pixels wide.
PIXEL_CM = 0.08
# Height of the measuring camera above the axis, where the film's mount hides nothing.
CAMERA_ABOVE_CM = 13.0
# Samples a pixel of the measurement: 2 million paths.
MEASURED_SPP = 9
# Mean of the two yellow lines, which are nearer to each other than the slit is wide.
YELLOW_NM = 578.05
# Half width of the window about an expected position in which a line is measured. The next line's image is outside.
NEAR_CM = 0.35
# Films in the furnace: height in µm of a sinusoid of PERIOD_UM, and the theory. A flat one has no orders.
FURNACE_FILMS = ((0.0, "scalar"), (0.1, "scalar"), (0.2, "scalar"), (0.4, "scalar"), (0.4, "rigorous"))
# Values of `transmission` for the spheres in the furnace, a shell and a solid ball.
BODIES = ("film", "interface")
# Angles at which sheets of film are seen in the furnace, across their grooves.
FURNACE_ANGLES_DEG = (0.0, 30.0, 60.0)
# Longest path in the furnace, beyond which a shell has no light left.
FURNACE_DEPTH = 64
# Samples a pixel in the furnace, whose pictures have 24 pixels across.
FURNACE_SPP = 144


def single_line(view: View) -> dict:
    """The spectrometer with the wavelength and the period of DRAWN."""
    return spectrometer_scene(view, powers={DRAWN[0]: 1.0}, period_um=DRAWN[1])


# Pictures by their file names: function that makes the scene, its camera, and samples a pixel.
PICTURES = {
    "spectrometer": (spectrometer_scene, SPECTROMETER_VIEW, 400),
    "single-line": (single_line, SPECTROMETER_VIEW, 400),
    "spectacles": (spectacles_scene, SPECTACLES_VIEW, 256),
    "window": (window_scene, WINDOW_VIEW, 400),
    "wing": (wing_scene, WING_VIEW, 64),
}


def position_cm(order: int, wavelength_nm: float, period_um: float = PERIOD_UM) -> float | None:
    """x on the screen of an order by the grating equation; None if it does not leave the film."""
    sine = order * wavelength_nm / 1e3 / period_um
    return SCREEN_CM * math.tan(math.asin(sine)) if abs(sine) < 1 else None


def profile(scene: dict) -> tuple[np.ndarray, np.ndarray]:
    """Positions x in cm of columns of the spectrometer's screen, and their brightness at the height of the axis.

    The room's light is off. A camera above the film sees the screen from the front, so columns are equally wide there.
    """
    columns, rows = round(2 * HALF_SCREEN_CM / PIXEL_CM), round((2 * CAMERA_ABOVE_CM + 2) / PIXEL_CM)
    distance, height = SCREEN_CM - 1, AXIS_CM + CAMERA_ABOVE_CM
    view = View(columns, rows, (0, 1, height), (0, 2, height), 2 * math.degrees(math.atan(HALF_SCREEN_CM / distance)))
    sensor = {**scene["sensor"], **{key: view.sensor(MEASURED_SPP)[key] for key in ("fov", "to_world")}}
    sensor["film"] = {**sensor["film"], "width": columns, "height": rows}
    dark = {key: value for key, value in scene.items() if key != "room"}
    pixels = np.array(mi.render(mi.load_dict({**dark, "sensor": sensor}), spp=MEASURED_SPP))
    # The slit's image is 3 cm high; its middle 2 cm are the last rows of the picture.
    strip = pixels[-round(2 / PIXEL_CM) :]
    return ((np.arange(columns) + 0.5) / columns - 0.5) * 2 * HALF_SCREEN_CM, strip.clip(0).sum(axis=(0, 2))


def line_cm(x_cm: np.ndarray, brightness: np.ndarray, expected_cm: float) -> float:
    """Centroid of a line near its expected position on the screen, above the darkest column there."""
    near = np.abs(x_cm - expected_cm) < NEAR_CM
    weights = brightness[near] - brightness[near].min()
    return float(np.average(x_cm[near], weights=weights))


def measured_lines() -> list[dict]:
    """Expected and measured positions in cm of orders 1 and 2 of mercury's lines, on both sides."""
    x_cm, brightness = profile(spectrometer_scene())
    lines_nm = [nm for nm in MERCURY if nm < 570] + [YELLOW_NM]
    rows = []
    for order in (-2, -1, 1, 2):
        for nm in lines_nm:
            expected = position_cm(order, nm)
            rows.append({"order": order, "nm": nm, "cm": expected, "found_cm": line_cm(x_cm, brightness, expected)})
    return rows


def off_of_single_line() -> float:
    """Largest distance in cm of the first orders of DRAWN from their expected positions."""
    x_cm, brightness = profile(single_line(SPECTROMETER_VIEW))
    return max(abs(line_cm(x_cm, brightness, x) - x) for x in (position_cm(order, *DRAWN) for order in (-1, 1)))


def furnace(shape: dict) -> float:
    """Mean radiance of a shape within a uniform light of radiance 1, where it covers 0.95 of the unit sphere's disc."""
    size, fov_deg, distance = 24, 6.0, 20.0
    view = View(size, size, (0, -distance, 0), (0, 0, 0), fov_deg)
    sensor = {**view.sensor(FURNACE_SPP), "sampler": {"type": "independent"}}
    sensor["film"] = {**sensor["film"], "pixel_format": "luminance", "rfilter": {"type": "box"}}
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": FURNACE_DEPTH, "rr_depth": FURNACE_DEPTH},
        "sensor": sensor,
        "light": {"type": "constant", "radiance": {"type": "uniform", "value": 1.0}},
    }
    covered, empty = (
        np.array(mi.render(mi.load_dict({**scene, **content}), spp=FURNACE_SPP))[..., 0]
        for content in ({"shape": shape}, {})
    )
    y, x = (np.mgrid[:size, :size] + 0.5) / size * 2 - 1
    on_disc = np.hypot(x, y) * math.tan(math.radians(0.5 * fov_deg)) * distance < 0.95
    return float(covered[on_disc].mean() / empty.mean())


def furnace_film(height_um: float, theory: str) -> dict:
    """The plugin of a film with a sinusoidal relief, or of a flat one."""
    if height_um == 0:
        return film({"preset": "flat"}, coherence_um=60.0)
    return film({"preset": "sinusoidal", "period": PERIOD_UM, "height": height_um, "theory": theory}, coherence_um=30.0)


def sheet(bsdf: dict, angle_deg: float) -> dict:
    """A large rectangle seen at an angle with its normal, in the plane across its grooves."""
    place = mi.ScalarTransform4f().rotate([0, 0, 1], angle_deg).rotate([1, 0, 0], 90).scale([50, 50, 1])
    return {"type": "rectangle", "to_world": place, "bsdf": bsdf}


def in_furnace(height_um: float, theory: str) -> dict:
    """Radiances in the furnace: a film at each of FURNACE_ANGLES_DEG, a closed shell of it, and a solid ball.

    The rigorous theory has no ball.
    """
    bsdf = furnace_film(height_um, theory)
    bodies = BODIES if theory == "scalar" else BODIES[:1]
    radiances = [furnace({"type": "sphere", "bsdf": {**bsdf, "transmission": kind}}) for kind in bodies]
    shell, solid = (*radiances, None)[:2]
    sheets = [furnace(sheet(bsdf, angle)) for angle in FURNACE_ANGLES_DEG]
    return {"height_um": height_um, "theory": theory, "sheets": sheets, "shell": shell, "solid": solid}


def figures() -> dict:
    """Renders the pictures; returns expected and measured positions of lines, and radiances in the furnace."""
    use_variant(fall_back=False)
    for name, (make, view, spp) in PICTURES.items():
        pixels, _ = render_scene(make(replace(view, width=SIZE[0], height=SIZE[1])), spp)
        check(pixels, name)
        Image.fromarray(tone_mapped(pixels, 0.0)).save(images(PART) / f"{name}.jpg", quality=90)
    lines = measured_lines()
    off_cm = max(abs(line["found_cm"] - line["cm"]) for line in lines)
    insist(PART, off_cm < PIXEL_CM, "lines are where the grating equation has them, to a pixel")
    rows = [in_furnace(height, theory) for height, theory in FURNACE_FILMS]
    insist(PART, max(max(*row["sheets"], row["shell"]) for row in rows) < 1, "a film in a furnace is darker than it")
    return {
        "size": list(SIZE),
        "spp": {name: spp for name, (_, _, spp) in PICTURES.items()},
        "lines": lines,
        "off_cm": off_cm,
        "pixel_cm": PIXEL_CM,
        "screen_cm": SCREEN_CM,
        "period_um": PERIOD_UM,
        "drawn": {"order_1_cm": position_cm(1, *DRAWN), "off_cm": off_of_single_line()},
        "angles_deg": list(FURNACE_ANGLES_DEG),
        "furnace": rows,
    }
