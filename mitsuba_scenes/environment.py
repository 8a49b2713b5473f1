"""Set-up of Mitsuba: finds the compiled plugin and selects a variant that runs on this machine.

The plugin is `plugins/diffraction.so` in the folder that the environment variable SUNBEAM_MITSUBA names, by default the
checkout's `target/mitsuba`.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mitsuba as mi

# Folder of the checkout.
REPOSITORY = Path(__file__).resolve().parent.parent
# Folder that Mitsuba's file resolver searches; it contains plugins/.
PLUGIN_FOLDER = Path(os.environ.get("SUNBEAM_MITSUBA", REPOSITORY / "target" / "mitsuba"))
# The compiled plugin.
PLUGIN = PLUGIN_FOLDER / "plugins" / "diffraction.so"

# Default variant of Mitsuba: vectorised and spectral.
DEFAULT_VARIANT = "llvm_ad_spectral"
# Variant that needs neither LLVM nor a GPU, used in place of any LLVM variant.
FALLBACK_VARIANT = "scalar_spectral"


class SetupError(Exception):
    """A missing requirement, a failed command, or a failed check; the message is one line that names it."""


def use_plugin(path: Path) -> None:
    """Makes `use_variant` load the build `path`. Raises SetupError unless it is an existing `…/plugins/diffraction.so`.

    It has an effect only before the first call of `use_variant`, since Mitsuba takes the plugin of the folder that its
    resolver got first. The only caller, benches/mitsuba_cost.py, begins with it.
    """
    global PLUGIN, PLUGIN_FOLDER
    plugin = path.resolve()
    if not plugin.is_file() or plugin.parts[-2:] != ("plugins", "diffraction.so"):
        raise SetupError(f"{path} is no build of the plugin; it must be an existing plugins/diffraction.so")
    PLUGIN, PLUGIN_FOLDER = plugin, plugin.parent.parent


def use_variant(name: str = DEFAULT_VARIANT, fall_back: bool = True) -> str:
    """Selects the variant `name`, makes the plugin known to it, and returns the name of the selected variant.

    If the library of an LLVM variant cannot be loaded and `fall_back` is true, FALLBACK_VARIANT is selected with a note
    on stderr. Raises SetupError for an unknown variant, a missing plugin, and a variant that does not run on this
    machine.
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
    """Turns off the disk cache of tables, in plugin and command, within the context: to measure build times."""
    before = os.environ.get("SUNBEAM_CACHE")
    os.environ["SUNBEAM_CACHE"] = "off"
    try:
        yield
    finally:
        if before is None:
            del os.environ["SUNBEAM_CACHE"]
        else:
            os.environ["SUNBEAM_CACHE"] = before
