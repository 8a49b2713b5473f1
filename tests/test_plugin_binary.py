"""The plugin refuses other Mitsubas, and registers all variants of the wheel."""

import os
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import drjit
import mitsuba as mi
import pytest
from conftest import PLUGIN_FOLDER

COMPILED = "3.9.1"


def run(script, *arguments, path=None, **environment):
    prefix = f"import sys; sys.path.insert(0, {str(path)!r})\n" if path else ""
    return subprocess.run(
        [sys.executable, "-c", prefix + script, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
    )


def test_every_variant_is_registered():
    """The library is called directly, so that CUDA variants count on machines without a GPU."""
    script = """
import ctypes, sys
import mitsuba as mi
mi.set_variant("scalar_rgb")  # loads the libraries that the plugin needs
found = []
# A std::string_view is passed as its two members: length, pointer.
callback = ctypes.CFUNCTYPE(
    None, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p
)
@callback
def register(name_length, name, variant_length, variant, kind, instantiate):
    assert ctypes.string_at(name, name_length) == b"diffraction"
    found.append(ctypes.string_at(variant, variant_length).decode())
init = ctypes.CDLL(sys.argv[1]).init_plugin
init.argtypes = [ctypes.c_size_t, ctypes.c_char_p, callback]
init(len("diffraction"), b"diffraction", register)
print(*sorted(found))
"""
    result = run(script, str(PLUGIN_FOLDER / "plugins" / "diffraction.so"))
    assert result.stdout.split() == sorted(mi.variants()), result.stderr
    assert len(mi.variants()) == 13


LOAD = """
import sys
import mitsuba as mi
print(mi.__file__)
mi.set_variant(sys.argv[2])
mi.file_resolver().append(sys.argv[1])
print(mi.load_dict({"type": "diffraction", "preset": "flat"}))
"""


@pytest.fixture
def other_mitsuba(tmp_path):
    """Makes a copy of the installed Mitsuba that reports another version."""

    def make(version):
        label, package = b"Mitsuba version ", Path(mi.__file__).parent
        copy = tmp_path / "mitsuba"
        copy.mkdir()
        # Links to files would resolve to the folder of the originals.
        for entry in package.iterdir():
            if entry.is_dir():
                (copy / entry.name).symlink_to(entry)
            else:
                shutil.copy(entry, copy)
        (tmp_path / "drjit").symlink_to(Path(drjit.__file__).parent)
        library = (package / "libmitsuba.so").read_bytes()
        assert library.count(label + COMPILED.encode()) == 1
        (copy / "libmitsuba.so").write_bytes(library.replace(label + COMPILED.encode(), label + version.encode()))
        return tmp_path

    return make


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_spectral"])
@pytest.mark.parametrize("other", ["3.9.0", "4.0.0", "x.y.z"])
def test_another_version_is_refused(other_mitsuba, variant, other):
    path = other_mitsuba(other)
    result = run(LOAD, str(PLUGIN_FOLDER), variant, path=path)
    assert str(path) in result.stdout, "the copy was not used"
    assert result.returncode == 1, result.stdout
    found = "a Mitsuba of unknown version" if other == "x.y.z" else f"Mitsuba {other};"
    assert f"compiled for Mitsuba {COMPILED}, but is being loaded into {found}" in result.stderr


def test_a_copy_with_its_own_version_is_accepted(other_mitsuba):
    result = run(LOAD, str(PLUGIN_FOLDER), "scalar_rgb", path=other_mitsuba(COMPILED))
    assert result.returncode == 0, result.stderr
    assert "Diffraction[" in result.stdout


# Imitates a Mitsuba built without AVX2, whose function returns its result as a plain structure.
OTHER_FLAGS = """
#include <dlfcn.h>
#include <immintrin.h>
#define NAME "_ZN7mitsuba16srgb_model_fetchERKNS_5ColorIfLm3EEE"
struct Plain { float x, y, z; };
Plain fetch(const void *color) asm(NAME);
Plain fetch(const void *color) {
    void *mitsuba = dlopen("libmitsuba.so", RTLD_LAZY | RTLD_NOLOAD);
    auto original = (__m128 (*)(const void *)) dlsym(mitsuba, NAME);
    alignas(16) float values[4];
    _mm_store_ps(values, original(color));
    return { values[0], values[1], values[2] };
}
"""


def test_other_compiler_flags_are_refused(tmp_path):
    source, library = tmp_path / "flags.cpp", tmp_path / "flags.so"
    source.write_text(OTHER_FLAGS)
    compiler = os.environ.get("CXX", "c++")
    subprocess.run([compiler, "-shared", "-fPIC", "-D_GNU_SOURCE", "-o", library, source, "-ldl"], check=True)
    result = run(LOAD, str(PLUGIN_FOLDER), "scalar_rgb", LD_PRELOAD=str(library))
    assert result.returncode == 1, result.stdout
    assert "pass arrays in different ways" in result.stderr


def test_the_pinned_version_is_installed():
    assert version("mitsuba") == COMPILED


def test_build_refuses_other_packages(tmp_path):
    """With an interpreter without Mitsuba, the build names the required release.

    The build script runs without Cargo, which would compile everything again afterwards.
    """
    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\nexec "{sys.executable}" -I -S "$@"\n')
    python.chmod(0o755)
    environment = {
        **os.environ,
        "SUNBEAM_PYTHON": str(python),
        "CARGO_CFG_TARGET_OS": "linux",
        "CARGO_CFG_TARGET_ARCH": "x86_64",
    }
    scripts = PLUGIN_FOLDER.parent.glob("release/build/sunbeam-mitsuba-*/build-script-build")
    newest_first = sorted(scripts, key=lambda path: path.stat().st_mtime, reverse=True)
    results = [subprocess.run([path], env=environment, capture_output=True, text=True) for path in newest_first]
    refusals = [result.stderr for result in results if result.returncode != 0]
    assert refusals, "the build script accepted an interpreter without Mitsuba"
    assert "it needs mitsuba 3.9.1" in refusals[0]
    assert "there is none" in refusals[0]
