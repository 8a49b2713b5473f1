"""Part `published-figures` of the documentation (page.py): a checked number for each figure of Single 2014.

Single 2014 is M. Single's thesis (docs/model.md#sources). The parts `slits`, `films`, `periodicity`, `brdf-maps`,
`renderings`, `renderings-methods` and `lab` measure the numbers; this part formats them. Keys of dictionaries are the
numbers of the thesis' figures and tables, as text. Values are text for the column *checked* of the page. The page's
template has the text of figures without a measured number.

FLSS, NMM and PQ are methods of the thesis, and Stam's is an older one (docs/glossary.md). ΔE is the colour difference
CIEDE2000. A map's pixel is *lit* where the reference map is not black.
"""

from __future__ import annotations

import json
from functools import cache

from mitsuba_scenes.environment import SetupError

from .page import DOCS


def figures() -> dict:
    """The checked numbers of all figures, under `checked`."""
    return {"checked": {**gratings(), **spacings(), **maps(), **renderings(), **other_methods()}}


@cache
def data(part: str) -> dict:
    """The data of another part; raises SetupError if its file is missing."""
    file = DOCS / "data" / f"{part}.json"
    if not file.exists():
        raise SetupError(f"{file} is missing: run `make figures PAGES={part}`")
    return json.loads(file.read_text(encoding="utf-8"))


def first_row(rows: list[dict], **wanted) -> dict:
    """The first row whose keys have the values `wanted`; raises StopIteration without one."""
    return next(row for row in rows if all(row[key] == value for key, value in wanted.items()))


def gratings() -> dict[str, str]:
    """Figures 1.1 and 1.2: the spectrometer. 1.4 and 1.5: N slits. 1.3, 1.6 and 1.7 are drawings without data."""
    slits, films = data("slits"), data("films")
    fifty = first_row(slits["rows"], count=50)
    # Deviations in cm become mm with two decimals. The bound of 1e-3 cm keeps small deviations from being printed as 0.
    return {
        "1.1": f"{len(films['lines'])} lines within {10 * max(films['off_cm'], 1e-3):.2f} mm of the grating equation, "
        f"{films['screen_cm']:g} cm from the film",
        "1.2": f"path-traced within {10 * max(films['drawn']['off_cm'], 1e-3):.2f} mm of "
        f"{films['drawn']['order_1_cm']:.1f} cm",
        "1.4": f"width of a peak ∝ N^{slits['exponent']:.3f} from {slits['fitted_from']} slits on",
        "1.5": f"{fifty['width_in_zeros']:.4f} λ/(Nd) wide for 50 slits, the limit being {slits['limit']:.4f}",
    }


def spacings() -> dict[str, str]:
    """Figures 1.8 to 1.10 and table 1.1: mean and variance of the spacing in nm and nm², measured and in the thesis."""
    periodicity = data("periodicity")

    def compared(grating: str, method: str) -> str:
        row = first_row(periodicity["rows"], grating=grating, method=method)
        theirs = row["theirs"]
        return (
            f"{grating} {row['mean_nm']:.1f} ({row['variance_nm2']:.2g}) against {theirs['mean_nm']} "
            f"({theirs['variance_nm2']})"
        )

    def line(method: str, *names: str) -> str:
        return "; ".join(compared(grating, method) for grating in names)

    found = {
        "1.8": line("flss", "blazed", "elaphe", "xenopeltis"),
        "1.9": line("nmm", "blazed", "elaphe"),
        "1.10": line("pq", "blazed", "elaphe"),
    }
    # Ratio of the spacings of both species, `None` without scans. `turned` is that of the scans turned by 180°.
    ratio = periodicity["ratio"]
    if ratio:
        found["table 1.1"] = (
            f"*Xenopeltis* over *Elaphe* in the scans {ratio['scans']:.3f} ({ratio['turned']:.3f} lit from the other "
            f"side), in the thesis {ratio['theirs']:.3f}"
        )
    else:
        found["table 1.1"] = "the scans were missing"
    return found


def maps() -> dict[str, str]:
    """Figures 2.3 to 2.13: BRDF maps."""
    data_of_maps = data("brdf-maps")
    sheets, spot, spread = data_of_maps["sheets"], data_of_maps["white_spot"], data_of_maps["spread"]
    # Smallest step between the summed wavelengths at which ΔE reaches 1, by surface.
    first_seen = {name: f"{step['first_seen']} nm" for name, step in data_of_maps["steps"].items()}
    elaphe = " and ".join(f"{first_seen[skin['key']]} ({skin['name']})" for skin in data_of_maps["skins"]["elaphe"])

    def pq_errors(sheet: str) -> str:
        panels = [panel for panel in sheets[sheet]["panels"] if "PQ" in panel["caption"]]
        return "ΔE of PQ where it is lit: " + ", ".join(f"{panel['delta_e_lit']:.1f}" for panel in panels)

    def terms(*surfaces: str) -> str:
        """Numbers of terms of Taylor's series, about the lowest height and about the middle of the heights."""
        return "; ".join(
            f"{name}: {counts['base']} about the base, {counts['middle']} about the middle"
            for name, counts in data_of_maps["terms_seen"].items()
            if name.startswith(surfaces)
        )

    # The row of the smallest width σs of the coherence window, at which orders overlap. `window` is the smallest
    # response between two orders over that of the weaker order, with σs as the coherence length.
    overlapping = data_of_maps["valleys"][0]
    # Percentages of a map's chroma in the right half, by skin and one for each angle of incidence.
    right = {
        name: " ".join(f"{100 * row['share']:.0f}" for row in side["rows"])
        for name, side in data_of_maps["right_side"].items()
    }
    return {
        "2.3": "ΔE where it is lit at most "
        f"{max(panel['delta_e_lit'] for panel in sheets['gratings']['panels']):.2f} against the direct sum's spectra",
        "2.4": f"mean chroma of the spot {spot['nmm']:.1f} by NMM, {spot['flss']:.1f} by FLSS; PQ puts "
        f"{100 * spread['pq']:.1f} % of the first order beyond 3σ, FLSS {100 * spread['flss']:.1f} %",
        "2.5": f"ΔE reaches 1 from steps of {first_seen['blazed']} on",
        "2.6": f"ΔE reaches 1 from {elaphe} on",
        "2.7": pq_errors("pq-blazed"),
        "2.8": pq_errors("pq-elaphe"),
        "2.9": pq_errors("pq-xenopeltis"),
        "2.10": f"between orders {100 * overlapping['window']:.0f} % of the peak is left at "
        f"{overlapping['sigma_um']} µm",
        "2.11": terms("blazed", "xenopeltis"),
        "2.12": terms("elaphe"),
        "2.13": "; ".join(f"{name}: {percentages} % right of the middle" for name, percentages in right.items()),
    }


def renderings() -> dict[str, str]:
    """Figures 2.14 to 2.18: the snake by FLSS."""
    pictures = data("renderings")
    chroma = [f"{row['label']} {row['flss']:.1f}" for row in pictures["gratings"]["chroma"].values()]
    zooms = [f"{zoom['chroma']:.0f}" for zoom in pictures["closer"]["zooms"]]
    # Difference of the picture from one with grey diffraction, by species.
    without_colour = {name: row["delta_e_dark"] for name, row in pictures["elaphe"]["colour"].items()}
    steps = [step["delta_e_flss_per_deg"] for step in pictures["moving_sun"]["steps"]]
    return {
        "2.14": f"mean chroma: {', '.join(chroma)}",
        "2.15": f"without its colour the picture moves by ΔE {without_colour['elaphe']:.1f}, that of *Xenopeltis* by "
        f"{without_colour['xenopeltis']:.1f}",
        "2.17": f"mean chroma {', '.join(zooms)}",
        "2.18": f"ΔE of {min(steps):.1f} to {max(steps):.1f} per degree that the light moves",
    }


def other_methods() -> dict[str, str]:
    """Figures 2.19 to 2.22 and B.1, table 2.1: the laboratory, Stam's model, NMM."""
    methods, lab = data("renderings-methods"), data("lab")
    # Rms distance of a surface's lines of constant phase from straight ones.
    wander = {row["title"]: row["wander_nm"] for row in methods["cut_outs"]}
    # GPU Gems' form of Stam's shader at three spacings: the first is the tracks' own, the last is fitted.
    gems = methods["disc"]["gems"]
    blazed = first_row(methods["symmetry"], title="Blazed")
    # The first row of each method, that of the scan if present.
    flss, stam = (next(row for row in methods["xenopeltis"] if method in row["caption"]) for method in ("FLSS", "Stam"))
    # The first three rows are FLSS, NMM and weighted NMM, on the scan if present.
    hues = [row["of_blue"]["hue_deg"] for row in methods["nmm"][:3]]
    frames_per_second = [row["fps"] for row in methods["frames"]]
    slowest, fastest = min(frames_per_second), max(frames_per_second)
    spots = [
        f"{sample['title']} {sample['measured_spacing_um']:.3f} µm ({sample['spacing_um']:.3f} µm in the heights)"
        for sample in lab["samples"]
        if sample["is_drawn"]
    ]
    return {
        "2.19": f"spacing from the spots: {', '.join(spots)}",
        "2.20": f"lines wander by {', '.join(f'{nm:.0f} nm ({title})' for title, nm in wander.items())}",
        "2.21": f"peak angles differ by up to {gems[0]['largest_off_deg']:.1f}°, with a fitted spacing by "
        f"{gems[-1]['largest_off_deg']:.1f}°; right over left {blazed['gems']:.2f} on a blazed grating, by FLSS "
        f"{blazed['flss']:.2f}",
        # 36 is the number of bins of hues, 10° each (hues.py).
        "2.22": f"dark near highlights {100 * stam['dark_near']:.0f} % by Stam, {100 * flss['dark_near']:.0f} % by "
        f"FLSS; {stam['hues']:.0f} and {flss['hues']:.0f} effective hues of 36",
        "B.1": f"hue of what is blue: {hues[0]:.1f}° by FLSS, {hues[1]:.1f}° by NMM, {hues[2]:.1f}° with weights",
        "table 2.1": f"{slowest:.2g} to {fastest:.2g} frames a second on {methods['adapter']}",
    }
