"""Conversion of instruments' files by SurfaceTopography keeps heights, units and directions.

The library is in requirements-formats.lock. From Python 3.10 on these tests fail without it.
"""

import os
import struct
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import needs
import numpy as np
import pytest
from needs import require_module
from sweeps import QUICK, REPOSITORY, one_line, sweep, write_spec

from mitsuba_scenes.environment import SetupError
from mitsuba_scenes.tool import sunbeam

if sys.version_info < (3, 10):
    needs.skip("readers", "SurfaceTopography needs Python 3.10 or newer", module="tests/test_formats.py")

import gsffile
import SurfaceTopography.IO as library
from SurfaceTopography import Topography, UniformLineScan, read_topography

# Heights that differ under every flip, on a grid longer than wide; row 0 is y = 0.
ROWS, COLUMNS = 6, 9
DX_UM, DY_UM = 0.07, 0.11
IX, IY = np.arange(COLUMNS), np.arange(ROWS)[:, None]
HEIGHTS_UM = 0.2 + 0.02 * IX + 0.04 * IY**2 / ROWS + 0.03 * IX * IY / ROWS
HOLE = (4, 1)
# Rounding of 32-bit floats below 1 µm, as in .gsf; and of lengths scaled in double precision.
FLOAT_UM, DOUBLE_UM = 6e-8, 1e-12
# Extensions that only the library reads and sunbeam leaves out: profiles, bare arrays, terrain, and text.
NO_MAPS = {"qep", "xlsx", "zip", "hfm", "h5", "mat", "npz", "hgt", "dat"}
OWN = {"spm", "001", "002", "003", "004", "005", "gwy", "npy", "tiff", "tif", "sdf", "txt", "asc", "x3p", "xyz", "csv"}


@pytest.fixture(scope="module")
def package(sweep_package):
    """The checkout's package with its module `convert`."""
    import sunbeam_mitsuba
    import sunbeam_mitsuba.convert

    assert sweep_package is sunbeam_mitsuba.sweep
    return sunbeam_mitsuba


def with_hole():
    heights = HEIGHTS_UM.copy()
    heights[HOLE] = np.nan
    return heights


def write_bcrf(path, heights_um, unit="nm", per_um=1e3):
    """A BCRF file: a header of 2048 bytes, then rows of 32-bit floats from the top; the largest float is a hole."""
    rows, columns = heights_um.shape
    lines = {
        "fileformat": "bcrf", "headersize": 2048, "xpixels": columns, "ypixels": rows, "intelmode": 1,
        "xlength": columns * DX_UM * 1e3, "ylength": rows * DY_UM * 1e3,
        "xunit": "nm", "yunit": "nm", "zunit": unit,
    }  # fmt: skip
    header = "".join(f"{name} = {value}\n" for name, value in lines.items()).encode()
    stored = np.where(np.isfinite(heights_um), heights_um * per_um, 3.402823e38)
    path.write_bytes(header.ljust(2048) + np.flipud(stored).astype("<f4").tobytes())


def write_stp(path, heights_um):
    """A file of WSxM with heights as doubles in nm, rotated by 180 degrees."""
    rows, columns = heights_um.shape
    header = (
        "WSxM file copyright UAM\nSxM Image file\nImage header size: 999\n[Control]\n"
        f"    X Amplitude: {columns * DX_UM * 1e3} nm\n    Y Amplitude: {rows * DY_UM * 1e3} nm\n[General Info]\n"
        f"    Image Data Type: double\n    Number of columns: {columns}\n    Number of rows: {rows}\n"
        f"    Z Amplitude: {np.ptp(heights_um) * 1e3} nm\n[Header end]\n"
    )
    turned = np.flipud(heights_um)[::-1, ::-1]
    path.write_bytes(header.replace("\n", "\r\n").encode() + (turned * 1e3).astype("<f8").tobytes())


def write_gwy(path, *titles, unit="m"):
    """A file of Gwyddion with a channel for each title; channel i holds (i + 1) times the heights."""
    from gwyfile import objects

    container = objects.GwyContainer()
    for number, title in enumerate(titles):
        extent = {"xreal": COLUMNS * DX_UM * 1e-6, "yreal": ROWS * DY_UM * 1e-6, "si_unit_xy": "m", "si_unit_z": unit}
        data = np.flipud(HEIGHTS_UM).copy() * (number + 1) * 1e-6
        container[f"/{number}/data/title"] = title
        container[f"/{number}/data"] = objects.GwyDataField(data, **extent)
    container.tofile(str(path))


def write_x3p(path, heights_um):
    x3pio = require_module("readers", "x3pio")
    kind = {"revision": x3pio.Revision.ISO5436_2000, "storage": x3pio.DataStorage.BINARY}
    x3pio.write(path, heights_um * 1e-6, x_scale=DX_UM * 1e-6, y_scale=DY_UM * 1e-6, **kind)


def write_sdf(path, heights_um):
    sdfio = require_module("readers", "sdfio")
    metadata = sdfio.Metadata(revision=sdfio.Revision.ISO_1_0, data_type=sdfio.DataType.BINARY64)
    kind = {"format": sdfio.FileFormat.BINARY, "metadata": metadata}
    sdfio.write(path, heights_um * 1e-6, x_scale=DX_UM * 1e-6, y_scale=DY_UM * 1e-6, **kind)


def write_nanoscope(path, heights_um):
    """A Nanoscope file of one image of 16 bits, whose first line is the bottom."""
    counts = np.round((heights_um - 0.2) / 0.7 * 32767).astype("<i2")
    rows, columns = counts.shape
    # Full scale is 65536 counts.
    scale_v = 0.7 / 32767 * 65536
    header = (
        "\\*File list\r\n\\Version: 0x05120130\r\n\\Data length: 2048\r\n"
        "\\*Scanner list\r\n\\@Sens. Zscan: V 1000 nm/V\r\n"
        f"\\*Ciao scan list\r\n\\Samps/line: {columns}\r\n\\Lines: {rows}\r\n"
        f"\\*Ciao image list\r\n\\Data offset: 2048\r\n\\Data length: {2 * counts.size}\r\n\\Bytes/pixel: 2\r\n"
        f"\\Samps/line: {columns}\r\n\\Number of lines: {rows}\r\n\\Aspect ratio: 1:1\r\n"
        f"\\Scan size: {columns * DX_UM * 1e3} {rows * DX_UM * 1e3} nm\r\n"
        '\\@2:Image Data: S [Height] "Height"\r\n'
        f"\\@2:Z scale: V [Sens. Zscan] (1.0 V/LSB) {scale_v} V\r\n\\*File list end\r\n"
    )
    path.write_bytes(header.encode().ljust(2048, b"\0") + counts.tobytes())


def converted(package, path, *arguments, **options):
    """Converts a file; returns the .gsf's heights in µm from y = 0 on, and its pixel's edges."""
    out = path.with_name("converted.gsf")
    package.convert.convert(path, out, *arguments, **options)
    heights, header = gsffile.read_gsf(out)
    assert (header["XYUnits"], header["ZUnits"]) == ("m", "m")
    rows, columns = heights.shape
    pixel_um = (header["XReal"] * 1e6 / columns, header["YReal"] * 1e6 / rows)
    return np.flipud(heights).astype(float) * 1e6, pixel_um


def refusal(package, path, *arguments, **options):
    with pytest.raises(package.SunbeamError) as refused:
        converted(package, path, *arguments, **options)
    assert "\n" not in str(refused.value)
    return str(refused.value)


def exit_code(package, *words):
    try:
        return package.convert.main([str(word) for word in words])
    except SystemExit as stopped:
        return stopped.code


@pytest.mark.parametrize(("unit", "per_um"), [("nm", 1e3), ("um", 1.0), ("m", 1e-6)])
def test_bcrf_keeps_heights_size_and_holes(package, tmp_path, unit, per_um):
    write_bcrf(tmp_path / "scan.bcrf", with_hole(), unit, per_um)
    heights, pixel_um = converted(package, tmp_path / "scan.bcrf")
    np.testing.assert_allclose(heights, with_hole(), rtol=0, atol=2 * FLOAT_UM)
    np.testing.assert_allclose(pixel_um, (DX_UM, DY_UM), rtol=1e-12)


def test_wsxm_keeps_heights_and_size(package, tmp_path):
    write_stp(tmp_path / "scan.stp", HEIGHTS_UM)
    heights, pixel_um = converted(package, tmp_path / "scan.stp")
    np.testing.assert_allclose(heights, HEIGHTS_UM, rtol=0, atol=FLOAT_UM)
    np.testing.assert_allclose(pixel_um, (DX_UM, DY_UM), rtol=1e-12)


@pytest.mark.parametrize("name", ["scan.gwy", "scan.x3p", "scan.sdf", "scan.spm", "scan.xyz"])
def test_convert_and_the_native_reader_agree(package, tmp_path, name):
    """Heights and pixels equal the native reader's, to rounding of doubles, and of floats in .gsf."""
    path = tmp_path / name
    options = {}
    if name == "scan.gwy":
        write_gwy(path, "Topography")
    elif name == "scan.xyz":
        y, x = np.mgrid[:ROWS, :COLUMNS]
        np.savetxt(path, np.stack([x * DX_UM, y * DY_UM, HEIGHTS_UM], axis=-1).reshape(-1, 3))
        options = {"unit": "µm"}
    else:
        {".x3p": write_x3p, ".sdf": write_sdf, ".spm": write_nanoscope}[path.suffix](path, HEIGHTS_UM)
    sunbeam("height-field", "--height-field", path, "--level", "none", "-o", tmp_path / "own.npy")
    own = np.load(tmp_path / "own.npy")
    # The Nanoscope file counts the heights in 32768ths of 0.7 µm.
    np.testing.assert_allclose(own, HEIGHTS_UM - (0.2 if name == "scan.spm" else 0), rtol=0, atol=1e-5)
    relief = package.convert.read(path, **options).relief
    np.testing.assert_allclose(relief.heights_um, own, rtol=0, atol=DOUBLE_UM)
    np.testing.assert_allclose(relief.pixel_um, (DX_UM, DX_UM if name == "scan.spm" else DY_UM), rtol=1e-9)
    np.testing.assert_allclose(converted(package, path, **options)[0], own, rtol=0, atol=FLOAT_UM)


def test_channels_are_chosen_by_title_or_number(package, tmp_path):
    path = tmp_path / "scan.gwy"
    write_gwy(path, "Deflection", "Amplitude Error", "Map", "Z Sensor", "Height")
    for wanted, factor in [(None, 4), (2, 3), ("4", 5), ("map", 3), ("Deflection", 1)]:
        np.testing.assert_allclose(converted(package, path, wanted)[0], factor * HEIGHTS_UM, rtol=1e-6)
    write_gwy(path, "Phase", "Map", "Lateral force")
    np.testing.assert_allclose(converted(package, path)[0], 2 * HEIGHTS_UM, rtol=1e-6)
    listed = 'there are 0 "Phase" (m), 1 "Map" (m), 2 "Lateral force" (m)'
    assert f'there is no channel "3"; {listed}' in refusal(package, path, 3)
    write_gwy(path, "Phase", "Error")
    assert "choose one with channel" in refusal(package, path)


def test_channels_without_lengths_are_refused(package):
    from sunbeam_mitsuba._channels import channel_of, choose

    # The library's readers describe such channels by a pair in place of the unit, by the kind, or without a unit.
    told = [("Phase", True, ("nm", None), ("nm", None)), ("Height", False, "m", "V"), ("Map", True, None, None)]
    names = ("name", "is_height_channel", "unit", "data_unit")
    infos = [SimpleNamespace(index=i, **dict(zip(names, one))) for i, one in enumerate(told)]
    channels = tuple(channel_of(info) for info in infos)
    assert choose(channels, None).title == "Map"
    for wanted in ("phase", "1"):
        with pytest.raises(package.SunbeamError, match=r"is not a length; there are 0 .*1 .*V.*2 .*no unit"):
            choose(channels, wanted)


def test_a_large_offset_costs_no_digits(package, tmp_path):
    """A relief of 1 µm at 8 cm above the instrument's zero, where 32-bit floats are 4 nm apart, keeps its digits."""
    write_stp(tmp_path / "scan.stp", HEIGHTS_UM + 8e4)
    heights, _ = converted(package, tmp_path / "scan.stp")
    np.testing.assert_allclose(heights - heights.mean(), HEIGHTS_UM - HEIGHTS_UM.mean(), rtol=0, atol=FLOAT_UM)


def test_given_size_and_unit_complete_a_file(package, tmp_path):
    path = tmp_path / "grid.xyz"
    y, x = np.mgrid[:ROWS, :COLUMNS]
    np.savetxt(path, np.stack([x * DX_UM, y * DY_UM, HEIGHTS_UM], axis=-1).reshape(-1, 3))
    assert "does not tell its unit; give unit" in refusal(package, path)
    assert "'furlong' is no length; accepted are" in refusal(package, path, unit="furlong")
    np.testing.assert_allclose(converted(package, path, unit="nm")[0], HEIGHTS_UM * 1e-3, rtol=1e-6)
    assert "pixel_size is given as 0.07 µm, but the file says" in refusal(package, path, unit="µm", pixel_size=DX_UM)
    write_bcrf(tmp_path / "scan.bcrf", HEIGHTS_UM)
    assert "unit is given as µm, but the heights are in nm" in refusal(package, tmp_path / "scan.bcrf", unit="µm")
    # Terrain tells no size; its 30 µm here are not its own.
    (tmp_path / "N00E000.hgt").write_bytes(np.arange(36, dtype=">i2").tobytes())
    assert "give pixel_size" in refusal(package, tmp_path / "N00E000.hgt", unit="µm")
    heights, pixel_um = converted(package, tmp_path / "N00E000.hgt", unit="µm", pixel_size=0.5)
    np.testing.assert_allclose(heights, np.flipud(np.arange(36.0).reshape(6, 6)), atol=2e-6)
    np.testing.assert_allclose(pixel_um, 0.5)


def test_refusals_name_the_fault(package, tmp_path):
    np.save(tmp_path / "bare.npy", HEIGHTS_UM)
    assert "bare arrays" in refusal(package, tmp_path / "bare.npy")
    np.savetxt(tmp_path / "profile.csv", np.stack([np.arange(9.0), np.sin(np.arange(9.0))], axis=-1), delimiter=",")
    assert "it holds profiles" in refusal(package, tmp_path / "profile.csv")
    (tmp_path / "scan.ibw").write_bytes(b"no wave")
    assert "fails on it: The file is too short" in refusal(package, tmp_path / "scan.ibw")
    (tmp_path / "scan.sxm").write_bytes(b":NANONIS_VERSION:")
    assert "knows no format of this content; Gwyddion" in refusal(package, tmp_path / "scan.sxm")
    assert "no such file" in refusal(package, tmp_path / "lost.ibw")
    write_bcrf(tmp_path / "scan.bcrf", np.full_like(HEIGHTS_UM, np.nan))
    assert "no point has a height" in refusal(package, tmp_path / "scan.bcrf")
    write_bcrf(tmp_path / "scan.bcrf", HEIGHTS_UM, "mm", 1e3)
    assert "more than the 1000 µm" in refusal(package, tmp_path / "scan.bcrf")
    whole = (tmp_path / "scan.bcrf").read_bytes()
    (tmp_path / "scan.bcrf").write_bytes(whole[:-10])
    assert "SurfaceTopography fails on it" in refusal(package, tmp_path / "scan.bcrf")


def test_a_reader_without_the_extension_is_closed_when_another_serves(package, monkeypatch):
    closed = []
    unfit = SimpleNamespace(format=lambda: "x", file_extensions=lambda: ["x"], close=lambda: closed.append(True))

    class Fitting:
        def __init__(self, path):
            pass

        @staticmethod
        def file_extensions():
            return ["ibw"]

    readers = SimpleNamespace(
        open_topography=lambda path: unfit, readers=[Fitting], CannotDetectFileFormat=library.CannotDetectFileFormat
    )
    monkeypatch.setattr(package.convert, "library", lambda: readers)
    assert isinstance(package.convert._open(Path("scan.ibw")), Fitting)
    assert closed == [True]


@pytest.mark.parametrize(
    ("name", "title"), [("a.gsf", "\ud800"), (f"{'a' * 251}.gsf", "Height")], ids=["title", "name"]
)
def test_a_file_that_cannot_be_written_leaves_nothing(package, tmp_path, name, title):
    """A title that is no Unicode, and a name of 255 bytes: the unfinished file's name adds the process number."""
    channel = package.convert.Channel(0, title, "m", True)
    relief = package._relief.Relief(HEIGHTS_UM, (DX_UM, DY_UM))
    with pytest.raises(package.SunbeamError, match="cannot be written"):
        package.convert._write_gsf(tmp_path / name, package.convert.Reading(relief, channel, (channel,)))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["scan.png", "scan", "no/such/scan.gsf", "folder.gsf", f"no/{'a' * 300}.gsf"])
def test_outputs_are_checked_before_the_file_is_read(package, tmp_path, name):
    (tmp_path / "folder.gsf").mkdir()
    with pytest.raises(package.SunbeamError, match=r"must be \.gsf|cannot be written"):
        package.convert.convert(tmp_path / "not-there.ibw", tmp_path / name)


def test_the_command_lists_channels_and_refuses_in_one_line(package, tmp_path, capsys):
    path, out = tmp_path / "scan.gwy", tmp_path / "scan.gsf"
    write_gwy(path, "Amplitude", "Height")
    assert package.convert.main([str(path), "-o", str(out)]) == 0
    listed, told = capsys.readouterr().err.splitlines()
    assert listed == 'channels: 0 "Amplitude" (m), 1 "Height" (m)'
    assert told.startswith(f'{out}: channel 1 "Height" (m), 9 × 6 pixels of 0.07 × 0.11 µm')
    for words in (["-o", out, "--channel", 5], ["-o", "scan.png"], [], ["-o", out, "--pixel-size", "x"]):
        assert exit_code(package, path, *words) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith("convert: ")


def test_a_missing_library_is_one_line_with_its_remedy(tmp_path):
    """Runs the command in a process that cannot import the library."""
    (tmp_path / "scan.ibw").write_bytes(b"")
    script = (
        "import sys\nsys.modules['SurfaceTopography'] = None\nfrom sunbeam_mitsuba.convert import main\n"
        "sys.exit(main(['scan.ibw', '-o', 'scan.gsf']))"
    )
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY / "python")}
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("convert: scan.ibw: ")
    assert line.endswith('pip install "sunbeam-mitsuba[formats]"')
    assert not list(tmp_path.glob("*.gsf"))


def test_extensions_are_the_librarys_without_sunbeams_own(package):
    read = {extension for reader in library.readers for extension in reader.file_extensions()}
    # Nanoscope files end in .di, too, and are known by their content.
    assert (read | {"di"}) - OWN - NO_MAPS == package.convert.EXTENSIONS
    assert read >= NO_MAPS - {"zip"}


def test_the_command_points_to_the_converter(package, tmp_path):
    for extension in sorted(package.convert.EXTENSIONS):
        with pytest.raises(SetupError) as refused:
            sunbeam("height-field", "--height-field", tmp_path / f"scan.{extension}")
        assert f"`python -m sunbeam_mitsuba.convert {tmp_path}/scan.{extension} -o scan.gsf`" in str(refused.value)
        assert "Gwyddion" in str(refused.value)
    for extension in ("sxm", "sm4", "wip"):
        with pytest.raises(SetupError, match="Gwyddion reads them"):
            sunbeam("height-field", "--height-field", tmp_path / f"scan.{extension}")


QUICK_SURFACE = {"coherence_length": 3.0, "conserve_energy": False, "tolerance": 0.01}
# Off both axes, so that every flip shows.
WI, WO, NM = [0.36, 0.48, 0.8], [-0.1, -0.7, np.sqrt(0.5)], [450.0, 550.0, 650.0]


def f_of(package, *arguments, **parameters):
    return package.Surface(*arguments, **QUICK_SURFACE, **parameters).eval(WI, WO, NM)


def test_a_topography_equals_its_array(package):
    expected = f_of(package, HEIGHTS_UM, (DX_UM, DY_UM))
    upside_down = f_of(package, HEIGHTS_UM[::-1], (DX_UM, DY_UM))
    assert np.abs(upside_down / expected - 1).max() > 0.01
    for unit, per_um in [("nm", 1e3), ("µm", 1.0), ("m", 1e-6), ("Å", 1e4)]:
        sizes = (COLUMNS * DX_UM * per_um, ROWS * DY_UM * per_um)
        topography = Topography(HEIGHTS_UM.T * per_um, sizes, unit=unit)
        # Heights and pixels are rounded in another unit; the offset of 0.2 µm stays.
        np.testing.assert_allclose(f_of(package, topography), expected, rtol=1e-4)


@pytest.mark.parametrize("name", ["scan.gwy", "scan.x3p", "scan.sdf"])
def test_a_topography_equals_its_file(package, tmp_path, name):
    path = tmp_path / name
    if name == "scan.gwy":
        write_gwy(path, "Height")
    else:
        {".x3p": write_x3p, ".sdf": write_sdf}[path.suffix](path, HEIGHTS_UM)
    native = f_of(package, filename=str(path))
    np.testing.assert_allclose(f_of(package, read_topography(str(path))), native, rtol=1e-4)
    np.testing.assert_allclose(f_of(package, read_topography(str(path)).detrend(), level="none"), native, rtol=1e-2)


def test_unusable_topographies_are_refused(package):
    sizes = (COLUMNS * DX_UM, ROWS * DY_UM)
    for topography, reason in [
        (Topography(HEIGHTS_UM.T, sizes), "has no unit"),
        (Topography(HEIGHTS_UM.T, sizes, unit="V"), "'V' is no length"),
        (UniformLineScan(HEIGHTS_UM[0], COLUMNS * DX_UM, unit="µm"), "line scan"),
        (Topography(with_hole().T, sizes, unit="µm"), "1 of 54 heights .*`fill`"),
    ]:
        with pytest.raises(package.SunbeamError, match=reason):
            f_of(package, topography)
    with pytest.raises(package.SunbeamError, match="pixel_um is given, but a topography"):
        f_of(package, Topography(HEIGHTS_UM.T, sizes, unit="µm"), 0.1)


def test_masked_heights_are_holes(package, tmp_path):
    np.save(tmp_path / "holes.npy", with_hole())
    masked = np.ma.masked_array(np.where(np.isfinite(with_hole()), HEIGHTS_UM, 7.0), ~np.isfinite(with_hole()))
    topography = Topography(masked.T, (COLUMNS * 0.1, ROWS * 0.1), unit="µm")
    for fill in ("laplace", "mean"):
        file = f_of(package, filename=str(tmp_path / "holes.npy"), pixel_size=0.1, fill=fill)
        for heights in (masked, with_hole(), np.where(np.isfinite(with_hole()), HEIGHTS_UM, np.inf)):
            # Arrays go through single precision, files through double.
            np.testing.assert_allclose(f_of(package, heights, 0.1, fill=fill), file, rtol=1e-4)
        np.testing.assert_allclose(f_of(package, topography, fill=fill), file, rtol=1e-4)
    for heights in (masked, with_hole()):
        with pytest.raises(package.SunbeamError, match=r"1 of 54 heights .*row 4, column 1; `fill`"):
            f_of(package, heights, 0.1)
    # A mask that hides nothing changes nothing.
    shown = np.ma.masked_array(HEIGHTS_UM, np.zeros_like(HEIGHTS_UM, dtype=bool))
    np.testing.assert_array_equal(f_of(package, shown, 0.1), f_of(package, HEIGHTS_UM, 0.1))


def test_masked_directions_and_wavelengths_are_refused(package):
    surface = package.Surface(HEIGHTS_UM, 0.1, **QUICK_SURFACE)
    wo = np.ma.masked_array(np.tile(WO, (3, 1)), np.eye(3, dtype=bool))
    nm = np.ma.masked_array(NM, [False, True, False])
    u = np.ma.masked_array(np.full((2, 3), 0.5), [[0, 0, 0], [0, 1, 0]])
    with pytest.raises(package.SunbeamError, match="wo has 3 masked values"):
        surface.eval(WI, wo, 550)
    with pytest.raises(package.SunbeamError, match="wavelength_nm has 1 masked"):
        surface.eval_pdf(WI, WO, nm)
    with pytest.raises(package.SunbeamError, match="u has 1 masked"):
        surface.sample(WI, 550, u)


def test_a_sweep_takes_files_that_need_the_library(package, tmp_path):
    import pyarrow.parquet as pq

    y, x = np.mgrid[:48, :64]
    heights_um = 0.1 * np.cos(2 * np.pi * x * DX_UM / 0.9) + 0.05 * np.sin(2 * np.pi * y * DY_UM / 1.3)
    heights_um[10, 20] = np.nan
    write_bcrf(tmp_path / "scan.bcrf", heights_um)
    (tmp_path / "torn.bcrf").write_bytes((tmp_path / "scan.bcrf").read_bytes()[:-4])
    package.convert.convert(tmp_path / "scan.bcrf", tmp_path / "scan.gsf")
    files = 'files = ["*.bcrf", "scan.gsf"]\nfill = "laplace"\n'
    spec = f'output = "out"\n[[surface]]\n{files}[settings]\n{QUICK}[want.statistics]\n[want.colour]\nsamples = 64\n'
    done = sweep(write_spec(tmp_path, spec), "--workers", "1")
    assert done.returncode == 1, done.stderr
    rows = {row["filename"]: row for row in pq.read_table(tmp_path / "out" / "sweep.parquet").to_pylist()}
    assert rows["torn.bcrf"]["status"] == "failed"
    assert rows["torn.bcrf"]["error"].startswith("torn.bcrf: SurfaceTopography fails on it")
    instrument, own = rows["scan.bcrf"], rows["scan.gsf"]
    figures = [name for name in own if name.startswith(("statistics_", "colour_")) and name != "colour_strip"]
    assert len(figures) > 10
    assert [instrument[name] for name in figures] == [own[name] for name in figures]
    assert abs(instrument["statistics_period_x_um"] - 0.9) < 0.02
    # The checksum is that of the instrument's file.
    assert instrument["input_sha256"] != own["input_sha256"]


def test_a_sweep_without_the_library_is_refused_before_it_begins(tmp_path):
    (tmp_path / "scan.bcrf").write_bytes(struct.pack("<4s", b"file"))
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.modules['SurfaceTopography'] = None\n")
    spec = f'output = "out"\n[[surface]]\nfiles = "*.bcrf"\n[settings]\n{QUICK}[want.colour]\n'
    path = os.pathsep.join([str(tmp_path), str(REPOSITORY / "python")])
    line = one_line(sweep(write_spec(tmp_path, spec), PYTHONPATH=path))
    assert line.endswith('pip install "sunbeam-mitsuba[formats]"')
    assert not (tmp_path / "out").exists()
