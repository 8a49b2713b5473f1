"""Pages and their numbers are those of the data in docs/data.

Sentences with numbers that no template writes are made here from the data, and must stand. Where one does not, the data
have changed: the message has the sentence that is true now.
"""

import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from docs.figures import card
from docs.figures.__main__ import PAGES
from docs.figures.page import write_page

REPOSITORY = Path(__file__).resolve().parent.parent
RATIO_VARIANTS = ("llvm_ad_rgb", "scalar_rgb", "llvm_ad_spectral", "scalar_spectral")
SKINS = ("elaphe", "xenopeltis")


@cache
def data(name):
    return json.loads((REPOSITORY / "docs" / "data" / f"{name}.json").read_text(encoding="utf-8"))


def words(text):
    """The text with its line breaks and runs of spaces as single spaces."""
    return " ".join(text.split())


def named(rows, name, key="name"):
    return next(row for row in rows if row[key] == name)


def microseconds(value):
    """Two digits, as the tables of the pages have them."""
    return f"{value:.2f}" if value < 1 else f"{value:.2g}"


def method_rows():
    labels = {"flss": "`flss`, 5 nm, converged"}
    for name in ("table", "pq", "flss", "nmm", "stam"):
        same = named(data("crosscheck")["methods"]["xenopeltis"], name)["same_rays"]
        us = data("realtime")["shading"]["xenopeltis"][name]["us"]
        label = labels.get(name, f"`{name}`")
        yield "README.md", f"| {label} | {same['delta_e']:.2f} | {same['flip']:.3f} | {microseconds(us)} µs |"


def agreement():
    low, high = data("crosscheck")["median"]
    yield (
        "README.md",
        f"the GPU's FLSS differ by {low:.0e} to {high:.0e} in the median and by at most "
        f"{100 * data('crosscheck')['p99']:.1f} % in 99 % of the pixels",
    )


def colours():
    surfaces = data("speed-error")["surfaces"]
    just = {s["name"]: named(s["choices"], 1.0, "delta_e") for s in surfaces}
    fine = {s["name"]: named(s["choices"], 0.1, "delta_e") for s in surfaces}
    tables = [just[skin]["any"] for skin in SKINS]
    assert {row["method"] for row in tables} == {"colour-table"}
    assert {row["parameters"]["resolution"] for row in tables} == {0.7}
    summed = [just[skin]["flss"]["cpu_us"] for skin in SKINS]
    low, high = sorted(row["cpu_us"] for row in tables)
    assert 3 * low == pytest.approx(1, rel=0.2) == 3 * high
    yield "README.md", "A colour in a third of a microsecond, to a just noticeable difference."
    blazed = just["blazed"]
    assert blazed["any"]["parameters"]["resolution"] == 1.0
    yield (
        "README.md",
        f"On both procedural skins the colour table at 0.7 of its default resolution keeps ΔE₂₀₀₀ below 1 in 99 % "
        f"of the directions at {low:.2f} to {high:.2f} µs on one core, where FLSS, held against its own model, takes "
        f"{min(summed):.0f} to {max(summed):.0f} µs; on `blazed` it is {blazed['any']['cpu_us']:.2f} against "
        f"{blazed['flss']['cpu_us']:.1f} µs.",
    )
    better = [s["name"] for s in surfaces if fine[s["name"]]["any"]["method"] == "flss"]
    assert better == ["blazed", "elaphe", "xenopeltis", "scan of xenopeltis"]
    yield "README.md", "For a ΔE of 0.1 FLSS is the fastest on `blazed`, on both skins and on the scan"


def noise():
    ways = {(p["surface"], p["light"]): {w["name"]: w for w in p["ways"]} for p in data("sampling")["pictures"]}

    def seconds(light, way):
        return [ways[skin, light][way]["seconds_to_error"] for skin in SKINS]

    (a, b), (c, d) = seconds("sky", "importance"), seconds("sky", "cosine")
    (e, f), (g, h) = seconds("sun and sky", "importance"), seconds("sun and sky", "cosine")
    size = data("sampling")["size"]
    yield (
        "README.md",
        f"a picture of {size[0]} × {size[1]} pixels of the procedural skins to 5 % in {a:.2f} and {b:.2f} s, "
        f"by extrapolation from 64 samples; drawing by the cosine would need {c:.0f} and {d:.0f} s. With a sun in "
        f"the sky, which sampling the light finds, it is {e:.0f} and {f:.0f} s against {g:.0f} and {h:.0f}",
    )


def ratios():
    cells = {(c["scene"], c["variant"]): c["ways"] for c in data("sampling")["headline"]["cells"]}
    for name in ("blazed", "xenopeltis"):
        found = [named(cells["sphere", variant], name)["time_ratio"]["median"] for variant in RATIO_VARIANTS]
        yield (
            "README.md",
            f"| `diffraction`, `{name}` / `roughconductor` | {' | '.join(f'{ratio:.1f} ×' for ratio in found)} |",
        )


def graphics_card():
    found = card.read()
    rgb, spectral = (found.render_ratio(kind, "sphere", "xenopeltis") for kind in ("rgb", "spectral"))
    if rgb is None or spectral is None:
        yield "README.md", "(those for CUDA are compiled and were never run)"
        yield "README.md", "On a graphics card (`cuda_ad_rgb`, `cuda_ad_spectral`): not run."
        return
    yield (
        "README.md",
        f"On a graphics card ({found.name}; 1920 × 1080 pixels, 64 samples) `xenopeltis` takes {rgb:.1f} × in "
        f"`cuda_ad_rgb` and {spectral:.1f} × in `cuda_ad_spectral`.",
    )


def surfaces():
    made = data("tables")
    rows = {f"AFM scan of *{species}*, alone": f"scan of {species.lower()}" for species in ("Elaphe", "Xenopeltis")}
    rows |= {"`blazed`": "blazed", "`cd`": "cd"}
    rows |= {f"`{skin}` (procedural)": skin for skin in ("elaphe", "xenopeltis")}
    for name, row in ((name, made["surfaces"][key]) for name, key in rows.items()):
        pixels = " × ".join(str(count) for count in row["pixels"])
        size = f"{row['extent_um'][0]:.3g} µm, {pixels}"
        taps = " × ".join(str(count) for count in row["taps"])
        yield (
            "README.md",
            f"| {name} | {size} | {row['mb']:.2g} MB | {row['build_s']:.1f} s | {row['error']:.0e} | {taps} |",
        )
    shares = {key: 1 - made["surfaces"][key]["bare_s"] / made["surfaces"][key]["build_s"] for key in rows.values()}
    assert shares.pop("blazed") > 0.99
    scans, others = (
        sorted(f"{100 * share:.0f}" for key, share in shares.items() if ("scan" in key) is of_scans)
        for of_scans in (True, False)
    )
    yield (
        "README.md",
        f"all but a hundredth of the time of `blazed`, {scans[0]} to {scans[-1]} % of the scans', and {others[0]} to "
        f"{others[-1]} %",
    )
    kept = {name: (row["albedo"], row["albedo_kept"]) for name, row in made["surfaces"].items()}
    yield (
        "README.md",
        f"the mean albedo of `blazed` falls from {kept['blazed'][0]:.2f} to {kept['blazed'][1]:.2f}, of `elaphe` from "
        f"{kept['elaphe'][0]:.2f} to {kept['elaphe'][1]:.2f}",
    )


def albedos():
    asked = data("stability")["questions"]
    found = f"of {asked['albedos']:,} albedos of surfaces drawn at random {asked['albedos_above'] or 'none'}"
    by = "by more than the surface's tolerance and 0.001"
    yield "README.md", f"{found} do {by}, and the largest is {asked['albedo']:.3f}"
    yield "docs/tables.md", f"{found} exceed one {by}, the largest is {asked['albedo']:.3f}"


def validity():
    made = data("validity")
    slope, period = made["sweeps"]["slope"], made["sweeps"]["period"]["sinusoid"]
    at_60 = made["angles_deg"].index(60.0)
    steep = slope["misplaced"]["stam, limited"][at_60][slope["values"].index(15.0)]
    worst = period["misplaced"]["stam, limited"][at_60][period["values"].index(3.5)]
    assert (made["period_um"], made["swept"]["slope_deg"]) == (2.5, 10.0)
    scope = (
        f"a perfectly conducting sinusoid of 2.5 µm with slopes of up to 15° misplaces {100 * steep:.1f} % of "
        f"unpolarised light that comes in across its grooves at 60°, one of 3.5 µm and 10° {100 * worst:.1f} %"
    )
    for page in ("README.md", "docs/model.md", "docs/tour-scan.md"):
        yield page, scope
    rms = {s["name"]: max(s["rms_slope_deg"]) for s in made["surfaces"]}
    for page in ("README.md", "docs/tour-scan.md"):
        yield page, f"root mean square slopes of {rms['elaphe']:.0f}° and {rms['xenopeltis']:.0f}°"


def terms():
    deep = data("stability")["visible"]
    yield (
        "docs/model.md",
        f"At κH = {deep['kappa_h']:.0f} the power series needs {deep['taylor_terms']} terms and is off by "
        f"{deep['taylor_f32']:.0e} in single precision, where this one takes {deep['chebyshev_terms']} and is off by "
        f"{deep['chebyshev_f32']:.0e}",
    )
    left = [remainder(13.54, count) for count in (22, 24)]
    assert left[0] <= 1e-3 < remainder(13.54, 21)
    assert left[1] <= 1e-4 < remainder(13.54, 23)
    yield "docs/model.md", "where κH is up to 13.54, 22 terms are good to 1e-3 and 24 to 1e-4"


def remainder(x, count):
    """The sum of `2 |J_n(x)|` from `n = count` on, each by its integral."""
    angle = np.linspace(0, np.pi, 20_001)
    return sum(2 * abs(np.trapezoid(np.cos(n * angle - x * np.sin(angle)), angle) / np.pi) for n in range(count, 60))


CLAIMS = [
    claim
    for claims in (method_rows, agreement, colours, noise, ratios, graphics_card, surfaces, albedos, validity, terms)
    for claim in claims()
]


@pytest.mark.parametrize(("page", "sentence"), CLAIMS, ids=range(len(CLAIMS)))
def test_the_data_carry_the_sentence(page, sentence):
    assert words(sentence) in words((REPOSITORY / page).read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_what_its_template_makes_of_the_data(name, tmp_path):
    # Words are changed in the template, or the next run of `make figures` takes them back.
    made = write_page(name, data(name), tmp_path)
    assert made.read_text(encoding="utf-8") == (REPOSITORY / "docs" / f"{name}.md").read_text(encoding="utf-8")


def test_a_sentence_that_is_not_there_is_missed():
    """The negative control: with any other number a claim does not stand."""
    page, sentence = CLAIMS[0]
    text = words((REPOSITORY / page).read_text(encoding="utf-8"))
    for number in re.finditer(r"\d+\.\d+", sentence):
        other = sentence[: number.start()] + f"{float(number.group()) + 0.01:.2f}" + sentence[number.end() :]
        assert words(other) not in text
