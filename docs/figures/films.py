"""Part `films` of the documentation (page.py): diffracting films in pictures, in a spectrometer and a white furnace.

A *film* is a transparent sheet with a relief on one side, a body that transmits (docs/model.md#bodies-that-transmit).
The scenes are those of mitsuba_scenes/films.py. The spectrometer of figures 1.1 and 1.2 of Single 2014, M. Single's
thesis, sends the light of spectral lines through a film onto a screen. Order m of a line meets the screen at
x = D tan(asin(mλ/d)). λ is the wavelength, d the film's period, and D its distance SCREEN_CM from the screen.

A *white furnace* is uniform light of radiance 1 from everywhere. A film that lost no light would have radiance 1 in it.
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
# Wavelength in nm and period in µm of the drawing of figure 1.2 on the page periodicity.md.
DRAWN = (550.0, 1.25)
# Half width of the measured strip, which is as wide as the screen.
HALF_SCREEN_CM = 25.0
# Edge of a measured pixel on the screen. The image of the spectrometer's slit is two pixels wide.
PIXEL_CM = 0.08
# Height of the measuring camera above the axis, where the film's mount hides nothing.
CAMERA_ABOVE_CM = 13.0
# Samples a pixel of the measurement: 2 million paths for the picture of 625 × 350 pixels.
MEASURED_SPP = 9
# Mean of the two yellow lines, which are nearer to each other than the slit is wide.
YELLOW_NM = 578.05
# Half width of the window about an expected position in which a line is measured. It holds the slit's image, 0.16 cm
# wide at normal incidence, without the next line's.
NEAR_CM = 0.35
# Films in the furnace: height in µm of a sinusoid of PERIOD_UM, and the plugin's parameter `theory`, the phase screen
# (scalar) or Maxwell's equations (rigorous). A film of height 0 is flat.
FURNACE_FILMS = ((0.0, "scalar"), (0.1, "scalar"), (0.2, "scalar"), (0.4, "scalar"), (0.4, "rigorous"))
# Angles at which sheets of film are seen in the furnace, across their grooves.
FURNACE_ANGLES_DEG = (0.0, 30.0, 60.0)
# Largest number of segments of a path in the furnace. Light that has not left a shell by then is negligible.
FURNACE_DEPTH = 64
# Width and height of pictures in the furnace in pixels.
FURNACE_PIXELS = 24
# Samples a pixel in the furnace.
FURNACE_SPP = 144
# Vertical and horizontal field of view in the furnace. With FURNACE_DISTANCE the picture just holds the unit sphere.
FURNACE_FOV_DEG = 6.0
# Distance of the camera from the origin in the furnace, in radii of the sphere. Larger ones make rays more parallel.
FURNACE_DISTANCE = 20.0
# Radius about the picture's centre within which radiance is averaged, in radii of the sphere. The sphere's edge, where
# pixels are partly empty, is left out.
FURNACE_RADIUS = 0.95


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
    """x on the screen of an order by the grating equation; None if the order does not leave the film."""
    sine = order * wavelength_nm / 1e3 / period_um
    return SCREEN_CM * math.tan(math.asin(sine)) if abs(sine) < 1 else None


def profile(scene: dict) -> tuple[np.ndarray, np.ndarray]:
    """Positions x in cm on the spectrometer's screen, (columns,), and the brightness there at the height of the axis.

    The room's light is off. A camera above the film sees the screen from the front, so columns are equally wide there.
    The picture reaches from 1 cm below the axis up to CAMERA_ABOVE_CM + 1 cm above the camera.
    """
    columns, rows = round(2 * HALF_SCREEN_CM / PIXEL_CM), round((2 * CAMERA_ABOVE_CM + 2) / PIXEL_CM)
    # The camera looks along +y from y = 1 cm, and sees the whole width of the screen; the film is at y = 0.
    distance, height = SCREEN_CM - 1, AXIS_CM + CAMERA_ABOVE_CM
    fov_deg = 2 * math.degrees(math.atan(HALF_SCREEN_CM / distance))
    view = View(columns, rows, origin_cm=(0, 1, height), target_cm=(0, 2, height), fov_deg=fov_deg)
    # The scene's sampler and reconstruction filter are kept.
    sensor = {**scene["sensor"], **{key: view.sensor(MEASURED_SPP)[key] for key in ("fov", "to_world")}}
    sensor["film"] = {**sensor["film"], "width": columns, "height": rows}
    dark = {key: value for key, value in scene.items() if key != "room"}
    pixels = np.array(mi.render(mi.load_dict({**dark, "sensor": sensor}), spp=MEASURED_SPP))
    # The slit's image is 3 cm high; its middle 2 cm are the last rows of the picture.
    strip = pixels[-round(2 / PIXEL_CM) :]
    x_cm = ((np.arange(columns) + 0.5) / columns - 0.5) * 2 * HALF_SCREEN_CM
    # Spectral colours have negative channels in linear sRGB, which count as 0. Brightness sums rows and channels.
    return x_cm, strip.clip(0).sum(axis=(0, 2))


def line_cm(x_cm: np.ndarray, brightness: np.ndarray, expected_cm: float) -> float:
    """Centroid of a line near its expected position on the screen; the darkest column there counts as black."""
    near = np.abs(x_cm - expected_cm) < NEAR_CM
    weights = brightness[near] - brightness[near].min()
    return float(np.average(x_cm[near], weights=weights))


def measured_lines() -> list[dict]:
    """Expected and measured positions, `cm` and `found_cm`, of orders ±1 and ±2 of mercury's lines."""
    x_cm, brightness = profile(spectrometer_scene())
    # YELLOW_NM stands for the two lines beyond 570 nm.
    lines_nm = [nm for nm in MERCURY if nm < 570] + [YELLOW_NM]
    rows = []
    for order in (-2, -1, 1, 2):
        for nm in lines_nm:
            expected = position_cm(order, nm)
            rows.append({"order": order, "nm": nm, "cm": expected, "found_cm": line_cm(x_cm, brightness, expected)})
    return rows


def single_line_error_cm() -> float:
    """Largest distance in cm of the first orders of DRAWN from their expected positions."""
    x_cm, brightness = profile(single_line(SPECTROMETER_VIEW))
    expected_cm = [position_cm(order, *DRAWN) for order in (-1, 1)]
    return max(abs(line_cm(x_cm, brightness, expected) - expected) for expected in expected_cm)


def furnace(shape: dict) -> float:
    """Mean radiance of a shape in the furnace, over a disc of FURNACE_RADIUS that the shape must fill."""
    size = FURNACE_PIXELS
    view = View(size, size, (0, -FURNACE_DISTANCE, 0), (0, 0, 0), FURNACE_FOV_DEG)
    sensor = {**view.sensor(FURNACE_SPP), "sampler": {"type": "independent"}}
    sensor["film"] = {**sensor["film"], "pixel_format": "luminance", "rfilter": {"type": "box"}}
    scene = {
        "type": "scene",
        # Russian roulette would start at the longest paths, so it is off.
        "integrator": {"type": "path", "max_depth": FURNACE_DEPTH, "rr_depth": FURNACE_DEPTH},
        "sensor": sensor,
        "light": {"type": "constant", "radiance": {"type": "uniform", "value": 1.0}},
    }
    covered, empty = (
        np.array(mi.render(mi.load_dict({**scene, **content}), spp=FURNACE_SPP))[..., 0]
        for content in ({"shape": shape}, {})
    )
    # Pixel centres from -1 to 1, scaled to lengths in the plane y = 0.
    y, x = (np.mgrid[:size, :size] + 0.5) / size * 2 - 1
    half_width = math.tan(math.radians(0.5 * FURNACE_FOV_DEG)) * FURNACE_DISTANCE
    on_disc = np.hypot(x, y) * half_width < FURNACE_RADIUS
    # The picture without the shape is the unit of radiance.
    return float(covered[on_disc].mean() / empty.mean())


def furnace_film(height_um: float, theory: str) -> dict:
    """The plugin of a film with a sinusoidal relief, or of a flat one.

    The radiance in the furnace hardly depends on the coherence length, since it sums over orders.
    """
    if height_um == 0:
        return film({"preset": "flat"}, coherence_um=60.0)
    return film({"preset": "sinusoidal", "period": PERIOD_UM, "height": height_um, "theory": theory}, coherence_um=30.0)


def sheet(bsdf: dict, angle_deg: float) -> dict:
    """A large rectangle seen at an angle with its normal, in the plane across its grooves."""
    # Mitsuba's rectangle lies in the plane z = 0 with a side of 2. It is enlarged, set upright, and turned about z.
    place = mi.ScalarTransform4f().rotate([0, 0, 1], angle_deg).rotate([1, 0, 0], 90).scale([50, 50, 1])
    return {"type": "rectangle", "to_world": place, "bsdf": bsdf}


def in_furnace(height_um: float, theory: str) -> dict:
    """Radiances in the furnace: the film as sheets at FURNACE_ANGLES_DEG, as a closed shell, and as a solid ball.

    The solid ball has the film's relief as its surface.
    """
    bsdf = furnace_film(height_um, theory)

    def sphere(transmission: str) -> float:
        return furnace({"type": "sphere", "bsdf": {**bsdf, "transmission": transmission}})

    return {
        "height_um": height_um,
        "theory": theory,
        "sheets": [furnace(sheet(bsdf, angle)) for angle in FURNACE_ANGLES_DEG],
        "shell": sphere("film"),
        "solid": sphere("interface"),
    }


def figures() -> dict:
    """Renders the pictures; returns expected and measured positions of lines, and radiances in the furnace.

    `off_cm` is the largest distance between both positions, of mercury's lines and, under `drawn`, of DRAWN. Raises
    SetupError if a line of mercury is off by a pixel or more, or a sheet or shell is not darker than the furnace.
    """
    use_variant(fall_back=False)
    for name, (make, view, spp) in PICTURES.items():
        # The times of rendering are not reported.
        pixels, _ = render_scene(make(replace(view, width=SIZE[0], height=SIZE[1])), spp)
        # A black picture, or one with values that are not finite, is an error.
        check(pixels, name)
        # An exposure of 0 stops leaves the radiance as it is.
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
        "drawn": {"order_1_cm": position_cm(1, *DRAWN), "off_cm": single_line_error_cm()},
        "angles_deg": list(FURNACE_ANGLES_DEG),
        "furnace": rows,
    }
