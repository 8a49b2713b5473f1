"""Loads the plugin that `make plugin` built into the stock wheel of Mitsuba."""

import gc
import json
import os
import sys
from pathlib import Path

# NumPy's threads would compete with tests that run in parallel. NumPy reads the variable at its import.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import drjit as dr
import mitsuba as mi
import needs
import pytest

REPOSITORY = Path(__file__).resolve().parent.parent
# Tests share tables in a cache of this checkout, apart from the user's.
os.environ.setdefault("SUNBEAM_CACHE_DIR", str(REPOSITORY / "target" / "test_cache"))
# Folder of the plugin; scripts/versions.py names another release's.
PLUGIN_FOLDER = Path(os.environ.get("SUNBEAM_PLUGIN_FOLDER", REPOSITORY / "target" / "mitsuba"))

# The variants of the wheel that run on this machine.
CUDA = dr.has_backend(dr.JitBackend.CUDA)
VARIANTS = [name for name in mi.variants() if CUDA or not name.startswith("cuda")]
# One variant of each kind, for tests that depend on neither colour nor polarisation.
TYPICAL_VARIANTS = ["scalar_rgb", "scalar_spectral", "llvm_ad_rgb", "llvm_ad_spectral_polarized"]
# One vectorised variant of each kind.
TRACED_VARIANTS = ["llvm_ad_spectral", "llvm_ad_rgb"]


def pytest_sessionstart(session):
    if not (PLUGIN_FOLDER / "plugins" / "diffraction.so").exists():
        pytest.exit("the plugin is not built: run `make plugin` first", returncode=2)
    if not CUDA and not hasattr(session.config, "workerinput"):
        needs.miss("cuda", "the CUDA variants", "there is no NVIDIA GPU")


def use_variant(name):
    """Selects a variant and makes the plugin known to it."""
    mi.set_variant(name)
    resolver = mi.file_resolver()
    if str(PLUGIN_FOLDER) not in [str(folder) for folder in resolver]:
        resolver.append(str(PLUGIN_FOLDER))


_built = {}


def built(variant, **parameters):
    """Selects a variant and returns its `diffraction` BSDF with these parameters.

    Modules share a BSDF between tests, since a skin's tables take seconds, so tests must not change it.
    """
    use_variant(variant)
    key = variant, json.dumps(parameters, sort_keys=True)
    if key not in _built:
        _built[key] = mi.load_dict({"type": "diffraction", **parameters})
    return _built[key]


@pytest.fixture(scope="module", autouse=True)
def nothing_left(request):
    """Deletes a module's BSDFs after its tests.

    A kernel for rendering contains all existing BSDFs. Those of earlier modules would lengthen it, and change it with
    the order of modules, so that the cache of kernels would not hit.
    """
    yield
    _built.clear()
    for value in vars(request.module).values():
        if hasattr(value, "cache_clear"):
            value.cache_clear()
    gc.collect()


@pytest.fixture(params=VARIANTS)
def variant(request):
    """Every variant that runs on this machine."""
    use_variant(request.param)
    return request.param


@pytest.fixture(params=TYPICAL_VARIANTS)
def typical_variant(request):
    use_variant(request.param)
    return request.param


@pytest.fixture(params=TRACED_VARIANTS)
def traced(request):
    use_variant(request.param)
    return request.param


@pytest.fixture
def scalar_rgb():
    use_variant("scalar_rgb")


@pytest.fixture
def llvm_ad_rgb():
    use_variant("llvm_ad_rgb")


@pytest.fixture
def make_bsdf():
    """A function that makes a `diffraction` BSDF from keyword arguments."""
    return lambda **parameters: mi.load_dict({"type": "diffraction", **parameters})


@pytest.fixture(scope="module")
def sweep_package():
    """The package `sunbeam_mitsuba.sweep` of the checkout; removed afterwards for tests of the wheel."""
    names = [name for name in sys.modules if name.split(".")[0] == "sunbeam_mitsuba"]
    before = {name: sys.modules.pop(name) for name in names}
    sys.path.insert(0, str(REPOSITORY / "python"))
    try:
        import sunbeam_mitsuba.sweep

        yield sunbeam_mitsuba.sweep
    finally:
        sys.path.remove(str(REPOSITORY / "python"))
        for name in [name for name in sys.modules if name.split(".")[0] == "sunbeam_mitsuba"]:
            del sys.modules[name]
        sys.modules.update(before)
