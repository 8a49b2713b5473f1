"""A compact disc and a DVD under their polycarbonate. Lengths are in cm, z is up.

On Mitsuba's disk the texture coordinate u is the radius. The x axis of a relief follows u, and the preset `cd` has its
tracks along y, so they are circles.
"""

from __future__ import annotations

from dataclasses import dataclass

import mitsuba as mi

from .light import lamps, uniform_sky
from .scene import View, soil, stage

# Refractive index of polycarbonate.
POLYCARBONATE = 1.58
# Radius of the disc (IEC 60908 and ECMA-267).
RADIUS_CM = 6.0
# Inner and outer radius of the tracks.
TRACKS_CM = (2.3, 5.85)
# Radius of the clear hub, within which there is no metal.
HUB_CM = 1.9
# Reflectance of the hub's body: slightly brighter than the ground.
HUB_GREY = 0.05
# Radius of the hole.
HOLE_CM = 0.75
# Height of the disc above the ground.
HEIGHT_CM = 0.12
# Vertical distance between the disc's parts, enough for rays to tell them apart.
LAYER_CM = 0.002
# Camera, as far away as a person at a table.
DISC_VIEW = View(origin_cm=(0, -40, 43), target_cm=(0, -0.2, 0), fov_deg=13.8)
# Coherence length, the width over which light interferes, in pitches of the tracks. The preset's tile repeats a few
# hundred pits, while a pixel of a real disc would see thousands, all different. Larger coherence lengths show the
# repetition as streaks.
COHERENCE_TRACKS = 10
# Relative error of the tables, above the default: the colours are smooth, and the build takes half the time.
TOLERANCE = 1e-2
# Radiance of a white plane at the disc that faces one of the small lamps. The unit of all radiances here is that of a
# white plane in the sun (light.py).
LAMP_BRIGHTNESS = 0.25
# Radiance of the dim room, in all directions.
ROOM_RADIANCE = 0.03
# Radiance of the room's window. A larger one brightens its colours on the disc.
WINDOW_RADIANCE = 8.0
# Width and height of the room's window.
WINDOW_CM = (50.0, 70.0)


@dataclass(frozen=True)
class Format:
    """Kind of disc.

    `pitch_um` is the distance between tracks and `depth_um` the depth of pits. `lamps` has azimuth and elevation in
    degrees of small lamps (`direction` of light.py), and `window_centre_cm` is the centre of a window of the room.
    Their first orders reach the camera of DISC_VIEW.
    """

    pitch_um: float
    depth_um: float
    lamps: list[tuple[float, float]]
    window_centre_cm: tuple[float, float, float]

    def tracks(self) -> dict:
        """The plugin for the tracks of pits in aluminium."""
        return {
            "type": "diffraction",
            "preset": "cd",
            # Factors on the preset's lengths along the surface and on its heights.
            "scale": self.pitch_um / CD.pitch_um,
            "depth": self.depth_um / CD.depth_um,
            "coherence_length": COHERENCE_TRACKS * self.pitch_um,
            "tolerance": TOLERANCE,
            "material": "Al",
            "cover_eta": POLYCARBONATE,
        }


# Compact disc, as in the preset.
CD = Format(pitch_um=1.6, depth_um=0.12, lamps=[(73, 64), (114, 61)], window_centre_cm=(60, 150, 115))
# DVD (ECMA-267). Its depth is about a quarter of the wavelength of the player's laser, 0.65 µm, in polycarbonate.
DVD = Format(pitch_um=0.74, depth_um=0.105, lamps=[(-11, 75), (160, 65)], window_centre_cm=(111, 92, 115))


def disc(kind: Format) -> dict:
    """The disc as entries of a scene dictionary: horizontal disks of decreasing radius, each slightly above the last.

    From below: a mirror without tracks up to the rim, the tracks, a mirror inside the tracks, the hub without metal,
    and ground in the hole. For simplicity the mirrors have no polycarbonate over them.
    """
    mirror = {"type": "conductor", "material": "Al"}
    # An opaque grey in place of clear polycarbonate, through which the path tracer would hit the lamps by chance alone.
    hub = {"type": "plastic", "int_ior": POLYCARBONATE, "diffuse_reflectance": {"type": "rgb", "value": HUB_GREY}}
    parts = {
        "rim": (RADIUS_CM, mirror),
        "tracks": (TRACKS_CM[1], kind.tracks()),
        "mirror": (TRACKS_CM[0], mirror),
        "hub": (HUB_CM, hub),
        "hole": (HOLE_CM, soil()),
    }
    transform = mi.ScalarTransform4f()
    return {
        name: {
            "type": "disk",
            "to_world": transform.translate([0, 0, HEIGHT_CM + layer * LAYER_CM]).scale(radius_cm),
            "bsdf": bsdf,
        }
        for layer, (name, (radius_cm, bsdf)) in enumerate(parts.items())
    }


def window(kind: Format) -> dict:
    """A room's window behind the disc and the dim light of the room, as entries of a scene dictionary."""
    transform = mi.ScalarTransform4f()
    # It faces the disc at the origin. Mitsuba's rectangle has sides of 2.
    place = transform.look_at(list(kind.window_centre_cm), [0, 0, 0], [0, 0, 1])
    place = place @ transform.scale([0.5 * WINDOW_CM[0], 0.5 * WINDOW_CM[1], 1])
    emitter = {"type": "area", "radiance": {"type": "d65", "scale": WINDOW_RADIANCE}}
    return {"window": {"type": "rectangle", "to_world": place, "emitter": emitter}, **uniform_sky(ROOM_RADIANCE)}


def disc_scene(view: View = DISC_VIEW, spp: int = 64, kind: Format = CD, emitters: dict | None = None) -> dict:
    """A disc on the ground, with the read side up, under its small lamps or other `emitters`."""
    return stage(disc(kind), emitters or lamps(kind.lamps, LAMP_BRIGHTNESS, ROOM_RADIANCE), view, spp)
