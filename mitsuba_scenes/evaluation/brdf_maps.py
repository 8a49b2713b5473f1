"""The BRDF maps of Single 2014 (figures 2.3 to 2.13) as contact sheets, each panel with its error."""

from __future__ import annotations

import json
import math
import random
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from ..contact_sheet import contact_sheet
from ..tool import sunbeam
from .page import images

PAGE = "brdf-maps"
SIZE = 160
# Pixels across a panel of a sheet, and panels in a row.
PANEL, COLUMNS = 224, 4
# The reference: the same patch model through spectral tables of this tolerance, at each nm. Held against the direct
# double-precision sum at so many pairs of directions and wavelengths.
REFERENCE = ("--method", "table", "--model", "patch", "--tolerance", 1e-5, "--lambda-step", 1)
CHECKS = 24
GRATINGS = ("blazed", "elaphe", "xenopeltis")
STEPS_NM = (1, 5, 10, 25, 50, 100)
COHERENCE_UM = (3.25, 6.5, 15, 30, 45, 65)
TERMS = (1, 5, 9, 13, 17, 21, 23, 25, 29, 33, 37, 40)
THETA_I_DEG = (0, 10, 20)


@dataclass(frozen=True)
class Panel:
    """A map: a surface, a method with its options, and what is written under it."""

    caption: str
    surface: tuple
    method: tuple
    theta_i_deg: float = 0

    def words(self, method: tuple) -> list:
        return [*self.surface, "--theta-i", self.theta_i_deg, "--size", SIZE, *method]


@dataclass
class Sheet:
    """A figure of Single 2014."""

    name: str
    title: str
    figure: str
    panels: list[Panel] = field(default_factory=list)


def preset(name: str, *more) -> tuple:
    return ("--preset", name, *more)


def method(name: str, *options) -> tuple:
    return ("--method", name, *options)


def sheets() -> list[Sheet]:
    """What Single 2014 shows, with our series beside theirs."""
    fine = method("flss", "--lambda-step", 1)
    theirs = ("--series", "taylor", "--terms")
    return [
        Sheet("gratings", "Three gratings", "2.3", [Panel(name, preset(name), fine) for name in GRATINGS]),
        Sheet(
            "methods",
            "Every method on the blazed grating",
            "2.4 and 2.5",
            [Panel(name, preset("blazed"), method(name)) for name in ("flss", "nmm", "pq", "stam")]
            + [Panel("nmm, unweighted", preset("blazed"), method("nmm", "--weighted", "false"))],
        ),
        Sheet(
            "steps",
            "Steps between wavelengths, on Elaphe",
            "2.6",
            [Panel(f"{nm} nm", preset("elaphe"), method("flss", "--lambda-step", nm)) for nm in STEPS_NM],
        ),
        Sheet(
            "coherence",
            "Coherence lengths, on the blazed grating",
            "2.7",
            [Panel(f"{um:g} um", preset("blazed", "--coherence-length", um), method("flss")) for um in COHERENCE_UM],
        ),
        Sheet(
            "taylor",
            "Terms of Taylor's series in single precision, on Xenopeltis",
            "2.8",
            [Panel(f"{n} terms", preset("xenopeltis"), method("flss", *theirs, n)) for n in TERMS],
        ),
        Sheet(
            "chebyshev",
            "Terms of the Chebyshev series in single precision, on Xenopeltis",
            "2.8, with ours",
            [Panel(f"{n} terms", preset("xenopeltis"), method("flss", "--terms", n)) for n in TERMS],
        ),
        Sheet(
            "angles",
            "Angles of incidence, on Xenopeltis",
            "2.9",
            [Panel(f"{deg} degrees", preset("xenopeltis"), method("flss"), deg) for deg in THETA_I_DEG],
        ),
        Sheet(
            "pq",
            "FLSS beside PQ",
            "2.10 to 2.13",
            [Panel(f"{name}, {of}", preset(name), method(of)) for of in ("flss", "pq") for name in GRATINGS],
        ),
    ]


def figures() -> dict:
    """Draws the sheets, and returns the errors of every panel."""
    folder = images(PAGE)
    with TemporaryDirectory() as scratch:
        references = References(Path(scratch))
        made = [draw(sheet, references, folder) for sheet in sheets()]
        by_name = {sheet["name"]: sheet["panels"] for sheet in made}
        of_method = {row["caption"]: row for row in by_name["methods"]}
        of_step = {row["caption"]: row for row in by_name["steps"]}
        return {
            "size": SIZE,
            "sheets": made,
            "taylor_worst": max(by_name["taylor"], key=lambda row: row["delta_e_mean"]),
            "taylor_last": by_name["taylor"][-1],
            "chebyshev_good": next(row for row in by_name["chebyshev"] if row["delta_e_mean"] < 1),
            "five_nm": of_step["5 nm"],
            "ten_nm": of_step["10 nm"],
            "nmm": of_method["nmm"],
            "nmm_unweighted": of_method["nmm, unweighted"],
            "stam": of_method["stam"],
            "reference_check": [
                {"surface": " ".join(map(str, surface)), **check(surface)} for surface in map(preset, GRATINGS)
            ],
        }


class References:
    """The reference maps, each drawn once."""

    def __init__(self, folder: Path):
        self.folder = folder
        self._drawn: dict[tuple, tuple[Path, float]] = {}
        # The disc alone is compared.
        self.mask = folder / "mask.png"
        place = (np.arange(SIZE) + 0.5) * 2 / SIZE - 1
        Image.fromarray(np.where(np.hypot(place[:, None], place) < 1, 255, 0).astype(np.uint8)).save(self.mask)

    def of(self, panel: Panel) -> tuple[Path, float]:
        """The map without error, and the exposure at which it is shown."""
        key = (panel.surface, panel.theta_i_deg)
        if key not in self._drawn:
            exr = self.folder / f"reference-{len(self._drawn)}.exr"
            report = json.loads(
                sunbeam("brdf-map", "-o", exr, "--png", exr.with_suffix(".png"), *panel.words(REFERENCE))
            )
            self._drawn[key] = (exr, report["exposure"])
        return self._drawn[key]


def draw(sheet: Sheet, references: References, folder: Path) -> dict:
    """Writes the sheet and returns its panels' figures."""
    cells, rows = [], []
    for number, panel in enumerate(sheet.panels):
        reference, exposure = references.of(panel)
        exr = references.folder / f"{sheet.name}-{number}.exr"
        png = exr.with_suffix(".png")
        report = json.loads(
            sunbeam("brdf-map", "-o", exr, "--png", png, "--exposure", exposure, *panel.words(panel.method))
        )
        found = json.loads(
            sunbeam("compare", reference, exr, "--exposure", math.log2(exposure), "--mask", references.mask)
        )
        delta_e = found["delta_e_2000"]
        cells.append((png, f"{panel.caption}: CIEDE2000 {delta_e['mean']:.2g}"))
        rows.append(
            {
                "caption": panel.caption,
                "relative_rmse": math.sqrt(found["relative_mse"]),
                "delta_e_mean": delta_e["mean"],
                "delta_e_p99": delta_e["p99"],
                "flip": found["flip"]["mean"],
                "seconds": report["seconds"],
            }
        )
        print(f"{sheet.name}: {cells[-1][1]}", flush=True)
    columns = COLUMNS if len(cells) > 6 else 3
    sheet_png = references.folder / f"{sheet.name}.png"
    contact_sheet([cells[i : i + columns] for i in range(0, len(cells), columns)], sheet_png, PANEL)
    picture = folder / f"{sheet.name}.jpg"
    with Image.open(sheet_png) as drawn:
        drawn.save(picture, quality=88)
    return {"name": sheet.name, "title": sheet.title, "figure": sheet.figure, "picture": picture.name, "panels": rows}


def check(surface: tuple) -> dict:
    """How far the reference's spectra are from the direct double-precision sum, relative to the largest of them."""
    draw_one = random.Random(1)

    def direction() -> list[float]:
        # Uniform over the hemisphere's projection, which is what a map shows.
        radius, azimuth = math.sqrt(draw_one.random()) * 0.99, draw_one.uniform(0, 2 * math.pi)
        x, y = radius * math.cos(azimuth), radius * math.sin(azimuth)
        return [x, y, math.sqrt(1 - x * x - y * y)]

    lines = [
        json.dumps({"wi": [0, 0, 1], "wo": direction(), "wavelength": draw_one.uniform(380, 780)})
        for _ in range(CHECKS)
    ]

    def answers(*words) -> list[float]:
        answered = sunbeam("eval", *surface, "--model", "patch", *words, stdin="\n".join(lines) + "\n")
        return [json.loads(line)["f"] for line in answered.splitlines()]

    exact, tables = answers("--method", "exact"), answers("--method", "table", "--tolerance", 1e-5)
    return {
        "pairs": CHECKS,
        "worst": max(abs(a - b) for a, b in zip(exact, tables)) / max(exact),
    }
