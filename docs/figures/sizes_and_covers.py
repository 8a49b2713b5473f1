"""Part `sizes-and-covers` of the documentation (page.py): RGB against spectral pictures, and the cost of a BSDF call.

*Sizes* are the plugin's parameters `scale` and `depth`, which shrink a relief along the surface and in height. A
*cover* is a clear layer of a dielectric over the relief. The *kinds* of surface are a bare relief, one with textures of
sizes, one under a cover, and one with both. The pictures show the ball of benchmark_scenes.py from so near that it
fills them. ΔE76 is the distance of two colours in CIELAB.
"""

from __future__ import annotations

import gc
import time
from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant
from mitsuba_scenes.scene import View, raw_texture
from mitsuba_scenes.skin import preset_skin

from .benchmark_scenes import ALUMINIUM, BenchmarkScene, scenes, sphere_parts
from .bsdf_calls import FEWEST, RELIEFS, VARIANTS, Inputs, reduced_result
from .rgb_against_spectral import MATERIALS, RGB, SPECTRAL, difference, halves

# Media by name, as parameters of the plugin.
MEDIA = {**MATERIALS, "aluminium": ALUMINIUM}
# Refractive index of the cover, that of lacquer.
COVER_ETA = 1.5
# Lower limit of the texture of `scale`; the upper limit is 1. Texels have the values at their centres, so the extreme
# values are up to 3 % of the range inside the limits.
SCALE_MIN = 0.55
# Lower limit of the texture of `depth`; see SCALE_MIN.
DEPTH_MIN = 0.5
# Number of times that `scale` grows from its smallest to its largest value around the ball.
RAMPS = 4
# Rows and columns of the textures.
TEXELS = (32, 64)
# Width and height of the pictures in pixels. A pixel covers about as much of the ball as in rgb_against_spectral.py.
SIZE = (12, 8)
# Horizontal field of view at which the ball is as wide as the picture.
FOV_DEG = 18.0
# Samples per pixel of one render, a square number, as its sampler requires. With fewer the fixed cost of a render
# dominates.
SPP = 16384
# Default seconds of each of the two pictures of a row, without building tables and compiling.
BUDGET_S = 20.0
# Aims of the mean ΔE76 between RGB and spectral pictures, and of its 95th percentile, with which the page compares the
# measured values. A ΔE76 of about 2 is just noticeable.
AIMS = (1.0, 2.5)
# Measured methods of `mi.BSDF`.
CALLS = ("eval_pdf", "sample")
# Number of elements of a timed wavefront (`cpu_ns`), which takes some tenths of a second of CPU.
WAVEFRONT = 1 << 19
# Number of timed wavefronts of each call, the fastest of which counts. More come closer to the time of an idle machine.
REPEATS = 30


def kinds(mirror: bool) -> dict[str, dict]:
    """Parameters of the compared kinds of surface by name, made in the selected variant. `bare` has none.

    `mirror` says whether covers have their mirror reflection.
    """
    rows, columns = TEXELS
    # Texture coordinates of the texels' centres in [0, 1].
    y, x = (np.mgrid[:rows, :columns] + 0.5) / np.reshape(TEXELS, (2, 1, 1))
    sizes = {
        "scale": raw_texture(SCALE_MIN + (1 - SCALE_MIN) * (RAMPS * x % 1), "bilinear"),
        "depth": raw_texture(DEPTH_MIN + (1 - DEPTH_MIN) * y, "bilinear"),
    }
    cover = {"cover_eta": COVER_ETA, "cover_reflection": mirror}
    return {"bare": {}, "sizes": sizes, "cover": cover, "sizes and cover": {**sizes, **cover}}


def figures(budget_s: float = BUDGET_S, repeats: int = REPEATS) -> dict:
    """All numbers of the part, with the settings: `colours` and `calls` are the results of these functions.

    `budget_s` is the time of each picture in seconds, and `repeats` the number of timed wavefronts of each call.
    """
    return {
        "picture_s": budget_s,
        "size": list(SIZE),
        "aims": list(AIMS),
        "ranges": {"scale": [SCALE_MIN, 1.0], "depth": [DEPTH_MIN, 1.0], "cover_eta": COVER_ETA},
        "ramps": RAMPS,
        "colours": colours(budget_s),
        "repeats": repeats,
        "call_names": list(CALLS),
        "calls": calls(repeats),
    }


def colours(budget_s: float) -> list[dict]:
    """A row for each relief, medium and kind of surface: the numbers of `difference` over the ball's pixels.

    Keys of a row are `relief`, `material` (the medium), `kind`, and those of `difference` (rgb_against_spectral.py).
    Covers have no mirror reflection, whose colourless light would hide differences.
    """
    # The first scene is the ball on a floor.
    ball = replace(scenes()[0], build=near_ball)
    rows = []
    for relief in RELIEFS:
        for material, optics in MEDIA.items():
            for kind in kinds(mirror=False):
                scene = ball.with_materials({relief: preset_skin(relief)}, optics)
                found = ball_difference(scene, relief, kind, budget_s)
                row = {"relief": relief, "material": material, "kind": kind, **found}
                print({key: row[key] for key in ("relief", "material", "kind", "delta_e_mean")}, flush=True)
                rows.append(row)
    return rows


def near_ball(bsdf: mi.BSDF, view: View, spp: int) -> dict:
    """The scene of `sphere_parts` from nearer, with the sampler of `View`, whose wavelengths are stratified.

    The reconstruction filter is a box of one pixel, so that pixels on the ball get no light from beside it.
    """
    near = replace(view, fov_deg=FOV_DEG)
    sensor = near.sensor(spp)
    sensor["film"]["rfilter"] = {"type": "box"}
    return {**sphere_parts(bsdf, near, spp), "sensor": sensor}


def ball_difference(scene: BenchmarkScene, relief: str, kind: str, budget_s: float) -> dict:
    """The numbers of `difference` over the ball's pixels for one kind of surface; `budget_s` is as in `halves`."""
    pictures = {}
    for variant in (RGB, SPECTRAL):
        use_variant(variant, fall_back=False)
        bsdf = mi.load_dict({**scene.diffraction(scene.surfaces[relief]), **kinds(mirror=False)[kind]})
        loaded = scene.load(bsdf, SIZE, SPP)
        # Means of two independent halves of the renders, (2, rows, columns, 3); of these, the ball's pixels.
        pictures[variant] = halves(loaded, budget_s)[:, sees_ball(loaded)]
        # Dr.Jit compiles every living BSDF into the kernels of the next picture.
        del bsdf, loaded
        gc.collect()
    return difference(pictures[RGB], pictures[SPECTRAL])


def sees_ball(scene: mi.Scene) -> np.ndarray:
    """Mask of the pixels whose corners all see the ball of radius 1 at (0, 0, 1), (rows, columns)."""
    columns, rows = SIZE
    # The pixels' corners, in units of the film.
    y, x = np.mgrid[: rows + 1, : columns + 1] / np.reshape((rows, columns), (2, 1, 1))
    # Arguments of `sample_ray`: time, sample of the wavelength, positions on the film, sample of the aperture.
    rays = scene.sensors()[0].sample_ray(0, 0.5, mi.Point2f(x.ravel(), y.ravel()), 0.5)[0]
    hit = scene.ray_intersect(rays)
    distance = np.linalg.norm(np.array(hit.p).T - [0, 0, 1], axis=1)
    corners = (np.array(hit.is_valid()) & (np.abs(distance - 1) < 1e-3)).reshape(rows + 1, columns + 1)
    return corners[:-1, :-1] & corners[:-1, 1:] & corners[1:, :-1] & corners[1:, 1:]


def calls(repeats: int) -> list[dict]:
    """Rows of {variant, relief, kind, ns, ratio} in aluminium.

    `ns` has nanoseconds of CPU per element by call (`cpu_ns`), and `ratio` their ratios to those of the bare relief.
    """
    rows = []
    for variant in VARIANTS:
        use_variant(variant, fall_back=False)
        for relief in RELIEFS:
            base = {"type": "diffraction", **preset_skin(relief), **ALUMINIUM}
            bsdfs = {kind: mi.load_dict({**base, **parameters}) for kind, parameters in kinds(mirror=True).items()}
            times = {call: cpu_ns(bsdfs, call, repeats) for call in CALLS}
            for kind in bsdfs:
                ns = {call: times[call][kind] for call in CALLS}
                ratio = {call: ns[call] / times[call]["bare"] for call in CALLS}
                rows.append({"variant": variant, "relief": relief, "kind": kind, "ns": ns, "ratio": ratio})
    return rows


def cpu_ns(bsdfs: dict[str, mi.BSDF], call: str, repeats: int) -> dict[str, float]:
    """Nanoseconds of CPU per element of one call, by the names of the BSDFs, which take turns.

    A wavefront is an array of evaluations that one kernel of Dr.Jit does; an element is one evaluation.

    CPU time excludes most effects of other programs. It includes the tracing of the kernel, which cancels in the
    difference of wavefronts of WAVEFRONT and of FEWEST elements.
    """
    wavefronts = [Inputs(FEWEST), Inputs(WAVEFRONT)]
    seconds: dict[str, list] = {name: [] for name in bsdfs}
    # The first turn compiles kernels.
    for turn in range(repeats + 1):
        for name, bsdf in bsdfs.items():
            taken = [cpu_s(bsdf, call, inputs) for inputs in wavefronts]
            if turn > 0:
                seconds[name].append(taken)
    # The smallest seconds by BSDF, for the small and for the large wavefront.
    few, many = np.min([seconds[name] for name in bsdfs], axis=1).T
    return dict(zip(bsdfs, ((many - few) / (WAVEFRONT - FEWEST) * 1e9).tolist()))


def cpu_s(bsdf: mi.BSDF, call: str, inputs: Inputs) -> float:
    """Seconds of CPU of all threads that one call on a wavefront takes."""
    dr.sync_thread()
    start = time.process_time()
    # `reduced_result` calls the BSDF and returns arrays that are not evaluated yet.
    dr.eval(reduced_result(bsdf, call, inputs))
    dr.sync_thread()
    return time.process_time() - start
