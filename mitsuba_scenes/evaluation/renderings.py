"""The renderings of Single 2014 (figures 2.14 to 2.18), on the GPU and path-traced in Mitsuba."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from ..environment import use_variant
from ..light import Light
from ..skin import preset_skin
from .page import images
from .studio import SNAKE, SPP, SUPERSAMPLE, Sheet, Shot, Studio, both, draw

PAGE = "renderings"
SKINS = ("blazed", "elaphe", "xenopeltis")
ZOOMS_DEG = (30, 14, 6, 2.5)
# Azimuth and elevation in degrees along an arc of the sun; the snake's tail points east, +x.
SOUTH_TO_NORTH = ((-90, 20), (-90, 50), (-90, 80), (90, 50), (90, 20))
SOUTHEAST_TO_WEST = ((-45, 25), (-75, 40), (-110, 45), (-150, 40), (-180, 25))


def sheets() -> list[Sheet]:
    """Everything that the page shows."""
    xenopeltis = preset_skin("xenopeltis")
    skins = [Shot(f"{name}, flss", preset_skin(name), "flss") for name in SKINS]
    bare = [replace(shot, caption=f"{shot.caption}, bare", pigment=False) for shot in skins]
    zooms = [Shot(f"{deg} degrees, table", xenopeltis, "table", view=replace(SNAKE, fov_deg=deg)) for deg in ZOOMS_DEG]

    def sweep(name: str, title: str, places: tuple) -> Sheet:
        shots = [
            Shot(f"{azimuth}, {elevation}, table", xenopeltis, "table", Light(azimuth, elevation, "directional", 0))
            for azimuth, elevation in places
        ]
        text = (
            "Captions are the sun's azimuth, counter-clockwise from the tail's direction, and its elevation in degrees."
        )
        return Sheet(name, title, "2.17 and 2.18", text, both(shots))

    return [
        Sheet(
            "skins",
            "Three skins",
            "2.14 and 2.15",
            "Over the pigment, weighted by what the surface does not reflect, and without it (“bare”).",
            [*both(skins), *both(bare)],
        ),
        Sheet("zoom", "Closer", "2.16", "The field of view is the caption's number.", both(zooms)),
        sweep("south-to-north", "The sun from south to north", SOUTH_TO_NORTH),
        sweep("southeast-to-west", "The sun from south-east to west", SOUTHEAST_TO_WEST),
    ]


def figures() -> dict:
    """Draws the sheets; returns how far each path-traced picture is from the one above it or beside it."""
    use_variant()
    folder = images(PAGE)
    with TemporaryDirectory() as scratch:
        studio = Studio(Path(scratch))
        made = [draw(sheet, studio, folder) for sheet in sheets()]
        return {"spp": SPP, "rays": SUPERSAMPLE**2, "adapter": studio.adapter, "sheets": made}
