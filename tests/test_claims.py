"""Numbers of pages against the data in docs/data.

Sentences with numbers in hand-written text are made here from the data and must be on their page. A failure after a
change of the data shows the sentence that is true now.
"""

import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from docs.figures import card
from docs.figures.__main__ import PARTS
from docs.figures.page import DOCS, write_part

REPOSITORY = Path(__file__).resolve().parent.parent
RENDER_VARIANTS = ("llvm_ad_rgb", "llvm_ad_spectral")


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


def speed_and_error():
    """Rows of the README's table. A render's ratio is of the scene in which the surface was measured first."""
    tables = data("tables")["surfaces"]
    colours = {
        surface["name"]: named(surface["choices"], 1.0, "delta_e") for surface in data("speed-error")["surfaces"]
    }
    cells = {(cell["scene"], cell["variant"]): cell["ways"] for cell in data("sampling")["headline"]["cells"]}
    for label, key, scene, material in (
        ("AFM scan of *Xenopeltis*", "scan of xenopeltis", "scan", "scan"),
        ("`blazed`", "blazed", "sphere", "blazed"),
        ("`elaphe` (procedural)", "elaphe", None, None),
        ("`xenopeltis` (procedural)", "xenopeltis", "sphere", "xenopeltis"),
    ):
        table, colour = tables[key], colours[key]
        assert colour["any"]["method"] == "colour-table"
        renders = ["–", "–"]
        if scene:
            ratios = [named(cells[scene, variant], material)["time_ratio"]["median"] for variant in RENDER_VARIANTS]
            renders = [f"{ratio:.1f} ×" for ratio in ratios]
        times = [f"{microseconds(colour[way]['cpu_us'])} µs" for way in ("any", "flss")]
        cost = [f"{table['mb']:.2g} MB", f"{table['build_s']:.1f} s", f"{table['error']:.0e}"]
        yield "README.md", f"| {' | '.join([label, *cost, *times, *renders])} |"


def graphics_card():
    found = card.read()
    rgb, spectral = (found.render_ratio(kind, "sphere", "xenopeltis") for kind in ("rgb", "spectral"))
    if rgb is None or spectral is None:
        yield "README.md", "On a graphics card (`cuda_ad_rgb`, `cuda_ad_spectral`): never run."
        return
    yield (
        "README.md",
        f"On a graphics card ({found.name}; 1920 × 1080 pixels, 64 samples) `xenopeltis` takes {rgb:.1f} × in "
        f"`cuda_ad_rgb` and {spectral:.1f} × in `cuda_ad_spectral`.",
    )


def albedos():
    kept = {name: (row["albedo"], row["albedo_kept"]) for name, row in data("tables")["surfaces"].items()}
    yield (
        "README.md",
        f"The mean albedo of `blazed` falls from {kept['blazed'][0]:.2f} to {kept['blazed'][1]:.2f}, of `elaphe` from "
        f"{kept['elaphe'][0]:.2f} to {kept['elaphe'][1]:.2f}",
    )
    asked = data("stability")["questions"]
    yield "README.md", f"the largest of {asked['albedos']:,} random ones is {asked['albedo']:.3f}"
    found = f"of {asked['albedos']:,} albedos of surfaces drawn at random {asked['albedos_above'] or 'none'}"
    by = "by more than the surface's tolerance and 0.01"
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


def covered():
    flat, sinusoid = data("covers-validity")["to_and_fro"][:2]
    at_60 = data("covers-validity")["angles_deg"].index(60.0)
    yield (
        "docs/model.md",
        f"a mirror of aluminium lacks {100 * flat['later'][0] / flat['once'][0]:.0f} % of what it sends out along the "
        "normal",
    )
    yield (
        "docs/model.md",
        f"a sinusoid of 2.5 µm with slopes of 10° in aluminium lacks "
        f"{100 * sinusoid['later'][at_60] / sinusoid['once'][at_60]:.0f} % of what it sends out for light at 60°",
    )


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


CLAIMS = [claim for claims in (speed_and_error, graphics_card, albedos, validity, covered, terms) for claim in claims()]


@pytest.mark.parametrize(("page", "sentence"), CLAIMS, ids=range(len(CLAIMS)))
def test_the_data_carry_the_sentence(page, sentence):
    assert words(sentence) in words((REPOSITORY / page).read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", PARTS)
def test_regions_are_their_templates_with_the_data(name, tmp_path):
    """An edit of the page alone fails here: the next run of `make figures` would revert it."""
    made = write_part(name, data(name), tmp_path)
    assert made.read_text(encoding="utf-8") == (DOCS / made.name).read_text(encoding="utf-8")


def test_every_template_is_a_part():
    assert {file.name.removesuffix(".md.j2") for file in (DOCS / "templates").iterdir()} == set(PARTS)


def test_a_claim_with_another_number_fails():
    """The negative control of the claims."""
    page, sentence = CLAIMS[0]
    text = words((REPOSITORY / page).read_text(encoding="utf-8"))
    for number in re.finditer(r"\d+\.\d+", sentence):
        other = sentence[: number.start()] + f"{float(number.group()) + 0.01:.2f}" + sentence[number.end() :]
        assert words(other) not in text
