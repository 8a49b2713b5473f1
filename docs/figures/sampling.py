"""Part `sampling` of the documentation (page.py): the plugin's sampler against simple ones, and the BSDF's cost.

The *weight* of a sample is the BSDF times the cosine over the density. Errors of pictures are relative to a reference
picture with many more samples. The reference is made by the plugin's own sampler, since no other converges within
hours. A bias of this sampler would cancel in the sampler's own error; tests of the density exclude a bias.
"""

from __future__ import annotations

import json

import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant
from mitsuba_scenes.light import Light
from mitsuba_scenes.scene import View, snake_scene
from mitsuba_scenes.skin import KERATIN, preset_skin
from mitsuba_scenes.snake import snake_files
from mitsuba_scenes.tool import sunbeam

from . import headline
from .cost import REFERENCES, VARIANTS, measure, ratios
from .hemisphere_sampled import KINDS, hemisphere_sampled
from .page import images
from .speed_error import processor
from .time_to_error import ERROR, FLOOR, relative_error, render, seconds_to_error
from .time_to_error_plot import draw

PART = "sampling"
# Presets of the pictures.
SURFACES = ("blazed", "elaphe", "xenopeltis")
# Lights of the pictures. `Light` always has a sun, which `picture` removes for "sky".
LIGHTS = {"sky": Light(sky_radiance=1.0), "sun and sky": Light()}
# Camera of the pictures, width and height in pixels; small for the sake of the reference's many samples.
VIEW = View(48, 32)
# Samples per pixel of the pictures under test.
SPP = 64
# Number of pictures under test, and of timed renders. More make errors and times more certain.
REPETITIONS = 5
# Samples per pixel of the reference, by light. With the sun most of the light is in few samples, so more are needed.
REFERENCE_SPP = {"sky": 4096, "sun and sky": 65_536}


def figures(
    *arguments: str, spp: int = SPP, reference_spp: dict[str, int] = REFERENCE_SPP, repetitions: int = REPETITIONS
) -> dict:
    """All numbers of the part; draws the times to an error.

    `arguments` are further ones of `sunbeam bench`. `spp`, `reference_spp` and `repetitions` replace the constants of
    these names, for short runs. The numbers are

    - `rows`: the surfaces in the report of `sunbeam bench`, with statistics of the weight by angle and wavelength;
    - `weights`: for each surface the worst of these statistics by angle of incidence (`by_angle`), and the tables' MB;
    - `pictures`: a row of `picture` for each surface in each light;
    - `headline`: the cost in Mitsuba by headline.py, such as the time to an error;
    - `costs`: the render times of `cost` in each of VARIANTS.
    """
    report = json.loads(sunbeam("bench", "--what", "sampler", *arguments))
    in_mitsuba = headline.figures()
    # The plot has the times to the relative error `aim` in each cell, a scene in a variant of Mitsuba. Times are scaled
    # to square pictures of `nominal_pixels` pixels, with this side.
    side = round(in_mitsuba["nominal_pixels"] ** 0.5)
    draw(in_mitsuba["cells"], in_mitsuba["aim"], side, images(PART) / "time-to-error.svg")
    use_variant("llvm_ad_spectral", fall_back=False)
    pictures = [
        picture(surface, light, spp, reference_spp[light], repetitions) for surface in SURFACES for light in LIGHTS
    ]
    return {
        "cpu": processor(),
        "samples": report["samples"],
        "weights": [
            {"name": surface["name"], "mb": surface["bytes"] / 1e6, "angles": by_angle(surface["rows"])}
            for surface in report["surfaces"]
        ],
        "rows": report["surfaces"],
        "spp": spp,
        "reference_spp": reference_spp,
        "repetitions": repetitions,
        "size": [VIEW.width, VIEW.height],
        "error": ERROR,
        "floor": FLOOR,
        "pictures": pictures,
        "headline": in_mitsuba,
        "costs": [cost(variant, repetitions) for variant in VARIANTS],
    }


def by_angle(rows: list[dict]) -> list[dict]:
    """A row for each angle of incidence, with the largest of each statistic over azimuths and wavelengths.

    The statistics of the weight are its standard deviation, 99.9th percentile and maximum, each over its mean. `lost`
    is the fraction of the samples without a direction above the horizon.
    """
    found = []
    for theta in sorted({row["theta_deg"] for row in rows}):
        here = [row for row in rows if row["theta_deg"] == theta]
        worst = {key: max(row[key] for row in here) for key in ("relative_std", "p999_to_mean", "max_to_mean", "lost")}
        found.append({"theta_deg": theta, **worst})
    return found


def picture(surface: str, light: str, spp: int, reference_spp: int, repetitions: int) -> dict:
    """Errors and times of pictures of one surface in one light: a row of `ways` for each sampler.

    `light` is a key of LIGHTS. The samplers are the plugin's own, `importance`, and KINDS of hemisphere_sampled.py.
    Errors are relative, over the pixels where the reference is not black.
    """
    files = snake_files()
    bsdf = mi.load_dict({"type": "diffraction", "eta": KERATIN, "obliquity": "stam", **preset_skin(surface)})

    def scene(material: mi.BSDF) -> mi.Scene:
        parts = snake_scene(material, files, LIGHTS[light], VIEW, spp, max_depth=2)
        if light == "sky":
            del parts["sun"]
        return mi.load_dict(parts)

    scenes = {"importance": scene(bsdf)} | {kind: scene(hemisphere_sampled(bsdf, kind)) for kind in KINDS}
    # The reference is a mean of pictures with `spp` samples. Seeds from 1000 on keep the reference independent of the
    # pictures under test.
    truth = np.mean([render(scenes["importance"], 1000 + i).image for i in range(reference_spp // spp)], axis=0)
    # Pixels that are not black.
    mask = truth.sum(axis=2) > 0
    ways = []
    for name, sampled in scenes.items():
        for seed in (0, 1):
            # Untimed renders: Dr.Jit compiles kernels for the first one, and again when the seed first changes.
            render(sampled, seed)
        renders = [render(sampled, 2 + i) for i in range(repetitions)]
        error = float(np.mean([relative_error(each.image, truth, mask) for each in renders]))
        seconds = float(np.median([each.seconds for each in renders]))
        mean = np.mean([each.image for each in renders], axis=0)
        ways.append(
            {
                "name": name,
                "error": error,
                "seconds": seconds,
                "seconds_to_error": seconds_to_error(seconds, error),
                # 1 within noise, which checks the wrappers and the sampler's density.
                "mean_ratio": float(mean[mask].mean() / truth[mask].mean()),
            }
        )
    return {"surface": surface, "light": light, "ways": ways}


def cost(variant: str, repetitions: int) -> dict:
    """Render times of the plugin's and of Mitsuba's BSDFs in a variant, and their ratios to each of REFERENCES."""
    use_variant(variant, fall_back=False)
    # Larger pictures hide the fixed cost of a render better, and take longer. Paths of up to six segments evaluate the
    # BSDF more often than those of `picture`, which have two.
    result = measure(repetitions, View(128, 128), spp=16, max_depth=6)
    relative = {reference: ratios(result, reference) for reference in REFERENCES}
    rows = [
        {
            "name": name,
            "tables_s": times["tables_s"],
            "first_render_s": times["first_render_s"],
            "seconds": float(np.median(times["renders_s"])),
            "ratios": {reference: relative[reference][name] for reference in REFERENCES},
        }
        for name, times in result.items()
    ]
    return {"variant": variant, "rows": rows}
