"""The XML scenes of `make scenes` load, equal the Python scenes, and render with the command `mitsuba`."""

import subprocess
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from conftest import PLUGIN_FOLDER, use_variant

from mitsuba_scenes import files, picture
from mitsuba_scenes.laboratory import Bench, bench_scene
from mitsuba_scenes.light import Light
from mitsuba_scenes.scene import View, snake_scene
from mitsuba_scenes.skin import skin_bsdf
from mitsuba_scenes.snake import snake_files

# Small pictures, with the preset whose tables are built fastest.
SMALL = {
    "snake": {"width": 48, "height": 32, "spp": 16, "preset": "blazed"},
    "laboratory": {"width": 40, "height": 36, "crop_height": 30, "spp": 64, "preset": "blazed"},
    "scan": {"width": 32, "height": 32, "spp": 16},
}
# The files hold the Python scenes' numbers to five digits, and samples are equal.
SAME_SCENE_RTOL = 2e-3


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    use_variant("scalar_rgb")
    folder = tmp_path_factory.mktemp("scenes")
    # tests/test_foils.py has the scenes made by Python alone.
    assert [path.stem for path in files.write_scenes(folder, resolution=1)][: len(SMALL)] == sorted(SMALL)
    return folder


def rendered(scene):
    return np.array(mi.render(scene), dtype=np.float64)


def loaded(folder, name):
    """Loads the scene of a file at a small size. In parallel, or optimised, Mitsuba would order lamps at random."""
    values = {key: str(value) for key, value in SMALL[name].items()}
    return mi.load_file(str(folder / f"{name}.xml"), parallel=False, optimize=False, **values)


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb"])
@pytest.mark.parametrize("name", sorted(SMALL))
def test_each_file_renders(folder, variant, name):
    use_variant(variant)
    pixels = rendered(loaded(folder, name))
    assert pixels.shape[:2] == (SMALL[name].get("crop_height", SMALL[name]["height"]), SMALL[name]["width"])
    # The beam's power is 3e-2 mm² over a screen of half a square metre.
    picture.check(pixels * (1e5 if name == "laboratory" else 1), name)


@pytest.mark.parametrize("name", ["snake", "laboratory"])
def test_files_equal_the_python_scene(folder, name):
    use_variant("llvm_ad_rgb")
    small = SMALL[name]
    if name == "snake":
        made = snake_files(1)
        skin = skin_bsdf({"preset": small["preset"]}, made.pigment)
        scene = snake_scene(skin, made, Light(), View(small["width"], small["height"]), small["spp"])
    else:
        scene = bench_scene(
            {"type": "diffraction", "preset": small["preset"]}, Bench(pixels_per_mm=0.05), {"type": "d65"}
        )
        scene["sensor"]["sampler"]["sample_count"] = small["spp"]
    scenes = mi.load_dict(scene, parallel=False, optimize=False), loaded(folder, name)
    expected, found = (rendered(scene).mean(axis=(0, 1)) for scene in scenes)
    np.testing.assert_allclose(found, expected, rtol=SAME_SCENE_RTOL)


def test_the_mitsuba_command_renders_a_users_scan(folder, tmp_path):
    y, x = np.mgrid[:64, :64] * 0.1
    rows = "\n".join(" ".join(f"{h:.5f}" for h in row) for row in 0.1 * np.sin(2 * np.pi * x / 1.6) + 0 * y)
    (tmp_path / "ridges.txt").write_text(rows)
    use_variant("scalar_rgb")
    own = (
        (folder / "scan.xml")
        .read_text()
        .replace(
            '<string name="filename" value="$scan"/>',
            '<string name="filename" value="$scan"/><float name="pixel_size" value="0.1"/>'
            '<float name="coherence_length" value="6"/>',
        )
    )
    (tmp_path / "own.xml").write_text(own)
    output = tmp_path / "own.exr"
    words = [Path(sys.executable).parent / "mitsuba", "-a", PLUGIN_FOLDER, "-m", "scalar_rgb", "-o", output]
    words += ["-D", f"scan={tmp_path / 'ridges.txt'}", "-D", "width=32", "-D", "height=32", "-D", "spp=4"]
    done = subprocess.run([*map(str, words), str(tmp_path / "own.xml")], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    picture.check(np.array(mi.Bitmap(str(output)), dtype=np.float64), "own")
