"""The plugin's cost in Mitsuba: times to an error, of calls and of the first picture, and RGB against spectral colours.

A *cell* is a scene in a variant of Mitsuba, in which materials are compared: by the time until a picture's relative rms
error is `aim` (time_to_error.py). The documentation's part `sampling` and `benches/mitsuba_cost.py` use the
measurements; `cell_lines` and `lines` give them as text.
"""

from __future__ import annotations

import time

from mitsuba_scenes.environment import SetupError

from . import bsdf_calls, first_render, rgb_against_spectral, time_to_error
from .benchmark_scenes import scanned_surface, scenes
from .speed_error import processor


def figures(cell_s: float = time_to_error.BUDGET_S, picture_s: float = rgb_against_spectral.BUDGET_S) -> dict:
    """All measurements with their settings, and under `took_s` the seconds that each took.

    - `cells`, `calls`, `first_renders`, `colours`: the results of `cells` here, and of `figures` in bsdf_calls.py,
      first_render.py and rgb_against_spectral.py.
    - `cell_s`: the time of each cell. Cells with slow renders take longer, since each has a minimum number of rounds.
    - `picture_s`: the time of each of the two converged pictures (RGB and spectral) of `colours`. Both times are in
      seconds and leave out compiling.
    - `call_names`, `turns`: the measured calls, and how often each is timed.
    - `first_size`: the size of the first pictures.
    - `scanned`: a caption of the scan, or of the preset that replaces it.
    - `grey`: the mean luminance at which colours are compared.
    """
    _, scanned_caption = scanned_surface()
    made = {
        **cell_settings(cell_s),
        "picture_s": picture_s,
        "call_names": bsdf_calls.CALLS,
        "turns": bsdf_calls.TURNS,
        "first_size": first_render.SIZE,
        "scanned": scanned_caption,
        "grey": rgb_against_spectral.GREY,
        "took_s": {},
    }
    parts = {
        "cells": lambda: cells(cell_s),
        "calls": bsdf_calls.figures,
        "first_renders": first_render.figures,
        "colours": lambda: rgb_against_spectral.figures(picture_s),
    }
    for name, part in parts.items():
        start = time.perf_counter()
        made[name] = part()
        made["took_s"][name] = time.perf_counter() - start
        print(f"{name}: {made['took_s'][name]:.0f} s", flush=True)
    return made


def cell_settings(cell_s: float) -> dict:
    """The settings of the cells, and the processor's name `cpu`.

    - `aim`: the relative error until which times are stated.
    - `nominal_pixels`: the number of pixels to which times are scaled.
    - `noise_size`: the size (width, height) of the pictures whose errors are measured.
    """
    return {
        "cpu": processor(),
        "aim": time_to_error.ERROR,
        "nominal_pixels": time_to_error.NOMINAL_PIXELS,
        "noise_size": time_to_error.SIZES[0],
        "cell_s": cell_s,
    }


def cells_with_settings(cell_s: float, names: list[str] | None = None) -> dict:
    """The cells of the named scenes, or of all, with their settings; the input of `cell_lines`."""
    return {**cell_settings(cell_s), "cells": cells(cell_s, names)}


def cells(cell_s: float, names: list[str] | None = None) -> list[dict]:
    """The results of `time_to_error.measure` for the named scenes, or for all, in each variant.

    Raises SetupError for unknown names.
    """
    all_scenes = {scene.name: scene for scene in scenes()}
    if unknown := set(names or ()) - set(all_scenes):
        raise SetupError(f"unknown scene {', '.join(sorted(unknown))}; available: {', '.join(all_scenes)}")
    found = []
    for scene in [all_scenes[name] for name in names or all_scenes]:
        for variant in time_to_error.VARIANTS:
            print(f"{scene.name}, {variant} ...", flush=True)
            found.append(time_to_error.measure(scene, variant, cell_s))
    return found


def cell_lines(made: dict) -> list[str]:
    """The cells as lines of a text table: a line for each row of a cell's `ways`, so for each material.

    Columns:

    - `s`, `/ rough`, `by cpu`: seconds of a picture of `nominal_pixels` pixels, their ratio to those of
      `roughconductor`, and the ratio of CPU seconds;
    - `error`: the relative error of the measured picture of `noise_size`;
    - `s to aim`, `/ rough`: seconds until the error is `aim`, and their ratio to those of `roughconductor`;
    - `rounds`: the number of rounds, in each of which every material is rendered once.

    `made` is the result of `figures` or of `cells_with_settings`.
    """
    # Side of a square picture with this number of pixels.
    side = round(made["nominal_pixels"] ** 0.5)
    found = [f"seconds for {side}x{side} pixels, and until the relative error is down to {made['aim']:.0%}", ""]
    heads = f"{'s':>10}{'/ rough':>9}{'by cpu':>9}{'error':>9}{'s to aim':>11}{'/ rough':>9}{'rounds':>8}"
    found.append(f"{'scene':8}{'variant':18}{'material':16}{heads}")
    for cell in made["cells"]:
        for row in cell["ways"]:
            found.append(
                f"{cell['scene']:8}{cell['variant']:18}{row['name']:16}{row['seconds']:10.3g}"
                f"{row['time_ratio']['median']:9.2f}{row['cpu_ratio']['median']:9.2f}"
                f"{row['error']:9.1%}{row['seconds_to_error']:11.3g}"
                f"{row['error_time_ratio']:9.3g}{cell['rounds']:8}"
            )
    return found


def lines(made: dict) -> list[str]:
    """The result of `figures` as lines of text tables.

    The last table has numbers of `rgb_against_spectral.difference`: mean and 95th percentile of ΔE76, its mean by noise
    alone, and the ratio, RGB over spectral, of sums over pixels and channels.
    """
    found = cell_lines(made)
    found += ["", f"{'ns per call':26}{'material':16}" + "".join(f"{call:>10}" for call in bsdf_calls.CALLS)]
    for row in made["calls"]:
        numbers = "".join(f"{row['ns'][call]:10.4g}" for call in bsdf_calls.CALLS)
        found.append(f"{'':8}{row['variant']:18}{row['name']:16}{numbers}")
    found += ["", f"{'first picture':26}{'material':16}{'load s':>10}{'render s':>10}{'process s':>10}"]
    for row in made["first_renders"]:
        numbers = "".join(f"{row[key]:10.2f}" for key in ("load_s", "render_s", "process_s"))
        found.append(f"{'':8}{row['variant']:18}{row['name']:16}{numbers}")
    heads = f"{'dE76':>10}{'p95':>10}{'noise':>10}{'energy':>10}"
    found += ["", f"{'RGB against spectral':26}{'material':16}{heads}"]
    for row in made["colours"]:
        keys = ("delta_e_mean", "delta_e_p95", "noise_delta_e_mean", "energy_ratio")
        found.append(f"{row['scene']:26}{row['material']:16}" + "".join(f"{row[key]:10.3f}" for key in keys))
    return found
