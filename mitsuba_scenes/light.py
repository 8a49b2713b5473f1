"""Sun, sky and lamps as Mitsuba emitters with the spectrum of D65.

The unit of radiance is that of a white diffuse plane facing the sun. Since such a plane has the radiance E/π at the
irradiance E, the sun's irradiance on it is π. The frame is that of scene.py: cm, z up, the snake's tail towards +x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mitsuba as mi
import numpy as np

# Kinds of sun: parallel light ("directional"), and a disc of the sun's angular size ("disc").
SUN_KINDS = ("directional", "disc")
# Angular diameter of the sun seen from the Earth.
SUN_DIAMETER_DEG = 0.53
# Distance of the sun's disc from the origin. Its direction varies by less than 0.06° over the 10 cm of the snake.
DISC_DISTANCE_CM = 1e4
# Distance of lamps from the origin, as in a room.
LAMP_DISTANCE_CM = 200.0
# Radius of a lamp: its angular diameter from the origin is 0.57°, about that of the sun.
LAMP_RADIUS_CM = 1.0


def direction(azimuth_deg: float, elevation_deg: float) -> np.ndarray:
    """Unit vector to a light: `azimuth_deg` counter-clockwise from +x seen from above, `elevation_deg` above z = 0."""
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    return np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])


def uniform_sky(radiance: float) -> dict:
    """A uniform sky of D65 as the entry "sky" of a scene dictionary, or no entry for a radiance of 0."""
    return {"sky": {"type": "constant", "radiance": {"type": "d65", "scale": radiance}}} if radiance > 0 else {}


def lamps(directions: list[tuple[float, float]], brightness: float, sky_radiance: float) -> dict:
    """Small spheres of D65 and a uniform sky, as entries of a scene dictionary.

    `directions` has azimuth and elevation of each lamp in degrees (`direction`). A white diffuse plane at the origin
    that faces a lamp has the radiance `brightness`.
    """
    # A sphere of radius r and radiance L at the distance d gives the irradiance E = π L r²/d², and `brightness` is E/π.
    radiance = brightness * (LAMP_DISTANCE_CM / LAMP_RADIUS_CM) ** 2
    spheres = {
        f"lamp_{number}": {
            "type": "sphere",
            "center": (LAMP_DISTANCE_CM * direction(*angles)).tolist(),
            "radius": LAMP_RADIUS_CM,
            "emitter": {"type": "area", "radiance": {"type": "d65", "scale": radiance}},
        }
        for number, angles in enumerate(directions)
    }
    return {**spheres, **uniform_sky(sky_radiance)}


@dataclass(frozen=True)
class Light:
    """A sun and a uniform sky, both D65.

    `azimuth_deg` is the sun's angle from +x (tail), counter-clockwise seen from above. `elevation_deg` is its angle
    above the ground, in (0, 90]. `sun` is one of SUN_KINDS. `sky_radiance` is not negative, and 0 leaves out the sky.
    Values outside these ranges raise ValueError.

    The defaults are chosen by eye. The default sun stands on the side of the head and the camera. A brighter sky adds
    diffuse light, in which the diffraction colours pale.
    """

    azimuth_deg: float = -150.0
    elevation_deg: float = 40.0
    sun: str = "disc"
    sky_radiance: float = 0.05

    def __post_init__(self):
        if self.sun not in SUN_KINDS:
            raise ValueError(f"sun is {self.sun!r}, not one of {', '.join(SUN_KINDS)}")
        if not (math.isfinite(self.azimuth_deg) and 0 < self.elevation_deg <= 90):
            raise ValueError("the azimuth must be finite and the elevation in (0, 90] degrees")
        if not (math.isfinite(self.sky_radiance) and self.sky_radiance >= 0):
            raise ValueError("the sky's radiance must be a number that is not negative")

    def to_sun(self) -> np.ndarray:
        """Unit vector from the snake to the sun."""
        return direction(self.azimuth_deg, self.elevation_deg)

    def emitters(self) -> dict:
        """The emitters as entries of a scene dictionary."""
        sun = self._directional() if self.sun == "directional" else self._disc()
        return {"sun": sun, **uniform_sky(self.sky_radiance)}

    def _directional(self) -> dict:
        """Parallel light of irradiance π."""
        return {
            "type": "directional",
            "direction": (-self.to_sun()).tolist(),
            "irradiance": {"type": "d65", "scale": math.pi},
        }

    def _disc(self) -> dict:
        """A disc of the sun's angular radius ρ. Its radiance 1/sin²ρ gives the directional sun's irradiance, π.

        The radius of the disc is its distance times sin ρ instead of tan ρ, since they differ by only 1e-5 of ρ.
        """
        sin_radius = math.sin(math.radians(SUN_DIAMETER_DEG / 2))
        transform = mi.ScalarTransform4f
        centre = (self.to_sun() * DISC_DISTANCE_CM).tolist()
        # The up direction of `look_at` must not be parallel to the direction to the sun. Any other one serves.
        up = [0, 0, 1] if self.elevation_deg < 80 else [1, 0, 0]
        return {
            "type": "disk",
            "to_world": transform().look_at(centre, [0, 0, 0], up) @ transform().scale(DISC_DISTANCE_CM * sin_radius),
            "emitter": {"type": "area", "radiance": {"type": "d65", "scale": 1 / sin_radius**2}},
        }
