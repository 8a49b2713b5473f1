"""The programs in examples/, which `cargo test` builds, print correct results."""

import subprocess
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parent.parent
BUILT = REPOSITORY / "target" / "release" / "examples"
TOOL = REPOSITORY / "target" / "release" / "sunbeam"


def run(name, *arguments):
    program = BUILT / name
    assert program.exists(), f"{program} is not built: cargo build --release -p sunbeam --examples"
    done = subprocess.run([str(program), *map(str, arguments)], capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


def test_evaluate_finds_the_orders():
    rows = [line.split() for line in run("evaluate").decode().splitlines()[1:]]
    found = {float(row[0].rstrip("°")): [float(value) for value in row[1:]] for row in rows}
    assert len(found) == 33
    # For light at 20° order 0 leaves at -20° at every wavelength, and little light leaves beside it.
    assert all(value > 100 * between for value, between in zip(found[-20.0], found[-30.0]))


def test_sample_averages_to_the_albedo():
    for line in run("sample").decode().splitlines()[:-1]:
        mean, albedo = (float(word.rstrip(",")) for word in line.split() if word.startswith("0."))
        assert abs(mean - albedo) < 0.02, line


def test_map_is_a_picture_of_the_hemisphere():
    head, pixels = run("map").split(b"255\n", 1)
    assert head.split() == [b"P6", b"256", b"256"]
    picture = np.frombuffer(pixels, np.uint8).reshape(256, 256, 3)
    assert picture[0, 0].max() == 0
    # Orders lie along x.
    assert picture[126:130].max() == 255
    assert picture[20:60].max() < 64


def test_scan_describes_a_file(tmp_path):
    file = tmp_path / "scan.gsf"
    subprocess.run(
        [str(TOOL), "height-field", "--preset", "sinusoidal", "-o", str(file)], check=True, capture_output=True
    )
    lines = run("scan", file).decode().splitlines()
    assert lines[0].startswith("1024 × 1 pixels")
    assert lines[-1].startswith("650 nm: the albedo for light along the normal is 0.")
    missing = subprocess.run([str(BUILT / "scan"), "nothing.gsf"], capture_output=True, text=True)
    assert missing.returncode != 0
    assert "nothing.gsf" in missing.stderr
