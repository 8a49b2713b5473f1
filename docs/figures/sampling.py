"""Importance sampling: how evenly it weighs, what it brings to a picture in equal time, and what the BSDF costs."""

from __future__ import annotations

import json
import time

import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import REPOSITORY, use_variant
from mitsuba_scenes.light import Light
from mitsuba_scenes.scene import View, snake_scene
from mitsuba_scenes.skin import KERATIN, preset_skin
from mitsuba_scenes.snake import snake_files
from mitsuba_scenes.tool import sunbeam

from . import headline
from .benchmark_scenes import REFERENCE
from .cost import REFERENCES, VARIANTS, measure, ratios
from .hemisphere_sampled import KINDS, hemisphere_sampled
from .page import images
from .speed_error import processor
from .time_to_error import ERROR, FLOOR, relative_error, seconds_to_error
from .time_to_error_plot import draw

PAGE = "sampling"
# What another build of the plugin took: `benches/mitsuba_cost.py --plugin PATH --scenes sphere snake`.
EARLIER = REPOSITORY / "docs" / "data" / "sampling-earlier.json"

# Surfaces and lights of the pictures.
SURFACES = ("blazed", "elaphe", "xenopeltis")
LIGHTS = {"sky": Light(sky=1.0), "sun and sky": Light()}
VIEW = View(48, 32)
# Samples a pixel of what is judged, and repetitions.
SPP, REPETITIONS = 64, 5
# Samples a pixel of the reference; the sun's few bright samples take more of them to settle.
REFERENCE_SPP = {"sky": 4096, "sun and sky": 65_536}


def figures(
    *words: str, spp: int = SPP, reference_spp: dict[str, int] = REFERENCE_SPP, repetitions: int = REPETITIONS
) -> dict:
    """Asks the sampler for its weights, renders, and times."""
    report = json.loads(sunbeam("bench", "--what", "sampler", *words))
    costs = headline.figures()
    draw(costs["cells"], costs["aim"], round(costs["nominal_pixels"] ** 0.5), images(PAGE) / "time-to-error.svg")
    use_variant("llvm_ad_spectral", fall_back=False)
    pictures = [
        picture(surface, light, spp, reference_spp[light], repetitions) for surface in SURFACES for light in LIGHTS
    ]
    return {
        "cpu": processor(),
        "samples": report["samples"],
        "weights": [
            {"name": s["name"], "mb": s["bytes"] / 1e6, "angles": by_angle(s["rows"])} for s in report["surfaces"]
        ],
        "rows": report["surfaces"],
        "spp": spp,
        "reference_spp": reference_spp,
        "repetitions": repetitions,
        "size": [VIEW.width, VIEW.height],
        "error": ERROR,
        "floor": FLOOR,
        "pictures": pictures,
        "headline": costs,
        "earlier": beside(**json.loads(EARLIER.read_text())),
        "costs": [cost(variant, repetitions) for variant in VARIANTS],
    }


def beside(cells: list[dict], beside: list[dict], **_: object) -> list[dict]:
    """Each diffraction of each cell that another build of the plugin was measured in, beside the one that followed it.

    Both were measured on one machine on the same morning, so they are kept together and not measured anew.
    """
    of_now = {(cell["scene"], cell["variant"], way["name"]): way for cell in beside for way in cell["ways"]}
    return [
        {"scene": cell["scene"], "variant": cell["variant"], "name": way["name"], "before": way, "now": of_now[key]}
        for cell in cells
        for way in cell["ways"]
        if way["name"] != REFERENCE and (key := (cell["scene"], cell["variant"], way["name"])) in of_now
    ]


def by_angle(rows: list[dict]) -> list[dict]:
    """The worst of all azimuths and wavelengths at each angle of incidence."""
    found = []
    for theta in sorted({row["theta_deg"] for row in rows}):
        here = [row for row in rows if row["theta_deg"] == theta]
        worst = {key: max(row[key] for row in here) for key in ("relative_std", "p999_to_mean", "max_to_mean", "lost")}
        found.append({"theta_deg": theta, **worst})
    return found


def picture(surface: str, light: str, spp: int, reference_spp: int, repetitions: int) -> dict:
    """Errors and times of one picture with each way to sample."""
    files = snake_files()
    made = mi.load_dict({"type": "diffraction", "eta": KERATIN, "obliquity": "stam", **preset_skin(surface)})

    def scene(bsdf: mi.BSDF) -> mi.Scene:
        parts = snake_scene(bsdf, files, LIGHTS[light], VIEW, spp, max_depth=2)
        if light == "sky":
            del parts["sun"]
        return mi.load_dict(parts)

    scenes = {"importance": scene(made)} | {kind: scene(hemisphere_sampled(made, kind)) for kind in KINDS}
    truth = np.mean([render(scenes["importance"], spp, 1000 + i)[0] for i in range(reference_spp // spp)], axis=0)
    judged = truth.sum(axis=2) > 0
    ways = []
    for name, each in scenes.items():
        for seed in (0, 1):
            # Compiles the kernels, and once more when the seed first changes.
            render(each, spp, seed)
        runs = [render(each, spp, 2 + i) for i in range(repetitions)]
        errors = [relative_error(image, truth, judged) for image, _ in runs]
        error, seconds = float(np.mean(errors)), float(np.median([seconds for _, seconds in runs]))
        mean = np.mean([image for image, _ in runs], axis=0)
        ways.append(
            {
                "name": name,
                "error": error,
                "seconds": seconds,
                "seconds_to_error": seconds_to_error(seconds, error),
                # Noise of the mean of all runs alone, were the two the same: a check of the wrapper, not of the noise.
                "mean_ratio": float(mean[judged].mean() / truth[judged].mean()),
            }
        )
    return {"surface": surface, "light": light, "ways": ways}


def render(scene: mi.Scene, spp: int, seed: int) -> tuple[np.ndarray, float]:
    """Linear sRGB, and seconds."""
    start = time.perf_counter()
    image = np.array(mi.render(scene, spp=spp, seed=seed), dtype=np.float64)[:, :, :3]
    return image, time.perf_counter() - start


def cost(variant: str, repetitions: int) -> dict:
    """Times of the BSDFs beside Mitsuba's own."""
    use_variant(variant, fall_back=False)
    result = measure(repetitions, View(128, 128), spp=16, max_depth=6)
    against = {reference: ratios(result, reference) for reference in REFERENCES}
    rows = [
        {
            "name": name,
            "tables_s": times["tables_s"],
            "first_render_s": times["first_render_s"],
            "seconds": float(np.median(times["renders_s"])),
            "ratios": {reference: against[reference][name] for reference in REFERENCES},
        }
        for name, times in result.items()
    ]
    return {"variant": variant, "rows": rows}
