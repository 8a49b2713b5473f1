"""The Python package as installed: the wheel is built, unpacked into a folder, and imported from there."""

import json
import os
import re
import subprocess
import sys
import zipfile
from importlib.metadata import version as installed_version
from pathlib import Path

import numpy as np
import pytest

REPOSITORY = Path(__file__).resolve().parent.parent
TOOL = REPOSITORY / "target" / "release" / "sunbeam"
# A surface with quick tables. Directions and values pass in single precision; a direction's rounding of 6e-8 is 1e-5 of
# an order's width.
QUICK = {"preset": "blazed", "period": 2.0, "coherence_length": 10.0, "conserve_energy": False, "tolerance": 0.01}
RTOL = 1e-4


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    words = ["wheel", "--quiet", "--no-build-isolation", "--no-deps", "--wheel-dir", str(folder), str(REPOSITORY)]
    subprocess.run([sys.executable, "-m", "pip", *words], check=True, timeout=1200)
    (made,) = folder.glob("*.whl")
    return made


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    words = ["install", "--quiet", "--no-deps", "--no-index", "--target", str(folder), str(wheel)]
    subprocess.run([sys.executable, "-m", "pip", *words], check=True)
    return folder


def run(script, *paths, cwd):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths))}
    words = [sys.executable, "-c", script]
    return subprocess.run(words, env=environment, cwd=cwd, capture_output=True, text=True, timeout=600)


@pytest.fixture(scope="module")
def package(installed):
    """The installed package, imported in this process."""
    sys.path.insert(0, str(installed))
    try:
        import sunbeam_mitsuba

        assert Path(sunbeam_mitsuba.__file__).is_relative_to(installed)
        yield sunbeam_mitsuba
    finally:
        sys.path.remove(str(installed))


def test_the_wheel_holds_the_plugin_and_names_its_platform(wheel):
    assert wheel.name.startswith("sunbeam_mitsuba-0.1.0-py3-none-linux")
    names = zipfile.ZipFile(wheel).namelist()
    assert "sunbeam_mitsuba/plugins/3.9.1/plugins/diffraction.so" in names
    assert "sunbeam_mitsuba/__init__.py" in names
    (metadata,) = [name for name in names if name.endswith("METADATA")]
    described = zipfile.ZipFile(wheel).read(metadata).decode()
    assert "Requires-Dist: mitsuba<=3.9.1,>=3.7.1" in described
    assert described.endswith((REPOSITORY / "python" / "README.md").read_text(encoding="utf-8"))


def test_the_readme_s_scene_renders_in_an_empty_environment(wheel, tmp_path):
    """The environment has the packages that `pip install` brings and no others."""
    environment = tmp_path / "environment"
    subprocess.run([sys.executable, "-m", "venv", str(environment)], check=True)
    python = environment / "bin" / "python"
    pinned = [f"mitsuba=={installed_version('mitsuba')}", f"numpy=={installed_version('numpy')}"]
    words = ["install", "--quiet", "--disable-pip-version-check", "--no-compile", "--only-binary=:all:"]
    subprocess.run([str(python), "-m", "pip", *words, str(wheel), *pinned], check=True, timeout=600)
    readme = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    (scene,) = re.findall(r"```python\n(import mitsuba.*?)```", readme, re.S)
    scene = scene.replace('mi.file_resolver().append("target/mitsuba")', IMPORT)
    assert IMPORT in scene
    done = subprocess.run([str(python), "-c", scene], cwd=tmp_path, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "ball.png").stat().st_size > 10_000


IMPORT = "import sunbeam_mitsuba"
LOAD = "print(mi.variant(), mi.load_dict({'type': 'diffraction', 'preset': 'flat'}).class_name())"


@pytest.mark.parametrize(
    "lines",
    [
        ["mi.set_variant('scalar_rgb')", IMPORT, LOAD],
        [IMPORT, "mi.set_variant('scalar_rgb')", LOAD],
        [IMPORT, "mi.set_variant('llvm_ad_spectral')", LOAD, "mi.set_variant('scalar_rgb')", LOAD],
        [IMPORT, "sunbeam_mitsuba.register()", "mi.set_variant('scalar_rgb')", LOAD],
        ["sys.path.insert(0, '')", "import sunbeam_mitsuba; sunbeam_mitsuba.Surface(preset='flat')",
         "mi.set_variant('scalar_rgb')", LOAD],
    ],
    ids=["after", "before", "several", "again", "surface-first"],
)  # fmt: skip
def test_the_plugin_registers_in_any_order_of_imports(installed, tmp_path, lines):
    done = run("\n".join(["import sys", "import mitsuba as mi", *lines]), installed, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout
    assert all(line.endswith(" Diffraction") for line in done.stdout.splitlines())


def test_another_mitsuba_is_refused_by_name(installed, tmp_path):
    """Another release's metadata suffice, since the package is refused before Mitsuba is loaded."""
    other = tmp_path / "other" / "mitsuba-3.6.0.dist-info"
    other.mkdir(parents=True)
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: mitsuba\nVersion: 3.6.0\n")
    done = run("import sunbeam_mitsuba", other.parent, installed, cwd=tmp_path)
    assert done.returncode == 1
    assert "ImportError: sunbeam_mitsuba was compiled for mitsuba==3.9.1, but 3.6.0 is installed" in done.stderr


def test_versions_are_the_same_everywhere(package):
    project = (REPOSITORY / "pyproject.toml").read_text()
    assert f'version = "{package.__version__}"' in project
    assert f'version = "{package.__version__}"' in (REPOSITORY / "Cargo.toml").read_text()
    packaging = REPOSITORY / "crates/c_abi/package"
    assert f"Version: {package.__version__}\n" in (packaging / "sunbeam.pc").read_text()
    assert f'PACKAGE_VERSION "{package.__version__}"' in (packaging / "sunbeam-config-version.cmake").read_text()
    script = (REPOSITORY / "cpp_shim/build.rs").read_text()
    newest, *_, oldest = re.findall(r'Release \{ mitsuba: "([\d.]+)"', script)
    assert newest == package.MITSUBA_VERSION
    for text in (project, (REPOSITORY / "requirements.lock").read_text()):
        assert f"mitsuba=={newest}" in text
    assert f'"mitsuba>={oldest},<={newest}"' in project


def directions(count, seed):
    random = np.random.default_rng(seed)
    z, phi = 0.05 + 0.95 * random.random(count), 2 * np.pi * random.random(count)
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1).astype(np.float32)


def asked(lines, command="eval", **parameters):
    """Answers of the command line, one a line of input."""
    words = [word for name, value in parameters.items() for word in (f"--{name.replace('_', '-')}", str(value).lower())]
    text = "\n".join(json.dumps(line) for line in lines)
    done = subprocess.run([str(TOOL), command, *words], input=text, capture_output=True, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_batches_equal_the_command_lines(package):
    surface = package.Surface(**QUICK, eta=1.5, k=0.2)
    wi, wo, nm = directions(50, 1), directions(50, 2), np.array([420.0, 550.0, 700.0], dtype=np.float32)
    # Half of the directions lie in the plane of incidence, where a grating sends its light.
    wo[::2, 1] = -wi[::2, 1]
    wo[::2, 2] = np.sqrt(np.maximum(1 - wo[::2, 0] ** 2 - wo[::2, 1] ** 2, 1e-3))
    wo /= np.linalg.norm(wo, axis=-1, keepdims=True)
    lines = [{"wi": a.tolist(), "wo": b.tolist(), "wavelength": nm.tolist()} for a, b in zip(wi, wo)]
    expected = asked(lines, **QUICK, eta=1.5, k=0.2)
    f, pdf = surface.eval_pdf(wi, wo, nm)
    assert (f.shape, pdf.shape, f.dtype) == ((50, 3), (50,), np.float32)
    np.testing.assert_allclose(f, [answer["f"] for answer in expected], rtol=RTOL, atol=1e-7)
    np.testing.assert_allclose(pdf, [answer["pdf"] for answer in expected], rtol=RTOL, atol=1e-7)
    assert np.count_nonzero(f > 0.01) > 20
    np.testing.assert_array_equal(surface.eval(wi, wo, nm), f)
    np.testing.assert_array_equal(surface.pdf(wi, wo, nm), pdf)


def test_parameters_may_be_numpy_scalars(package):
    surface = package.Surface(**{**QUICK, "coherence_length": np.float32(20)}, eta=np.float64(1.5), k=np.int64(0))
    plain = package.Surface(**{**QUICK, "coherence_length": 20}, eta=1.5, k=0)
    assert surface.eval([0, 0, 1], [0.6, 0, 0.8], 550.0) == plain.eval([0, 0, 1], [0.6, 0, 0.8], 550.0)
    with pytest.raises(package.SunbeamError, match="eta is neither a number"):
        package.Surface(**QUICK, eta=1.5 + 2j)


def test_samples_equal_the_command_lines(package):
    surface, wi, u = package.Surface(**QUICK), np.float32([0.6, 0, 0.8]), np.random.default_rng(3).random((40, 3), "f4")
    lines = [{"wi": wi.tolist(), "wavelength": [450, 600], "u": random.tolist()} for random in u]
    wo, pdf, weight = surface.sample(wi, [450, 600], u)
    expected = asked(lines, "sample", **QUICK)
    np.testing.assert_allclose(wo, [answer["wo"] or [0, 0, 0] for answer in expected], atol=1e-6)
    np.testing.assert_allclose(pdf, [answer["pdf"] for answer in expected], rtol=RTOL)
    np.testing.assert_allclose(weight, [answer["weight"] for answer in expected], rtol=RTOL, atol=1e-9)
    assert np.count_nonzero(pdf) > 20


def test_arrays_broadcast_as_numpy_does(package):
    surface, wi, wo = package.Surface(**QUICK), directions(4, 5), directions(3, 6)
    table = surface.eval(wi[:, None], wo[None], [500, 600])
    assert table.shape == (4, 3, 2)
    for i in range(4):
        for j in range(3):
            np.testing.assert_array_equal(table[i, j], surface.eval(wi[i], wo[j], [500, 600]))
            assert surface.eval(wi[i], wo[j], 500).shape == ()
            assert surface.eval(wi[i], wo[j], 500) == table[i, j, 0]
    own = surface.eval(wi[0], wo, [[500], [550], [600]])
    assert [own[j, 0] for j in range(3)] == [surface.eval(wi[0], wo[j], nm) for j, nm in enumerate([500, 550, 600])]
    strided = np.asfortranarray(np.concatenate([wo, wo], axis=1))[:, :3]
    np.testing.assert_array_equal(surface.eval(wi[0], strided, 500), surface.eval(wi[0], wo, 500))
    assert surface.eval(wi[0], np.empty((0, 3)), 500).shape == (0,)


def test_large_batches_equal_small_ones(package):
    surface, wo = package.Surface(**QUICK), directions(20_000, 7)
    whole = surface.eval([0, 0, 1], wo, 550)
    np.testing.assert_array_equal(
        whole, np.concatenate([surface.eval([0, 0, 1], part, 550) for part in np.split(wo, 40)])
    )


def test_heights_may_be_an_array(package):
    x = np.arange(64) / 64
    heights = np.tile(0.1 * np.cos(2 * np.pi * x), (4, 1))
    quick = {"tiling": "periodic", "coherence_length": 10, "conserve_energy": False, "tolerance": 0.01, "level": "none"}
    surface = package.Surface(heights, pixel_um=(2.0 / 64, 0.5), **quick)
    same = package.Surface(
        preset="sinusoidal", period=2.0, height=0.2, coherence_length=10, conserve_energy=False, tolerance=0.01
    )
    wi, wo = np.array([0.6, 0, 0.8]), directions(200, 8)
    wo[:, 1] *= 0.05
    wo /= np.linalg.norm(wo, axis=-1, keepdims=True)
    # The preset has 1024 samples a period and this array 64. The difference is small, since orders beyond the 30th have
    # no power.
    np.testing.assert_allclose(surface.eval(wi, wo, 550), same.eval(wi, wo, 550), rtol=0.03, atol=2e-3)
    assert surface.describe()["config"]["tiling"] == "periodic"


@pytest.mark.parametrize(
    ("call", "mentioned"),
    [
        (lambda p: p.Surface(preset="cobra"), "xenopeltis"),
        (lambda p: p.Surface(coherence=3), "coherence_length"),
        (lambda p: p.Surface(filename=Path("no/such.gsf")), "no/such.gsf"),
        (lambda p: p.Surface(np.zeros(4), pixel_um=1), "iy, ix"),
        (lambda p: p.Surface(np.zeros((4, 4))), "pixel_um"),
        (lambda p: p.Surface(np.full((4, 4), np.nan), pixel_um=1), "NaN"),
        (lambda p: p.Surface(np.zeros((4, 4)), pixel_um=1, preset="flat"), '"preset"'),
        (lambda p: p.Surface(**QUICK).eval([0, 0, 2], [0, 0, 1], 550), "`wi` has length 2"),
        (lambda p: p.Surface(**QUICK).eval([0, 1], [0, 0, 1], 550), "wi has the shape"),
        (lambda p: p.Surface(**QUICK).eval([0, 0, 1], [0, 0, 1], 900), "360"),
        (lambda p: p.Surface(**QUICK).eval([0, 0, 1], [0, 0, 1], []), "wavelength_count"),
        (lambda p: p.Surface(**QUICK).sample([0, 0, 1], 550, [0, 0, 1.5]), "[0, 1)"),
    ],
)
def test_refusals_name_the_fault(package, call, mentioned):
    with pytest.raises(package.SunbeamError) as error:
        call(package)
    assert mentioned in str(error.value)


def test_describe_tells_how_a_file_was_understood(package, tmp_path):
    path = tmp_path / "metres.txt"
    np.savetxt(path, 1e-7 * np.random.default_rng(1).random((6, 8)))
    described = package.Surface(filename=str(path), pixel_size=0.1, coherence_length=2.0).describe()["file"]
    assert described["provenance"]["pixel_size"]["source"] == "option"
    assert described["provenance"]["height_unit"] == {"source": "default", "value": "µm"}
    assert "was the file in metres" in described["doubts"][0]
    assert "file" not in package.Surface(preset="blazed", coherence_length=2.0).describe()
