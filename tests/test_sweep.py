"""Results of a sweep from the command line, and their independence of the number of workers."""

import json
import re
import subprocess
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest
from sweeps import QUICK, REPOSITORY, SPEC, begin, environment, one_line, results, sweep, wait_for, write_spec

TOOL = REPOSITORY / "target" / "release" / "sunbeam"
# A corrupt and a good file, two gratings, and all kinds of figures.
EVERYTHING = f"""
output = "out"

[[surface]]
name = "scans"
files = "scans/*.npy"
pixel_size = 0.05

[[surface]]
preset = "sinusoidal"
period = 1.6
height = [0.1, 0.2]

[settings]
theta_i_deg = 30
{QUICK}
eta = 1.5

[want.statistics]
[want.peaks]
[want.orders]
wavelengths_nm = [550]
[want.colour]
samples = 2000
[want.map]
size = 48
[want.render]
scene = "ball.xml"
variant = "scalar_rgb"
spp = 4
"""
BALL = """
<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="2"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="20"/>
        <transform name="to_world"><lookat origin="0, 0, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="12"/></film>
    </sensor>
    <emitter type="constant"/>
    <shape type="sphere"><bsdf type="diffuse" id="surface"/></shape>
</scene>
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder of a sweep with two workers (`out`) and with one (`one`)."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "scans").mkdir()
    y, x = np.mgrid[:40, :40] * 0.05
    np.save(folder / "scans" / "good.npy", 0.05 * np.cos(2 * np.pi * x / 0.5) + 0.01 * np.cos(2 * np.pi * y / 0.4))
    (folder / "scans" / "corrupt.npy").write_bytes(b"no heights")
    (folder / "ball.xml").write_text(BALL)
    spec = write_spec(folder, EVERYTHING)
    two = sweep(spec, "--workers", 2)
    assert two.returncode == 1, two.stderr
    assert re.search(r"^4 cases, 2 failed, [\d.]+ s: .*--retry-failed tries them again$", two.stdout), two.stdout
    one = sweep(spec, "--workers", 1, "-o", folder / "one")
    assert one.returncode == 1, one.stderr
    return folder


@pytest.fixture(scope="module")
def rows(folder):
    return pq.read_table(folder / "out" / "sweep.parquet").to_pylist()


def test_one_and_two_workers_give_the_same_bytes(folder):
    for name in ("sweep.parquet", "index.html"):
        one, two = (folder / "one" / name).read_bytes(), (folder / "out" / name).read_bytes()
        # The page's title is its folder's name.
        assert one.replace(b"<title>one", b"<title>out").replace(b"<h1>one", b"<h1>out") == two, name
    pictures = sorted((folder / "out" / "pictures").glob("*/*"))
    # Three cases, each with a strip, two files of the map and two of the render.
    assert len(pictures) == 3 * 5
    for picture in pictures:
        other = folder / "one" / picture.relative_to(folder / "out")
        assert picture.read_bytes() == other.read_bytes(), picture.name


def test_a_corrupt_file_becomes_a_failed_row(rows):
    assert [(row["surface"], row["filename"], row["status"]) for row in rows] == [
        ("scans", "scans/corrupt.npy", "failed"),
        ("scans", "scans/good.npy", "failed"),
        ("sinusoidal", None, "done"),
        ("sinusoidal", None, "done"),
    ]
    bad, skin = rows[:2]
    assert "corrupt.npy" in bad["error"]
    assert "\n" not in bad["error"]
    assert bad["map_png"] is None
    # A relief that varies along y has all figures except a grating's orders.
    assert re.match(r"orders: the relief varies along y", skin["error"])
    assert skin["orders_list"] is None
    assert skin["statistics_period_x_um"] == pytest.approx(0.5, rel=0.02)
    assert skin["map_png"] is not None
    assert len(skin["input_sha256"]) == 64


def test_statistics_and_peaks_match_the_surface(rows):
    for row, height in zip(rows[2:], (0.1, 0.2)):
        assert row["statistics_rms_um"] == pytest.approx(height / np.sqrt(8), rel=1e-3)
        assert row["statistics_period_x_um"] == pytest.approx(1.6, rel=1e-3)
        # With a window of 10 µm orders are some degrees wide, which shifts their peaks slightly.
        assert row["peaks_spacing_nm"] == pytest.approx(1600, rel=3e-3)
        assert row["peaks_rms_error_deg"] < 0.2
        for angle in row["peaks_angles"]:
            sine = angle["wavelength_nm"] / 1600 - np.sin(np.radians(30))
            assert angle["grating_deg"] == pytest.approx(np.degrees(np.arcsin(sine)), abs=1e-9)


def test_orders_equal_the_commands(rows):
    words = ["orders", "--json", "--preset=sinusoidal", "--period=1.6", "--height=0.2", "--eta=1.5", "--theta-i=30"]
    for theory in ("scalar", "rigorous"):
        more = ["--obliquity=stam"] if theory == "scalar" else []
        done = subprocess.run([TOOL, *words, *more, f"--theory={theory}"], capture_output=True, text=True, check=True)
        expected = {order["order"]: order["mean"] for order in json.loads(done.stdout)["orders"]}
        found = {order["order"]: order["mean"] for order in rows[3]["orders_list"] if order["theory"] == theory}
        assert found == expected
        assert rows[3][f"orders_{theory}_reflected"] == pytest.approx(sum(expected.values()))


def linear(path):
    import mitsuba as mi

    if mi.variant() is None:
        mi.set_variant("scalar_rgb")
    return np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))


def test_maps_equal_the_commands(rows, folder, tmp_path):
    words = [
        "--preset=sinusoidal",
        "--period=1.6",
        "--height=0.2",
        "--theta-i=30",
        "--eta=1.5",
        "--coherence-length=10",
    ]
    words += ["--conserve-energy=false", "--tolerance=0.01", "--obliquity=stam", "--size=48"]
    subprocess.run([TOOL, "brdf-map", "-o", tmp_path / "map.exr", *words], check=True, capture_output=True)
    theirs, ours = linear(tmp_path / "map.exr"), linear(folder / "out" / rows[3]["map_exr"])
    # Mitsuba's table of the observer has steps of 5 nm, the command's of 1 nm.
    np.testing.assert_allclose(ours, theirs, rtol=0.02, atol=0.003 * theirs.max())
    assert ours.max() > 0.1


def test_the_mean_colour_is_the_power_of_all_orders(rows):
    for row in rows[2:]:
        # The orders are at 550 nm, near the peak of luminance.
        assert row["colour_luminance"] == pytest.approx(row["orders_scalar_reflected"], rel=0.05)
        assert row["colour_gamut_area"] > 0.05
        assert all(abs(corner["view_deg"] - 30) > 3 for corner in row["colour_gamut"])


def test_renders_show_the_surface(rows, folder):
    pictures = [linear(folder / "out" / row["render_exr"]) for row in rows[1:]]
    assert all(picture.shape == (12, 16, 3) for picture in pictures)
    # The sky's radiance is 1, and the ball reflects some per cent.
    assert all(picture[0, 0].min() > 0.9 and 0 < picture[6, 8].max() < 0.3 for picture in pictures)
    assert not np.array_equal(pictures[1], pictures[2])


def test_the_sheet_is_self_contained(folder, rows):
    page = (folder / "out" / "index.html").read_text(encoding="utf-8")
    assert page.count('<img src="data:image/png;base64,') == 3 * 3
    assert not re.search(r"(?:src|href)=\"(?:https?:)?//", page)
    assert "4 cases, 2 failed" in page
    for link in re.findall(r'href="([^"]+)"', page):
        assert (folder / "out" / link).exists(), link
    for name in ("colour_gamut_area", "statistics_rms_um", "error", "height"):
        assert f">{name}</th>" in page
    assert page.count("<tr") == 1 + len(rows)


def test_the_summary_describes_the_columns(folder, rows):
    summary = json.loads((folder / "out" / "sweep.json").read_text())
    assert (summary["state"], summary["cases"], summary["failed"]) == ("finished", 4, 2)
    assert set(summary["columns"]) == set(rows[0])
    schema = pq.read_schema(folder / "out" / "sweep.parquet")
    meaning = schema.field("peaks_variance_nm2").metadata[b"meaning"].decode()
    assert meaning == "variance of the spacing over the wavelengths, in nm²"
    times = pq.read_table(folder / "out" / "times.parquet").to_pylist()
    assert [row["identity"] for row in times] == [row["identity"] for row in rows]
    assert all(row["seconds"] > 0 for row in times)


def test_only_changed_cases_are_computed_again(folder, tmp_path):
    before = {path: path.stat().st_mtime_ns for path in results(folder / "out")}
    table = (folder / "out" / "sweep.parquet").read_bytes()
    done = sweep(folder / "spec.toml")
    assert done.returncode == 1, done.stderr
    assert "cases to do" not in done.stderr
    assert {path: path.stat().st_mtime_ns for path in results(folder / "out")} == before
    assert (folder / "out" / "sweep.parquet").read_bytes() == table
    # A new modification time changes nothing; new heights do.
    (folder / "scans" / "good.npy").touch()
    np.save(folder / "scans" / "corrupt.npy", np.zeros((8, 8)))
    done = sweep(folder / "spec.toml")
    assert "1 cases to do" in done.stderr
    changed = [path for path, at in before.items() if path.stat().st_mtime_ns != at]
    assert len(changed) == 1
    assert json.loads(changed[0].read_text())["parameters"]["filename"] == "scans/corrupt.npy"


def test_a_plan_computes_nothing(tmp_path):
    done = sweep(write_spec(tmp_path), "--plan", "--workers", 2)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("12 cases of 6 surfaces; ")
    assert not (tmp_path / "out").exists()
    # The estimate is of this machine.
    done = sweep(write_spec(tmp_path), "--plan", "--scheduler", "tcp://127.0.0.1:1")
    assert done.returncode == 2
    assert "not allowed with argument" in done.stderr


def test_a_missing_scheduler_is_one_line(tmp_path):
    line = one_line(sweep(write_spec(tmp_path), "--scheduler", "tcp://127.0.0.1:1"))
    assert "the scheduler tcp://127.0.0.1:1 does not answer" in line
    assert "the scheduler nowhere does not answer" in one_line(sweep(write_spec(tmp_path), "--scheduler", "nowhere"))


def test_a_missing_command_is_one_line(tmp_path):
    spec = write_spec(tmp_path, SPEC + "[want.statistics]\n")
    line = one_line(sweep(spec, SUNBEAM_COMMAND=str(tmp_path / "none")))
    assert "SUNBEAM_COMMAND names" in line
    assert not (tmp_path / "out").exists()


def test_folders_with_other_files_are_left_alone(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("years of work")
    line = one_line(sweep(write_spec(tmp_path), "--fresh"))
    assert "holds other things (thesis.tex)" in line
    assert (tmp_path / "out" / "thesis.tex").exists()


@pytest.mark.parametrize("name", ["results/ab/notes.json", "pictures/cat.png", "index.html"])
def test_folders_of_no_sweep_are_left_alone(sweep_package, tmp_path, name):
    from sunbeam_mitsuba.sweep.store import Store

    other = tmp_path / name
    other.parent.mkdir(parents=True, exist_ok=True)
    other.write_text("years of work")
    # The second store finds the folder unlocked, while the first one exists.
    stores = [Store(tmp_path), Store(tmp_path)]
    for store, fresh in zip(stores, (True, False)):
        with pytest.raises(sweep_package.SweepError, match=r"holds other things .* and no sweep\.json of a sweep"):
            store.open(fresh)
    assert other.read_text() == "years of work"


def test_a_fresh_sweep_removes_earlier_results_alone(sweep_package, tmp_path):
    from sunbeam_mitsuba.sweep import store as stores

    identity = "ab" + 18 * "0"
    stores.write_result(tmp_path, {"identity": identity}, {"map.png": b"dots"})
    for name in (stores.SUMMARY, stores.TABLE, stores.TIMES, stores.SHEET):
        (tmp_path / name).write_text("{}")
    (tmp_path / "results" / "ab" / "notes.json").write_text("years of work")
    (tmp_path / "pictures" / "cat.png").write_text("years of work")
    store = stores.Store(tmp_path)
    store.open(fresh=True)
    store.close()
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert left - {".lock"} == {"sweep.json", "results/ab/notes.json", "pictures/cat.png"}
    assert not (tmp_path / "pictures" / "ab").exists()


def test_a_file_that_stays_out_of_reach_is_unchanged(sweep_package, tmp_path):
    from sunbeam_mitsuba.sweep.store import input_of, is_current

    # Longer than a file name may be, so that even the question whether it exists is an error.
    unreachable = tmp_path / (300 * "x")
    assert is_current({"input": None}, unreachable)
    file = tmp_path / "scan.npy"
    file.write_bytes(b"heights")
    assert is_current({"input": input_of(file)}, file)
    assert not is_current({"input": None}, file)
    assert not is_current({"input": input_of(file)}, unreachable)


def test_blocked_outputs_are_refused_before_the_work(tmp_path):
    place = tmp_path / "out" / "index.html"
    place.mkdir(parents=True)
    line = one_line(sweep(write_spec(tmp_path)))
    assert f"{place} cannot be written" in line
    assert not list(tmp_path.glob("out/results/*"))


@pytest.mark.parametrize("taken", ["", "results", "pictures", "sweep.json", "sweep.parquet", "times.parquet"])
def test_misplaced_entries_are_refused(sweep_package, tmp_path, taken):
    from sunbeam_mitsuba.sweep.store import Store

    place = tmp_path / "out" / taken
    place.parent.mkdir(exist_ok=True)
    if place.suffix:
        place.mkdir()
    else:
        place.write_text("years of work")
    with pytest.raises(sweep_package.SweepError, match=f"{place} cannot be written"):
        Store(tmp_path / "out").open(fresh=True)
    assert place.is_dir() or place.read_text() == "years of work"


def test_a_second_sweep_into_a_folder_is_refused(tmp_path):
    spec = write_spec(tmp_path)
    first = begin(spec, "--workers", 1, slow=0.2)
    wait_for(lambda: (tmp_path / "out" / "sweep.json").exists())
    line = one_line(sweep(spec))
    assert "another sweep is writing to" in line
    assert first.wait(60) == 0
    assert sweep(spec, "--fresh", "--workers", 1).returncode == 0


def test_missing_packages_are_named_with_their_remedy(tmp_path):
    (tmp_path / "pyarrow.py").write_text("raise ModuleNotFoundError(name='pyarrow')")
    env = environment(tmp_path)
    env["PYTHONPATH"] = f"{tmp_path}:{env['PYTHONPATH']}"
    done = subprocess.run(
        [sys.executable, "-c", "import sunbeam_mitsuba.sweep"], env=env, capture_output=True, text=True
    )
    assert done.stderr.strip().splitlines()[-1].endswith('pip install "sunbeam-mitsuba[sweep]"')


def test_films_are_judged_by_their_reflected_light(tmp_path):
    surface = """
[[surface]]
preset = "sinusoidal"
period = 1.6
height = 0.2
"""
    spec = write_spec(
        tmp_path,
        f"""
output = "out"
{surface}transmission = ["none", "film"]
{surface}transmission = "film"
back_reflection = false

[settings]
theta_i_deg = 30
coherence_length = 10
conserve_energy = false
eta = 1.5

[want.orders]
theories = ["rigorous"]
wavelengths_nm = [550]
[want.colour]
samples = 200000
lambda_step_nm = 20
gamut = false
""",
    )
    done = sweep(spec, "--workers", 1)
    assert done.returncode == 0, done.stderr
    bare, film, in_mitsuba = pq.read_table(tmp_path / "out" / "sweep.parquet").to_pylist()
    # A film reflects about one sample in twenty, so the noise is about 1 %.
    for row in (film, in_mitsuba):
        assert row["colour_luminance"] == pytest.approx(bare["colour_luminance"], rel=0.05)
        assert row["orders_rigorous_reflected"] == pytest.approx(bare["orders_rigorous_reflected"], rel=1e-4)
        sides = {order["side"] for order in row["orders_list"]}
        assert {"above", "below"} <= sides
        # Nearly all light leaves, or is trapped.
        assert sum(order["mean"] for order in row["orders_list"]) == pytest.approx(1, abs=0.1)
    assert {order["side"] for order in bare["orders_list"]} == {"above"}
