"""Every parameter is accepted, refused and shown as documented."""

import mitsuba as mi
import pytest

ACCEPTED = [
    {},
    {"preset": "blazed", "period": 2.0, "height": 0.2},
    {"preset": "xenopeltis", "level": "mean", "tiling": "aperiodic"},
    {"coherence_length": 1e-3, "tolerance": 1e-6},
    {"coherence_length": 100000, "tolerance": 0.1},
    {"model": "patch", "obliquity": "unit", "conserve_energy": True, "shadowing": True},
    {"material": "Al"},
    {"material": "none"},
    {"eta": 1.56},
    {"eta": 0.2, "k": 3.9},
    {"specular_reflectance": 0.5, "diffuse_reflectance": {"type": "checkerboard"}},
    {"rotation": 30},
    {"rotation": {"type": "checkerboard"}},
]

# Parameters, the one that the message must name, and what it must say is accepted.
REFUSED = [
    ({"preset": "blazd"}, "preset", "xenopeltis"),
    ({"preset": 1.0}, "preset", "string"),
    ({"period": 2.0}, "period", "blazed"),
    ({"preset": "blazed", "period": 0.0}, "period", "(0, 1e6]"),
    ({"preset": "blazed", "period": "wide"}, "period", "float"),
    ({"preset": "lamellar", "height": -1.0}, "height", "(0, 1e6]"),
    ({"preset": "flat", "height": 1.0}, "height", "sinusoidal"),
    ({"filename": "no-such-file.exr"}, "filename", "no-such-file.exr"),
    ({"filename": True}, "filename", "string"),
    ({"pixel_size": 0.1}, "pixel_size", "filename"),
    ({"max_height": 0.1}, "max_height", "filename"),
    ({"level": "flat"}, "level", "plane"),
    ({"tiling": "mirror"}, "tiling", "aperiodic"),
    ({"coherence_length": 0.0}, "coherence_length", "[1e-3, 1e5]"),
    ({"coherence_length": float("nan")}, "coherence_length", "finite"),
    ({"model": "average"}, "model", "ensemble"),
    ({"obliquity": "cosine"}, "obliquity", "stam"),
    ({"conserve_energy": "yes"}, "conserve_energy", "bool"),
    ({"shadowing": 1.0}, "shadowing", "bool"),
    ({"tolerance": 0.5}, "tolerance", "[1e-6, 1e-1]"),
    ({"tolerance": float("inf")}, "tolerance", "finite"),
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
def test_accepted(typical_variant, make_bsdf, parameters):
    make_bsdf(**parameters)


@pytest.mark.parametrize(("parameters", "named", "accepted"), REFUSED, ids=str)
def test_refused(typical_variant, make_bsdf, parameters, named, accepted):
    with pytest.raises(RuntimeError) as refusal:
        make_bsdf(**parameters)
    message = str(refusal.value)
    assert f'"{named}"' in message
    assert accepted in message


@pytest.fixture
def height_file(tmp_path):
    path = tmp_path / "heights of a skin.gsf"
    path.write_bytes(b"Gwyddion Simple Field 1.0\nXRes = 1\nYRes = 1\n\0\0\0\0\0\0\0\0")
    return path


def test_file_beside_preset_is_refused(scalar_rgb, make_bsdf, height_file):
    with pytest.raises(RuntimeError, match='"preset" contradicts "filename"'):
        make_bsdf(preset="blazed", filename=str(height_file))
    with pytest.raises(RuntimeError, match='"period" contradicts "filename"'):
        make_bsdf(period=1.0, filename=str(height_file))


def test_file_is_found_by_the_resolver(scalar_rgb, make_bsdf, height_file):
    mi.file_resolver().append(str(height_file.parent))
    assert str(height_file) in str(make_bsdf(filename=height_file.name))


def test_a_folder_is_not_a_file(scalar_rgb, make_bsdf, tmp_path):
    with pytest.raises(RuntimeError, match='"filename"'):
        make_bsdf(filename=str(tmp_path))


def test_description_tells_the_surface(variant, make_bsdf):
    text = str(make_bsdf(preset="blazed", period=2.0, coherence_length=30.0, tolerance=1e-4))
    for part in ("blazed", "period 2 µm", "30 µm", "1e-4", "eta", "rotation"):
        assert part in text


def test_xml_is_read(scalar_rgb):
    bsdf = mi.load_string(
        '<bsdf type="diffraction" version="3.0.0">'
        '<string name="preset" value="sinusoidal"/><float name="period" value="1.5"/>'
        '<boolean name="shadowing" value="true"/><rgb name="diffuse_reflectance" value="0.1, 0.2, 0.3"/>'
        "</bsdf>"
    )
    assert "sinusoidal, period 1.5 µm" in str(bsdf)


def test_traverse_shows_what_is_continuous(variant, make_bsdf):
    params = mi.traverse(make_bsdf(diffuse_reflectance=0.2))
    names = {key.split(".")[0] for key in params.keys()}  # noqa: SIM118
    assert names == {"eta", "k", "specular_reflectance", "diffuse_reflectance", "rotation"}
    params["specular_reflectance.value"] = 0.5
    params.update()
