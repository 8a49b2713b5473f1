"""The page `peers`: one coherent patch by our sums and by WaveOpticsBrdf of Yan et al. 2018, and a judge between them.

It is made only where the environment's `PEER` names that program, which docs/peers.md says how to build.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import mitsuba as mi
import numpy as np

from ..environment import SetupError
from ..tool import TOOL
from .page import images
from .peer_plots import draw_maps
from .peer_program import core_seconds, peer_program, run_peer
from .peer_reliefs import Relief, facets, flat, scans, smooth, steep
from .peer_sums import ALL, Approximations, Patch, approximate_sum, direct_sum, hemisphere
from .speed_error import processor

PAGE = "peers"
# Pixels across a map of the hemisphere, and directions of it that the judge is asked.
SIZE, JUDGED = 64, 192
BASE = Patch(window_um=2.0, theta_i_deg=0.0, phi_i_deg=40.0, wavelength_um=0.55)
# A scan of 6.5 µm has room for this window: three deviations either side.
SCAN_BASE = replace(BASE, window_um=1.0)
# Reliefs of which everything is asked.
SWEPT = ("smooth", "steep", "xenopeltis-scan")
PIXELS_UM = (0.5, 0.25, 0.125)
ALONE = {
    "half_floats": "heights in half floats",
    "window_cut": "the window ends at three deviations",
    "gabor_texels": "Gaussian pixels with a linear phase",
    "curved_texels": "(not theirs) Gaussian pixels with a quadratic phase",
}
# What the approximations leave unexplained of the other program's answers may be no more: it answers in half floats,
# which round by up to 4.9e-4, and computes in single precision.
UNEXPLAINED = 1e-3


@dataclass(frozen=True)
class Case:
    """A relief and what is asked of it, the maps of both programs and the judge's answers at a sample of directions."""

    relief: Relief
    patch: Patch
    wo: np.ndarray
    sample: np.ndarray
    peer: np.ndarray
    exact: np.ndarray
    judge: np.ndarray
    figures: dict


def figures() -> dict | None:
    """Runs both programs; `None`, with one line printed, where there is no `PEER`."""
    program = peer_program()
    if program is None:
        print(f"{PAGE}: left as it is, since PEER names no program (docs/{PAGE}.md says which)", flush=True)
        return None
    if mi.variant() is None:
        mi.set_variant("scalar_rgb")
    folder = images(PAGE)
    bases = [(smooth(), BASE), (steep(), BASE), (facets(), BASE), *((scan, SCAN_BASE) for scan in scans())]
    cases = {relief.name: [compare(program, relief, patch) for patch in asked(relief, base)] for relief, base in bases}
    for name, (base, *_) in cases.items():
        draw_maps(base.peer, base.exact, SIZE, folder / f"{name}.png")
    pixels = [compare(program, make(pixel_um), BASE).figures for make in (smooth, steep) for pixel_um in PIXELS_UM]
    plane = compare(program, flat(), BASE)
    made = {
        "cpu": processor(),
        "size": SIZE,
        "judged": JUDGED,
        "reliefs": [relief_figures(relief) for relief, _ in bases],
        "cases": {name: [case.figures for case in each] for name, each in cases.items()},
        "pixels": pixels,
        "plane": plane.figures,
        "ladders": {name: ladder(each[0]) for name, each in cases.items()},
        "controls": controls(program, cases["smooth"][0]),
        "has_scans": len(bases) > 3,
        "unexplained_limit": UNEXPLAINED,
    }
    made["summary"] = summary(made)
    return made


def varied(base: Patch) -> list[Patch]:
    """The base, and with one thing changed at a time: the window, the incidence, the wavelength."""
    wider = 1.5 if base is BASE else 1 / 1.5
    return [
        base,
        replace(base, window_um=base.window_um / 2),
        replace(base, window_um=base.window_um * wider),
        replace(base, theta_i_deg=30.0),
        replace(base, theta_i_deg=60.0),
        replace(base, wavelength_um=0.45),
        replace(base, wavelength_um=0.65),
    ]


def asked(relief: Relief, base: Patch) -> list[Patch]:
    """Everything of the first of each kind of relief, and of the others two incidences."""
    patches = varied(base)
    return patches if relief.name in SWEPT else [patches[0], patches[3]]


def relief_figures(relief: Relief) -> dict:
    """What the relief is, with lengths in µm."""
    ny, nx = relief.heights.shape
    return {
        "name": relief.name,
        "words": relief.words,
        "pixels": [nx, ny],
        "pixel_um": relief.pixel_um,
        "rms_slope": relief.rms_slope,
    }


def compare(program: Path, relief: Relief, patch: Patch) -> Case:
    """Asks both programs for the whole map, and the judge at the sample: the sum over the finest heights."""
    wo, _ = hemisphere(SIZE)
    sample = np.random.default_rng(1).choice(len(wo), JUDGED, replace=False)
    theirs, seconds = run_peer(program, relief.heights, relief.pixel_um, patch, SIZE)
    exact, table, ours_us = ask_sunbeam(relief, patch, wo)
    judge = direct_sum(relief.finest, relief.finest_pixel_um, patch, wo[sample])
    found = {
        "relief": relief.name,
        "pixel_um": relief.pixel_um,
        **asdict(patch),
        "apart": difference(theirs, exact),
        "total": float(theirs.sum() / exact.sum() - 1),
        "correlation": float(np.corrcoef(theirs, exact)[0, 1]),
        "peer_off": difference(theirs[sample], judge),
        "exact_off": difference(exact[sample], judge),
        "table_off": difference(table[sample], judge),
        "us": {"peer": 1e6 * seconds / len(wo), **ours_us},
    }
    print(f"{relief.name}, {patch}: {found['apart']:.2g} apart", flush=True)
    return Case(relief, patch, wo, sample, theirs, exact, judge, found)


def difference(found: np.ndarray, true: np.ndarray) -> float:
    """The sum of the absolute differences over the sum of what is true."""
    return float(np.abs(found - true).sum() / true.sum())


def ask_sunbeam(relief: Relief, patch: Patch, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict]:
    """`f_r` in 1/sr by the exact sum and by the tables, and what an answer takes of one core in µs."""
    # Our window stands over the tile's first pixel.
    heights = np.roll(relief.heights, [-(side // 2) for side in relief.heights.shape], axis=(0, 1))
    with TemporaryDirectory() as folder:
        file = Path(folder) / "relief.npy"
        np.save(file, heights)
        surface = ["--height-field", file, "--pixel-size", relief.pixel_um, "--level", "none", "--tiling", "periodic"]
        surface += ["--model", "patch", "--obliquity", "unit", "--conserve-energy", "false"]
        surface += ["--coherence-length", 4 * patch.window_um]
        exact, exact_s = answers(["eval", *surface, "--method", "exact"], patch, wo)
        table, _ = answers(["eval", *surface, "--method", "table"], patch, wo)
        return exact, table, {"exact": 1e6 * exact_s / len(wo), "table": table_us(surface, patch, folder)}


def answers(words: list, patch: Patch, wo: np.ndarray) -> tuple[np.ndarray, float]:
    """What `sunbeam eval` answers, and the seconds of one core over those that one answer takes with its tables."""
    nm = 1e3 * patch.wavelength_um
    lines = [json.dumps({"wi": list(patch.wi), "wo": list(each), "wavelength": nm}) for each in wo]
    command = [str(TOOL), *map(str, words)]
    printed: list[str] = []
    seconds = core_seconds(command, "\n".join(lines) + "\n", printed) - core_seconds(command, lines[0] + "\n")
    return np.array([json.loads(line)["f"] for line in printed[0].splitlines()]), seconds


def table_us(surface: list, patch: Patch, folder: str) -> float:
    """What the tables take for a direction and a wavelength in µs, by a map of 81 wavelengths without its building."""
    words = [str(TOOL), "brdf-map", *map(str, surface), "-o", f"{folder}/map.exr", "--method", "table"]
    words += ["--theta-i", str(patch.theta_i_deg), "--phi-i", str(patch.phi_i_deg)]
    printed: list[str] = []
    core_seconds([*words, "--size", str(SIZE)], output=printed)
    report = json.loads(printed[0])
    return 1e6 * report["seconds"] / (report["wavelengths"] * len(hemisphere(SIZE)[0]))


def ladder(case: Case) -> dict:
    """How far off the judge the sum over the pixels is with each approximation alone and with all of theirs.

    `ours_in_half_floats` is our exact sum of such heights; `unexplained` is what all of theirs leave of the difference
    to the program itself.
    """
    relief, patch, wo = case.relief, case.patch, case.wo[case.sample]

    def off(chosen: Approximations) -> float:
        return difference(approximate_sum(relief.heights, relief.pixel_um, patch, wo, chosen), case.judge)

    rounded = (relief.heights / relief.pixel_um).astype(np.float16).astype(np.float64) * relief.pixel_um
    in_half_floats, _, _ = ask_sunbeam(
        replace(relief, finest=rounded, finest_pixel_um=relief.pixel_um, step=1), patch, wo
    )
    all_of_them = approximate_sum(relief.heights, relief.pixel_um, patch, wo, ALL)
    found = {
        "none": off(Approximations()),
        **{name: off(Approximations(**{name: True})) for name in ALONE},
        "all": difference(all_of_them, case.judge),
        "peer": case.figures["peer_off"],
        "ours": case.figures["exact_off"],
        "ours_in_half_floats": difference(in_half_floats, case.judge),
        "unexplained": difference(case.peer[case.sample], all_of_them),
    }
    if found["unexplained"] > UNEXPLAINED:
        raise SetupError(f"{relief.name}: {found['unexplained']:.2g} of the other program's answers is not explained")
    return found


def controls(program: Path, case: Case) -> dict:
    """How far apart the maps are with an error put into one: each must be told from agreement."""
    relief, patch = case.relief, case.patch

    def wrong(heights: np.ndarray) -> float:
        theirs, _ = run_peer(program, heights, relief.pixel_um, patch, SIZE)
        return difference(theirs, case.exact)

    found = {
        "axes exchanged": wrong(relief.heights.T),
        "heights turned over": wrong(-relief.heights),
        "one pixel aside": wrong(np.roll(relief.heights, 1, axis=1)),
        "window 2 % wider": difference(
            run_peer(program, relief.heights, relief.pixel_um, replace(patch, window_um=1.02 * patch.window_um), SIZE)[
                0
            ],
            case.exact,
        ),
    }
    return found


def summary(made: dict) -> dict:
    return {}
