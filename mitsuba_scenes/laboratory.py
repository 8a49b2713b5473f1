"""The laboratory set-up: a thin collimated beam on a flat sample, and a white screen for the diffracted light.

Frame, in mm: the sample is at the origin. Untilted, its normal is +z and its tangent +x; a tilt turns it about the y
axis. The screen is the plane z = `distance_mm`, with x to the right and y up on a picture.

Light path: the beam's emitter → the sample → the screen, in a direction sampled by the sample's BSDF → the camera. The
camera is in the plane of the sample and sees it edge-on, so it sees the screen alone. The film is parallel to the
screen, so each pixel is a square on the screen.

Symbols: λ is the wavelength, and d the sample's spacing (period). θi is the beam's angle with the sample's normal, and
θo that of the diffracted light. Order j leaves at `sin θo = jλ/d − sin θi` and meets the screen at
`x = distance_mm · tan(θo + tilt)`. The spatial frequency of a point of the screen is (sin θo + sin θi)/λ, which is j/d.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

# Largest number of paths in memory during a pass, one render of the scene. More paths need fewer passes and more
# memory; these take a few GB.
PATHS_PER_PASS = 1 << 22
# y of the camera. The camera is on the y axis, so it is in the plane of the sample at any tilt. A camera farther from
# the sample would need a taller film (`camera`).
CAMERA_Y_MM = -60.0
# Edge of the square sample: many times the beam's radius, so that the sample catches a grazing beam.
SAMPLE_EDGE_MM = 4.0
# Distance along z between the screen and the beam's emitter, which is below the screen.
BEAM_START_MM = 20.0
# Largest distance between the beam's emitter and the sample. Beams nearly parallel to the screen reach it.
BEAM_LENGTH_MM = 250.0
# Edges of the screen relative to those of the picture, so that the screen fills the picture.
SCREEN_SCALE = 1.2
# Half width of the triangular spectrum of monochromatic light. Wider lines have wider spots.
LINE_NM = 1.0
# Half height of the strip about y = 0 in which `spot_mm` measures, as a fraction of the screen's distance. A higher
# strip has less noise. But each column has the spatial frequency of its point at y = 0, which is less accurate for
# points far from y = 0.
STRIP_FRACTION = 0.025
# Columns of the moving average before the search for the brightest column, so that one noisy column does not win.
SMOOTHED_COLUMNS = 3
# Iterations of the centroid under a window centred on it; 20 converge for all samples.
CENTROID_ROUNDS = 20
# Segments of a path: emitter to sample, sample to screen, screen to camera. No light returns from screen to sample.
SEGMENTS = 3


@dataclass(frozen=True)
class Bench:
    """Dimensions of the set-up and resolution of the picture.

    `theta_i_deg` is the angle θi between beam and sample normal in the plane y = 0, positive for a beam from +x.
    `tilt_deg` is the angle between this normal and the screen's axis +z, positive towards +x. If both are equal, the
    mirrored beam meets the middle of the screen at a right angle. `distance_mm` is the screen's distance from the
    sample. `width_mm` and `height_mm` are the sizes of the photographed part of the screen, and `pixels_per_mm` is the
    resolution on it.
    """

    theta_i_deg: float = 0.0
    tilt_deg: float = 0.0
    distance_mm: float = 200.0
    width_mm: float = 800.0
    height_mm: float = 600.0
    beam_radius_mm: float = 0.1
    pixels_per_mm: float = 1.0

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture in pixels."""
        return round(self.width_mm * self.pixels_per_mm), round(self.height_mm * self.pixels_per_mm)

    def x_mm(self) -> np.ndarray:
        """x of the columns of a picture, (columns,)."""
        count = self.size[0]
        return ((np.arange(count) + 0.5) / count - 0.5) * self.width_mm

    def y_mm(self) -> np.ndarray:
        """y of the rows of a picture, (rows,), from the top down."""
        count = self.size[1]
        return (0.5 - (np.arange(count) + 0.5) / count) * self.height_mm

    def position_mm(self, spacing_um: float, order: int, wavelength_nm: float) -> float | None:
        """x of an order on the screen in mm by the grating equation; None if it does not reach the screen's plane."""
        sin_theta_i = math.sin(math.radians(self.theta_i_deg))
        return self.x_of_sine_mm(order * wavelength_nm / 1e3 / spacing_um - sin_theta_i)

    def x_of_sine_mm(self, sin_theta_o: float) -> float | None:
        """x on the screen in mm of a direction in the plane y = 0; None if it does not reach the screen's plane."""
        if abs(sin_theta_o) >= 1:
            return None
        from_axis = math.asin(sin_theta_o) + math.radians(self.tilt_deg)
        return self.distance_mm * math.tan(from_axis) if abs(from_axis) < 0.5 * math.pi else None

    def angle_deg(self, x_mm: float | np.ndarray) -> float | np.ndarray:
        """Angle θo in degrees of the direction to the point (x, y = 0) of the screen, a number or an array."""
        return np.degrees(np.arctan2(x_mm, self.distance_mm)) - self.tilt_deg


def lines(powers: dict[float, float]) -> dict:
    """A spectrum of narrow lines as a Mitsuba dictionary: triangles of half width LINE_NM.

    `powers` has the height of each line by its wavelength in nm, in ascending order and over 2 LINE_NM apart.
    """
    # Three nodes of each triangle, of which the outer ones are 0.
    nodes = [(nm + shift, power * (shift == 0)) for nm, power in powers.items() for shift in (-LINE_NM, 0, LINE_NM)]
    wavelengths, values = (", ".join(map(str, column)) for column in zip(*nodes))
    return {"type": "irregular", "wavelengths": wavelengths, "values": values}


def line(wavelength_nm: float) -> dict:
    """The spectrum of monochromatic light, a line of height 1."""
    return lines({wavelength_nm: 1})


def bench_scene(bsdf, bench: Bench, spectrum: dict) -> dict:
    """The scene as a dictionary. `bsdf` is the sample's, a dictionary or an object; `spectrum` the beam's radiance."""
    transform = mi.ScalarTransform4f
    from_axis = math.radians(bench.theta_i_deg + bench.tilt_deg)
    to_light = [math.sin(from_axis), 0.0, math.cos(from_axis)]
    # z of the direction is its cosine with the screen's axis. Its lower bound avoids a division by zero for beams
    # parallel to the screen.
    beam_length = min((bench.distance_mm - BEAM_START_MM) / max(to_light[2], 1e-9), BEAM_LENGTH_MM)
    emitter = [beam_length * component for component in to_light]
    # Mitsuba's rectangle has edges of length 2.
    half_width, half_height = 0.5 * SCREEN_SCALE * bench.width_mm, 0.5 * SCREEN_SCALE * bench.height_mm
    screen = transform().translate([0, 0, bench.distance_mm]) @ transform().scale([half_width, half_height, 1])
    return {
        "type": "scene",
        # Russian roulette starts beyond the longest path, so it is off.
        "integrator": {"type": "ptracer", "max_depth": SEGMENTS, "rr_depth": 100},
        "sensor": camera(bench),
        "beam": {
            "type": "disk",
            "to_world": transform().look_at(emitter, [0, 0, 0], [0, 1, 0]) @ transform().scale(bench.beam_radius_mm),
            "emitter": {"type": "directionalarea", "radiance": spectrum},
        },
        "sample": {
            "type": "rectangle",
            "to_world": transform().rotate([0, 1, 0], bench.tilt_deg) @ transform().scale(0.5 * SAMPLE_EDGE_MM),
            "bsdf": bsdf,
        },
        "screen": {
            "type": "rectangle",
            # The screen faces down, to the sample.
            "to_world": screen @ transform().rotate([1, 0, 0], 180),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "uniform", "value": 1.0}},
        },
    }


def camera(bench: Bench) -> dict:
    """The camera in the plane of the sample, as a dictionary. Its picture is the photographed part of the screen."""
    transform = mi.ScalarTransform4f
    width, height = bench.size
    # Mitsuba's camera, looking along +z, has +x at its left; the scale mirrors it.
    mirror = transform().scale([-1, 1, 1])
    return {
        "type": "perspective",
        "to_world": transform().look_at([0, CAMERA_Y_MM, 0], [0, CAMERA_Y_MM, 1], [0, 1, 0]) @ mirror,
        "fov_axis": "x",
        "fov": 2 * math.degrees(math.atan(0.5 * bench.width_mm / bench.distance_mm)),
        "near_clip": 1.0,
        "far_clip": 1e4,
        "sampler": {"type": "independent"},
        "film": {
            "type": "hdrfilm",
            "width": width,
            # The film is centred on the camera's y. The crop is its upper part, centred on y = 0.
            "height": height + 2 * round(-CAMERA_Y_MM * bench.pixels_per_mm),
            "crop_width": width,
            "crop_height": height,
            "crop_offset_x": 0,
            "crop_offset_y": 0,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
    }


def photograph(bsdf, bench: Bench, spectrum: dict, paths: int, seed: int = 0) -> np.ndarray:
    """The screen in linear sRGB, (rows, columns, 3) from the top down, with about `paths` ≥ 1 paths from the beam.

    `bsdf` is the sample's, and `spectrum` the beam's radiance. Passes have consecutive seeds from `seed` on.
    """
    scene = mi.load_dict(bench_scene(bsdf, bench, spectrum))
    width, height = bench.size
    # Passes of equal numbers of paths, each a whole number of samples per pixel.
    passes = math.ceil(paths / PATHS_PER_PASS)
    spp = max(1, round(paths / passes / (width * height)))
    return sum(np.array(mi.render(scene, spp=spp, seed=seed + i), dtype=np.float64) for i in range(passes)) / passes


def film_position(bench: Bench, x_mm: float, y_mm: float) -> tuple[float, float]:
    """Column and row of a point of the screen on the picture, in pixels from the top left corner."""
    sensor = mi.load_dict(camera(bench))
    # A surface interaction at the point, since the sensor is sampled from surfaces.
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.p = mi.Point3f(x_mm, y_mm, bench.distance_mm)
    found, _ = sensor.sample_direction(si, mi.Point2f(0.5))
    column, row = (float(np.ravel(component)[0]) for component in found.uv)
    return column, row


def spot_mm(
    bench: Bench, picture: np.ndarray, spacing_um: float, order: int, wavelength_nm: float, window_per_um: float
) -> float | None:
    """Measured x in mm of an order's spot on a monochromatic picture; None for an order beyond the picture.

    The search begins at the brightest column near y = 0 within half the distance to each neighbouring order. The spot
    is the centroid over spatial frequency under a Gaussian window of standard deviation `window_per_um` in cycles per
    µm. The window is moved to the centroid and applied again, CENTROID_ROUNDS times. `picture` is as from
    `photograph`, and not black near y = 0.
    """
    expected = bench.position_mm(spacing_um, order, wavelength_nm)
    # The spot of an order within a hundredth of the width from an edge may be cut off.
    if expected is None or abs(expected) > 0.49 * bench.width_mm:
        return None
    # Brightness of each column: the sum over the strip and over the three channels.
    profile = picture[np.abs(bench.y_mm()) < STRIP_FRACTION * bench.distance_mm].sum(axis=(0, 2))
    # Spatial frequency of each column in cycles per µm.
    sin_theta_i = math.sin(math.radians(bench.theta_i_deg))
    frequency = (np.sin(np.radians(bench.angle_deg(bench.x_mm()))) + sin_theta_i) * 1e3 / wavelength_nm
    near = np.abs(frequency - order / spacing_um) < 0.5 / spacing_um
    smooth = np.convolve(profile, np.ones(SMOOTHED_COLUMNS) / SMOOTHED_COLUMNS, mode="same")
    centre = frequency[near][np.argmax(smooth[near])]
    for _ in range(CENTROID_ROUNDS):
        weights = profile * np.exp(-0.5 * ((frequency - centre) / window_per_um) ** 2)
        centre = float(np.average(frequency, weights=weights))
    return bench.x_of_sine_mm(centre * wavelength_nm / 1e3 - sin_theta_i)
