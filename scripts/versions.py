"""Builds the plugin for each release of Mitsuba that it can be compiled against, and tests it there.

Each release has an environment of its own in target/versions/, with its plugin beside it:

    python scripts/versions.py build            # environments and plugins
    python scripts/versions.py test [RELEASE …] # also runs the tests that every release must pass
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
FOLDER = REPOSITORY / "target" / "versions"
# Packages of every release's environment, in the versions of requirements.lock.
SHARED = ("nanobind", "numpy", "pytest", "iniconfig", "packaging", "pluggy", "Pygments")
# Files of tests/ that every release must pass.
TESTS = (
    "test_chi2.py",
    "test_plugin_parameters.py",
    "test_plugin_live.py",
    "test_plugin_bsdf.py",
    "test_frozen.py",
    "test_lifetimes.py",
)
# Largest relative difference between a picture's mean colours in two releases. Random numbers and model are equal; the
# releases' own code rounds differently.
MEANS = 1e-4
PICTURE = """
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
VARIANTS = ("scalar_rgb", "llvm_ad_rgb", "llvm_ad_spectral")


def releases() -> list[str]:
    """Releases listed in the plugin's build script (`RELEASES`), the newest first."""
    script = (REPOSITORY / "cpp_shim" / "build.rs").read_text(encoding="utf-8")
    return re.findall(r'Release \{ mitsuba: "([\d.]+)"', script)


def run(*words: object, **variables: str) -> None:
    subprocess.run([str(word) for word in words], check=True, cwd=REPOSITORY, env={**os.environ, **variables})


def python_of(release: str) -> Path:
    """Interpreter of the release's environment, which is made where it is missing or outdated."""
    environment = FOLDER / release / "venv"
    python = environment / "bin" / "python"
    lock = (REPOSITORY / "requirements.lock").read_text(encoding="utf-8")
    pinned = [line for line in lock.splitlines() if line.split("==")[0] in SHARED]
    wanted = "\n".join([f"mitsuba=={release}", *pinned]) + "\n"
    # The installed requirements, written after a complete installation.
    installed = FOLDER / release / "installed.txt"
    if not installed.exists() or installed.read_text(encoding="utf-8") != wanted:
        run(sys.executable, "-m", "venv", "--clear", environment)
        requirements = FOLDER / release / "requirements.txt"
        requirements.write_text(wanted, encoding="utf-8")
        pip = ("-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary=:all:")
        run(python, *pip, "-r", requirements)
        requirements.replace(installed)
    return python


def plugin_folder(release: str) -> Path:
    """Folder of the release's plugin for Mitsuba's file resolver."""
    return FOLDER / release


def build(release: str) -> None:
    """Compiles the plugin against the release's wheel."""
    print(f"== the plugin for Mitsuba {release}", flush=True)
    run("cargo", "build", "--release", "--package", "sunbeam-mitsuba", SUNBEAM_PYTHON=str(python_of(release)))
    plugins = plugin_folder(release) / "plugins"
    plugins.mkdir(exist_ok=True)
    shutil.copyfile(REPOSITORY / "target" / "release" / "libsunbeam_mitsuba.so", plugins / "diffraction.so")


def means(release: str) -> dict[str, list[float]]:
    """Mean colours of a picture by variant, each rendered in a process of its own (see `test`)."""
    found: dict[str, list[float]] = {}
    for variant in VARIANTS:
        words = [python_of(release), "-c", PICTURE, plugin_folder(release), variant]
        done = subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True)
        found[variant] = json.loads(done.stdout)
    return found


def test(release: str, newest: dict[str, list[float]]) -> None:
    """Runs TESTS with the release, and compares its picture with the newest release's."""
    print(f"== tests with Mitsuba {release}", flush=True)
    files = [REPOSITORY / "tests" / name for name in TESTS]
    folder = str(plugin_folder(release))
    # Two processes: in 3.8.0 an LLVM render after a scalar one fails, with Mitsuba's own BSDFs too.
    for which in ("scalar", "not scalar"):
        run(python_of(release), "-m", "pytest", "-q", "-k", which, *files, SUNBEAM_PLUGIN_FOLDER=folder)
    for variant, here in means(release).items():
        off = max(abs(a - b) / b for a, b in zip(here, newest[variant]))
        print(f"   {variant}: means within {off:.1e} of the newest release's")
        if not off <= MEANS:
            raise SystemExit(f"Mitsuba {release}, {variant}: the means are off by {off:.1e}, more than {MEANS}")


def main(words: list[str]) -> int:
    what, *chosen = words or [""]
    known = releases()
    if what not in ("build", "test") or not set(chosen) <= set(known):
        print(f"{sys.argv[0]} build|test [{'|'.join(known)} ...]", file=sys.stderr)
        return 2
    wanted = [release for release in known if release in chosen or not chosen]
    for release in wanted:
        build(release)
    if what == "test":
        if known[0] not in wanted:
            build(known[0])
        newest = means(known[0])
        for release in wanted:
            test(release, newest)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
