"""The part `polarisation`: degree of linear polarisation in pictures of gratings."""

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
# Samples a pixel.
SPP = 144
# Largest number of segments of a path.
MAX_DEPTH = 3
# Parameters of an aluminium surface.
ALUMINIUM = {"material": "Al"}
# Parameters of a glass surface.
GLASS = {"eta": 1.5}
# The relief of a compact disc.
TRACKS = {"preset": "cd"}
# Grooves as far apart and deep as a disc's tracks, constant along y, so that both theories apply.
GROOVES = {"preset": "lamellar", "period": 1.6, "height": 0.12}
THEORIES = ("scalar", "rigorous")
# Luminance weights of linear sRGB (IEC 61966-2-1).
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# Smallest luminance relative to the picture's median at which polarisation is above the noise.
DARK = 0.02
SPHERE = View(*SIZE, origin_cm=(0, -6, 2.5), target_cm=(0, 0, 1), fov_deg=32)
DISC = View(*SIZE, origin_cm=(0, -16, 13), target_cm=(0, 0, 0), fov_deg=42)


def sphere(optics: dict) -> dict:
    """A blazed ball under a uniform sky and a lamp."""
    return {
        "ball": {"type": "sphere", "center": [0, 0, 1], "bsdf": {"type": "diffraction", "preset": "blazed", **optics}},
        "floor": floor(20, (0.05, 0.05, 0.05)),
        "lamp": lamp((3, -3, 4), 0.2, 30),
        "sky": sky(0.5),
    }


def disc(relief: dict, ply) -> dict:
    """A horizontal compact disc in aluminium under a uniform sky and a lamp."""
    return {
        "disc": {"type": "ply", "filename": str(ply), "bsdf": {"type": "diffraction", **relief, **ALUMINIUM}},
        "floor": floor(20, (0.05, 0.05, 0.05)),
        "lamp": lamp((6, 6, 14), 0.5, 60),
        "sky": sky(0.5),
    }


def stokes(parts: dict, view: View) -> np.ndarray:
    """Stokes components of a picture, `[row, column, component, channel]`, linear sRGB."""
    sensor = view.sensor(SPP)
    sensor["sampler"] = {"type": "independent", "sample_count": SPP}
    integrator = {"type": "stokes", "nested": {"type": "path", "max_depth": MAX_DEPTH}}
    scene = mi.load_dict({"type": "scene", "integrator": integrator, "sensor": sensor, **parts})
    image = np.array(mi.render(scene, spp=SPP, seed=1))
    return image[..., 3:].reshape(*image.shape[:2], 4, 3)


def linear_degree(picture: np.ndarray) -> np.ndarray:
    """√(Q² + U²)/I of the luminance; NaN in dark pixels."""
    i, q, u, _ = np.moveaxis(picture @ LUMINANCE, -1, 0)
    bright = i > DARK * np.median(i)
    return np.where(bright, np.hypot(q, u) / np.where(bright, i, 1), np.nan)


def figures() -> dict:
    """All numbers of the part; writes its pictures."""
    use_variant(VARIANT, fall_back=False)
    folder = images(PART)
    ply = write_disc(folder / "disc.ply")
    cases = [
        ("compact disc, aluminium, scalar", disc(TRACKS, ply), DISC),
        *(
            (f"grooved disc, aluminium, {theory}", disc({**GROOVES, "theory": theory}, ply), DISC)
            for theory in THEORIES
        ),
        *(
            (f"blazed sphere, aluminium, {theory}", sphere({**ALUMINIUM, "theory": theory}), SPHERE)
            for theory in THEORIES
        ),
        ("blazed sphere, glass of 1.5, scalar", sphere(GLASS), SPHERE),
    ]
    pictures = [(name, stokes(parts, view)) for name, parts, view in cases]
    ply.unlink()
    rows = [{"name": name, "most": float(np.nanquantile(linear_degree(picture), 0.99))} for name, picture in pictures]
    most = {row["name"]: row["most"] for row in rows}
    for surface in ("grooved disc, aluminium", "blazed sphere, aluminium"):
        scalar, rigorous = (most[f"{surface}, {theory}"] for theory in THEORIES)
        insist(PART, rigorous > 1.5 * scalar, f"orders of the {surface} polarise more than its interface")
    glass, metal = most["blazed sphere, glass of 1.5, scalar"], most["blazed sphere, aluminium, scalar"]
    insist(PART, glass > 1.5 * metal, "glass polarises more than aluminium")
    draw(folder / "degree.jpg", pictures)
    return {"rows": rows, "size": list(SIZE), "spp": SPP, "variant": VARIANT}


def draw(path, pictures: list) -> None:
    """Draws each picture, and below it its degree of linear polarisation on a separate scale."""
    columns = len(pictures) // 2
    figure, axes = plt.subplots(4, columns, figsize=(11, 10.6), layout="constrained")
    # Pairs of rows, the picture over its degree.
    pairs = axes.reshape(2, 2, columns).transpose(0, 2, 1).reshape(-1, 2)
    for column, (name, picture) in zip(pairs, pictures):
        column[0].imshow(tone_mapped(picture[:, :, 0], 0.0))
        column[0].set_title(name)
        degree = linear_degree(picture)
        most = np.ceil(10 * np.nanquantile(degree, 0.99)) / 10
        shown = column[1].imshow(degree, vmin=0, vmax=most, cmap="magma")
        figure.colorbar(
            shown, ax=column[1], orientation="horizontal", label="degree of linear polarisation", shrink=0.8
        )
        for ax in column:
            ax.set_axis_off()
    figure.savefig(path, dpi=90)
    plt.close(figure)
