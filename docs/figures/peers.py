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

from mitsuba_scenes.environment import SetupError
from mitsuba_scenes.tool import TOOL

from .page import images, insist
from .peer_plots import draw_maps
from .peer_program import HALF_MAX, core_seconds, peer_program, run_peer
from .peer_reliefs import PIXEL_UM, Relief, facets, flat, scans, smooth, steep
from .peer_sums import ALL, Approximations, Patch, approximate_sum, direct_sum, hemisphere, in_half_floats, within
from .speed_error import processor

PAGE = "peers"
# Pixels across a map of the hemisphere.
SIZE = 48
# The same of a map by which the tables are timed, in the hundredths of a second that the system counts.
TIMED_SIZE = 128
BASE = Patch(window_um=2.0, theta_i_deg=0.0, phi_i_deg=40.0, wavelength_um=0.55)
# A scan of 6.5 µm has room for this window: three deviations either side.
SCAN_BASE = replace(BASE, window_um=1.0)
# Reliefs of which everything is asked.
SWEPT = ("smooth", "steep")
# Edges of pixels beside `PIXEL_UM` at which those are compared again.
OTHER_PIXELS_UM = (0.5, 0.125)
# What the approximations leave unexplained of the other program's answers may be no more: it answers in half floats,
# which round by up to 4.9e-4, and computes in single precision.
UNEXPLAINED = 1e-3


@dataclass(frozen=True)
class Case:
    """A relief, what is asked of it, directions of a map, and `f_r` there in 1/sr by both programs and the judge."""

    relief: Relief
    patch: Patch
    wo: np.ndarray
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
    reliefs = [(smooth(), BASE), (steep(), BASE), (facets(), BASE), *((scan, SCAN_BASE) for scan in scans())]
    bases, rows = [], []
    for relief, base in reliefs:
        cases = [compare(program, relief, patch) for patch in asked(relief, base)]
        bases.append(cases[0])
        rows += [case.figures for case in cases]
        draw_maps(cases[0].peer, cases[0].exact, SIZE, folder / f"{relief.name}.png")
    rows += [compare(program, make(um), BASE).figures for make in (smooth, steep) for um in OTHER_PIXELS_UM]
    made = {
        "cpu": processor(),
        "size": SIZE,
        "reliefs": [relief_figures(relief) for relief, _ in reliefs],
        "has_scans": len(reliefs) > 3,
        # The other pixels of a relief beside its own.
        "rows": sorted(rows, key=lambda row: [relief.name for relief, _ in reliefs].index(row["relief"])),
        "plane": compare(program, flat(), BASE).figures,
        "ladders": {case.relief.name: ladder(case) for case in bases},
        "controls": controls(program, bases[0]),
        "overflow_um": 4 * overflow_um(BASE),
    }
    return {**made, "summary": summary(made)}


def asked(relief: Relief, base: Patch) -> list[Patch]:
    """The base, and with one thing changed at a time: incidence, and of some reliefs window and wavelength too."""
    slanted = replace(base, theta_i_deg=30.0)
    if relief.name not in SWEPT:
        return [base, slanted]
    return [
        base,
        slanted,
        replace(base, theta_i_deg=60.0),
        replace(base, window_um=0.5 * base.window_um),
        replace(base, window_um=1.5 * base.window_um),
        replace(base, wavelength_um=0.45),
        replace(base, wavelength_um=0.65),
    ]


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
    """Asks both programs for a map, and the judge: the sum over the finest heights."""
    wo, _ = hemisphere(SIZE)
    theirs, seconds = run_peer(program, relief.heights, relief.pixel_um, patch, SIZE)
    exact, table, ours_us = ask_sunbeam(relief, patch, wo)
    judge = direct_sum(relief.finest, relief.finest_pixel_um, patch, wo)
    found = {
        "relief": relief.name,
        "pixel_um": relief.pixel_um,
        "pixels": len(relief.heights),
        **asdict(patch),
        "phase_step": phase_step(relief, patch),
        "apart": difference(theirs, exact),
        "total": float(theirs.sum() / exact.sum() - 1),
        "correlation": float(np.corrcoef(theirs, exact)[0, 1]),
        "peer_off": difference(theirs, judge),
        "exact_off": difference(exact, judge),
        "table_off": difference(table, judge),
        "us": {"peer": 1e6 * seconds / len(wo), **ours_us},
    }
    print(f"{relief.name}, {patch}: {found['apart']:.2g} apart", flush=True)
    return Case(relief, patch, wo, theirs, exact, judge, found)


def phase_step(relief: Relief, patch: Patch) -> float:
    """The largest step of the phase between neighbouring pixels, in half turns, for light that leaves along the normal.

    Of the pixels within three deviations of the window. Above 1 the pixels do not tell the phase.
    """
    _, heights = within(3 * patch.window_um, relief.heights, relief.pixel_um)
    steps = max(np.abs(np.diff(heights, axis=axis)).max() for axis in (0, 1))
    return float(2 * (1 + patch.wi[2]) * steps / patch.wavelength_um)


def overflow_um(patch: Patch) -> float:
    """The window s in µm at which a plane's answer in the mirror direction, 4π s² / λ², overflows in half floats."""
    return float(np.sqrt(HALF_MAX / (4 * np.pi)) * patch.wavelength_um)


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
        # The tables, which every command makes, are made once.
        cache = {"SUNBEAM_CACHE": "on", "SUNBEAM_CACHE_DIR": folder}
        exact, exact_s = answers(["eval", *surface, "--method", "exact"], patch, wo, cache)
        table, _ = answers(["eval", *surface, "--method", "table"], patch, wo, cache)
        return exact, table, {"exact": 1e6 * exact_s / len(wo), "table": table_us(surface, patch, folder, cache)}


def answers(words: list, patch: Patch, wo: np.ndarray, variables: dict) -> tuple[np.ndarray, float]:
    """What `sunbeam eval` answers, and the seconds of one core over those that a single answer takes."""
    nm = 1e3 * patch.wavelength_um
    lines = [json.dumps({"wi": list(patch.wi), "wo": list(each), "wavelength": nm}) for each in wo]
    command = [str(TOOL), *map(str, words)]
    core_seconds(command, lines[0] + "\n", variables)
    _, one_s = core_seconds(command, lines[0] + "\n", variables)
    printed, all_s = core_seconds(command, "\n".join(lines) + "\n", variables)
    return np.array([json.loads(line)["f"] for line in printed.splitlines()]), all_s - one_s


def table_us(surface: list, patch: Patch, folder: str, variables: dict) -> float:
    """What the tables take of one core for a direction and a wavelength in µs, by a map of 81 wavelengths."""
    words = [str(TOOL), "brdf-map", *map(str, surface), "-o", f"{folder}/map.exr", "--method", "table"]
    words += ["--theta-i", str(patch.theta_i_deg), "--phi-i", str(patch.phi_i_deg), "--size"]
    _, small_s = core_seconds([*words, "2"], variables=variables)
    printed, all_s = core_seconds([*words, str(TIMED_SIZE)], variables=variables)
    return 1e6 * (all_s - small_s) / (json.loads(printed)["wavelengths"] * len(hemisphere(TIMED_SIZE)[0]))


def ladder(case: Case) -> dict:
    """How far off the judge the sum over the pixels is with approximations of theirs alone and all together.

    `half_floats` is our exact sum of such heights; `unexplained` is what all of theirs leave of the program's answers.
    """
    relief, patch = case.relief, case.patch
    heights, pixel_um = relief.heights, relief.pixel_um
    rounded = replace(relief, finest=in_half_floats(heights, pixel_um), finest_pixel_um=pixel_um, step=1)

    def approximated(chosen: Approximations) -> np.ndarray:
        return approximate_sum(heights, pixel_um, patch, case.wo, chosen)

    all_of_them = approximated(ALL)
    found = {
        "ours": case.figures["exact_off"],
        "half_floats": difference(ask_sunbeam(rounded, patch, case.wo)[0], case.judge),
        "window_cut": difference(approximated(Approximations(window_cut=True)), case.judge),
        "gabor_texels": difference(approximated(Approximations(gabor_texels=True)), case.judge),
        "curved_texels": difference(approximated(Approximations(curved_texels=True)), case.judge),
        "all": difference(all_of_them, case.judge),
        "peer": case.figures["peer_off"],
        "unexplained": difference(case.peer, all_of_them),
    }
    if found["unexplained"] > UNEXPLAINED:
        raise SetupError(f"{relief.name}: {found['unexplained']:.2g} of the other program's answers is not explained")
    return found


def controls(program: Path, case: Case) -> dict:
    """How far apart the maps are with an error put into one: each must be told from agreement."""
    relief, patch = case.relief, case.patch

    def wrong(heights: np.ndarray, asked: Patch = patch) -> float:
        theirs, _ = run_peer(program, heights, relief.pixel_um, asked, SIZE)
        return difference(theirs, case.exact)

    wider = replace(patch, window_um=1.05 * patch.window_um)
    return {
        "axes exchanged": wrong(relief.heights.T),
        "heights turned over": wrong(-relief.heights),
        "the window one pixel aside": wrong(np.roll(relief.heights, 1, axis=1)),
        "the window 5 % wider": wrong(relief.heights, wider),
    }


def summary(made: dict) -> dict:
    """What the page says of the numbers; an error where they do not carry it."""
    ladders, rows = made["ladders"], made["rows"]
    by_relief = {each["name"]: [row for row in rows if row["relief"] == each["name"]] for each in made["reliefs"]}
    scanned = [row for name, each in by_relief.items() if name.endswith("-scan") for row in each]
    random = [row for name in SWEPT for row in by_relief[name]]
    told, untold = ([row for row in random if (row["phase_step"] < 1) is below] for below in (True, False))
    same_but_window = {key: value for key, value in asdict(BASE).items() if key != "window_um"}
    timed = [row for row in by_relief["smooth"] if same_but_window.items() <= row.items()]
    ratios = [row["us"]["peer"] / row["us"]["table"] for row in timed]
    agreed = span([row for row in by_relief["smooth"] if row["pixel_um"] == PIXEL_UM], "apart")
    finer = sorted((row for row in timed if row["window_um"] == BASE.window_um), key=lambda row: -row["pixel_um"])
    insist(PAGE, min(made["controls"].values()) > 2 * agreed[1], "an error put in is told from agreement")
    insist(
        PAGE,
        span(told, "exact_off")[1] < 0.1 * span(told, "peer_off")[0],
        "the exact sum is right where pixels tell the phase",
    )
    insist(
        PAGE, span(by_relief["facets"], "exact_off")[1] < span(by_relief["facets"], "peer_off")[0], "so it is on facets"
    )
    for name in SWEPT:
        each = ladders[name]
        insist(
            PAGE,
            each["gabor_texels"] > max(each["window_cut"], each["half_floats"]),
            f"linear phases cost most: {name}",
        )
        insist(PAGE, each["curved_texels"] < 0.5 * each["gabor_texels"], f"quadratic phases mend it: {name}")
    insist(PAGE, all(a["peer_off"] > b["peer_off"] for a, b in zip(finer, finer[1:])), "smaller pixels bring it nearer")
    return {
        "smooth_apart": agreed,
        "told": both(told),
        "untold": both(untold),
        "peer_nearer": [label(row) for row in random if row["peer_off"] < row["exact_off"]],
        "facets": both(by_relief["facets"]),
        "scans": {**both(scanned), "phase_step": span(scanned, "phase_step")[1]} if scanned else None,
        "unexplained": max(each["unexplained"] for each in ladders.values()),
        "half_floats": max(abs(ladders[name]["half_floats"] - ladders[name]["ours"]) for name in SWEPT),
        "finer": finer,
        "timed": timed,
        "table_faster": [min(ratios), max(ratios)],
    }


def span(rows: list[dict], key: str) -> list[float]:
    """The least and the largest of a figure."""
    return [min(row[key] for row in rows), max(row[key] for row in rows)]


def both(rows: list[dict]) -> dict:
    """How far off the judge the two programs are."""
    return {key: span(rows, key) for key in ("peer_off", "exact_off")}


def label(row: dict) -> str:
    """The row in words."""
    return f"`{row['relief']}` with pixels of {row['pixel_um']:g} µm at {1000 * row['wavelength_um']:.0f} nm"
