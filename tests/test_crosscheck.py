"""The two renderers agree point by point, and the comparison detects differences."""

import mitsuba as mi
import needs
import numpy as np
import pytest
from conftest import use_variant

from mitsuba_scenes import snake
from mitsuba_scenes.crosscheck import __main__ as command
from mitsuba_scenes.crosscheck import (
    cases,
    methods,
    points,
    realtime,
    run,
    same_colours,
    same_picture,
    same_points,
    spectral,
)
from mitsuba_scenes.crosscheck.agreement import FEWEST_PIXELS, agreement
from mitsuba_scenes.crosscheck.cases import SAME_MODEL, Case, plugin
from mitsuba_scenes.crosscheck.quadrature import Quadrature
from mitsuba_scenes.environment import SetupError
from mitsuba_scenes.light import Light
from mitsuba_scenes.scene import View

SPECTRAL = ["llvm_ad_spectral", "scalar_spectral"]
# The command's view with a third of its pixels.
SMALL = View(56, 38, fov_deg=5.0)
# Largest difference between the variants, which trace rays with different code in single precision.
VARIANTS_RTOL = 2e-3
# A blazed grating in aluminium; the tests of the realtime renderer leave its tables in the cache.
RIGOROUS = {"preset": "blazed", "period": 0.6, "height": 0.08, "theory": "rigorous", "eta": 1.0, "k": 6.9}
# Noise of a white plane's mean over 256 pixels with 100 samples in each band.
NOISE = 0.01
# Largest FLIP between a model and its table of colours along equal rays: an error of 1e-3 is below 8 bits.
SAME_MODEL_FLIP = 0.01


@pytest.fixture(scope="module")
def files():
    return snake.snake_files()


@pytest.fixture(scope="module")
def relief(tmp_path_factory):
    """A small, smooth, random, periodic relief, longer than wide, so that signs and axes are distinguishable."""
    path = tmp_path_factory.mktemp("reliefs") / "rough.npy"
    rng = np.random.default_rng(5)
    waves = np.fft.rfft2(rng.normal(size=(36, 50)))
    waves[6:-6], waves[:, 8:] = 0, 0
    heights = np.fft.irfft2(waves, s=(36, 50))
    np.save(path, 0.3 * heights / np.ptp(heights))
    skin = {"filename": str(path), "pixel_size": 0.1, "tiling": "periodic", "coherence_length": 20.0, "rotation": 30.0}
    return Case("rough", skin, supersample=2)


@pytest.fixture
def realtime_runs(files, tmp_path):
    """Skips where there is no adapter; any other error is a failure."""
    try:
        realtime.render(tmp_path / "a.exr", "stam", files.mesh, {"preset": "blazed"}, run.LIGHTS[0], View(8, 8))
    except SetupError as error:
        if "no usable GPU adapter" in str(error):
            needs.skip("gpu", str(error))
        raise


@pytest.fixture(params=SPECTRAL)
def spectral_variant(request):
    use_variant(request.param)
    return request.param


def equal_weights(count=81, step=5.0):
    """A quadrature over wavelengths with smooth weights."""
    nm = 380 + step * np.arange(count)
    weights = np.exp(-(((nm[:, None] - [610, 550, 450]) / 40) ** 2))
    return Quadrature(nm, weights / weights.sum(axis=0))


def points_of(case, files, light=run.LIGHTS[1], view=SMALL):
    bsdf = plugin(case, **SAME_MODEL)
    return bsdf, points.trace_points(mi.load_dict(cases.bare_scene(bsdf, files, light, view, 1)), light, view)


@pytest.mark.parametrize("name", ["blazed", "rough"])
def test_both_renderers_give_the_same_points(realtime_runs, files, relief, tmp_path, name):
    use_variant("llvm_ad_spectral")
    case = relief if name == "rough" else Case("blazed", {"preset": "blazed"}, supersample=1)
    view = SMALL if name == "rough" else run.CLOSE
    found = same_points.check(case, files, run.LIGHTS[1:], view, tmp_path)
    # One entry for each direction of the light; both negative controls must differ.
    assert len(found) == 2
    assert same_points.failures(case.name, found) == []
    for figures in found:
        assert figures["holds"]
        assert set(figures["controls"]) == {"rotated", "sign of u"}
        assert all(control["median"] > 100 * figures["median"] for control in figures["controls"].values())
    assert len(same_points.lines(found)) == 2


def test_both_renderers_give_the_same_colours_of_a_grating_in_aluminium(realtime_runs, files, tmp_path):
    """Plugin and GPU agree pixel by pixel to single precision, both by Maxwell's equations."""
    use_variant("llvm_ad_rgb")
    case = Case("aluminium", RIGOROUS, supersample=1)
    found = same_colours.check(case, files, run.LIGHTS[1:], run.CLOSE, tmp_path)
    assert same_points.failures(case.name, found) == [], same_points.lines(found)
    for line in same_points.lines(found):
        print(line)
    for figures in found:
        assert all(control["median"] > 100 * figures["median"] for control in figures["controls"].values())


def test_both_renderers_give_the_same_picture(realtime_runs, files, relief, tmp_path):
    use_variant("llvm_ad_spectral")
    case = Case(relief.name, relief.skin, supersample=8)
    found = same_picture.check(case, files, run.LIGHTS[1], View(24, 16, fov_deg=2.0), 1024, tmp_path)
    assert same_picture.failures(case.name, found) == [], same_picture.lines(found)


def test_the_table_of_methods_has_every_method(realtime_runs, files, relief, tmp_path, monkeypatch):
    use_variant("llvm_ad_spectral")
    monkeypatch.setattr(methods, "SUPERSAMPLE", 2)
    found = methods.check(relief, files, run.LIGHTS[0], View(24, 16), 16, tmp_path)
    against = found["against_the_reference"]
    assert list(against) == [*methods.METHODS, methods.SAME_RAYS, methods.ENERGY_KEPT, methods.TABLE_KEPT]
    assert all(against[name]["gpu_ms"] > 0 and against[name]["build_s"] >= 0 for name in methods.METHODS)
    # Along equal rays the table equals the ensemble; a single spacing does not.
    flip = {name: figures[methods.SAME_RAYS]["flip"]["mean"] for name, figures in against.items()}
    assert flip[methods.SAME_RAYS] == 0.0
    assert flip["table"] < SAME_MODEL_FLIP < flip["stam"]
    # The ensemble conserves energy by wavelength and the table by band. The remaining difference is smaller than
    # without conservation: tables by wavelength are raised at ridges, which bands do not have.
    kept = {name: against[name][methods.ENERGY_KEPT]["flip"]["mean"] for name in ("table", methods.TABLE_KEPT)}
    assert kept[methods.TABLE_KEPT] < 0.6 * kept["table"], kept
    # The mask selects the skin.
    assert 0 < against["flss"]["pixels"] < 24 * 16
    assert len(methods.lines(found)) == 4 + len(against)
    assert (tmp_path / "methods-rough.png").stat().st_size > 0


def test_the_variants_see_the_same_points(files, relief):
    found = []
    for variant in SPECTRAL:
        use_variant(variant)
        bsdf, at = points_of(relief, files, view=View(24, 16, fov_deg=5.0))
        found.append((points.radiance(bsdf, at, equal_weights(9, 50.0)), at))
    (one, at), (other, _) = found
    assert at.comparable.sum() > FEWEST_PIXELS
    assert agreement(one, other, at.comparable).median < VARIANTS_RTOL


def test_comparable_points_are_lit_and_away_from_the_rim(files, relief):
    use_variant("llvm_ad_spectral")
    _, at = points_of(relief, files, light=cases.sun(90.0, 60.0), view=View(96, 64, fov_deg=20.0))
    assert 0 < at.comparable.sum() < at.lit.sum() < at.seen.sum() < at.seen.size
    assert not (at.comparable & ~at.lit).any()
    assert not at.comparable[[0, -1]].any()
    for step in (-1, 1):
        for axis in (0, 1):
            assert not (at.comparable & ~np.roll(at.lit, step, axis)).any()


def test_a_mirrored_relief_is_the_sign_of_u(files, relief, tmp_path):
    use_variant("llvm_ad_spectral")
    bsdf, at = points_of(relief, files)
    turned_round = plugin(cases.mirrored(relief, tmp_path), **SAME_MODEL)
    weights = equal_weights()
    found = agreement(
        points.radiance(bsdf, points.mirrored(at, 30.0), weights),
        points.radiance(turned_round, at, weights),
        at.comparable,
    )
    assert found.holds, found
    assert not agreement(
        points.radiance(bsdf, at, weights), points.radiance(turned_round, at, weights), at.comparable
    ).holds


def test_a_turned_relief_turns_back(spectral_variant, relief):
    bsdf = plugin(relief, **SAME_MODEL)

    def rotation():
        return float(np.array(mi.traverse(bsdf)["rotation.value"]).item())

    with cases.turned(bsdf, 1.0):
        assert rotation() == 31.0
    assert rotation() == 30.0


def test_a_white_plane_is_white_in_bands(spectral_variant):
    light = Light(azimuth_deg=30, elevation_deg=90, sun="directional", sky_radiance=0)
    view, weights = View(16, 16, origin_cm=(0, -0.1, 5), target_cm=(0, 0, 0), fov_deg=10), equal_weights()
    sensor = {**view.sensor(100), "film": spectral.film(view, weights)}
    plane = {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": 1.0}}
    scene = {"type": "scene", "integrator": {"type": "path"}, "sensor": sensor, "plane": plane, **light.emitters()}
    colours = spectral.colours(np.array(mi.render(mi.load_dict(scene)), dtype=np.float64), weights)
    assert colours.shape == (16, 16, 3)
    np.testing.assert_allclose(colours.mean(axis=(0, 1)), 1.0, rtol=NOISE)


def test_agreement_is_relative_to_the_colour():
    rng = np.random.default_rng(3)
    a = rng.uniform(0.5, 1, (20, 20, 3))
    everywhere = np.ones((20, 20), dtype=bool)
    found = agreement(a, a * 1.0005, everywhere)
    assert found.holds
    assert found.median == pytest.approx(0.0005, rel=1e-3)
    assert not agreement(a, a * 1.002, everywhere).holds
    # One pixel in fifty exceeds the accepted hundredth.
    wrong = a.copy()
    wrong[::5, ::10] *= 1.5
    assert not agreement(a, wrong, everywhere).holds


def test_agreement_ignores_pixels_that_are_dark_in_both():
    a = np.random.default_rng(3).uniform(0.5, 1, (20, 20, 3))
    everywhere = np.ones((20, 20), dtype=bool)
    dark = np.where(np.arange(20)[:, None, None] < 10, a, 1e-5)
    assert agreement(dark, dark * np.where(dark < 1e-3, 2, 1), everywhere).pixels == 200
    assert not agreement(dark, a, everywhere).holds


@pytest.mark.parametrize("brightness", [0.0, 1.0, np.nan])
def test_pictures_that_show_nothing_are_refused(brightness):
    few = np.zeros((20, 20), dtype=bool)
    few[0] = True
    with pytest.raises(ValueError, match=r"pixels are bright enough|not finite"):
        agreement(np.full((20, 20, 3), brightness), np.full((20, 20, 3), brightness), few)


def test_failures_name_the_case_and_the_control():
    good = {"light": {"azimuth_deg": 5.0}, "holds": True, "text": "fine"}
    bad = {**good, "holds": False, "text": "off"}
    controls = {"rotated": {"holds": False, "text": "seen"}}
    assert same_points.failures("skin", [{**good, "controls": controls}]) == []
    differ, unnoticed = same_points.failures("skin", [{**bad, "controls": {"rotated": good}}])
    assert all(part in differ for part in ("skin", "off", "5°"))
    assert all(part in unnoticed for part in ("rotated", "fine"))
    with pytest.raises(run.Disagreement, match="off"):
        run.insist({"failures": [differ]})
    run.insist({"failures": []})


def test_each_limit_of_a_picture_counts():
    fine = {"delta_e_2000": {"mean": 0.5, "p99": 3.0}, "flip": {"mean": 0.01}}
    assert same_picture.holds(fine)
    for part, figure, value in [("delta_e_2000", "mean", 3.0), ("delta_e_2000", "p99", 20.0), ("flip", "mean", 0.2)]:
        assert not same_picture.holds({**fine, part: {**fine[part], figure: value}})


@pytest.mark.parametrize("change", [{"weights": [[1, 1, 1]]}, {"weights": [[0.5, 0.5, 0.4]] * 2}])
def test_invalid_quadratures_are_refused(change):
    fine = {"wavelengths_nm": [500.0, 510.0], "weights": [[0.5, 0.5, 0.5]] * 2}
    assert Quadrature.of_report({"quadrature": fine}).step_nm == 10.0
    with pytest.raises(ValueError, match="white"):
        Quadrature.of_report({"quadrature": {**fine, **change}})


def test_parameters_become_the_tool_s_arguments():
    words = realtime.surface_words({"filename": "a.npy", "pixel_size": 0.1, "conserve_energy": False})
    assert words == ["--height-field", "a.npy", "--pixel-size", 0.1, "--conserve-energy", "false"]


def test_a_missing_scan_is_reported(capsys, tmp_path):
    names = [case.name for case in cases.cases(tmp_path / "none.gsf")]
    assert names == [*cases.SKINS, "covered-blazed", "resized-xenopeltis"]
    assert "NOT CHECKED" in capsys.readouterr().out


def test_exit_codes_tell_the_outcome(monkeypatch, capsys, tmp_path):
    outcomes = iter([{"failures": []}, {"failures": ["elaphe differs"]}, SetupError("no tool")])

    def outcome(*_):
        found = next(outcomes)
        if isinstance(found, Exception):
            raise found
        return found

    monkeypatch.setattr(command, "crosscheck", outcome)
    assert [command.main(["-o", str(tmp_path)]) for _ in range(3)] == [0, 1, 2]
    said = capsys.readouterr().err
    assert all(part in said for part in ("elaphe differs", "no tool"))


def test_variants_without_wavelengths_are_refused(tmp_path):
    use_variant("scalar_rgb")
    with pytest.raises(SetupError, match="scalar_rgb"):
        run.crosscheck(tmp_path)
