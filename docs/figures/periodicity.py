"""Part `periodicity` of the documentation (page.py): spacings of gratings and skins from their peak angles.

Single 2014 is a thesis by M. Single (docs/model.md#sources). This part repeats its table 1.1 and figures 1.8 to 1.10.
The angle of the brightest light at each wavelength gives a spacing (spacing.py). The page lists mean and variance of
the spacing over the wavelengths.

- *Preset*: a procedural relief of `sunbeam`. *Scan*: a measured relief. *Strip*: a part of a scan.
- *Tile*: a relief that repeats.
- *Grating*: any of the reliefs. Skins count as gratings, since they are periodic along x.
- *Ridge*: a group of wavelengths whose spacings agree.
- FLSS, NMM, PQ: Single 2014's methods (docs/realtime.md), which need a tile. Presets are evaluated by them, scans by
  the direct sum, which needs no tile.
- `theirs`: values of Single 2014. `inside`: whether such a value is within the range of the scans' strips.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

from mitsuba_scenes.environment import SetupError

from .page import images
from .skin_scans import SKINS, STRIPS, scan, scans_present, size_rows, strips, write_heights
from .spacing import (
    ANGLE_STEP_DEG,
    SCAN_ANGLE_STEP_DEG,
    SCAN_WAVELENGTH_STEP_NM,
    THETA_I_DEG,
    WAVELENGTH_STEP_NM,
    Evaluation,
    Relief,
    draw,
    evaluate,
    evaluate_scan,
    rounding_nm2,
)

PART = "periodicity"
# Single 2014's table 1.1: mean in nm and variance in nm² of the spacing, by grating and method. It has `xenopeltis` by
# FLSS alone.
THEIRS = {
    ("blazed", "flss"): (2499.997, 0.377),
    ("blazed", "nmm"): (2499.997, 0.377),
    ("blazed", "pq"): (2491.861, 248.044),
    ("elaphe", "flss"): (1144.262, 0.401),
    ("elaphe", "nmm"): (1144.179, 0.677),
    ("elaphe", "pq"): (1052.308, 49.678),
    ("xenopeltis", "flss"): (1552.27, 0.45),
}
# Ranges of angles of view in degrees that contain the first order, positive on the side of the light. Single 2014 gives
# none.
ANGLES_DEG = {"blazed": (-55, -40), "elaphe": (-42, -13), "xenopeltis": (-50, -25)}
# Ranges of angles of view in degrees for the scans, whose orders are wider.
SCAN_ANGLES_DEG = {"elaphe": (-42, -10), "xenopeltis": (-52, -22)}
# Searched ranges in nm of the spacings of scans, which exclude side lobes of order 0.
SCAN_BETWEEN_NM = {"elaphe": (900, 1450), "xenopeltis": (1250, 1950)}
# Period of the preset `blazed`.
BLAZED_NM = 2500
# Pixels of one period of the preset `blazed`. With more the facet, which pixels make a staircase, is smoother.
BLAZED_PIXELS = 1024
# Height of the preset `blazed`.
BLAZED_HEIGHT_UM = 0.25
# Number of periods in Single 2014's blazed tile, 65 µm / 2.5 µm.
BLAZED_PERIODS = 26
# Edge of the tile of the preset `elaphe`: 57 periods, whose length is Single 2014's mean spacing.
ELAPHE_TILE_UM = 57 * 1.14426
# Numbers of repeats of the tile along x for PQ, by grating.
REPEATS = {"blazed": (2, 3, 5, 10, BLAZED_PERIODS), "elaphe": (1, 2, 3, 5, 10)}
# Approximate edge of the sub-regions of `xenopeltis`, squares of slightly different period: two along each axis.
REGION_SIZE_UM = 33
# Relative spread of the sub-regions' spatial frequencies about the preset's, to either side. At this value each of the
# two ridges is the brighter one at some wavelengths.
REGION_SPREAD = 0.038
# Names of the properties of reliefs in the page's text.
NAMES = {"rms_um": "rms height", "slope_x": "rms slope along x", "slope_y": "rms slope along y"}
# Smallest distance between two separate ridges, and largest range of spacings within a ridge. REGION_SPREAD puts the
# ridges about three times as far apart.
APART_NM = 40


def figures() -> dict:
    """All numbers of the part; writes its pictures.

    Without the scans `scans`, `repeated` and `sizes` are empty, and `ratio` is `None`.
    """
    folder = images(PART)
    with TemporaryDirectory() as temporary:
        scratch = Path(temporary)
        measured = {skin: measured_skin(skin, scratch) for skin in SKINS} if scans_present() else {}
        reliefs = {skin: Relief(skin, ("--preset", skin), ANGLES_DEG[skin]) for skin in SKINS}
        # The preset `blazed` is a single period, Single 2014's tile has BLAZED_PERIODS.
        reliefs["blazed"] = Relief("blazed", write_blazed(scratch), ANGLES_DEG["blazed"], BLAZED_NM)
        found = {}
        for grating, method in THEIRS:
            found[grating, method] = evaluate(reliefs[grating], "--method", method)
            print(f"{grating} {method}: {found[grating, method].row()}", flush=True)
        repeated = repeated_scan(measured)
        pictures(folder, measured, repeated, reliefs, found)
        regions = sub_regions(folder, measured, found["xenopeltis", "flss"])
        return {
            "theta_i_deg": THETA_I_DEG,
            "wavelength_step_nm": WAVELENGTH_STEP_NM,
            "angle_step_deg": ANGLE_STEP_DEG,
            "scan_wavelength_step_nm": SCAN_WAVELENGTH_STEP_NM,
            "scan_angle_step_deg": SCAN_ANGLE_STEP_DEG,
            "scans": [scan_row(skin, measured[skin]) for skin in SKINS if measured],
            "ratio": ratio(measured) if measured else None,
            "rows": [preset_row(grating, method, found[grating, method]) for grating, method in THEIRS],
            "repeated": {method: evaluation.row() for method, evaluation in repeated.items()},
            "rounding_nm2": rounding_nm2(found["blazed", "flss"]),
            "repeats": {preset: repeats(preset, counts) for preset, counts in REPEATS.items()},
            "regions": regions,
            **(relief_sizes() if measured else {"sizes": []}),
        }


def write_blazed(folder: Path) -> tuple:
    """Writes the preset `blazed` as Single 2014's tile of 65 µm to `folder`; returns the arguments that read it."""
    # Heights of one period in µm, at the pixels' centres.
    tooth = (np.arange(BLAZED_PIXELS) + 0.5) / BLAZED_PIXELS * BLAZED_HEIGHT_UM
    pixel_um = BLAZED_NM / 1000 / BLAZED_PIXELS
    arguments = write_heights(np.tile(tooth, BLAZED_PERIODS)[None, :], pixel_um, folder / "blazed.npy")
    return (*arguments, "--level", "none", "--tiling", "periodic")


@dataclass(frozen=True)
class Measured:
    """Evaluations of a scan and of its strips, as they are and turned by 180°.

    Light reaches a turned scan from the other side. `relief` is the whole scan, for evaluations by other methods.
    """

    relief: Relief
    whole: Evaluation
    strips: list[Evaluation]
    turned: Evaluation
    turned_strips: list[Evaluation]

    @property
    def strips_nm(self) -> list[float]:
        """The spacing in nm of each strip, lit from either side."""
        return [strip.report["mean_nm"] for strip in self.strips + self.turned_strips]


def measured_skin(skin: str, folder: Path) -> Measured:
    """Evaluates a scan and its strips; heights are written to `folder`."""
    heights_um, pixel_um = scan(skin)

    def relief(name: str, part_um: np.ndarray) -> Relief:
        """Writes the scan or a part of it to a file of this name; returns its relief."""
        arguments = write_heights(part_um, pixel_um, folder / f"{skin}-{name}.npy")
        return Relief(skin, arguments, SCAN_ANGLES_DEG[skin], between_nm=SCAN_BETWEEN_NM[skin])

    # An evaluation reads its file before it returns, so the next part may overwrite the file.
    def evaluated(part_um: np.ndarray) -> Evaluation:
        return evaluate_scan(relief("part", part_um))

    turned_um = heights_um[::-1, ::-1]
    measured = Measured(
        relief("scan", heights_um),
        whole=evaluated(heights_um),
        strips=[evaluated(strip) for strip in strips(heights_um)],
        turned=evaluated(turned_um),
        turned_strips=[evaluated(strip) for strip in strips(turned_um)],
    )
    print(f"scan of {skin}: {measured.whole.row()}, turned {measured.turned.row()}", flush=True)
    return measured


def repeated_scan(measured: dict[str, Measured]) -> dict[str, Evaluation]:
    """Evaluations of the scan of *Elaphe*, repeated as a tile, by `nmm` and `pq`; empty without scans."""
    if not measured:
        return {}
    return {method: evaluate(measured["elaphe"].relief, "--method", method) for method in ("nmm", "pq")}


def scan_row(skin: str, of_skin: Measured) -> dict:
    """The scan's spacing in light from either side, those of its strips, and the extremes of the strips' spacings.

    The extremes are `low_nm` and `high_nm`.
    """
    means_nm = of_skin.strips_nm
    theirs_nm = THEIRS[skin, "flss"][0]
    return {
        "skin": skin,
        "angles_deg": of_skin.relief.angles_deg,
        "between_nm": of_skin.relief.between_nm,
        **of_skin.whole.row(),
        "turned_nm": of_skin.turned.report["mean_nm"],
        "strips_nm": means_nm,
        "low_nm": min(means_nm),
        "high_nm": max(means_nm),
        "theirs_nm": theirs_nm,
        "inside": min(means_nm) <= theirs_nm <= max(means_nm),
    }


def ratio(measured: dict) -> dict:
    """The spacing of *Xenopeltis* over that of *Elaphe*: of the scans, of the turned scans, and in Single 2014.

    `low` and `high` are the extremes of the ratio over pairs of the species' strips.
    """
    xenopeltis, elaphe = measured["xenopeltis"], measured["elaphe"]
    theirs = THEIRS["xenopeltis", "flss"][0] / THEIRS["elaphe", "flss"][0]
    low = min(xenopeltis.strips_nm) / max(elaphe.strips_nm)
    high = max(xenopeltis.strips_nm) / min(elaphe.strips_nm)
    return {
        "scans": xenopeltis.whole.report["mean_nm"] / elaphe.whole.report["mean_nm"],
        "turned": xenopeltis.turned.report["mean_nm"] / elaphe.turned.report["mean_nm"],
        "low": low,
        "high": high,
        "theirs": theirs,
        "inside": low <= theirs <= high,
    }


def preset_row(grating: str, method: str, found: Evaluation) -> dict:
    """A row of table 1.1: our numbers, and Single 2014's under `theirs`."""
    mean_nm, variance_nm2 = THEIRS[grating, method]
    theirs = {"mean_nm": mean_nm, "variance_nm2": variance_nm2}
    return {
        "grating": grating,
        "method": method,
        "angles_deg": found.report["angles_deg"],
        **found.row(),
        "theirs": theirs,
    }


def repeats(preset: str, counts: tuple[int, ...]) -> dict:
    """Spacings by PQ of a preset, `blazed` or `elaphe`: a row for each number of repeats of its tile.

    - `coherent_um`: the length of the repeated tile.
    - `order`: the length of one tile over the mean spacing, a whole number if the peak is on an order of the tile.
    - `nearest`: the number of repeats whose variance is nearest to Single 2014's, on a logarithmic scale.

    Raises SetupError unless one tile of `elaphe` peaks midway between orders, to a tenth of an order, as the page says.
    """
    tile = Relief(preset, ("--preset", preset), ANGLES_DEG[preset])
    # The tile of `blazed` is one period.
    extent_um = BLAZED_NM / 1000 if preset == "blazed" else ELAPHE_TILE_UM
    rows = []
    for count in counts:
        found = evaluate(tile, "--method", "pq", "--repeats", f"{count},1")
        coherent_um, order = count * extent_um, 1000 * extent_um / found.report["mean_nm"]
        rows.append({"repeats": count, "coherent_um": coherent_um, "order": order, **found.row()})
    if preset == "elaphe" and abs(rows[0]["order"] % 1 - 0.5) > 0.1:
        raise SetupError(f"PQ of one tile does not peak midway between orders: {rows[0]}")
    nearest = min(rows, key=lambda row: abs(np.log(row["variance_nm2"] / THEIRS[preset, "pq"][1])))
    return {"rows": rows, "nearest": nearest["repeats"]}


def relief_sizes() -> dict:
    """Sizes of the scans against crops of their presets, as the rows of `size_rows` (skin_scans.py).

    - `worst_size`: the largest relative difference between a scan and the mean of the crops, in rms height or slope.
    - `outside`: names of the rms heights and slopes of scans beyond the crops' quantiles.

    Raises SetupError if such a size is below the quantiles, since the page says that these scans are rougher.
    """
    rows = size_rows()
    # `size_rows` also has peaks to valley. The page compares them with those of whole tiles of the presets.
    compared = [row for row in rows if row["what"] != "peak_to_valley_um"]
    outliers = [row for row in compared if not row["low"] <= row["scan"] <= row["high"]]
    if any(row["scan"] < row["low"] for row in outliers):
        raise SetupError(f"a scan is smoother than the crops of its preset, which the page does not say: {outliers}")
    return {
        "sizes": rows,
        "worst_size": max(abs(row["crops"] / row["scan"] - 1) for row in compared),
        "outside": [f"the {NAMES[row['what']]} of *{row['skin'].capitalize()}*" for row in outliers],
    }


def pictures(folder: Path, measured: dict, repeated: dict, reliefs: dict, found: dict) -> None:
    """Writes figures 1.8, 1.9 and 1.10.

    `measured` has the scans by skin, and `repeated` the evaluations of the scan of *Elaphe* as a tile, by method.
    `reliefs` has presets by the grating's name, and `found` their evaluations by grating and method. Without scans
    `measured` and `repeated` are empty.
    """
    blazed = ("(a) blazed, FLSS", reliefs["blazed"], found["blazed", "flss"])
    scanned, procedural = [], []
    for letter, skin in zip("bc", SKINS):
        name = f"({letter}) {skin.capitalize()}"
        if measured:
            scanned.append((f"{name}, scan, direct sum", measured[skin].relief, measured[skin].whole))
        procedural.append((f"{name}, procedural, FLSS", reliefs[skin], found[skin, "flss"]))
    # The presets are below their scans, with an empty panel below the blazed grating.
    rows = [[blazed, *scanned], [None, *procedural]] if measured else [[blazed, *procedural]]
    draw(folder / "figure-1.8.png", rows)
    for number, method in (("1.9", "nmm"), ("1.10", "pq")):
        name = method.upper()
        row = [(f"(a) blazed, {name}", reliefs["blazed"], found["blazed", method])]
        if measured:
            row.append((f"(b) Elaphe, scan repeated, {name}", measured["elaphe"].relief, repeated[method]))
        row.append((f"(b) Elaphe, procedural, {name}", reliefs["elaphe"], found["elaphe", method]))
        draw(folder / f"figure-{number}.png", [row])


def sub_regions(folder: Path, measured: dict, plain: Evaluation) -> dict:
    """The two ridges of the preset `xenopeltis` with sub-regions; draws its spacings beside those of the scan's strips.

    Sub-regions are squares of slightly different period (REGION_SIZE_UM). `plain` is the evaluation without them. The
    result has

    - `lower_nm`, `upper_nm`: the ridges' mean spacings;
    - `share_lower`: the fraction of the wavelengths on the lower ridge;
    - `toggles`: the number of changes of the ridge along the wavelengths;
    - `size_um`, `spread`, `strips`: REGION_SIZE_UM, REGION_SPREAD and STRIPS;
    - `mean_nm`, `variance_nm2`: those of the spacing over all wavelengths.

    Raises SetupError if there are no two separate ridges.
    """
    arguments = ("--preset", "xenopeltis", "--region-size", REGION_SIZE_UM, "--region-spread", REGION_SPREAD)
    found = evaluate(Relief("xenopeltis", arguments, ANGLES_DEG["xenopeltis"]), "--method", "flss")
    spacings_nm = found.spacings_nm
    # Spacings below this limit belong to the lower ridge.
    middle_nm = (spacings_nm.min() + spacings_nm.max()) / 2
    lower_nm, upper_nm = spacings_nm[spacings_nm < middle_nm], spacings_nm[spacings_nm >= middle_nm]
    # Equal spacings leave the lower ridge empty.
    are_apart = len(lower_nm) > 0 and upper_nm.min() - lower_nm.max() >= APART_NM
    if not are_apart or max(np.ptp(lower_nm), np.ptp(upper_nm)) > APART_NM:
        low_nm, high_nm = spacings_nm.min(), spacings_nm.max()
        raise SetupError(f"the sub-regions make no two ridges: spacings from {low_nm} to {high_nm} nm")
    draw_ridges(folder / "ridges.png", measured, plain, found)
    return {
        "size_um": REGION_SIZE_UM,
        "spread": REGION_SPREAD,
        "lower_nm": float(lower_nm.mean()),
        "upper_nm": float(upper_nm.mean()),
        "share_lower": float(len(lower_nm) / len(spacings_nm)),
        "toggles": int(np.count_nonzero(np.diff(spacings_nm < middle_nm))),
        "strips": STRIPS,
        **found.row(),
    }


def draw_ridges(path: Path, measured: dict, plain: Evaluation, with_regions: Evaluation) -> None:
    """Draws spacings of *Xenopeltis* over the wavelength: of the scan and its strips, and of the preset."""
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)

    def plot(ax, evaluation: Evaluation, *style, **options) -> None:
        ax.plot(evaluation.report["wavelengths_nm"], evaluation.spacings_nm, *style, **options)

    if measured:
        scanned = measured["xenopeltis"]
        for number, strip in enumerate(scanned.strips):
            plot(axes[0], strip, linewidth=1, label=f"strip {number + 1}")
        plot(axes[0], scanned.whole, "k-", linewidth=2, label="all of it")
        plot(axes[0], scanned.turned, "k--", linewidth=2, label="the same, turned")
        axes[0].legend(fontsize="x-small", ncols=3)
    axes[0].set_title("scan" if measured else "scan (not present)")
    plot(axes[1], plain, linewidth=1.5, label="no sub-regions")
    plot(axes[1], with_regions, linewidth=1.5, label=f"sub-regions, {100 * REGION_SPREAD:g} % either way")
    axes[1].legend(fontsize="x-small")
    axes[1].set_title("procedural")
    for ax in axes:
        ax.set_xlabel("wavelength / nm")
    axes[0].set_ylabel("spacing from the peak angle / nm")
    figure.savefig(path, dpi=80)
