"""Marks on pictures of the snake: boxes, insets, a compass, and a cone that shows the direction of the light.

All functions but `project` draw onto the picture in place. Points of the scene are in cm with z up, as in
mitsuba_scenes/scene.py. Positions in pictures are in pixels, x to the right and y down from the top.
"""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from mitsuba_scenes.light import Light
from mitsuba_scenes.scene import View

# Colour of boxes and letters, sRGB bytes.
RED = (225, 30, 30)
# Magnification of insets.
ENLARGED = 3
# Length and base radius of the cone that shows the light's direction. The sun is in the direction of the base.
CONE_CM, CONE_RADIUS_CM = 3.0, 0.35
# Colours of the cone's side, its base and the base's outline, sRGB bytes.
CONE_SIDE, CONE_BASE, CONE_RIM = (140, 140, 140), (190, 190, 190), (20, 20, 20)


def project(view: View, point_cm) -> tuple[float, float]:
    """Position (x, y) in the picture of a point of the scene, in pixels from the upper left corner.

    The point must be in front of the camera. The view must not be along z, since z is up in the picture.
    """
    origin = np.array(view.origin_cm, dtype=float)
    forward = np.array(view.target_cm) - origin
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    # Coordinates of the point in the camera's frame: to the right, up and forward.
    x, y, depth = np.array([right, np.cross(right, forward), forward]) @ (np.array(point_cm) - origin)
    # Pixels per cm at the point's depth. The field of view is horizontal, and pixels are square.
    scale = 0.5 * view.width / np.tan(np.radians(0.5 * view.fov_deg)) / depth
    return 0.5 * view.width + scale * x, 0.5 * view.height - scale * y


def box(picture: Image.Image, fraction: float) -> None:
    """Draws a red box about the middle; its sides are the `fraction`, in (0, 1], of the picture's sides."""
    width, height = picture.size
    half_x, half_y = 0.5 * fraction * width, 0.5 * fraction * height
    corners = [0.5 * width - half_x, 0.5 * height - half_y, 0.5 * width + half_x, 0.5 * height + half_y]
    ImageDraw.Draw(picture).rectangle(corners, outline=RED, width=2)


def inset(picture: Image.Image, centre: tuple[int, int], half: int) -> None:
    """Draws a red box of 2·`half` pixels a side about `centre`, and its enlarged contents in the lower right corner."""
    x, y = centre
    corners = (x - half, y - half, x + half, y + half)
    side = 2 * half * ENLARGED
    larger = picture.crop(corners).resize((side, side), Image.Resampling.LANCZOS)
    place = (picture.width - side - 2, picture.height - side - 2)
    picture.paste(larger, place)
    draw = ImageDraw.Draw(picture)
    draw.rectangle(corners, outline=RED, width=2)
    draw.rectangle((*place, place[0] + side, place[1] + side), outline=RED, width=2)


def compass(picture: Image.Image, view: View, middle_cm, reach_cm: tuple[float, float]) -> None:
    """Draws the letters E, W, N and S around the point `middle_cm`; +x is east, +y north.

    `reach_cm` are the distances of E and W, and of N and S, from the point.
    """
    font = ImageFont.load_default(size=24)
    east, north = np.array([reach_cm[0], 0, 0]), np.array([0, reach_cm[1], 0])
    draw = ImageDraw.Draw(picture)
    for letter, shift in (("E", east), ("W", -east), ("N", north), ("S", -north)):
        place = project(view, np.array(middle_cm) + shift)
        draw.text(place, letter, fill=RED, font=font, anchor="mm", stroke_width=2, stroke_fill="black")


def light_cone(picture: Image.Image, view: View, light: Light, apex_cm) -> None:
    """Draws a cone from the point `apex_cm` towards the sun, which must not be in the zenith.

    The base is drawn over the side, as if it faced the camera.
    """
    to_sun = light.to_sun()
    # Perpendicular unit vectors in the plane of the base.
    across = np.cross(to_sun, [0, 0, 1])
    across /= np.linalg.norm(across)
    down = np.cross(to_sun, across)
    # The base is a polygon with 48 corners.
    turns = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    centre = np.array(apex_cm) + CONE_CM * to_sun
    base = [centre + CONE_RADIUS_CM * (np.cos(turn) * across + np.sin(turn) * down) for turn in turns]
    tip = project(view, apex_cm)
    rim = [project(view, point) for point in base]
    draw = ImageDraw.Draw(picture)
    for start, end in zip(rim, [*rim[1:], rim[0]]):
        draw.polygon([tip, start, end], fill=CONE_SIDE)
    draw.polygon(rim, fill=CONE_BASE, outline=CONE_RIM)
