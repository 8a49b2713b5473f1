"""Transparent films: a spectrometer, diffraction spectacles, a window film, and a wing. Lengths are in cm, z is up.

Radiances with the spectrum of D65 are in the unit of light.py: a white diffuse plane facing the sun has the radiance 1.

The relief of a film is on the side of its rectangle's normal, and its grooves run along the rectangle's height. Sizes,
places and brightnesses without a comment are chosen by eye.
"""

from __future__ import annotations

import math
import os

import mitsuba as mi
import numpy as np

from .laboratory import lines
from .light import uniform_sky
from .scene import View, colour_texture, raw_texture, soil, stage
from .snake import FOLDER

# Edge of the pixels of the reliefs that are made here.
PIXEL_UM = 0.125
# Largest number of segments of a path. Five segments join a lamp, the film (hit twice), two diffuse surfaces and the
# camera. Fewer would leave out diffuse light from walls and floor, more take longer.
MAX_DEPTH = 5
# Period of the spectrometer's grating: 500 grooves a millimetre, as in films for classrooms.
PERIOD_UM = 2.0
# Wavelengths in nm and relative powers of the visible lines of a mercury lamp.
MERCURY = {404.7: 0.5, 435.8: 1.0, 546.1: 1.0, 577.0: 0.35, 579.1: 0.35}
# Distance of the screen from the spectrometer's film.
SCREEN_CM = 30.0
# Distance of the slit from the film, on the side of the lamp.
SLIT_DISTANCE_CM = 10.0
# Width and height of the slit.
SLIT_CM = (0.16, 3.0)
# Height of the optical axis above the table.
AXIS_CM = 7.0
# Spectral radiance at the centre of a line of power 1. Larger values brighten the orders against the lit room.
LINE_RADIANCE = 8e3
# Camera behind the lamp.
SPECTROMETER_VIEW = View(origin_cm=(-14, -31, 27), target_cm=(-1.5, 14, 3.5), fov_deg=50.0)
# Width and height of the window.
WINDOW_CM = (14.0, 80.0)
# Height of the window's sill above the floor.
SILL_CM = 55.0
# Vector to the sun, of about unit length: 9° from the window's normal in azimuth, at an elevation of 41°.
TO_SUN = (0.12, 0.75, 0.65)
# Camera with its back to the room.
WINDOW_VIEW = View(origin_cm=(45, -390, 190), target_cm=(-5, -130, 0), fov_deg=48.0)
# Camera of the spectacles, at the height of a person's eyes.
SPECTACLES_VIEW = View(origin_cm=(0, 0, 165), target_cm=(0, 1000, 255), fov_deg=62.0)
# Length and width of the wing.
WING_CM = (6.4, 2.6)
# Numbers of the wing's cells along and across it.
WING_CELLS = (24, 9)
# Height of the wing's middle.
WING_HEIGHT_CM = 60.0
# Camera of the wing.
WING_VIEW = View(origin_cm=(0, -16, WING_HEIGHT_CM), target_cm=(0, 0, WING_HEIGHT_CM), fov_deg=23.0)


def film(relief: dict, coherence_um: float, **parameters) -> dict:
    """The plugin for a clear film whose index is about that of acetate.

    `relief` has the parameters of the heights, `parameters` further ones. `coherence_um` is the coherence length, the
    width over which light interferes: a larger one makes narrower diffraction orders. With `transmission = film` the
    rectangle is a thin sheet with air on both sides, whose side away from the normal is flat.
    """
    body = {"eta": 1.5, "transmission": "film", "coherence_length": coherence_um}
    return {"type": "diffraction", **relief, **body, **parameters}


def write_relief(name: str, heights_um: np.ndarray) -> dict:
    """Writes heights as `name`.npy into FOLDER, that of the snake's files.

    Returns the plugin's parameters for the relief, a tile that repeats.
    """
    FOLDER.mkdir(parents=True, exist_ok=True)
    path, temporary = FOLDER / f"{name}.npy", FOLDER / f"{name}-{os.getpid()}.npy"
    np.save(temporary, heights_um.astype(np.float32))
    # Other processes may read the file, so it is replaced as a whole.
    temporary.replace(path)
    return {"filename": str(path), "pixel_size": PIXEL_UM, "tiling": "periodic", "level": "none"}


def matte(*rgb: float) -> dict:
    """A diffuse material by its reflectance: one number for grey, or three in linear sRGB."""
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": rgb[0] if len(rgb) == 1 else list(rgb)}}


def pane(centre_cm, towards_cm, size_cm: tuple[float, float], bsdf: dict, up=(0, 0, 1), **more) -> dict:
    """A rectangle whose normal points towards the point `towards_cm`.

    `size_cm` is its width and its height, which is along `up`. `more` has further entries, such as an emitter.
    """
    place = mi.ScalarTransform4f().look_at(list(centre_cm), list(towards_cm), list(up))
    return {"type": "rectangle", "to_world": place.scale([0.5 * size_cm[0], 0.5 * size_cm[1], 1]), "bsdf": bsdf, **more}


def box(centre_cm, size_cm, bsdf: dict) -> dict:
    """A box with edges along the axes."""
    x, y, z = centre_cm
    width, depth, height = (0.5 * edge for edge in size_cm)
    # Half edges, since Mitsuba's cube has edges of length 2. The rotation maps the cube's y to z and its z to y.
    place = mi.ScalarTransform4f().look_at([x, y, z], [x, y + 1, z], [0, 0, 1]).scale([width, height, depth])
    return {"type": "cube", "to_world": place, "bsdf": bsdf}


def frame(name: str, centre_cm, hole_cm: tuple[float, float], border_cm: float, depth_cm: float, bsdf: dict) -> dict:
    """Four boxes around a hole in the plane of x and z, as entries of a scene dictionary that begin with `name`.

    `hole_cm` is the hole's width and height, `border_cm` the width of the boxes, and `depth_cm` their extent along y.
    """
    x, y, z = centre_cm
    width, height = hole_cm
    across, up = 0.5 * (width + border_cm), 0.5 * (height + border_cm)
    sides = (border_cm, depth_cm, height + 2 * border_cm)
    return {
        f"{name}_left": box((x - across, y, z), sides, bsdf),
        f"{name}_right": box((x + across, y, z), sides, bsdf),
        f"{name}_top": box((x, y, z + up), (width, depth_cm, border_cm), bsdf),
        f"{name}_bottom": box((x, y, z - up), (width, depth_cm, border_cm), bsdf),
    }


def light_traced(scene: dict) -> dict:
    """Changes `scene` so that paths begin at its lamps, for light that a film throws on a surface; returns it.

    Paths from the camera would hit these narrow beams by chance alone.
    """
    # Russian roulette would start beyond the longest path, so it is off.
    scene["integrator"] = {"type": "ptracer", "max_depth": MAX_DEPTH, "rr_depth": 100}
    scene["sensor"]["sampler"]["type"] = "independent"
    scene["sensor"]["film"]["rfilter"] = {"type": "box"}
    return scene


def spectrometer_scene(
    view: View = SPECTROMETER_VIEW, spp: int = 144, powers: dict[float, float] = MERCURY, period_um: float = PERIOD_UM
) -> dict:
    """A lamp with collimator and slit, a film in the mount of a slide, and a screen; light goes along y.

    `powers` has the relative power of each of the lamp's lines by its wavelength in nm. Order m of a line of wavelength
    λ is on the screen at x = SCREEN_CM tan(asin(mλ/d)), where d is `period_um`.
    """
    # `slit` is the slit's centre; the lamp is 1 cm behind it, and wider than it.
    grey, slit = matte(0.25), (0, -SLIT_DISTANCE_CM, AXIS_CM)
    beam = {"type": "directionalarea", "radiance": lines({nm: LINE_RADIANCE * power for nm, power in powers.items()})}
    relief = {"preset": "sinusoidal", "period": period_um, "height": 0.4}
    objects = {
        "lamp": pane((0, slit[1] - 1, AXIS_CM), slit, (1.5 * SLIT_CM[0], SLIT_CM[1]), matte(0.0), emitter=beam),
        "housing": box((0, slit[1] - 5, 0.5 * AXIS_CM + 1.5), (6, 7.8, AXIS_CM + 3), grey),
        **frame("jaw", slit, SLIT_CM, 3.0, 0.1, grey),
        # With this coherence length an order is far narrower than the slit's image.
        "film": pane((0, 0, AXIS_CM), slit, (2.8, 3.4), film(relief, coherence_um=1000.0)),
        **frame("mount", (0, 0, AXIS_CM), (2.6, 3.2), 1.2, 0.2, matte(0.5)),
        "post": box((0, 0, 0.5 * AXIS_CM - 1.4), (0.8, 0.2, AXIS_CM - 2.8), grey),
        "screen": pane((0, SCREEN_CM, AXIS_CM), slit, (50, 14), matte(0.8)),
        "table": box((0, 8, 0), (70, 70, 0.2), matte(0.16, 0.12, 0.09)),
    }
    # A lamp that lights the apparatus for the camera.
    room = {
        "type": "spot",
        "to_world": mi.ScalarTransform4f().look_at([-25, -45, 60], [0, 12, 4], [0, 0, 1]),
        "intensity": {"type": "d65", "scale": 4000.0},
        "cutoff_angle": 28.0,
        "beam_width": 18.0,
    }
    return light_traced(stage(objects, {"room": room}, view, spp))


def window_scene(view: View = WINDOW_VIEW, spp: int = 144) -> dict:
    """The floor before a narrow window with a film in the sun: the window's image, and a spectrum on either side."""
    # The window's centre, a point before it outside, and a point of the floor.
    middle = np.array([0, 0, SILL_CM + 0.5 * WINDOW_CM[1]])
    outside, on_floor = (0, 100, middle[2]), (0, -120, 0)
    relief = {"preset": "sinusoidal", "period": 1.0, "height": 0.4}
    # 50 planks of slightly different browns. Each has 16 texels across, and the first of them is a dark gap.
    shade = np.repeat(np.random.default_rng(3).uniform(0.75, 1.25, 50), 16) * np.tile([0.4] + 15 * [1.0], 50)
    planks = {"type": "diffuse", "reflectance": colour_texture(shade[None, :, None] * np.array([0.36, 0.22, 0.12]))}
    sun = {"type": "directionalarea", "radiance": {"type": "d65", "scale": 50.0}}
    ceiling = {"type": "area", "radiance": {"type": "d65", "scale": 0.4}}
    objects = {
        "floor": pane((0, -200, 0.1), (0, -200, 1), (600, 400), planks, up=(0, 1, 0)),
        # The coherence length makes orders 1° wide, like the blur by the sun's disc and the waviness of films.
        "film": pane(middle, outside, WINDOW_CM, film(relief, coherence_um=40.0)),
        **frame("wall", (0, 2, middle[2]), WINDOW_CM, 300, 4, matte(0.6)),
    }
    emitters = {
        # A parallel beam towards the window, as wide as it, from 2 m away.
        "sun": pane(middle + 200 * np.array(TO_SUN), middle, WINDOW_CM, matte(0.0), emitter=sun),
        "ceiling": pane((0, -200, 280), on_floor, (300, 200), matte(0.0), emitter=ceiling),
    }
    return light_traced(stage(objects, emitters, view, spp))


def spectacles_scene(view: View = SPECTACLES_VIEW, spp: int = 64) -> dict:
    """A street at night through a film with crossed gratings, close to the eye."""
    eye = view.origin_cm
    # One period, 2 µm, of two crossed gratings, each 0.3 µm from valley to peak.
    wave = 0.15 * np.cos(2 * np.pi * np.arange(0, 2, PIXEL_UM) / 2)
    # The coherence length makes orders half a degree wide.
    gratings = film(write_relief("crossed", wave[:, None] + wave), coherence_um=60.0)
    objects = {
        "film": pane((eye[0], eye[1] + 3, eye[2]), eye, (8, 7), gratings),
        "street": box((0, 2000, 0), (1000, 4000, 2), matte(0.08)),
        **{f"houses_{side}": box((side * 900, 2200, 400), (600, 3600, 800), matte(0.15)) for side in (-1, 1)},
    }
    light = {"type": "area", "radiance": {"type": "d65", "scale": 80.0}}
    # Positions of the street lamps, on both sides of the street.
    for number, (x, y) in enumerate([(-330, 800), (330, 1300), (-330, 1900), (330, 2600), (-330, 3400)]):
        objects[f"post_{number}"] = box((x, y, 240), (14, 14, 480), soil())
        objects[f"lamp_{number}"] = {"type": "sphere", "center": [x, y, 500], "radius": 17, "emitter": light}
    return stage(objects, uniform_sky(0.003), view, spp, MAX_DEPTH)


def ridges() -> np.ndarray:
    """Heights in µm of a membrane's ridges: noise with periods about 1.3 µm, mostly along x, in a tile of 16 µm.

    White noise is filtered by Gaussians of its frequency and direction, and scaled to a standard deviation of 0.055 µm.
    """
    # Pixels along each side of the tile, 16 µm.
    count = 128
    # Frequencies in cycles per µm. The filter is centred on 1/1.3 µm, which is 0.77, and on the direction x. Its
    # Gaussians have the half widths 0.04 cycles per µm and 0.35 rad at 1/e; larger ones make the ridges less regular.
    # With |fx| opposite frequencies get equal weights, so the heights are real.
    fx, fy = np.meshgrid(*2 * [np.fft.fftfreq(count, PIXEL_UM)])
    frequency, angle = np.hypot(fx, fy), np.arctan2(fy, np.abs(fx))
    band = np.exp(-(((frequency - 0.77) / 0.04) ** 2) - (angle / 0.35) ** 2)
    heights = np.fft.ifft2(np.fft.fft2(np.random.default_rng(7).standard_normal((count, count))) * band).real
    return 0.055 * heights / heights.std()


def wing_cells(x: np.ndarray, y: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the Voronoi cells of points of the unit square, and how much farther in cm the second nearest seed is.

    x runs along the wing. Each square of a grid of WING_CELLS has one random seed. On the borders of cells both seeds
    are equally far, and the second value is 0.
    """
    squares = np.stack(np.meshgrid(*map(np.arange, WING_CELLS)), -1).reshape(-1, 2)
    seeds = (squares + rng.uniform(0.1, 0.9, squares.shape)) / WING_CELLS
    # Distances of each point from all seeds in cm. Lengths along the wing are scaled by 0.7, which makes cells longer.
    width, height = WING_CM
    distance = np.hypot((x[..., None] - seeds[:, 0]) * 0.7 * width, (y[..., None] - seeds[:, 1]) * height)
    nearest, second = np.moveaxis(np.partition(distance, 1, axis=-1)[..., :2], -1, 0)
    return distance.argmin(axis=-1), second - nearest


def wing_scene(view: View = WING_VIEW, spp: int = 36) -> dict:
    """An insect's wing before a wall, with lamps behind it; angle and pitch of the ridges differ from cell to cell."""
    width, height = WING_CM
    # Centres of the texels, 100 per cm, scaled to the unit square. x runs along the wing, y across it.
    y, x = np.mgrid[: round(100 * height), : round(100 * width)] + 0.5
    x, y = x / x.shape[1], y / x.shape[0]
    # Outline: y of the upper and of the lower edge at x.
    upper, lower = 0.62 + 0.33 * np.sqrt(x - x**9), 0.62 - 0.6 * x**0.7 * np.sqrt(1 - x**4)
    rng = np.random.default_rng(5)
    cell, excess_cm = wing_cells(x, y, rng)
    count = math.prod(WING_CELLS)
    # Veins run along the borders of cells and along the outline.
    veins = (excess_cm < 0.014) | (np.minimum(upper - y, y - lower) * height < 0.035)
    # The ridges' angle in degrees and the factor on their pitch differ from cell to cell; the angle also varies along
    # the wing.
    membrane = film(
        write_relief("ridges", ridges()),
        # Orders are 4° wide.
        coherence_um=8.0,
        tolerance=1e-2,
        rotation=raw_texture(12 * np.sin(5 * x + 3 * y) + rng.uniform(-6, 6, count)[cell]),
        scale=raw_texture(rng.uniform(0.9, 1.0, count)[cell]),
    )
    chitin = {"type": "twosided", "bsdf": matte(0.05, 0.035, 0.02)}
    whole = {"type": "blendbsdf", "weight": raw_texture(veins), "membrane": membrane, "veins": chitin}
    shape = {"type": "mask", "opacity": raw_texture((y < upper) & (y > lower)), "bsdf": whole}
    centre, eye = (0, 0, WING_HEIGHT_CM), view.origin_cm
    objects = {
        "wing": pane(centre, eye, WING_CM, shape),
        "wall": pane((0, 60, WING_HEIGHT_CM), eye, (200, 200), matte(0.06, 0.1, 0.11)),
    }
    light = {"type": "area", "radiance": {"type": "d65", "scale": 700.0}}
    # Positions of the lamps in a plane 40 cm behind the wing, relative to its middle.
    for number, (x_cm, z_cm) in enumerate([(-19, 9), (21, 0), (17, 17), (-24, -3)]):
        place = {"center": [x_cm, 40, WING_HEIGHT_CM + z_cm], "radius": 0.4}
        objects[f"lamp_{number}"] = {"type": "sphere", **place, "emitter": light}
    return stage(objects, uniform_sky(0.25), view, spp, MAX_DEPTH)
