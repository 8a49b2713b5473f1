"""Foils, discs and the varied snake: their textures, and their scenes as dictionaries and as XML."""

import mitsuba as mi
import numpy as np
import pytest
from conftest import use_variant

from mitsuba_scenes import files, foils, picture, skin
from mitsuba_scenes.snake import snake_files

# Pictures of 32 × 32 pixels with 4 samples each.
SIZE, SPP = 32, 4
# Names of the scenes, and bounds on `colourfulness`: between that of a rough mirror in place of the relief, which is
# at most 0.26 (0.36 on the card; noise, and coloured paper), and nine tenths of the scene's own in either variant.
LEAST_COLOUR = {
    "card": 1.5,
    "banknote": 0.34,
    "cd": 0.8,
    "cd-window": 0.4,
    "dvd": 1.0,
    "dvd-window": 0.5,
    "snake-varied": 0.8,
}
# Scenes by variant. Each scene is rendered in one variant, and the card in both.
RENDERED = [
    *[("llvm_ad_rgb", name) for name in ("card", "banknote", "cd-window", "dvd")],
    *[("llvm_ad_spectral", name) for name in ("card", "cd", "dvd-window", "snake-varied")],
]
# The files hold the dictionaries' numbers in single precision, and samples are equal. A path may miss an edge.
SAME_SCENE_RTOL = 2e-3


@pytest.fixture(scope="module")
def snake():
    return snake_files(resolution=1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    use_variant("scalar_rgb")
    folder = tmp_path_factory.mktemp("foils")
    files.write_scenes(folder, resolution=1)
    return folder


def small(scene):
    """The scene with a small film and few samples."""
    scene["sensor"]["film"].update(width=SIZE, height=SIZE)
    scene["sensor"]["sampler"]["sample_count"] = SPP
    return scene


def rendered(scene):
    return np.array(mi.render(scene), dtype=np.float64)


def colourfulness(pixels):
    """Mean over the picture of the largest less the smallest channel, relative to the mean brightness.

    White and grey light gives 0; a single primary gives 3.
    """
    pixels = np.clip(pixels, 0, np.quantile(pixels, 0.99))
    return np.ptp(pixels, axis=2).mean() / pixels.mean()


@pytest.mark.parametrize("make", [foils.card_pattern, foils.kinegram_pattern])
def test_patterns_are_deterministic_and_within_their_ranges(make):
    pattern, again = make(), make()
    for name in ("pitch", "angle", "covered"):
        values = getattr(pattern, name)
        assert values.shape == pattern.x.shape
        assert np.all(np.isfinite(values))
        np.testing.assert_array_equal(values, getattr(again, name))
    assert 0 < pattern.pitch.min() < 0.7 * pattern.pitch.max()
    assert pattern.pitch.max() <= 1
    assert 0 <= pattern.covered.min() < pattern.covered.max() <= 1


def test_the_snakes_sizes_and_angles_are_constant_on_each_scale():
    use_variant("scalar_rgb")
    textures = skin.varied_skin("xenopeltis")
    for name, least, most in (("scale", *skin.SIZES), ("rotation", -5 * skin.TURN_DEG, 5 * skin.TURN_DEG)):
        values = np.squeeze(np.array(textures[name]["bitmap"]))
        assert values.shape == tuple(rows * skin.TEXELS for rows in reversed(skin.ROWS))
        assert least <= values.min() < values.max() <= most
        # Whole and cut scales: points with an even sum in a lattice of 28 × 18.
        assert abs(len(np.unique(values)) - 28 * 18 / 2) <= 18
        # The value in the centre of a scale is that of its neighbourhood.
        for i, j in ((4, 4), (13, 9), (20, 2)):
            column, row = i * skin.TEXELS, j * skin.TEXELS
            assert np.ptp(values[row - 9 : row + 9, column - 9 : column + 9]) == 0


def test_every_scene_is_rendered():
    assert {name for _, name in RENDERED} == set(LEAST_COLOUR)


@pytest.mark.parametrize(("variant", "name"), RENDERED)
def test_scenes_render_in_colour_and_equal_their_files(folder, snake, variant, name):
    use_variant(variant)
    # In parallel, or optimised, Mitsuba orders lamps at random, and the path tracer draws other numbers.
    made = rendered(mi.load_dict(small(files.python_scenes(snake)[name]), parallel=False, optimize=False))
    assert made.shape == (SIZE, SIZE, 3)
    picture.check(made, name)
    assert colourfulness(made) > LEAST_COLOUR[name]
    size = {"width": str(SIZE), "height": str(SIZE), "spp": str(SPP)}
    read = mi.load_file(str(folder / f"{name}.xml"), parallel=False, optimize=False, **size)
    np.testing.assert_allclose(rendered(read).mean(axis=(0, 1)), made.mean(axis=(0, 1)), rtol=SAME_SCENE_RTOL)


def without_relief(scene):
    """The scene with a rough mirror in place of each relief."""
    if not isinstance(scene, dict):
        return scene
    if scene.get("type") == "diffraction":
        masks = {key: scene[key] for key in scene.keys() & {"specular_reflectance"}}
        return {"type": "roughconductor", "material": "Al", "alpha": 0.1, **masks}
    return {key: without_relief(value) for key, value in scene.items()}


def test_colour_is_that_of_the_relief(snake):
    use_variant("llvm_ad_spectral")
    for name in ("card", "banknote"):
        grey = rendered(mi.load_dict(without_relief(small(files.python_scenes(snake)[name]))))
        assert colourfulness(grey) < 0.9 * LEAST_COLOUR[name]


def test_other_parts_of_the_kinegram_are_lit_from_elsewhere():
    use_variant("llvm_ad_rgb")
    # The kinegram fills the middle of the picture.
    view = foils.View(48, 48, origin_cm=(2.9, -8, 18), target_cm=(2.9, 0, 0), fov_deg=10.0)

    def lit(azimuth_deg, seed):
        scene = mi.load_dict(foils.note_scene(view, directions=[(azimuth_deg, 40)]))
        pixels = np.array(mi.render(scene, spp=16, seed=seed)).mean(axis=2)
        # The sky and the paper are everywhere.
        return np.maximum(pixels - np.median(pixels), 0)

    def shared(a, b):
        """Fraction of the light of one picture that is at the same place in the other."""
        return np.minimum(a, b).sum() / max(a.sum(), b.sum())

    first = lit(35, 0)
    # 0.89 and 0.14, with the noise of 16 samples.
    assert shared(first, lit(35, 1)) > 0.8
    assert shared(first, lit(65, 1)) < 0.25
