"""Transparent films in scenes: a spectrometer's lines, both directions of tracing, a white furnace, and files."""

import json

import mitsuba as mi
import numpy as np
import pytest
from conftest import use_variant

from docs.figures import films as figure
from docs.figures.page import DOCS
from mitsuba_scenes import files, films, picture

# Width, height and samples a pixel of small pictures.
SMALL = {"width": 48, "height": 32, "spp": 36}
# The files hold the dictionaries' numbers in single precision, and samples are equal. A path may miss an edge.
SAME_SCENE_RTOL = 2e-3
SCENES = {
    "spectrometer": films.spectrometer_scene,
    "spectacles": films.spectacles_scene,
    "window": films.window_scene,
    "wing": films.wing_scene,
}
# Standard errors of a difference that count as agreement.
SIGMAS = 4.0
# Noise of a mean over the furnace's pictures, about 350 pixels of 144 samples, and the tables' error.
FURNACE = 0.01


@pytest.fixture(autouse=True)
def spectral():
    use_variant("llvm_ad_spectral")


def test_lines_are_where_the_grating_equation_has_them():
    """The centroid of an order's image of the slit is found to a fraction of a pixel."""
    lines = figure.measured_lines()
    assert len(lines) == 16
    for line in lines:
        assert line["found_cm"] == pytest.approx(line["cm"], abs=0.5 * figure.PIXEL_CM), line


def test_a_wrong_period_is_noticed():
    """Grooves wider by 0.5 % move a second order by 1.7 pixels, beyond the tolerance of the lines."""
    x_cm, brightness = figure.profile(films.spectrometer_scene(period_um=1.005 * films.PERIOD_UM))
    expected = figure.position_cm(2, 546.1)
    assert abs(figure.line_cm(x_cm, brightness, expected) - expected) > figure.PIXEL_CM


def test_figure_1_2_has_its_first_order_on_the_screen():
    assert figure.single_line_error_cm() < 0.5 * figure.PIXEL_CM
    assert figure.position_cm(1, *figure.DRAWN) < figure.HALF_SCREEN_CM < figure.position_cm(2, *figure.DRAWN)


def lit_screen(transmission, integrator):
    """A lit screen below a large shallow grating, seen by a camera above it."""
    relief = {"preset": "sinusoidal", "period": 2.0, "height": 0.15, "eta": 1.5, "coherence_length": 6.0}
    transform = mi.ScalarTransform4f()
    view = films.View(24, 16, origin_cm=(6, -14, 20), target_cm=(0, 0, 0), fov_deg=30)
    sensor = view.sensor(64)
    sensor.update(sampler={"type": "independent"}, film={**sensor["film"], "rfilter": {"type": "box"}})
    return {
        "type": "scene",
        "integrator": {"type": integrator, "max_depth": 6, "rr_depth": 6},
        "sensor": sensor,
        "grating": {
            "type": "rectangle",
            "to_world": transform.scale([40, 40, 1]),
            "bsdf": {"type": "diffraction", "transmission": transmission, **relief},
        },
        "screen": {
            "type": "rectangle",
            "to_world": transform.translate([0, 0, -10]).scale([5, 5, 1]),
            "emitter": {"type": "area", "radiance": {"type": "d65"}},
        },
    }


@pytest.mark.parametrize("transmission", ["film", "interface"])
def test_paths_from_lamps_and_from_the_camera_agree(transmission):
    """Light tracing evaluates importance, path tracing radiance, which changes with the squared index."""
    means = {}
    for integrator, spp in (("path", 256), ("ptracer", 2048)):
        scene = mi.load_dict(lit_screen(transmission, integrator))
        runs = [np.array(mi.render(scene, spp=spp, seed=seed)).mean() for seed in range(8)]
        means[integrator] = np.mean(runs), np.std(runs, ddof=1) / np.sqrt(len(runs))
    (path, path_noise), (ptracer, ptracer_noise) = means.values()
    noise = np.hypot(path_noise, ptracer_noise)
    # A missing factor of the squared index would be 125 %.
    assert noise < 0.02 * path
    assert abs(path - ptracer) < SIGMAS * noise


@pytest.fixture(scope="module")
def furnace():
    """Radiances of the films of scalar theory. Tables of the rigorous film take minutes."""
    use_variant("llvm_ad_spectral")
    return [figure.in_furnace(height, theory) for height, theory in figure.FURNACE_FILMS if theory == "scalar"]


def test_a_film_in_a_furnace_is_no_brighter_than_it(furnace):
    """Light that is trapped in the film, or reflected to and fro in it, is left out: deeper reliefs are darker."""
    for row in furnace:
        assert max(*row["sheets"], row["shell"], row["solid"]) < 1 + FURNACE, row
    shells = [row["shell"] for row in furnace]
    # The numbers on docs/plugin.md.
    published = json.loads((DOCS / "data" / "films.json").read_text(encoding="utf-8"))["furnace"]
    published = [row["shell"] for row in published if row["theory"] == "scalar"]
    np.testing.assert_allclose(shells, published, atol=FURNACE)


def test_only_a_flat_film_lacks_the_second_reflection_in_a_furnace(furnace):
    """A sheet along its normal has reflection R of its front and transmission (1 − R)² of both sides."""
    reflectance = ((1.5 - 1) / (1.5 + 1)) ** 2
    # A solid ball loses nothing.
    assert furnace[0]["solid"] == pytest.approx(1, abs=FURNACE)
    assert furnace[0]["sheets"][0] == pytest.approx(reflectance + (1 - reflectance) ** 2, abs=FURNACE)


def small(scene):
    """The scene with a small film and few samples."""
    scene["sensor"]["film"].update(width=SMALL["width"], height=SMALL["height"])
    scene["sensor"]["sampler"]["sample_count"] = SMALL["spp"]
    return scene


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    use_variant("scalar_spectral")
    folder = tmp_path_factory.mktemp("films")
    for name, make in SCENES.items():
        files.export(make(), folder / f"{name}.xml")
    return folder


@pytest.mark.parametrize("name", SCENES)
def test_scenes_equal_their_files(folder, name):
    # In parallel, or optimised, Mitsuba orders lamps at random, and light tracing draws other numbers.
    made = np.array(mi.render(mi.load_dict(small(SCENES[name]()), parallel=False, optimize=False)))
    picture.check(made, name)
    values = {key: str(value) for key, value in SMALL.items()}
    read = mi.load_file(str(folder / f"{name}.xml"), parallel=False, optimize=False, **values)
    means = [pixels.mean(axis=(0, 1)) for pixels in (np.array(mi.render(read)), made)]
    np.testing.assert_allclose(*means, rtol=SAME_SCENE_RTOL)


def test_files_hold_transforms_exactly(tmp_path):
    use_variant("scalar_rgb")
    # Mitsuba's own text of this scale has an error of 1e-3.
    place = mi.ScalarTransform4f().translate([0, -200, 0.1]).scale([300, 200, 1])
    path = files.export({"type": "scene", "floor": {"type": "rectangle", "to_world": place}}, tmp_path / "floor.xml")
    state = mi.parser.parse_file(mi.parser.ParserConfig(mi.variant()), str(path))
    [found] = [node.props["to_world"] for node in state.nodes if "to_world" in node.props]
    np.testing.assert_array_equal(found.matrix, place.matrix)


def test_light_behind_the_spectacles_makes_colours():
    """Without gratings the street is grey; mean of the largest less the smallest channel over the brightness."""

    def colour(scene):
        pixels = np.array(mi.render(mi.load_dict(small(scene)), spp=64))
        pixels = np.clip(pixels, 0, np.quantile(pixels, 0.98))
        return np.ptp(pixels, axis=2).mean() / pixels.mean()

    clear = films.spectacles_scene()
    clear["film"]["bsdf"] = {"type": "thindielectric"}
    assert colour(films.spectacles_scene()) > 3 * colour(clear)
