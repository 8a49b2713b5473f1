"""Every parameter is accepted, refused and shown as documented."""

import time

import mitsuba as mi
import numpy as np
import pytest
from conftest import use_variant
from surfaces import QUICK

# Most surfaces are quick to build; the ends of a parameter's range are those of the flat preset.
ACCEPTED = [
    {"preset": "blazed", "period": 2.0, "height": 0.2},
    {"preset": "flat", "level": "mean", "coherence_length": 1e-3, "tolerance": 1e-6, "conserve_energy": False},
    {"preset": "flat", "coherence_length": 100000, "tolerance": 0.1, "conserve_energy": False},
    {"preset": "flat", "model": "patch", "obliquity": "unit", "conserve_energy": True, "shadowing": True},
    {**QUICK, "material": "Al"},
    {**QUICK, "material": "none"},
    {**QUICK, "eta": 1.56},
    {**QUICK, "eta": 0.2, "k": 3.9},
    {**QUICK, "specular_reflectance": 0.5, "diffuse_reflectance": {"type": "checkerboard"}},
    {**QUICK, "scale": 0.5, "depth": 0.3},
    {**QUICK, "scale": {"type": "checkerboard"}, "depth": 0.5},
    {**QUICK, "cover_eta": 1.58, "material": "Al"},
    {**QUICK, "cover_eta": "acrylic glass"},
    {**QUICK, "cover_eta": 1.5, "cover_reflection": False, "eta": 1.56, "diffuse_reflectance": 0.3},
    {**QUICK, "rotation": 30},
    {**QUICK, "rotation": {"type": "checkerboard"}},
]
# Accepted in one variant alone: skins take seconds to build, and acceptance does not depend on the variant.
ACCEPTED_ONCE = [
    {},
    {"preset": "sinusoidal", "level": "mean", "tiling": "aperiodic", "conserve_energy": False, "tolerance": 1e-2},
]

# Parameters, the one that the message must name, and an accepted value or range that it must show.
REFUSED = [
    ({"preset": "blazd"}, "preset", "xenopeltis"),
    ({"preset": 1.0}, "preset", "string"),
    ({"period": 2.0}, "period", "blazed"),
    ({"preset": "blazed", "period": 0.0}, "period", "(0, 1e3]"),
    ({"preset": "blazed", "period": "wide"}, "period", "float"),
    ({"preset": "lamellar", "height": -1.0}, "height", "(0, 1e3]"),
    ({"preset": "blazed", "period": 1e6}, "period", "meant in nm?"),
    ({"preset": "flat", "height": 1.0}, "height", "sinusoidal"),
    ({"preset": "xenopeltis", "region_size": 2.0, "region_spread": 0.05}, "region_size", "[3e0, 3.3e1]"),
    ({"preset": "elaphe", "region_size": 20.0, "region_spread": 0.2}, "region_spread", "[0e0, 1e-1]"),
    ({"preset": "elaphe", "region_size": 20.0}, "region_size", "region_spread"),
    ({"preset": "cd", "region_size": 20.0, "region_spread": 0.05}, "region_size", "xenopeltis"),
    ({"scale": 0.0}, "scale", "[1e-3, 1e0]"),
    ({"depth": 1.5}, "depth", "[1e-3, 1e0]"),
    ({"preset": "blazed", "scale": {"type": "checkerboard"}, "theory": "rigorous"}, "scale", "numbers"),
    ({"cover_eta": 0.9}, "cover_eta", "[1e0, 2.6e0]"),
    ({"cover_eta": {"type": "checkerboard"}}, "cover_eta", "spectrum"),
    ({"cover_eta": float("nan")}, "cover_eta", "finite"),
    ({"cover_eta": "jelly"}, "jelly", "acrylic glass"),
    ({"cover_reflection": True}, "cover_reflection", "cover_eta"),
    ({"filename": "no-such-file.exr"}, "filename", "no-such-file.exr"),
    ({"filename": True}, "filename", "string"),
    ({"pixel_size": 0.1}, "pixel_size", "filename"),
    ({"max_height": 0.1}, "max_height", "filename"),
    ({"channel": "Height"}, "channel", "filename"),
    ({"fill": "laplace"}, "fill", "filename"),
    ({"fill": "zero"}, "fill", "laplace"),
    ({"level": "flat"}, "level", "plane"),
    ({"tiling": "mirror"}, "tiling", "aperiodic"),
    ({"coherence_length": 0.0}, "coherence_length", "[1e-3, 1e5]"),
    ({"coherence_length": float("nan")}, "coherence_length", "finite"),
    ({"model": "average"}, "model", "ensemble"),
    ({"obliquity": "cosine"}, "obliquity", "small_slope"),
    ({"obliquity": "small_slope", "eta": {"type": "checkerboard"}}, "obliquity", "numbers or spectra"),
    ({"conserve_energy": "yes"}, "conserve_energy", "bool"),
    ({"shadowing": 1.0}, "shadowing", "bool"),
    ({"tolerance": 0.5}, "tolerance", "[1e-6, 1e-1]"),
    ({"tolerance": float("inf")}, "tolerance", "finite"),
    ({"build_limit": 0.5}, "build_limit", "[1e0, 1e6]"),
    ({"material": "Unobtainium"}, "material", "Al"),
    ({"material": "../ior/Al"}, "material", "Al"),
    ({"material": "Al", "eta": 1.5}, "material", "eta"),
    ({"k": 1.0}, "k", "eta"),
    ({"eta": -1.0}, "eta", "at least 0"),
    ({"eta": 1.0, "k": float("nan")}, "k", "at least 0"),
    ({"eta": "glass"}, "eta", "texture"),
    ({"eta": {"type": "diffuse"}}, "eta", "Texture"),
    ({"specular_reflectance": 1.5}, "specular_reflectance", "[0, 1]"),
    ({"diffuse_reflectance": {"type": "rgb", "value": [2, 0, 0]}}, "diffuse_reflectance", "[0, 1]"),
    ({"rotation": "left"}, "rotation", "texture"),
    ({"rotation": float("inf")}, "rotation", "finite"),
    ({"coherence": 65.0}, "coherence", "coherence_length"),
    ({"alpha": 0.1, "preset": "blazed"}, "alpha", "tolerance"),
    ({"nested": {"type": "diffuse"}}, "nested", "preset"),
]


@pytest.mark.parametrize("parameters", ACCEPTED, ids=str)
def test_valid_parameters_are_accepted(typical_variant, make_bsdf, parameters):
    make_bsdf(**parameters)


@pytest.mark.parametrize("parameters", ACCEPTED_ONCE, ids=str)
def test_valid_parameters_are_accepted_in_one_variant(scalar_rgb, make_bsdf, parameters):
    make_bsdf(**parameters)


@pytest.mark.parametrize(("parameters", "named", "accepted"), REFUSED, ids=str)
def test_invalid_parameters_are_refused(typical_variant, make_bsdf, parameters, named, accepted):
    with pytest.raises(RuntimeError) as refusal:
        make_bsdf(**parameters)
    message = str(refusal.value)
    assert f'"{named}"' in message
    assert accepted in message


def gsf(metres, header="", cut=None):
    """A Gwyddion simple field with pixels of 0.1 µm."""
    rows, columns = metres.shape
    text = f"Gwyddion Simple Field 1.0\nXRes = {columns}\nYRes = {rows}\nXReal = {columns * 1e-7}\n"
    text += f"YReal = {rows * 1e-7}\nXYUnits = m\nZUnits = m\n{header}"
    text = text.encode()
    return (text + b"\0" * (4 - len(text) % 4) + metres.astype("<f4").tobytes())[:cut]


@pytest.fixture
def height_file(tmp_path):
    path = tmp_path / "heights of a skin.gsf"
    path.write_bytes(gsf(np.zeros((1, 1))))
    return path


def test_file_beside_preset_is_refused(scalar_rgb, make_bsdf, height_file):
    with pytest.raises(RuntimeError, match='"preset" contradicts "filename"'):
        make_bsdf(preset="blazed", filename=str(height_file))
    with pytest.raises(RuntimeError, match='"period" contradicts "filename"'):
        make_bsdf(period=1.0, filename=str(height_file))


def test_file_is_found_by_the_resolver(scalar_rgb, make_bsdf, height_file):
    mi.file_resolver().append(str(height_file.parent))
    assert str(height_file) in str(make_bsdf(filename=height_file.name, conserve_energy=False))


def test_holes_are_filled_on_request(scalar_rgb, make_bsdf, tmp_path):
    path = tmp_path / "holed.gsf"
    path.write_bytes(gsf(with_nan()))
    with pytest.raises(RuntimeError, match="`fill`"):
        make_bsdf(filename=str(path), conserve_energy=False)
    make_bsdf(filename=str(path), fill="laplace", conserve_energy=False)
    with pytest.raises(RuntimeError, match="single channel"):
        make_bsdf(filename=str(path), fill="mean", channel="1", conserve_energy=False)


def test_a_folder_is_not_a_file(scalar_rgb, make_bsdf, tmp_path):
    with pytest.raises(RuntimeError, match='"filename"'):
        make_bsdf(filename=str(tmp_path))


def test_description_tells_the_surface(variant, make_bsdf):
    surface = {"preset": "blazed", "period": 2.0, "coherence_length": 30.0, "tolerance": 1e-4}
    text = str(make_bsdf(**surface, conserve_energy=False))
    for part in ("blazed", "period 2 µm", "30 µm", "1e-4", "MB", "relative error", "eta", "rotation"):
        assert part in text


def test_xml_is_read(scalar_rgb):
    bsdf = mi.load_string(
        '<bsdf type="diffraction" version="3.0.0">'
        '<string name="preset" value="sinusoidal"/><float name="period" value="1.5"/>'
        '<boolean name="shadowing" value="true"/><boolean name="conserve_energy" value="false"/>'
        '<rgb name="diffuse_reflectance" value="0.1, 0.2, 0.3"/>'
        "</bsdf>"
    )
    assert "sinusoidal, period 1.5 µm" in str(bsdf)


def test_traverse_shows_the_continuous_parameters(variant, make_bsdf):
    params = mi.traverse(make_bsdf(**QUICK, diffuse_reflectance=0.2))
    names = {key.split(".")[0] for key in params.keys()}  # noqa: SIM118
    numbers = {"coherence_length", "scale", "depth"}
    assert names == {"eta", "k", "specular_reflectance", "diffuse_reflectance", "rotation"} | numbers
    params["specular_reflectance.value"] = 0.5
    params.update()


def npy(path, values):
    np.save(path, values)


def with_nan():
    values = np.zeros((5, 7))
    values[3, 2] = np.nan
    return values


PIXEL = {"pixel_size": 0.1}
# File name, writer, further parameters, and the parts of the message besides the file's name.
BAD_FILES = [
    ("nan.npy", lambda p: npy(p, with_nan()), PIXEL, ["row 3", "column 2", "fill"]),
    ("infinite.npy", lambda p: npy(p, np.full((2, 2), np.inf)), PIXEL, ["row 0", "4 of 4 points"]),
    ("nan.gsf", lambda p: p.write_bytes(gsf(with_nan())), {}, ["row 3", "column 2", "NaN"]),
    ("nan.txt", lambda p: p.write_text("0 1 2 1\nnan 2 3 1\n1 0 4 2\n"), PIXEL, ["row 1", "fill"]),
    ("words.txt", lambda p: p.write_text("0 1\n2 rough\n"), PIXEL, ["rough"]),
    ("ragged.txt", lambda p: p.write_text("0 1\n2\n"), PIXEL, ["text"]),
    ("empty.txt", lambda p: p.write_text(""), PIXEL, ["text"]),
    ("cube.npy", lambda p: npy(p, np.zeros((2, 2, 2))), PIXEL, ["NumPy"]),
    ("complex.npy", lambda p: npy(p, np.zeros((2, 2), dtype=complex)), PIXEL, ["NumPy"]),
    ("short.gsf", lambda p: p.write_bytes(gsf(np.zeros((9, 9)), cut=-4)), {}, ["Gwyddion"]),
    ("huge.gsf", lambda p: p.write_bytes(gsf(np.zeros((1, 1))).replace(b"XRes = 1", b"XRes = 4000000000")), {}, []),
    ("zero.exr", lambda p: p.write_bytes(b""), PIXEL, ["OpenEXR"]),
    ("noise.exr", lambda p: p.write_bytes(bytes(range(256)) * 9), PIXEL, ["OpenEXR"]),
    ("noise.png", lambda p: p.write_bytes(bytes(range(256)) * 9), PIXEL, ["PNG"]),
    ("surface.stl", lambda p: p.write_text("solid"), PIXEL, ["stl", ".gsf"]),
    ("unscaled.npy", lambda p: npy(p, np.zeros((4, 4))), {}, ["pixel_size"]),
    ("bytes.npy", lambda p: npy(p, np.eye(4, dtype=np.uint8)), PIXEL, ["max_height"]),
    ("other.gsf", lambda p: p.write_bytes(gsf(np.zeros((4, 4)))), {"pixel_size": 0.2}, ["pixel_size", "0.2"]),
]
BAD_SCALES = [("pixel_size", 0.0), ("pixel_size", -0.1), ("pixel_size", 1e7), ("max_height", -1.0), ("max_height", 0.0)]


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_spectral"])
@pytest.mark.parametrize(("name", "write", "scale", "said"), BAD_FILES, ids=[case[0] for case in BAD_FILES])
def test_a_bad_file_is_refused(variant, make_bsdf, tmp_path, name, write, scale, said):
    use_variant(variant)
    write(tmp_path / name)
    with pytest.raises(RuntimeError) as refusal:
        make_bsdf(filename=str(tmp_path / name), **scale)
    message = str(refusal.value)
    for part in [name, *said]:
        assert part in message


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_spectral"])
@pytest.mark.parametrize(("parameter", "value"), BAD_SCALES, ids=str)
def test_a_bad_scale_is_refused(variant, make_bsdf, height_file, parameter, value):
    use_variant(variant)
    with pytest.raises(RuntimeError, match=f'"{parameter}" is .*must be a length'):
        make_bsdf(filename=str(height_file), **{parameter: value})


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_spectral"])
def test_a_relief_too_deep_for_tables_is_refused(variant, make_bsdf):
    """A range of a quarter of a millimetre, as of nanometres taken for micrometres, is refused."""
    use_variant(variant)
    with pytest.raises(RuntimeError, match=r"building the tables would take .* Is the height in µm\?"):
        make_bsdf(preset="blazed", height=250.0)


def test_wrong_parameters_are_refused_before_tables_are_built(scalar_rgb, make_bsdf):
    """The refusal of an expensive skin takes far less time than its build."""
    start = time.perf_counter()
    with pytest.raises(RuntimeError, match='"speculer_reflectance"'):
        make_bsdf(preset="xenopeltis", tolerance=1e-6, speculer_reflectance=0.5)
    with pytest.raises(RuntimeError, match='"material"'):
        make_bsdf(preset="xenopeltis", tolerance=1e-6, material="Unobtainium")
    assert time.perf_counter() - start < 1.0
