"""Measurements and marks of the renderings, against closed forms."""

import math

import numpy as np
import pytest
from PIL import Image

from mitsuba_scenes.environment import use_variant
from mitsuba_scenes.scene import View

# Colours of the CIE's formulas by hand, to a few digits more than those of the constants of sRGB.
CIE = 1e-3
# Double precision.
ROUNDING = 1e-9


@pytest.fixture(scope="module", autouse=True)
def variant():
    use_variant()


def test_marks_are_projected_by_the_camera():
    from docs.figures.marks import project

    view = View(400, 200, origin_cm=(0, -10, 0), target_cm=(0, 0, 0), fov_deg=40)
    assert project(view, (0, 0, 0)) == pytest.approx((200, 100), abs=ROUNDING)
    edge = 10 * math.tan(math.radians(20))
    # Half the field of view to the right (east) is the right edge; pixels are square, and up is up.
    assert project(view, (edge, 0, 0)) == pytest.approx((400, 100), abs=ROUNDING)
    assert project(view, (0, 0, edge / 2)) == pytest.approx((200, 0), abs=ROUNDING)
    # Twice as far away is half as far from the middle.
    assert project(view, (edge, 10, 0)) == pytest.approx((300, 100), abs=ROUNDING)


def test_chroma_is_cielab_within_the_mask(tmp_path):
    from docs.figures.appearance import mean_chroma
    from mitsuba_scenes.render import EXPOSURE_STOPS

    # sRGB red has C*ab 104.55; white has none, and what is brighter than white is white.
    seen = np.array([[[1.0, 0, 0], [1, 1, 1], [3, 3, 3], [0, 0, 1]]])
    mask = tmp_path / "mask.png"
    Image.fromarray(np.uint8([[255, 255, 255, 0]])).save(mask)
    found = mean_chroma(seen / 2.0**EXPOSURE_STOPS, mask)
    assert found == pytest.approx(104.55 / 3, rel=CIE)


def test_greyed_pictures_keep_their_lightness():
    from docs.figures.appearance import greyed
    from docs.figures.rgb_against_spectral import lab

    linear = np.array([[[0.8, 0.1, 0.0], [0.05, 0.2, 0.6]]])
    before, after = lab(linear), lab(greyed(linear))
    assert after[..., 0] == pytest.approx(before[..., 0], rel=CIE)
    # Relative to a white of 100, whose seven digits leave about 1e-5.
    assert np.abs(after[..., 1:]).max() < CIE


def test_directions_of_the_moving_sun_have_equal_steps():
    from docs.figures.renderings import SOUTH_TO_NORTH, SOUTHEAST_TO_WEST, sun_of

    for column in (SOUTH_TO_NORTH, SOUTHEAST_TO_WEST):
        suns = np.array([sun_of(travels).to_sun() for travels in column])
        # Four digits are printed, of which some are off by a few: 0.1989 for sin 0.2, 0.1987.
        for travels, sun in zip(column, suns):
            assert sun == pytest.approx([-travels[1], -travels[0], -travels[2]], abs=2e-3)
        steps = np.arccos((suns[:-1] * suns[1:]).sum(axis=1))
        assert steps == pytest.approx(0.2, abs=2e-3)


def test_scene_keys_ignore_caption_mark_and_method():
    from docs.figures.studio import Shot

    shot = Shot("a", {"preset": "blazed"}, "flss")
    assert shot.scene_key() == Shot("b", {"preset": "blazed"}, None, mark=print).scene_key()
    assert shot.scene_key() != Shot("a", {"preset": "cd"}, "flss").scene_key()
    assert shot.scene_key() != Shot("a", {"preset": "blazed"}, "flss", view=View(10, 10)).scene_key()
    assert shot.picture_key() == Shot("b", {"preset": "blazed"}, "flss", mark=print).picture_key()
    assert shot.picture_key() != Shot("a", {"preset": "blazed"}, None).picture_key()
