"""Builds the plugin for each release of Mitsuba that it can be compiled against, and tests it there.

target/versions/RELEASE/ has the release's environment, `venv/`, and its plugin, `plugins/diffraction.so`.

    python scripts/versions.py build [RELEASE …]  # environments and plugins
    python scripts/versions.py test [RELEASE …]   # also runs the tests that every release must pass
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
# Folder of the environments and plugins.
FOLDER = REPOSITORY / "target" / "versions"
# Packages of every release's environment besides Mitsuba, in the versions of requirements.lock.
SHARED = ("nanobind", "numpy", "pytest", "iniconfig", "packaging", "pluggy", "Pygments")
# Files of tests/ that every release must pass. They need no packages beyond SHARED.
TESTS = (
    "test_chi2.py",
    "test_plugin_parameters.py",
    "test_plugin_live.py",
    "test_plugin_bsdf.py",
    "test_frozen.py",
    "test_lifetimes.py",
)
# Largest relative difference between a picture's mean colours in two releases. Random numbers and model are equal, but
# the releases round differently. Smaller values would refuse releases for rounding; larger ones could hide a defect.
MEANS_TOLERANCE = 1e-4
# Program that renders a picture and prints the mean of each channel as JSON. Its arguments are the plugin's folder and
# the variant.
PICTURE_PROGRAM = """
import json, sys
import mitsuba as mi
import numpy as np
mi.set_variant(sys.argv[2])
mi.file_resolver().append(sys.argv[1])
look = mi.ScalarTransform4f().look_at([0, -6, 3], [0, 0, 0], [0, 0, 1])
film = {"type": "hdrfilm", "width": 64, "height": 64}
scene = mi.load_dict({
    "type": "scene", "integrator": {"type": "path"},
    "sensor": {"type": "perspective", "to_world": look, "film": film},
    "sky": {"type": "constant"},
    "ball": {"type": "sphere", "skin": {"type": "diffraction", "preset": "elaphe", "eta": 1.56}},
})
print(json.dumps(np.array(mi.render(scene, spp=64, seed=1)).mean(axis=(0, 1)).tolist()))
"""
# Variants of the compared pictures.
VARIANTS = ("scalar_rgb", "llvm_ad_rgb", "llvm_ad_spectral")


def releases() -> list[str]:
    """Releases listed in the plugin's build script (`RELEASES`), the newest first."""
    script = (REPOSITORY / "cpp_shim" / "build.rs").read_text(encoding="utf-8")
    return re.findall(r'Release \{ mitsuba: "([\d.]+)"', script)


def run(*command: object, **variables: str) -> None:
    """Runs a command in the repository with further environment variables. Raises CalledProcessError if it fails."""
    subprocess.run([str(word) for word in command], check=True, cwd=REPOSITORY, env={**os.environ, **variables})


def release_folder(release: str) -> Path:
    """Folder of the release, in which Mitsuba's file resolver finds the plugin as `plugins/diffraction.so`."""
    return FOLDER / release


def python_of(release: str) -> Path:
    """Interpreter of the release's environment, which is created where it is missing or outdated."""
    environment = release_folder(release) / "venv"
    python = environment / "bin" / "python"
    lock = (REPOSITORY / "requirements.lock").read_text(encoding="utf-8")
    pinned = [line for line in lock.splitlines() if line.split("==")[0] in SHARED]
    wanted = "\n".join([f"mitsuba=={release}", *pinned]) + "\n"
    # Requirements of the last complete installation.
    installed = release_folder(release) / "installed.txt"
    if not installed.exists() or installed.read_text(encoding="utf-8") != wanted:
        run(sys.executable, "-m", "venv", "--clear", environment)
        requirements = release_folder(release) / "requirements.txt"
        requirements.write_text(wanted, encoding="utf-8")
        pip = ("-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary=:all:")
        run(python, *pip, "-r", requirements)
        # The rename comes last, so an interrupted installation is repeated.
        requirements.replace(installed)
    return python


def build(release: str) -> None:
    """Compiles the plugin against the release's wheel, and copies it to the release's folder."""
    print(f"== the plugin for Mitsuba {release}", flush=True)
    run("cargo", "build", "--release", "--package", "sunbeam-mitsuba", SUNBEAM_PYTHON=str(python_of(release)))
    plugins = release_folder(release) / "plugins"
    plugins.mkdir(exist_ok=True)
    shutil.copyfile(REPOSITORY / "target" / "release" / "libsunbeam_mitsuba.so", plugins / "diffraction.so")


def means(release: str) -> dict[str, list[float]]:
    """Mean colours of a picture rendered with the release, `[channels]`, by variant.

    Each variant has its own process, since in 3.8.0 an LLVM render fails after a scalar one.
    """
    by_variant: dict[str, list[float]] = {}
    for variant in VARIANTS:
        command = [python_of(release), "-c", PICTURE_PROGRAM, release_folder(release), variant]
        done = subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True)
        by_variant[variant] = json.loads(done.stdout)
    return by_variant


def test(release: str, newest_means: dict[str, list[float]]) -> None:
    """Runs TESTS with the release, and compares the means of its picture with those of the newest release.

    Raises CalledProcessError or SystemExit where it fails.
    """
    print(f"== tests with Mitsuba {release}", flush=True)
    files = [REPOSITORY / "tests" / name for name in TESTS]
    folder = str(release_folder(release))
    # Two processes, since in 3.8.0 an LLVM render fails after a scalar one, also with Mitsuba's own BSDFs.
    for selection in ("scalar", "not scalar"):
        run(python_of(release), "-m", "pytest", "-q", "-k", selection, *files, SUNBEAM_PLUGIN_FOLDER=folder)
    for variant, found in means(release).items():
        differences = [abs(a - b) / b for a, b in zip(found, newest_means[variant])]
        difference = max(differences)
        print(f"   {variant}: means within {difference:.1e} of the newest release's")
        # NaN, which `max` may pass over, is not within the tolerance.
        if not all(each <= MEANS_TOLERANCE for each in differences):
            raise SystemExit(
                f"Mitsuba {release}, {variant}: the means are off by {difference:.1e}, more than {MEANS_TOLERANCE}"
            )


def main(words: list[str]) -> int:
    """Runs the command line with the arguments `words`. Returns the exit status: 0, or 2 for wrong arguments."""
    action, *chosen = words or [""]
    known = releases()
    if action not in ("build", "test") or not set(chosen) <= set(known):
        print(f"{sys.argv[0]} build|test [{'|'.join(known)} ...]", file=sys.stderr)
        return 2
    wanted = [release for release in known if release in chosen or not chosen]
    for release in wanted:
        build(release)
    if action == "test":
        newest = known[0]
        if newest not in wanted:
            build(newest)
        newest_means = means(newest)
        for release in wanted:
            test(release, newest_means)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
