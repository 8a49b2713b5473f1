"""The snake's scenes render in their variants, and the command line reports errors."""

import os
import subprocess
import sys
from functools import cache

import mitsuba as mi
import numpy as np
import pytest
from conftest import REPOSITORY, use_variant
from PIL import Image

from mitsuba_scenes import demo, picture, render, snake
from mitsuba_scenes.crosscheck.cases import SCAN
from mitsuba_scenes.environment import SetupError
from mitsuba_scenes.light import Light
from mitsuba_scenes.scene import View
from mitsuba_scenes.skin import PRESETS, preset_skin, scanned_skin, skin_bsdf

SMALL = View(64, 48)


@pytest.fixture(scope="session")
def files():
    return snake.snake_files(resolution=1)


@pytest.fixture(params=["llvm_ad_spectral", "scalar_spectral"])
def scene_variant(request):
    use_variant(request.param)
    return request.param


@cache
def made_skin(variant, files, parameters):
    """A skin in the current variant, built once for each variant."""
    return mi.load_dict(skin_bsdf(dict(parameters), files.pigment))


@cache
def small_picture(variant, files, light=Light(), parameters=(("preset", "xenopeltis"),)):  # noqa: B008 (it is frozen)
    skin = made_skin(variant, files, parameters)
    return picture.render(skin, files, light, SMALL, spp=4, max_depth=3).pixels


@pytest.mark.parametrize("skin", ["blazed", "xenopeltis"])
def test_the_report_knows_the_tables(scene_variant, files, skin):
    found = demo.tables(str(made_skin(scene_variant, files, tuple(preset_skin(skin).items()))))
    assert found["size_mb"] > 0
    assert 0 < found["relative_error"] < 1e-2


def test_the_report_knows_tables_of_colours():
    use_variant("scalar_rgb")
    found = demo.tables(str(mi.load_dict({"type": "diffraction", "preset": "blazed"})))
    assert found["size_mb"] > 0
    assert 0 < found["relative_error"] < 1e-2


@pytest.mark.parametrize("skin", list(PRESETS))
def test_every_skin_renders(scene_variant, files, skin):
    pixels = small_picture(scene_variant, files, parameters=tuple(preset_skin(skin).items()))
    assert pixels.shape == (48, 64, 3)
    picture.check(pixels, skin)


@pytest.mark.parametrize("sun", ["directional", "disc"])
def test_the_sun_has_its_documented_radiance(scene_variant, files, sun):
    """A white ground facing the sun has radiance 1, and 0.25 from the sky."""
    light = Light(azimuth_deg=30, elevation_deg=90, sun=sun, sky_radiance=0.25)
    ground = {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": 1.0}}
    view = View(16, 16, origin_cm=(0, -0.1, 5), target_cm=(0, 0, 0), fov_deg=10)
    scene = mi.load_dict(
        {"type": "scene", "integrator": {"type": "path"}, "sensor": view.sensor(64), "g": ground, **light.emitters()}
    )
    mean = np.array(mi.render(scene)).mean(axis=(0, 1))
    # 256 pixels of 64 samples, each with a noise of 10 %.
    np.testing.assert_allclose(mean, 1.25, rtol=0.01)


def test_the_light_changes_the_picture(scene_variant, files):
    one = small_picture(scene_variant, files)
    other = small_picture(scene_variant, files, light=Light(azimuth_deg=Light().azimuth_deg + 60))
    assert np.abs(one - other).mean() > 0.1 * one.mean()


def test_a_scan_goes_from_file_to_picture(scene_variant, files, tmp_path):
    _, x = np.mgrid[:64, :64]
    grey = (127.5 + 127.5 * np.sin(2 * np.pi * x / 16)).astype(np.uint8)
    Image.fromarray(grey).save(tmp_path / "scan.png")
    skin = scanned_skin(tmp_path / "scan.png", pixel_size_um=0.1, max_height_um=0.2)
    picture.check(small_picture(scene_variant, files, parameters=tuple(skin.items())), "scan")


@pytest.mark.parametrize("pixels", [np.zeros((4, 4, 3)), np.full((4, 4, 3), np.nan), np.full((4, 4, 3), np.inf)])
def test_bad_pictures_are_found(pixels):
    with pytest.raises(picture.PictureError, match="some picture"):
        picture.check(pixels, "some picture")


def test_tone_mapping_keeps_order_and_range(scene_variant):
    ramp = np.linspace(0, 8, 64, dtype=np.float32)[None, :, None].repeat(3, axis=2)
    mapped = picture.tone_mapped(ramp, 0.0)[0, :, 0].astype(int)
    assert mapped[0] == 0
    # Mitsuba dithers by one step.
    assert np.all(np.diff(mapped) >= -1)
    assert 240 < mapped[-1] <= 255


def test_command_line_writes_both_files(scene_variant, files, tmp_path, capsys):
    output = tmp_path / "new" / "snake.exr"
    words = ["--variant", scene_variant, "--resolution", "32", "24", "--spp", "3", "--light-direction", "10", "50"]
    words += ["--mesh", str(files.mesh), "--pigment", str(files.pigment), "--skin", "blazed", "-o", str(output)]
    assert render.main(words) == 0
    # Rounded up to a square number.
    assert "rendering 32 x 24, 4 samples a pixel" in capsys.readouterr().out
    assert output.stat().st_size > 0
    assert output.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--skin", "cobra"], "xenopeltis"),
        (["--spp", "0"], "--spp"),
        (["--eta", "inf"], "inf is not a finite number above zero"),
        (["--light-direction", "10"], "--light-direction"),
        (["--sun", "moon"], "directional"),
        (["--skin", "cd", "--height-field", "a.gsf"], "not allowed with"),
        (["--height-field", "missing.gsf"], "missing.gsf"),
        (["--pixel-size", "0.1"], "--height-field"),
        (["--light-direction", "10", "-5"], "elevation"),
        (["--sky", "-1"], "sky"),
        (["--variant", "llvm_ad_smell"], "llvm_ad_spectral"),
        (["--mesh", "missing.ply"], "missing.ply"),
        (["-o", "snake.png"], ".exr"),
        (["-o", "pyproject.toml/snake.exr"], "pyproject.toml is no folder"),
        (["-o", "/proc/none/snake.exr"], "cannot be written"),
    ],
)
def test_command_line_errors_are_one_line_and_code_2(capsys, words, says):
    try:
        code = render.main(words)
    except SystemExit as exit_:
        code = exit_.code
    assert code == 2
    assert says in capsys.readouterr().err.splitlines()[-1]


def test_a_missing_plugin_is_named_with_its_remedy(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr("mitsuba_scenes.environment.PLUGIN", tmp_path / "diffraction.so")
    assert render.main(["--spp", "1"]) == 2
    assert "make plugin" in capsys.readouterr().err


def test_a_missing_tool_is_named_with_its_remedy(tmp_path):
    with pytest.raises(SetupError, match="make tool"):
        snake.snake_files(tool=tmp_path / "sunbeam")


def test_a_tool_that_fails_leaves_no_unfinished_snake(tmp_path):
    tool = tmp_path / "sunbeam"
    tool.write_text('#!/bin/sh\necho half > "$3"\nexit 1\n')
    tool.chmod(0o755)
    with pytest.raises(SetupError, match="failed"):
        snake.snake_files(tool=tool, folder=tmp_path / "scenes")
    assert list((tmp_path / "scenes").iterdir()) == []


def test_without_llvm_the_scalar_variant_is_used(files, tmp_path):
    words = ["--resolution", "16", "12", "--spp", "1", "--mesh", files.mesh, "--pigment", files.pigment]
    done = subprocess.run(
        [sys.executable, "-m", "mitsuba_scenes.render", *map(str, words), "-o", str(tmp_path / "a.exr")],
        cwd=REPOSITORY,
        env={**os.environ, "DRJIT_LIBLLVM_PATH": str(tmp_path / "none.so")},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "scalar_spectral" in done.stderr
    assert "scalar_spectral" in done.stdout


def test_the_demonstration_has_every_skin_and_three_lights():
    skins, sweep = demo.shots()
    measured = ["scan-xenopeltis"] if SCAN.exists() else []
    assert [name for name, *_ in skins] == [*measured, "blazed", "elaphe", "xenopeltis"]
    assert len({light.azimuth_deg for *_, light in sweep}) == 3
