"""A holographic card and a banknote with a kinegram: gratings whose pitch and angle are textures made by code.

Lengths are in cm, z is up, and the cards lie on the ground with their length along x. Positions, sizes, pitches and
angles in the patterns are chosen by eye unless a comment gives a reason.
"""

from __future__ import annotations

import mitsuba as mi
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from .light import lamps
from .scene import View, colour_texture, raw_texture, soil, stage

# Relief of both foils: an embossed grating with the largest pitch of the patterns, 1.6 µm, and a height of 0.16 µm.
# Under lacquer this height puts 37 % of the light at 550 nm into the first orders and 45 % into the second, by the
# phase screen (docs/model.md) at normal incidence.
EMBOSSED = {"preset": "sinusoidal", "period": 1.6, "height": 0.16, "material": "Al"}
# Smallest and largest pitch relative to that of EMBOSSED. First orders of finer gratings leave the lacquer only for few
# directions of the light.
PITCHES = (0.4, 1.0)
# Coherence length of the card in µm, the width over which light interferes. A card's pattern is written in dots of
# about this size, whose diffraction orders are 3° wide. Smaller dots light wider parts of the pattern in paler
# colours.
DOT_UM = 12.0
# Coherence length of the kinegram in µm. Its grooves are slightly curved, which spreads its orders over 6°.
KINEGRAM_DOT_UM = 6.0
# Refractive index of lacquer.
LACQUER = 1.5
# Texels per cm of all patterns. More sharpen their lines.
TEXELS_PER_CM = 100
# Width of the lines of a guilloche, a band of fine wavy lines as on banknotes.
LINE_CM = 0.034
# Size of an identification card, ISO/IEC 7810 ID-1: width along x and height along y.
CARD_CM = (8.56, 5.4)
# Size of the banknote.
NOTE_CM = (12.0, 6.6)
# Thickness of the card; the top is at this height.
CARD_THICKNESS_CM = 0.08
# Radius of the card's corners, as in ISO/IEC 7810.
CARD_CORNER_CM = 0.32
# Position of the kinegram's centre on the note.
KINEGRAM_CENTRE_CM = (2.9, 0.0)
# Radius of the kinegram.
KINEGRAM_RADIUS_CM = 1.9
# Number of nested stars.
STARS = 10
# Difference between the mean radii of neighbouring stars.
STAR_CM = 0.125
# Angle in degrees between the gratings of neighbouring stars. STARS steps cover a half turn, after which a grating is
# the same again.
STAR_STEP_DEG = 18.0
# Number of segments around the ring.
SEGMENTS = 48
# Width of each of the ring's three rows of segments.
RING_CM = 0.12
# Reflectance of unprinted paper, linear sRGB.
PAPER = (0.72, 0.68, 0.6)
# Camera of the card, above its lower edge.
CARD_VIEW = View(origin_cm=(0, -9, 18), target_cm=(0, 0, 0), fov_deg=27.0)
# Camera of the banknote.
NOTE_VIEW = View(origin_cm=(1.9, -8, 18), target_cm=(1.9, 0, 0), fov_deg=20.0)
# Azimuth and elevation in degrees of the lamps over the card: spotlights in a ceiling.
CARD_LAMPS = [(50, 40), (-50, 55), (15, 35), (125, 80), (-110, 60), (165, 42)]
# Azimuth and elevation in degrees of the lamps over the banknote.
NOTE_LAMPS = [(35, 40), (-65, 50)]
# Radiance of a white plane that faces one of the card's lamps. The unit of radiances is that of light.py.
CARD_BRIGHTNESS = 0.12
# Radiance of the sky over the card. A brighter sky would wash out the colours.
CARD_SKY = 0.05
# Radiance of a white plane that faces one of the banknote's lamps.
NOTE_BRIGHTNESS = 0.35
# Radiance of the sky over the banknote, which lights the paper about as brightly as the kinegram's colours.
NOTE_SKY = 0.3


class Pattern:
    """A picture of gratings on a rectangle: relative pitch, angle and coverage of each texel.

    All arrays have the shape (rows, columns); row 0 is at the smallest y. `x` and `y` are the centres of the texels in
    cm from the centre of the rectangle. `pitch` is relative to that of EMBOSSED, within PITCHES. `angle` is that of the
    direction across the grooves, in degrees counter-clockwise from x, seen from above. `covered` is the fraction of the
    light that the grating diffracts, 0 without one.
    """

    def __init__(self, size_cm: tuple[float, float]):
        columns, rows = (round(length * TEXELS_PER_CM) for length in size_cm)
        y, x = np.mgrid[:rows, :columns] + 0.5
        self.x, self.y = x / TEXELS_PER_CM - 0.5 * size_cm[0], y / TEXELS_PER_CM - 0.5 * size_cm[1]
        self.pitch, self.angle, self.covered = np.ones_like(x), np.zeros_like(x), np.zeros_like(x)

    def paint(
        self, where: np.ndarray, pitch: np.ndarray | float, angle: np.ndarray | float, covered: float = 1.0
    ) -> None:
        """Replaces the texels for which the boolean array `where` is true, and clips `pitch` to PITCHES.

        `pitch` and `angle` are numbers, or arrays over all texels; later paint hides earlier.
        """
        self.pitch = np.where(where, np.clip(pitch, *PITCHES), self.pitch)
        self.angle = np.where(where, angle, self.angle)
        self.covered = np.where(where, covered, self.covered)

    def polar(self, centre_cm: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
        """Distance in cm and azimuth in radians of each texel about the point `centre_cm`."""
        x, y = self.x - centre_cm[0], self.y - centre_cm[1]
        return np.hypot(x, y), np.arctan2(y, x)

    def rosette(self, centre_cm: tuple[float, float], radius_cm: float, petals: int) -> None:
        """Paints two families of eight rings with a wavy outline, twisted against each other as on engine-turned metal.

        Grooves are concentric in every second ring and turned by 30° in the others. Their pitch grows outwards.
        """
        radius, azimuth = self.polar(centre_cm)
        # Radius relative to the outline, which has `petals` waves.
        relative = radius / radius_cm / (1 + 0.1 * np.cos(petals * azimuth))
        for sign in (-1, 1):
            # Number of the ring, with a fraction. The waves of the two families are shifted in opposite directions.
            wave = 8 * relative + 0.4 * relative * np.sin(petals * azimuth + sign * 3 * relative)
            ring = np.floor(wave)
            # A gap separates each ring from the next.
            line = (wave < 8) & (wave - ring < 0.7)
            self.paint(line, 0.5 + 0.5 * relative, np.degrees(azimuth) + 30 * sign * (ring % 2))

    def guilloche(self, centre_y_cm: float, amplitude_cm: float, lines: int, waves_per_cm: float) -> None:
        """Paints a band of thin sine lines along x, shifted in phase.

        Grooves are along the lines; their pitch differs from line to line.
        """
        for number in range(lines):
            phase = 2 * np.pi * (waves_per_cm * self.x + number / lines)
            # The amplitude falls towards both ends of the card, which the approximate slope leaves out.
            wave = amplitude_cm * np.sin(phase) * np.cos(0.35 * self.x)
            # Slope of the line, and approximate distance of each texel from it.
            slope = amplitude_cm * 2 * np.pi * waves_per_cm * np.cos(phase)
            distance = np.abs(self.y - centre_y_cm - wave) / np.hypot(1, slope)
            self.paint(distance < 0.5 * LINE_CM, 0.55 + 0.45 * number / lines, np.degrees(np.arctan(slope)) + 90)

    def lettering(self, text: str, centre_cm: tuple[float, float], height_cm: float, angle: float) -> None:
        """Paints a line of text of the height `height_cm` about the point `centre_cm`, with `angle` (°) in its middle.

        Pitch and angle grow along the line, so that each letter has a colour of its own.
        """
        font = ImageFont.load_default(size=height_cm * TEXELS_PER_CM)
        picture = Image.new("L", self.x.shape[::-1])
        # The picture's first row is at the top, the pattern's at the bottom.
        rows, columns = self.x.shape
        at = columns / 2 + centre_cm[0] * TEXELS_PER_CM, rows / 2 - centre_cm[1] * TEXELS_PER_CM
        ImageDraw.Draw(picture).text(at, text, fill=255, font=font, anchor="mm")
        letters = np.array(picture)[::-1] > 127
        # About −0.5 to 0.5 along the text: letters are about 0.6 of their height wide.
        along = (self.x - centre_cm[0]) / (0.6 * height_cm * len(text))
        self.paint(letters, 0.72 + 0.5 * along, angle + 40 * along)


def foil(pattern: Pattern, coherence_um: float) -> dict:
    """The plugin for a pattern, dark where it is not covered, under lacquer."""
    return {
        "type": "diffraction",
        **EMBOSSED,
        "coherence_length": coherence_um,
        "cover_eta": LACQUER,
        "scale": raw_texture(pattern.pitch),
        "rotation": raw_texture(pattern.angle),
        "specular_reflectance": raw_texture(pattern.covered),
    }


def card_pattern() -> Pattern:
    """The card's rosettes, two guilloches and a lettering."""
    pattern = Pattern(CARD_CM)
    # A fan of faint gratings over the whole card.
    pattern.paint(np.ones_like(pattern.x, bool), 0.75 - 0.09 * pattern.y, 90 + 25 * pattern.x - 8 * pattern.y, 0.03)
    pattern.guilloche(centre_y_cm=-1.0, amplitude_cm=0.5, lines=9, waves_per_cm=0.22)
    pattern.guilloche(centre_y_cm=2.2, amplitude_cm=0.2, lines=5, waves_per_cm=0.45)
    pattern.rosette((-2.3, 0.45), radius_cm=1.55, petals=12)
    pattern.rosette((1.1, 0.75), radius_cm=1.05, petals=8)
    pattern.rosette((3.05, 0.55), radius_cm=0.75, petals=6)
    pattern.lettering("SUNBEAM", (0, -1.95), height_cm=0.95, angle=30)
    return pattern


def sheet(size_cm: tuple[float, float], thickness_cm: float, bsdf: dict) -> dict:
    """A horizontal rectangle at the height `thickness_cm`, with its centre on the z axis."""
    transform = mi.ScalarTransform4f().translate([0, 0, thickness_cm]).scale([0.5 * size_cm[0], 0.5 * size_cm[1], 1])
    return {"type": "rectangle", "to_world": transform, "bsdf": bsdf}


def rounded(pattern: Pattern, radius_cm: float, bsdf: dict) -> dict:
    """The material `bsdf` on the pattern's rectangle with rounded corners, and soil beyond the corners."""
    # Components of each texel's distance from the rectangle that is `radius_cm` smaller on each side.
    outside_x, outside_y = (
        np.maximum(np.abs(position) - (0.5 * np.ptp(position) - radius_cm), 0) for position in (pattern.x, pattern.y)
    )
    is_card = np.hypot(outside_x, outside_y) < radius_cm
    # A weight of 1 selects the second material.
    return {"type": "blendbsdf", "weight": raw_texture(is_card), "beyond": soil(), "inside": bsdf}


def card_scene(view: View = CARD_VIEW, spp: int = 64, directions: list[tuple[float, float]] = CARD_LAMPS) -> dict:
    """A holographic card under small lamps, whose `directions` are azimuth and elevation in degrees."""
    pattern = card_pattern()
    card = sheet(CARD_CM, CARD_THICKNESS_CM, rounded(pattern, CARD_CORNER_CM, foil(pattern, DOT_UM)))
    return stage({"card": card}, lamps(directions, CARD_BRIGHTNESS, CARD_SKY), view, spp)


def kinegram_pattern() -> Pattern:
    """A banknote's kinegram: nested stars and a number within a ring of segments.

    The angle grows from star to star, so the lit star moves outwards while the light goes around.
    """
    pattern = Pattern(NOTE_CM)
    radius, azimuth = pattern.polar(KINEGRAM_CENTRE_CM)
    # A faint concentric grating over the whole patch.
    pattern.paint(radius < KINEGRAM_RADIUS_CM, 0.9, np.degrees(azimuth), covered=0.3)
    # Radius in units of STAR_CM, corrected for the outline of five points. The integer part is the star's number.
    star = radius / (1 + 0.16 * np.cos(5 * azimuth - 0.5 * np.pi)) / STAR_CM
    number = np.floor(star)
    pattern.paint((star < STARS) & (star - number < 0.8), 0.65 + 0.3 * star / STARS, STAR_STEP_DEG * number)
    # Segments of the ring. From segment to segment their grooves are turned by 0°, 45°, 90° and 135° against concentric
    # grooves, then by 0° again.
    segment = np.floor(azimuth / (2 * np.pi) * SEGMENTS)
    ring = np.floor((KINEGRAM_RADIUS_CM - radius) / RING_CM)
    pattern.paint((ring >= 0) & (ring < 3), 0.9 - 0.15 * ring, np.degrees(azimuth) + 45 * (segment % 4))
    pattern.lettering("50", KINEGRAM_CENTRE_CM, height_cm=0.8, angle=20)
    return pattern


def printed_paper(pattern: Pattern) -> np.ndarray:
    """Reflectance of a note's paper in linear sRGB, (rows, columns, 3): wavy lines in two inks, and a number."""
    x, y = pattern.x, pattern.y
    # Both inks are printed where a wave over the paper exceeds a threshold, which sets the width of the lines.
    red = np.cos(2 * np.pi * (y + 0.25 * np.sin(1.3 * x) + 0.1 * np.sin(3.1 * x + 2 * y)) / 0.16) > 0.4
    blue = np.cos(2 * np.pi * (y - 0.4 * np.sin(0.9 * x + 1)) / 0.22) > 0.6
    number = Pattern(NOTE_CM)
    number.lettering("50", (-1.0, 0.9), height_cm=1.7, angle=0)
    colour = np.broadcast_to(PAPER, (*x.shape, 3))
    for where, ink in ((red, (0.65, 0.42, 0.36)), (blue, (0.45, 0.55, 0.7)), (number.covered > 0, (0.2, 0.25, 0.4))):
        colour = np.where(where[..., None], colour * ink, colour)
    return colour


def note_scene(view: View = NOTE_VIEW, spp: int = 64, directions: list[tuple[float, float]] = NOTE_LAMPS) -> dict:
    """A banknote with a kinegram on printed paper; the arguments are those of `card_scene`."""
    pattern = kinegram_pattern()
    bsdf = {
        "type": "blendbsdf",
        "weight": raw_texture(pattern.covered > 0),
        "paper": {"type": "diffuse", "reflectance": colour_texture(printed_paper(pattern))},
        "kinegram": foil(pattern, KINEGRAM_DOT_UM),
    }
    note = sheet(NOTE_CM, thickness_cm=0.01, bsdf=bsdf)
    return stage({"note": note}, lamps(directions, NOTE_BRIGHTNESS, NOTE_SKY), view, spp)
