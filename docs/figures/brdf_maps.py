"""The part `brdf-maps`: figures 2.2 to 2.13 of Single 2014 as sheets, with errors of each panel and checks."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from mitsuba_scenes.crosscheck.cases import SCANS

from . import map_checks as checks
from .map_panels import FINE, PANEL, REFERENCE, Drawing, Maps, Panel, Sheet, draw
from .map_surfaces import PERIOD_UM, SKINS, Surface, Surfaces, cut_out
from .page import images
from .taylor_sums import CONVERGED, WAVELENGTH_UM, pictures, plot, sums

PAGE = "brdf-maps"
# Box about the blazed grating's first order: x from, x to, y from, y to, in direction sines.
FIRST_ORDER = (-0.36, -0.10, -0.065, 0.065)
# Box about the mirror direction, in the same form.
CENTRE = (-0.05, 0.05, -0.05, 0.05)
# Steps between wavelengths of FLSS.
STEPS_NM = (1, 5, 10, 25, 50, 100)
# Values of σs in figure 2.10, Single 2014's width of the coherence window; see `map_checks.valleys`.
SIGMAS_UM = (3.25, 6.5, 15, 30, 45, 65)
# Numbers of terms in figures 2.11 and 2.12, and the 7 and 9 of the text, by surface.
TERMS = {
    "blazed": (1, 2, 4, 7, 9, 24, 26, 40),
    "xenopeltis-scan": (1, 2, 4, 24, 26, 40),
    "xenopeltis-procedural": (24, 26, 40, 64),
    "elaphe-scan": (1, 2, 5, 9, 10, 11, 24, 40),
    "elaphe-procedural": (5, 9, 11, 40),
}
# Angles of incidence.
THETA_I_DEG = (0, 10, 20, 30)
# The cut-outs of figure 2.2 in µm: edge of the square and length of the scale bar.
CUT_OUTS_UM = {"blazed": (17.5, 2.5), "elaphe": (6.5, 3.27), "xenopeltis": (6.5, 3.21)}
# Edge in µm of the small tile of figure 2.9.
SMALL_UM = 3.25
# Number of the small tile's repeats along each axis.
SMALL_REPEATS = 20


def method(name: str, *options) -> tuple:
    """Options of `sunbeam brdf-map` that select a method."""
    return ("--method", name, *options)


FLSS, PQ = method("flss"), method("pq")


def sheets(surfaces: Surfaces) -> list[Sheet]:
    """The sheets of maps in the order of their figures, scans before presets."""
    blazed, elaphe, xenopeltis = surfaces.blazed, surfaces.skin("elaphe"), surfaces.skin("xenopeltis")
    skins = [*elaphe, *xenopeltis]

    def first_order(caption: str, way: tuple, surface: Surface = blazed, fine: int = FINE) -> Panel:
        return Panel(caption, surface, way, box=FIRST_ORDER, fine=fine)

    gems = method("stam", "--stam-form", "gems", "--period-um", PERIOD_UM)
    methods = [
        first_order("(a) FLSS", FLSS, fine=5),
        Panel("(a) FLSS, centre", blazed, FLSS, box=CENTRE, fine=5),
        first_order("(b) NMM", method("nmm", "--weighted", "false"), surfaces.blazed_row, 5),
        Panel("(b) NMM, centre", surfaces.blazed_row, method("nmm", "--weighted", "false"), box=CENTRE, fine=5),
        first_order("NMM, weighted", method("nmm"), surfaces.blazed_row, 5),
        first_order("(c) PQ", PQ, fine=5),
        # A display colour, which cannot be compared with reflectances.
        Panel("(d) Stam, GPU Gems", blazed, gems, box=FIRST_ORDER, fine=5, exposure=1, compared=False),
        first_order("Stam, spacing alone", method("stam"), fine=5),
    ]
    xeno_pq = []
    for surface in xenopeltis:
        for deg in (0, 20):
            xeno_pq += [
                Panel(f"{surface.name}\nθi {deg}°, {name}", surface, way, deg)
                for name, way in (("FLSS", FLSS), ("PQ", PQ))
            ]
    small = surfaces.cut(xenopeltis[0], SMALL_UM)
    repeated = method("pq", "--repeats", SMALL_REPEATS)
    xeno_pq += [
        Panel(f"{small.name}\nPQ, {SMALL_REPEATS} × {SMALL_REPEATS} tiles", small, repeated),
        Drawing(f"{small.name}\nthe tile", cut_out(small, SMALL_UM, None, PANEL)),
    ]
    return [
        Sheet("cut-outs", 3, [Drawing(*each) for each in cut_outs(surfaces)]),
        Sheet("gratings", 3, [first_order("blazed", FLSS), *(Panel(s.name, s, FLSS) for s in skins)]),
        Sheet("methods", 4, methods),
        Sheet("steps-blazed", 3, [first_order(f"{nm} nm", method("flss", "--lambda-step", nm)) for nm in STEPS_NM]),
        *(
            Sheet(f"steps-{key(s)}", 3, [Panel(f"{nm} nm", s, method("flss", "--lambda-step", nm)) for nm in STEPS_NM])
            for s in elaphe
        ),
        Sheet("pq-blazed", 2, [first_order("FLSS", FLSS), first_order("PQ", PQ)]),
        Sheet(
            "pq-elaphe", 2, [Panel(f"{s.name}\n{n}", s, way) for s in elaphe for n, way in (("FLSS", FLSS), ("PQ", PQ))]
        ),
        Sheet("pq-xenopeltis", 4, xeno_pq),
        Sheet("coherence", 3, [windowed(blazed, f"σs {um:g} µm", um) for um in SIGMAS_UM]),
        Sheet("coherence-literal", 3, [windowed(blazed, f"4σs = {4 * um:g} µm", 4 * um) for um in SIGMAS_UM[:3]]),
        Sheet("taylor-blazed", 3, terms(surfaces, surfaces.blazed_row, TERMS["blazed"])),
        *(Sheet(f"taylor-{key(s)}", 3, terms(surfaces, s, TERMS[key(s)])) for s in skins),
        *(
            Sheet(f"angles-{key(s)}", 4, [Panel(f"θi {deg}°", s, FLSS, deg, compared=False) for deg in THETA_I_DEG])
            for s in xenopeltis
        ),
    ]


def key(surface: Surface) -> str:
    """The surface's name in file names and data."""
    return surface.name.lower().replace(", ", "-")


def windowed(surface: Surface, caption: str, coherence_um: float) -> Panel:
    """FLSS of the blazed grating with a coherence length in um."""
    return Panel(caption, surface.with_coherence(coherence_um), FLSS, box=FIRST_ORDER)


def terms(surfaces: Surfaces, surface: Surface, counts: tuple) -> list[Panel]:
    """A row for each number of terms: Taylor's series about the lowest height and the middle, and Chebyshev's."""
    based, box = surfaces.about_the_base(surface), FIRST_ORDER if surface.name.startswith("blazed") else None
    made = []
    for n in counts:
        taylor, chebyshev = method("flss", "--series", "taylor", "--terms", n), method("flss", "--terms", n)
        made += [
            Panel(f"N = {n}, about the base", based, taylor, box=box, truth=surface),
            Panel(f"N = {n}, about the middle", surface, taylor, box=box),
            Panel(f"N = {n}, Chebyshev", surface, chebyshev, box=box),
        ]
    return made


def cut_outs(surfaces: Surfaces) -> list[tuple]:
    """Captions and pictures of figure 2.2."""
    made = []
    for letter, name in zip("abc", CUT_OUTS_UM):
        edge_um, bar_um = CUT_OUTS_UM[name]
        for surface in [surfaces.blazed_row] if name == "blazed" else surfaces.skin(name):
            caption = f"({letter}) {surface.name}\nbar {bar_um:g} µm"
            made.append((caption, cut_out(surface, edge_um, bar_um, PANEL)))
    return made


def figures() -> dict:
    """Draws the sheets; returns the errors of every panel and the numbers of the checks."""
    folder = images(PAGE)
    with TemporaryDirectory() as scratch:
        surfaces, maps = Surfaces(Path(scratch)), Maps(Path(scratch))
        asked = {sheet.name: sheet for sheet in sheets(surfaces)}
        made = {name: draw(sheet, maps, folder) for name, sheet in asked.items()}
        elaphe, xenopeltis = surfaces.skin("elaphe"), surfaces.skin("xenopeltis")
        series = [surfaces.blazed_row, *xenopeltis, *elaphe]
        summed = [sums(surface) for surface in series]
        checks.hold_against_the_sum(summed[0], surfaces.blazed_row)
        plot(summed, folder / "taylor-sums.svg")
        parts = [Drawing(*each) for found in summed[-len(elaphe) :] for each in pictures(found)]
        made["partial-sums"] = draw(Sheet("partial-sums", 5, parts), maps, folder)
        told = {
            "panel": PANEL,
            "sheets": made,
            "scans": all(file.exists() for file in SCANS.values()),
            "skins": {name: [{"name": s.name, "key": key(s)} for s in surfaces.skin(name)] for name in SKINS},
            "steps": {
                name: checks.steps(maps, asked[f"steps-{name}"].panels, STEPS_NM)
                for name in ("blazed", *map(key, elaphe))
            },
            "white_spot": checks.white_spot(maps, asked["methods"].panels),
            "spread": checks.spread(surfaces.blazed),
            "valleys": checks.valleys(surfaces.blazed, SIGMAS_UM),
            "terms_seen": {key(s): checks.terms_seen(made[f"taylor-{key(s)}"]["panels"]) for s in series},
            "pixel": max(
                maps.error(Panel("", surfaces.about_the_base(s), REFERENCE, truth=s))["delta_e_mean"] for s in series
            ),
            "sums": [found.figures() for found in summed],
            "sums_nm": 1e3 * WAVELENGTH_UM,
            "converged": CONVERGED,
            "right_side": {key(s): checks.right_side(maps, asked[f"angles-{key(s)}"].panels) for s in xenopeltis},
            "reference_check": [
                {"surface": s.name, **checks.reference(s)} for s in (surfaces.blazed, *elaphe, *xenopeltis)
            ],
        }
        checks.hold(told)
        return told
