"""The command reads files of independent packages with the right heights, units and orientation.

Tests of packages that a version of Python does not have are skipped.
"""

import json
import subprocess

import numpy as np
import pytest
from needs import require_module

from mitsuba_scenes.environment import SetupError
from mitsuba_scenes.tool import TOOL, sunbeam

# Heights that differ under every flip, on a grid longer than wide; row 0 is y = 0, as in the library.
ROWS, COLUMNS = 5, 7
HEIGHTS_UM = 0.1 + 0.03 * np.arange(COLUMNS) + 0.05 * (np.arange(ROWS) ** 2)[:, None] / ROWS
DX_UM, DY_UM = 0.065, 0.11
# Rounding of products of doubles, and of 32-bit floats below 1 µm.
DOUBLE_UM, FLOAT_UM = 1e-12, 5e-8
HOLE = (3, 2)
# Parameters with quick tables.
WIDE = {"coherence_length": 2.0, "conserve_energy": False}


def with_hole():
    heights = HEIGHTS_UM.copy()
    heights[HOLE] = np.nan
    return heights


def read(path, *words):
    """The command's report on a file, and the heights in µm without levelling."""
    out = path.with_name("out.npy")
    report = json.loads(sunbeam("height-field", "--height-field", path, "--level", "none", "-o", out, *words))
    return report, np.load(out)


def check(path, *words, tolerance_um=DOUBLE_UM, hole=False, pixel_um=(DX_UM, DY_UM)):
    """Checks pixels and heights; a filled hole lies between its neighbours."""
    if hole:
        with pytest.raises(SetupError, match=r"1 of 35 points .*`fill`"):
            read(path, *words)
        words = (*words, "--fill", "laplace")
    report, heights = read(path, *words)
    np.testing.assert_allclose(report["pixel_um"], pixel_um, rtol=1e-7)
    expected = HEIGHTS_UM.copy()
    if hole:
        assert report["filled_points"] == 1
        rim = [expected[3, 1], expected[3, 3], expected[2, 2], expected[4, 2]]
        assert min(rim) < heights[HOLE] < max(rim)
        expected[HOLE] = heights[HOLE]
    np.testing.assert_allclose(heights, expected, rtol=0, atol=tolerance_um)
    return report


@pytest.mark.parametrize(("unit", "per_um"), [("m", 1e-6), ("nm", 1e3), ("um", 1.0)])
@pytest.mark.parametrize("hole", [False, True], ids=["whole", "hole"])
def test_gsf(tmp_path, unit, per_um, hole):
    gsffile = require_module("readers", "gsffile")
    path = tmp_path / "heights.gsf"
    heights = with_hole() if hole else HEIGHTS_UM
    extent = {"XReal": COLUMNS * DX_UM * 1e-6, "YReal": ROWS * DY_UM * 1e-6, "XYUnits": "m", "ZUnits": unit}
    gsffile.write_gsf(path, np.flipud(heights * per_um).astype(np.float32), {**extent, "Title": "skin"})
    check(path, tolerance_um=FLOAT_UM, hole=hole)


def test_gsf_of_the_tool(tmp_path):
    gsffile = require_module("readers", "gsffile")
    np.save(tmp_path / "heights.npy", HEIGHTS_UM)
    out = tmp_path / "out.gsf"
    words = ["--height-field", tmp_path / "heights.npy", "--pixel-size", 0.1, "--level", "none", "-o", out]
    sunbeam("height-field", *words)
    heights, header = gsffile.read_gsf(out)
    np.testing.assert_allclose(np.flipud(heights) * 1e6, HEIGHTS_UM, atol=FLOAT_UM)
    assert header["XReal"] == pytest.approx(COLUMNS * 1e-7)
    assert header["YReal"] == pytest.approx(ROWS * 1e-7)
    assert (header["XYUnits"], header["ZUnits"]) == ("m", "m")


def gwyddion_file(path, mask):
    objects = require_module("readers", "gwyfile.objects")

    def field(rows_up, unit_z):
        extent = {"xreal": COLUMNS * DX_UM * 1e-6, "yreal": ROWS * DY_UM * 1e-6}
        return objects.GwyDataField(np.flipud(rows_up).copy(), **extent, si_unit_xy="m", si_unit_z=unit_z)

    container = objects.GwyContainer()
    container["/0/data/title"] = "Phase"
    container["/0/data"] = field(np.zeros_like(HEIGHTS_UM), "deg")
    container["/1/data/title"] = "Height Sensor"
    container["/1/data"] = field(HEIGHTS_UM * 1e-6, "m")
    container["/2/data/title"] = "Z, upside down"
    container["/2/data"] = field(-HEIGHTS_UM * 1e-6, "m")
    if mask:
        marked = np.zeros_like(HEIGHTS_UM)
        marked[HOLE] = 1.0
        container["/1/mask"] = field(marked, "")
    container.tofile(str(path))


@pytest.mark.parametrize("mask", [False, True], ids=["whole", "mask"])
def test_gwy(tmp_path, mask):
    path = tmp_path / "heights.gwy"
    gwyddion_file(path, mask)
    assert check(path, hole=mask)["channel"] == "Height Sensor"
    check(path, "--channel", "height sensor", hole=mask)
    check(path, "--channel", "1", hole=mask)
    report, heights = read(path, "--channel", "2")
    assert report["channel"] == "Z, upside down"
    np.testing.assert_allclose(heights, -HEIGHTS_UM, atol=DOUBLE_UM)


def test_gwy_names_its_channels_when_the_choice_is_wrong(tmp_path):
    path = tmp_path / "heights.gwy"
    gwyddion_file(path, False)
    for choice, reason in [("Phase", "not a length"), ("3", "no `channel`"), ("Topography", "no `channel`")]:
        with pytest.raises(SetupError, match=reason) as refusal:
            read(path, "--channel", choice)
        for part in ("heights.gwy", '0 "Phase" (deg)', '1 "Height Sensor" (m)', '2 "Z, upside down" (m)'):
            assert part in str(refusal.value)


@pytest.mark.parametrize("compression", [None, "zlib"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
@pytest.mark.parametrize("byteorder", ["<", ">"])
def test_tiff(tmp_path, dtype, compression, byteorder):
    tifffile = require_module("readers", "tifffile")
    path = tmp_path / "heights.tif"
    is_integer = np.issubdtype(dtype, np.integer)
    full = np.iinfo(dtype).max if is_integer else 1.0
    pages = [np.zeros((ROWS, COLUMNS), dtype), np.flipud(HEIGHTS_UM * full).astype(dtype)]
    with tifffile.TiffWriter(path, byteorder=byteorder) as file:
        for page in pages:
            resolution = {"resolution": (1e4 / DX_UM, 1e4 / DY_UM), "resolutionunit": "CENTIMETER"}
            file.write(page, photometric="minisblack", compression=compression, metadata=None, **resolution)
    words = ["--max-height", 1.0] if is_integer else []
    tolerance_um = {np.uint8: 1 / 255, np.uint16: 1 / 65535, np.float32: FLOAT_UM, np.float64: DOUBLE_UM}[dtype]
    check(path, "--channel", "1", *words, tolerance_um=tolerance_um)
    _, first = read(path, *words)
    assert not first.any()


def test_tiff_of_imagej(tmp_path):
    tifffile = require_module("readers", "tifffile")
    path = tmp_path / "heights.tif"
    heights = np.flipud(with_hole()).astype(np.float32)
    tifffile.imwrite(path, heights, imagej=True, resolution=(1 / DX_UM, 1 / DY_UM), metadata={"unit": "um"})
    check(path, tolerance_um=FLOAT_UM, hole=True)


@pytest.mark.parametrize("file_format", ["ASCII", "BINARY"])
@pytest.mark.parametrize(
    ("revision", "data_type"),
    [("ISO_1_0", kind) for kind in ("INT16", "INT32", "BINARY64")]
    + [("ISO_2_0", kind) for kind in ("INT8", "INT16", "INT32", "BINARY32", "BINARY64")]
    + [("BCR_1_0", kind) for kind in ("UINT8", "UINT16", "UINT32", "BINARY32", "INT16", "BINARY64")],
)
def test_sdf(tmp_path, file_format, revision, data_type):
    sdfio = require_module("readers", "sdfio")
    path = tmp_path / "heights.sdf"
    kind = sdfio.DataType[data_type]
    metadata = sdfio.Metadata(revision=sdfio.Revision[revision], data_type=kind)
    shape = {"format": sdfio.FileFormat[file_format], "metadata": metadata}
    sdfio.write(path, with_hole() * 1e-6, x_scale=DX_UM * 1e-6, y_scale=DY_UM * 1e-6, **shape)
    # Heights equal those that the package reads, and the true ones to the data type's rounding.
    steps = {"8": 1 / 127, "16": 1 / 32767, "32": FLOAT_UM, "64": DOUBLE_UM}
    check(path, hole=True, tolerance_um=next(step for bits, step in steps.items() if data_type.endswith(bits)))
    _, heights = read(path, "--fill", "laplace")
    theirs = sdfio.read(path).data * 1e6
    valid = np.isfinite(theirs)
    np.testing.assert_allclose(heights[valid], theirs[valid], rtol=0, atol=DOUBLE_UM)


@pytest.mark.parametrize("storage", ["XML", "BINARY"])
@pytest.mark.parametrize("z_type", ["INT16", "INT32", "FLOAT32", "FLOAT64"])
@pytest.mark.parametrize("revision", ["ISO5436_2000", "ISO25178_72_2017_DAM1"])
def test_x3p(tmp_path, storage, z_type, revision):
    x3pio = require_module("readers", "x3pio")
    path = tmp_path / "heights.x3p"
    kind = {"storage": x3pio.DataStorage[storage], "z_type": x3pio.DataType[z_type]}
    kind["revision"] = x3pio.Revision[revision]
    x3pio.write(path, with_hole() * 1e-6, x_scale=DX_UM * 1e-6, y_scale=DY_UM * 1e-6, **kind)
    tolerance_um = {"INT16": 1 / 32767, "INT32": FLOAT_UM, "FLOAT32": FLOAT_UM, "FLOAT64": DOUBLE_UM}[z_type]
    check(path, hole=True, tolerance_um=tolerance_um)
    _, heights = read(path, "--fill", "laplace")
    theirs = np.squeeze(x3pio.read(path).layers[0].z) * 1e6
    valid = np.isfinite(theirs)
    np.testing.assert_allclose(heights[valid], theirs[valid], rtol=0, atol=DOUBLE_UM)


def test_text(tmp_path):
    path = tmp_path / "heights.csv"
    np.savetxt(path, with_hole(), delimiter=",")
    check(path, "--pixel-size", 0.1, hole=True, pixel_um=(0.1, 0.1))
    y, x = np.mgrid[:ROWS, :COLUMNS]
    points = np.stack([x * DX_UM + 3.0, y * DY_UM - 1.0, with_hole()], axis=-1).reshape(-1, 3)
    path = tmp_path / "heights.xyz"
    # Points are shuffled, and the hole is a missing point.
    np.savetxt(path, np.random.default_rng(1).permutation(points[np.isfinite(points[:, 2])]))
    check(path, hole=True)


@pytest.mark.parametrize("fortran", [False, True])
def test_npy(tmp_path, fortran):
    path = tmp_path / "heights.npy"
    np.save(path, np.asfortranarray(with_hole()) if fortran else with_hole())
    check(path, "--pixel-size", 0.1, hole=True, pixel_um=(0.1, 0.1))


def test_operations_go_in_their_order(tmp_path):
    """Filling, cropping, levelling and tiling equal NumPy's in this order."""
    rows, columns, pixel_um = 60, 110, 0.05
    x, y = np.arange(columns) * pixel_um, np.arange(rows)[:, None] * pixel_um
    heights = 0.2 * np.sin(2 * np.pi * x / 1.0) + 0.05 * np.cos(2 * np.pi * y / 0.5) + 0.3 * x - 0.2 * y + 5.0
    holed = heights.copy()
    holed[30, 60] = np.nan
    path = tmp_path / "tilted.npy"
    np.save(path, holed)
    out = tmp_path / "tile.npy"
    words = ["--height-field", path, "--pixel-size", pixel_um, "--fill", "laplace", "-o", out]
    report = json.loads(sunbeam("height-field", *words, "--crop", "0.25,0.5,5,2.5", "--make-tileable=0.5"))
    assert report["filled_points"] == 1
    # Four periods of 1 µm and four of 0.5 µm fit beside a blend of 0.5 µm.
    np.testing.assert_allclose(report["extent_um"], [4.0, 2.0], atol=1e-9)
    for axis in "xy":
        assert report["made_tileable"]["seams_after"][axis]["ratio"] < 1.5
    # A plane fitted over parts of periods leaves some tilt, which shifts the peak.
    assert report["periods"]["x"]["period_um"] == pytest.approx(1.0, abs=1e-4)
    assert report["periods"]["y"]["period_um"] == pytest.approx(0.5, abs=1e-4)
    cut = heights[10:60, 5:105]
    columns_of = np.stack([np.ones(cut.size), *(axis.ravel() for axis in np.mgrid[:50, :100])], axis=1)
    plane = columns_of @ np.linalg.lstsq(columns_of, cut.ravel(), rcond=None)[0]
    level = cut - plane.reshape(cut.shape)
    tile = np.load(out)
    assert tile.shape == (40, 80)
    # Differences remain at the filled point, by its effect on the plane, and in blended strips.
    inside = (slice(10, None), slice(10, None))
    difference = np.abs(tile[inside] - level[:40, :80][inside])
    assert np.sort(difference.ravel())[-2] < 1e-4
    np.testing.assert_allclose(report["roughness"]["sq_um"], np.std(tile), rtol=1e-9)
    centred = tile - tile.mean()
    for key, value in [("sa_um", np.abs(centred).mean()), ("ssk", (centred**3).mean() / np.std(tile) ** 3)]:
        assert report["roughness"][key] == pytest.approx(value, abs=1e-9)
    assert report["roughness"]["sku"] == pytest.approx((centred**4).mean() / np.var(tile) ** 2)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--crop", "1,2,3"], ["--crop", "X,Y,WIDTH,HEIGHT"]),
        (["--crop", "0,0,1e3,1"], ["does not lie within"]),
        (["--make-tileable=30"], ["blend of 30", "third"]),
        (["--fill", "zero"], ["none", "laplace", "mean"]),
        (["--fill", "mean"], ["filename"]),
        (["--channel", "Height"], ["filename"]),
        (["--level", "bowl"], ["quadratic", "lines"]),
    ],
)
def test_bad_operations_are_refused_in_one_line(words, said):
    with pytest.raises(SetupError) as refusal:
        sunbeam("height-field", "--preset", "sinusoidal", *words)
    assert "\n" not in str(refusal.value)
    for part in said:
        assert part in str(refusal.value)


def gwyddion_text(path, channel="Height", value_unit="m"):
    """A matrix exported by Gwyddion in a locale with decimal commas."""
    lines = [f"# Kanál: {channel}", f"# Šířka: {COLUMNS * DX_UM:.3f} µm", f"# Výška: {ROWS * DY_UM:.3f} µm"]
    lines += [f"# Jednotky hodnot: {value_unit}"]
    lines += ["\t".join(f"{height:.12e}" for height in row) for row in np.flipud(HEIGHTS_UM) * 1e-6]
    path.write_text("\n".join(lines).replace(".", ",") + "\n", encoding="utf-16")


def test_text_of_gwyddion_keeps_its_provenance(tmp_path):
    path = tmp_path / "skin.txt"
    gwyddion_text(path)
    provenance = check(path)["provenance"]
    sources = {name: entry["source"] for name, entry in provenance.items()}
    assert sources == {
        "pixel_size": "file",
        "height_unit": "file",
        "rows": "format",
        "channel": "default",
        "holes": "file",
    }
    assert provenance["height_unit"]["value"] == "m"
    gwyddion_text(path, value_unit="V")
    with pytest.raises(SetupError, match=r'unit "V" is not a known unit of length'):
        read(path)


def test_command_and_mitsuba_warn_of_metres_taken_for_micrometres(tmp_path):
    import mitsuba as mi
    from conftest import use_variant

    path = tmp_path / "metres.txt"
    np.savetxt(path, HEIGHTS_UM * 1e-6)
    words = [TOOL, "height-field", "--height-field", path, "--pixel-size", "0.1"]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=True)
    assert "less than an atom: was the file in metres" in done.stderr
    assert "was the file in metres" in json.loads(done.stdout)["doubts"][0]
    use_variant("scalar_rgb")
    logged = []

    class Listener(mi.Appender):
        def append(self, level, text):
            logged.append((level, text))

        def log_progress(self, *_):
            pass

    listener = Listener()
    mi.logger().add_appender(listener)
    try:
        for _ in range(2):
            mi.load_dict({"type": "diffraction", "filename": str(path), "pixel_size": 0.1, **WIDE})
    finally:
        mi.logger().remove_appender(listener)
    warnings = [text for level, text in logged if level == mi.LogLevel.Warn and "metres" in text]
    assert len(warnings) == 1, logged


def test_mitsuba_takes_a_channel_by_number(tmp_path):
    import mitsuba as mi
    from conftest import use_variant

    path = tmp_path / "heights.gwy"
    gwyddion_file(path, False)
    use_variant("scalar_rgb")
    bsdf = {"type": "diffraction", "filename": str(path), **WIDE}
    mi.load_dict({**bsdf, "channel": 2})
    for channel, reason in [(0, "not a length"), (7, "no `channel`"), (-1, "title or its number")]:
        with pytest.raises(RuntimeError, match=reason):
            mi.load_dict({**bsdf, "channel": channel})
