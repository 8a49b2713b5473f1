"""Part `polarisation` of the documentation (page.py): degree of linear polarisation in pictures of gratings.

The degree is √(Q² + U²)/I by the Stokes components I, Q and U. Compact discs of aluminium, and spheres of aluminium and
glass, are path-traced in a polarised variant of Mitsuba. The plugin's parameter `theory` is `scalar`, with the
polarisation of a flat interface, or `rigorous`, Maxwell's equations. Lengths of the scenes are in cm, z is up. Places
and radiances of lights are chosen by eye.
"""

from __future__ import annotations

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant
from mitsuba_scenes.picture import tone_mapped
from mitsuba_scenes.scene import View

from .benchmark_scenes import floor, lamp, sky
from .disc import write_disc
from .page import images, insist

PART = "polarisation"
# A scalar variant, since these small pictures take less time than the compilation of kernels.
VARIANT = "scalar_spectral_polarized"
# Width and height of the pictures in pixels.
SIZE = (144, 96)
# Samples per pixel. Noise raises the degree of polarisation; a larger number lowers the noise and takes longer.
SPP = 144
# Largest number of segments of a path: from the camera to the object, on to the floor, and to a light.
MAX_DEPTH = 3
# Optical parameters of the plugin for aluminium.
ALUMINIUM = {"material": "Al"}
# Optical parameters of the plugin for glass.
GLASS = {"eta": 1.5}
# Reflectance of the floor, linear sRGB. A brighter one would add unpolarised light.
DARK_FLOOR = (0.05, 0.05, 0.05)
# The relief of a compact disc.
TRACKS = {"preset": "cd"}
# Parameters of grooves with the period and depth of a disc's tracks, in µm. Grooves are constant along y, as
# `theory = rigorous` requires; the pits of TRACKS are not.
GROOVES = {"preset": "lamellar", "period": 1.6, "height": 0.12}
# Values of the plugin's parameter `theory`.
THEORIES = ("scalar", "rigorous")
# Luminance weights of linear sRGB (IEC 61966-2-1), for the picture's three channels.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# Luminance, relative to the picture's median, below which pixels are excluded. A larger value hides more of the
# picture, a smaller one shows noise.
DARK = 0.02
# Quantile of the degree of polarisation over the pixels that is reported as the largest degree, so that single noisy
# pixels do not count.
LARGEST = 0.99
# Smallest accepted ratio of largest degrees where the page says that one surface polarises more than another.
MORE = 1.5
# Camera of the pictures of the sphere.
SPHERE_VIEW = View(*SIZE, origin_cm=(0, -6, 2.5), target_cm=(0, 0, 1), fov_deg=32)
# Camera of the pictures of the disc.
DISC_VIEW = View(*SIZE, origin_cm=(0, -16, 13), target_cm=(0, 0, 0), fov_deg=42)


def sphere(optics: dict) -> dict:
    """A blazed sphere with the plugin's parameters `optics`, under a uniform sky and a lamp, as parts of a scene."""
    return {
        "ball": {"type": "sphere", "center": [0, 0, 1], "bsdf": {"type": "diffraction", "preset": "blazed", **optics}},
        "floor": floor(half_width_cm=20, reflectance=DARK_FLOOR),
        "lamp": lamp((3, -3, 4), radius_cm=0.2, radiance=30),
        "sky": sky(0.5),
    }


def disc(relief: dict, ply) -> dict:
    """The disc of the mesh `ply` in aluminium, under a uniform sky and a lamp, as parts of a scene.

    `relief` has the plugin's parameters of the heights and of the theory.
    """
    return {
        "disc": {"type": "ply", "filename": str(ply), "bsdf": {"type": "diffraction", **relief, **ALUMINIUM}},
        "floor": floor(half_width_cm=20, reflectance=DARK_FLOOR),
        "lamp": lamp((6, 6, 14), radius_cm=0.5, radiance=60),
        "sky": sky(0.5),
    }


def stokes(parts: dict, view: View) -> np.ndarray:
    """Stokes components I, Q, U, V of a picture in linear sRGB, (rows, columns, component, channel)."""
    sensor = view.sensor(SPP)
    # The page's pictures and numbers are made with this sampler, not with the view's `multijitter`.
    sensor["sampler"] = {"type": "independent", "sample_count": SPP}
    integrator = {"type": "stokes", "nested": {"type": "path", "max_depth": MAX_DEPTH}}
    scene = mi.load_dict({"type": "scene", "integrator": integrator, "sensor": sensor, **parts})
    image = np.array(mi.render(scene, spp=SPP, seed=1))
    # The first three channels are the picture itself; three channels for each component follow.
    return image[..., 3:].reshape(*image.shape[:2], 4, 3)


def linear_degree(picture: np.ndarray) -> np.ndarray:
    """√(Q² + U²)/I of the luminance of a `stokes` picture, (rows, columns); NaN in dark pixels."""
    # The product with the weights turns three channels into one.
    i, q, u, _ = np.moveaxis(picture @ LUMINANCE, -1, 0)
    bright = i > DARK * np.median(i)
    return np.where(bright, np.hypot(q, u) / np.where(bright, i, 1), np.nan)


def largest_degree(picture: np.ndarray) -> float:
    """The quantile LARGEST of the degree of linear polarisation of a `stokes` picture."""
    return float(np.nanquantile(linear_degree(picture), LARGEST))


def figures() -> dict:
    """The largest degree of polarisation of each picture, `most`, and the pictures' settings; draws the pictures.

    Raises SetupError if the degrees contradict the page.
    """
    use_variant(VARIANT, fall_back=False)
    folder = images(PART)
    # The mesh is read when scenes are loaded, and deleted after the last picture.
    ply = write_disc(folder / "disc.ply")
    cases = [
        ("compact disc, aluminium, scalar", disc(TRACKS, ply), DISC_VIEW),
        *(
            (f"grooved disc, aluminium, {theory}", disc({**GROOVES, "theory": theory}, ply), DISC_VIEW)
            for theory in THEORIES
        ),
        *(
            (f"blazed sphere, aluminium, {theory}", sphere({**ALUMINIUM, "theory": theory}), SPHERE_VIEW)
            for theory in THEORIES
        ),
        ("blazed sphere, glass of 1.5, scalar", sphere(GLASS), SPHERE_VIEW),
    ]
    pictures = [(name, stokes(parts, view)) for name, parts, view in cases]
    ply.unlink()
    rows = [{"name": name, "most": largest_degree(picture)} for name, picture in pictures]
    most = {row["name"]: row["most"] for row in rows}
    for surface in ("grooved disc, aluminium", "blazed sphere, aluminium"):
        scalar, rigorous = (most[f"{surface}, {theory}"] for theory in THEORIES)
        insist(PART, rigorous > MORE * scalar, f"orders of the {surface} polarise more than its interface")
    glass, metal = most["blazed sphere, glass of 1.5, scalar"], most["blazed sphere, aluminium, scalar"]
    insist(PART, glass > MORE * metal, "glass polarises more than aluminium")
    draw(folder / "degree.jpg", pictures)
    return {"rows": rows, "size": list(SIZE), "spp": SPP, "variant": VARIANT}


def draw(path, pictures: list) -> None:
    """Draws pairs (name, picture), and below each picture its degree of linear polarisation on a scale of its own.

    The figure has an upper and a lower half, each with half of the pictures, whose number is even.
    """
    columns = len(pictures) // 2
    figure, axes = plt.subplots(4, columns, figsize=(11, 10.6), layout="constrained")
    # The axes of each picture and of its degree: (half, picture or degree, column) becomes (picture, 2).
    pairs = axes.reshape(2, 2, columns).transpose(0, 2, 1).reshape(-1, 2)
    for (above, below), (name, picture) in zip(pairs, pictures):
        above.imshow(tone_mapped(picture[:, :, 0], exposure_stops=0.0))
        above.set_title(name)
        # The scale ends at the next tenth above the largest degree.
        top = np.ceil(10 * largest_degree(picture)) / 10
        drawn = below.imshow(linear_degree(picture), vmin=0, vmax=top, cmap="magma")
        figure.colorbar(drawn, ax=below, orientation="horizontal", label="degree of linear polarisation", shrink=0.8)
        above.set_axis_off()
        below.set_axis_off()
    figure.savefig(path, dpi=90)
    plt.close(figure)
