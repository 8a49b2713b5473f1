"""What must be there before a scene can be made: a variant that runs here, and the plugin."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mitsuba as mi

REPOSITORY = Path(__file__).resolve().parent.parent
# The folder for Mitsuba's file resolver: that of the checkout unless the environment names another.
PLUGIN_FOLDER = Path(os.environ.get("SUNBEAM_MITSUBA", REPOSITORY / "target" / "mitsuba"))
PLUGIN = PLUGIN_FOLDER / "plugins" / "diffraction.so"

DEFAULT_VARIANT = "llvm_ad_spectral"
# Needs neither LLVM nor a GPU.
FALLBACK_VARIANT = "scalar_spectral"


class SetupError(Exception):
    """Something is missing; the message is one line that says what, and how to get it."""


def use_plugin(path: Path) -> None:
    """Has `use_variant` take another build, `…/plugins/diffraction.so`; before any variant is selected."""
    global PLUGIN, PLUGIN_FOLDER
    PLUGIN = path.resolve()
    PLUGIN_FOLDER = PLUGIN.parent.parent


def use_variant(name: str = DEFAULT_VARIANT, fall_back: bool = True) -> str:
    """Selects a variant, makes the plugin known to it, and returns the name of the variant selected.

    Where the backend of an LLVM variant cannot be loaded, `fall_back` takes `scalar_spectral` and says so on stderr.
    """
    if name not in mi.variants():
        raise SetupError(f"unknown variant {name!r}; this Mitsuba has {', '.join(mi.variants())}")
    if not PLUGIN.exists():
        raise SetupError(f"the plugin {PLUGIN} is missing: run `make plugin`")
    try:
        mi.set_variant(name)
    except ImportError as error:
        reason = str(error).splitlines()[0]
        if not (fall_back and name.startswith("llvm")):
            raise SetupError(f"the variant {name} does not run here: {reason}") from error
        print(f"note: {name} does not run here ({reason}); using {FALLBACK_VARIANT}, which is slower", file=sys.stderr)
        name = FALLBACK_VARIANT
        mi.set_variant(name)
    resolver = mi.file_resolver()
    if str(PLUGIN_FOLDER) not in [str(folder) for folder in resolver]:
        resolver.append(str(PLUGIN_FOLDER))
    return name


@contextmanager
def cache_off() -> Iterator[None]:
    """Tables are built here even if there is a cache of them, and not kept: for times of building."""
    before = os.environ.get("SUNBEAM_CACHE")
    os.environ["SUNBEAM_CACHE"] = "off"
    try:
        yield
    finally:
        if before is None:
            del os.environ["SUNBEAM_CACHE"]
        else:
            os.environ["SUNBEAM_CACHE"] = before
