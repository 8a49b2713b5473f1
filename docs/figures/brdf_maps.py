"""Part `brdf-maps` of the documentation (page.py): figures 2.2 to 2.13 of Single 2014, their errors and checks.

Single 2014 is M. Single's thesis (docs/model.md#sources). FLSS, NMM and PQ are its methods, and Stam's is an older one;
all are methods of `sunbeam brdf-map` (docs/realtime.md).

- *Map*: a picture of the BRDF over outgoing directions. Positions on it are direction sines.
- *Sheet*: one picture file with several panels, maps or drawings: `Sheet(name, columns, panels)` (map_panels.py).
- `Panel(caption, surface, options, theta_i_deg)`: a map by the method that the options select. If it is `compared`, it
  gets its error against a reference map. An inset enlarges its `box`.
- *Skin*: the surface of a snake, of the species Elaphe or Xenopeltis, as a measured scan and as a procedural preset.
- *Terms*: those of the series of the phase screen in powers or Chebyshev polynomials of the heights
  (docs/model.md#the-two-expansions).
- *Partial sums*: those of every fourth term of the series in powers, Taylor's (taylor_sums.py).
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from mitsuba_scenes.crosscheck.cases import SCANS

from . import map_checks as checks
from .map_panels import FINE, PANEL, REFERENCE, Box, Drawing, Maps, Panel, Sheet, draw
from .map_surfaces import PERIOD_UM, SKINS, Surface, Surfaces, cut_out
from .page import images
from .taylor_sums import CONVERGED, WAVELENGTH_UM, pictures, plot, sums

PART = "brdf-maps"
# Region of the map about the blazed grating's order −1, into which the grating sends most light.
FIRST_ORDER = Box(x_min=-0.36, x_max=-0.10, y_min=-0.065, y_max=0.065)
# Region of the map about the mirror direction at normal incidence.
CENTRE = Box(x_min=-0.05, x_max=0.05, y_min=-0.05, y_max=0.05)
# Steps between the wavelengths that FLSS sums, for the sheets `steps-…` of figures 2.5 and 2.6.
STEPS_NM = (1, 5, 10, 25, 50, 100)
# Values in figure 2.10 of σs, Single 2014's width of the coherence window. The thesis can be read in two ways: σs is
# the coherence length, or the window's standard deviation, a quarter of the coherence length.
SIGMAS_UM = (3.25, 6.5, 15, 30, 45, 65)
# Numbers of terms of the series, by the surface's `key`. They are those of figures 2.11 and 2.12, with 7 and 9 from the
# text about them. The procedural Xenopeltis also has 64, since the figure's 40 are too few for it.
TERMS = {
    "blazed": (1, 2, 4, 7, 9, 24, 26, 40),
    "xenopeltis-scan": (1, 2, 4, 24, 26, 40),
    "xenopeltis-procedural": (24, 26, 40, 64),
    "elaphe-scan": (1, 2, 5, 9, 10, 11, 24, 40),
    "elaphe-procedural": (5, 9, 11, 40),
}
# Angles of incidence: those of figure 2.13, and 30°.
THETA_I_DEG = (0, 10, 20, 30)
# Edges of the squares of figure 2.2, in the order of its letters (a) to (c).
CUT_OUT_UM = {"blazed": 17.5, "elaphe": 6.5, "xenopeltis": 6.5}
# Lengths of the scale bars of figure 2.2, from its caption.
BAR_UM = {"blazed": 2.5, "elaphe": 3.27, "xenopeltis": 3.21}
# Edge of the small tile of figure 2.9, and number of its repeats along each axis.
SMALL_UM = 3.25
SMALL_REPEATS = 20


def method(name: str, *options) -> tuple:
    """Options of `sunbeam brdf-map` that select a method."""
    return ("--method", name, *options)


FLSS, PQ = method("flss"), method("pq")
# Names and options of the methods that are compared for each surface.
FLSS_AND_PQ = (("FLSS", FLSS), ("PQ", PQ))
# NMM as published, without quadrature weights.
UNWEIGHTED_NMM = method("nmm", "--weighted", "false")
# Factor on the side of the maps of the sheet `methods` (`Panel.fine`), above FINE, because the box CENTRE is small.
FINE_METHODS = 5


def sheets(surfaces: Surfaces) -> list[Sheet]:
    """The sheets of maps in the order of their figures, scans before presets."""
    # The blazed grating as the preset, one period that repeats, and as a tile of 65 µm, which NMM needs.
    blazed, blazed_tile = surfaces.blazed, surfaces.blazed_tile
    # Lists of the scan, if it is present, and the preset.
    elaphe, xenopeltis = surfaces.skin("elaphe"), surfaces.skin("xenopeltis")
    skins = [*elaphe, *xenopeltis]
    return [
        Sheet("cut-outs", 3, cut_outs(surfaces)),
        Sheet("gratings", 3, [first_order("blazed", blazed, FLSS), *(Panel(s.name, s, FLSS) for s in skins)]),
        Sheet("methods", 4, every_method(blazed, blazed_tile)),
        Sheet("steps-blazed", 3, [first_order(f"{nm} nm", blazed, flss_in_steps(nm)) for nm in STEPS_NM]),
        *(Sheet(f"steps-{key(s)}", 3, [Panel(f"{nm} nm", s, flss_in_steps(nm)) for nm in STEPS_NM]) for s in elaphe),
        Sheet("pq-blazed", 2, [first_order(name, blazed, options) for name, options in FLSS_AND_PQ]),
        Sheet(
            "pq-elaphe", 2, [Panel(f"{s.name}\n{name}", s, options) for s in elaphe for name, options in FLSS_AND_PQ]
        ),
        Sheet("pq-xenopeltis", 4, xenopeltis_pq(surfaces, xenopeltis)),
        Sheet("coherence", 3, [windowed(blazed, f"σs {um:g} µm", um) for um in SIGMAS_UM]),
        # With σs as the window's standard deviation the coherence length is 4σs.
        Sheet("coherence-literal", 3, [windowed(blazed, f"4σs = {4 * um:g} µm", 4 * um) for um in SIGMAS_UM[:3]]),
        Sheet("taylor-blazed", 3, terms(surfaces, blazed_tile, TERMS["blazed"])),
        *(Sheet(f"taylor-{key(s)}", 3, terms(surfaces, s, TERMS[key(s)])) for s in skins),
        *(
            Sheet(f"angles-{key(s)}", 4, [Panel(f"θi {deg}°", s, FLSS, deg, compared=False) for deg in THETA_I_DEG])
            for s in xenopeltis
        ),
    ]


def flss_in_steps(step_nm: float) -> tuple:
    """FLSS with this step between wavelengths."""
    return method("flss", "--lambda-step", step_nm)


def first_order(caption: str, surface: Surface, options: tuple, fine: int = FINE) -> Panel:
    """A map of the blazed grating, with order −1 in its inset. `fine` is that of `Panel`."""
    return Panel(caption, surface, options, box=FIRST_ORDER, fine=fine)


def every_method(blazed: Surface, blazed_tile: Surface) -> list[Panel]:
    """The blazed grating by each method, with insets of order −1 or of the centre."""
    gems = method("stam", "--stam-form", "gems", "--period-um", PERIOD_UM)
    return [
        first_order("(a) FLSS", blazed, FLSS, FINE_METHODS),
        Panel("(a) FLSS, centre", blazed, FLSS, box=CENTRE, fine=FINE_METHODS),
        first_order("(b) NMM", blazed_tile, UNWEIGHTED_NMM, FINE_METHODS),
        Panel("(b) NMM, centre", blazed_tile, UNWEIGHTED_NMM, box=CENTRE, fine=FINE_METHODS),
        first_order("NMM, weighted", blazed_tile, method("nmm"), FINE_METHODS),
        first_order("(c) PQ", blazed, PQ, FINE_METHODS),
        # This form of Stam's method gives display colours, which cannot be compared with reflectances.
        Panel("(d) Stam, GPU Gems", blazed, gems, box=FIRST_ORDER, fine=FINE_METHODS, exposure=1, compared=False),
        first_order("Stam, spacing alone", blazed, method("stam"), FINE_METHODS),
    ]


def xenopeltis_pq(surfaces: Surfaces, xenopeltis: list[Surface]) -> list[Panel | Drawing]:
    """Figure 2.9: FLSS and PQ on Xenopeltis, then PQ on a small tile that repeats, and a drawing of the tile."""
    # The small tile is cut from the scan if it is present, else from the preset.
    small = surfaces.cut(xenopeltis[0], SMALL_UM)
    return [
        *(
            Panel(f"{surface.name}\nθi {deg}°, {name}", surface, options, deg)
            for surface in xenopeltis
            for deg in (0, 20)
            for name, options in FLSS_AND_PQ
        ),
        Panel(
            f"{small.name}\nPQ, {SMALL_REPEATS} × {SMALL_REPEATS} tiles",
            small,
            method("pq", "--repeats", SMALL_REPEATS),
        ),
        # Without a scale bar.
        Drawing(f"{small.name}\nthe tile", cut_out(small, SMALL_UM, None, PANEL)),
    ]


def key(surface: Surface) -> str:
    """The surface's name in file names and data, such as `elaphe-scan`."""
    return surface.name.lower().replace(", ", "-")


def windowed(blazed: Surface, caption: str, coherence_um: float) -> Panel:
    """FLSS on the blazed preset with another coherence length."""
    return Panel(caption, blazed.with_coherence(coherence_um), FLSS, box=FIRST_ORDER)


def terms(surfaces: Surfaces, surface: Surface, counts: tuple) -> list[Panel]:
    """Three panels for each number of terms in `counts`.

    They are Taylor's series about the lowest height, Taylor's series about the middle of the heights, and Chebyshev's.
    """
    # The command's series are about the middle of the heights. `Surfaces.about_the_base` lowers one pixel by the range
    # of heights, so that the middle is the lowest height of all other pixels.
    based = surfaces.about_the_base(surface)
    box = FIRST_ORDER if surface.name == "blazed" else None
    panels = []
    for n in counts:
        taylor, chebyshev = method("flss", "--series", "taylor", "--terms", n), method("flss", "--terms", n)
        panels += [
            Panel(f"N = {n}, about the base", based, taylor, box=box, reference_surface=surface),
            Panel(f"N = {n}, about the middle", surface, taylor, box=box),
            Panel(f"N = {n}, Chebyshev", surface, chebyshev, box=box),
        ]
    return panels


def cut_outs(surfaces: Surfaces) -> list[Drawing]:
    """The panels of figure 2.2: cut-outs of each relief with scale bars."""
    drawings = []
    for letter, (name, edge_um) in zip("abc", CUT_OUT_UM.items()):
        for surface in [surfaces.blazed_tile] if name == "blazed" else surfaces.skin(name):
            caption = f"({letter}) {surface.name}\nbar {BAR_UM[name]:g} µm"
            drawings.append(Drawing(caption, cut_out(surface, edge_um, BAR_UM[name], PANEL)))
    return drawings


def figures() -> dict:
    """Draws the sheets and returns the page's numbers. Raises SetupError if they contradict its text.

    - `panel`: the side of a panel in pixels. `sheets`: the results of `draw`, with the errors of compared panels.
    - `scans`: whether all scans are present. `skins`: name and key of the surfaces of each species.
    - `steps`, `white_spot`, `spread`, `valleys`, `terms_seen`, `right_side`, `reference_check`: from map_checks.py.
    - `pixel`: the mean colour difference by which `about_the_base` changes a reference map, since it lowers one pixel;
      the largest of all surfaces.
    - `sums`: numbers of Taylor's terms at the wavelength `sums_nm`, from which on errors are at most `converged`.
    """
    folder = images(PART)
    with TemporaryDirectory() as scratch:
        surfaces, maps = Surfaces(Path(scratch)), Maps(Path(scratch))
        by_name = {sheet.name: sheet for sheet in sheets(surfaces)}
        drawn = {name: draw(sheet, maps, folder) for name, sheet in by_name.items()}
        elaphe, xenopeltis = surfaces.skin("elaphe"), surfaces.skin("xenopeltis")
        # Surfaces whose series are studied.
        summed = [surfaces.blazed_tile, *xenopeltis, *elaphe]
        blazed_sums = sums(surfaces.blazed_tile)
        elaphe_sums = [sums(surface) for surface in elaphe]
        taylor = [blazed_sums, *(sums(surface) for surface in xenopeltis), *elaphe_sums]
        checks.check_against_direct_sum(blazed_sums, surfaces.blazed_tile)
        plot(taylor, folder / "taylor-sums.svg")
        partial = [Drawing(*each) for found in elaphe_sums for each in pictures(found)]
        drawn["partial-sums"] = draw(Sheet("partial-sums", 5, partial), maps, folder)
        made = {
            "panel": PANEL,
            "sheets": drawn,
            "scans": all(file.exists() for file in SCANS.values()),
            "skins": {name: [{"name": s.name, "key": key(s)} for s in surfaces.skin(name)] for name in SKINS},
            "steps": {
                name: checks.steps(maps, by_name[f"steps-{name}"].panels, STEPS_NM)
                for name in ("blazed", *map(key, elaphe))
            },
            "white_spot": checks.white_spot(maps, by_name["methods"].panels),
            "spread": checks.spread(surfaces.blazed),
            "valleys": checks.valleys(surfaces.blazed, SIGMAS_UM),
            "terms_seen": {key(s): checks.terms_seen(drawn[f"taylor-{key(s)}"]["panels"]) for s in summed},
            "pixel": max(
                maps.error(Panel("", surfaces.about_the_base(s), REFERENCE, reference_surface=s))["delta_e_mean"]
                for s in summed
            ),
            "sums": [found.figures() for found in taylor],
            "sums_nm": 1e3 * WAVELENGTH_UM,
            "converged": CONVERGED,
            "right_side": {key(s): checks.right_side(maps, by_name[f"angles-{key(s)}"].panels) for s in xenopeltis},
            "reference_check": [
                {"surface": s.name, **checks.reference(s)} for s in (surfaces.blazed, *elaphe, *xenopeltis)
            ],
        }
        checks.check(made)
        return made
