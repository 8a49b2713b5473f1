"""Finds the plugin and tells Mitsuba where it is."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

#: The Mitsuba that the plugin was compiled for. The memory layout of its classes is no interface, so no other will do.
MITSUBA_VERSION = "3.9.1"

_HERE = Path(__file__).resolve().parent


def _plugin_folder() -> Path:
    """Where ``plugins/diffraction.so`` is: in the package, or in the checkout that the package is used from."""
    for folder in (_HERE, _HERE.parents[1] / "target" / "mitsuba"):
        if (folder / "plugins" / "diffraction.so").exists():
            return folder
    raise ImportError(
        f"sunbeam_mitsuba: there is no plugins/diffraction.so in {_HERE}: install the package with `pip install .`, "
        "or run `make plugin` in the checkout"
    )


def _check_version() -> None:
    """Refuses a Mitsuba that the plugin was not compiled for, before anything of it is loaded."""
    try:
        found = version("mitsuba")
    except PackageNotFoundError:
        raise ImportError(f"sunbeam_mitsuba needs mitsuba=={MITSUBA_VERSION}, which is not installed") from None
    if found != MITSUBA_VERSION:
        raise ImportError(
            f"sunbeam_mitsuba was compiled for mitsuba=={MITSUBA_VERSION}, but {found} is installed; their memory "
            f"layouts differ, so it would render garbage. Install mitsuba=={MITSUBA_VERSION}"
        )


_check_version()

#: The folder that Mitsuba's file resolver has to know; the plugin is below it.
PLUGIN_FOLDER = _plugin_folder()
PLUGIN = PLUGIN_FOLDER / "plugins" / "diffraction.so"


def register() -> None:
    """Makes the plugin known to Mitsuba, in the variant in use and in those that are set later. Importing the package
    does this; calling it again does no harm."""
    import mitsuba as mi

    def known(*_: object) -> None:
        resolver = mi.file_resolver()  # type: ignore[operator]  # Mitsuba's stubs know it as an object
        if str(PLUGIN_FOLDER) not in [str(folder) for folder in resolver]:
            resolver.append(str(PLUGIN_FOLDER))

    known()
    mi.detail.add_variant_callback(known)
