"""Finds the plugin for the Mitsuba that is installed, and tells Mitsuba where it is."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_HERE = Path(__file__).resolve().parent


def _plugin_folders() -> dict[str, Path]:
    """The folder with ``plugins/diffraction.so`` for each Mitsuba that a plugin was compiled for.

    They are in the package, or there is one in the checkout that the package is used from.
    """
    found = {folder.name: folder for folder in (_HERE / "plugins").glob("*")}
    built = _HERE.parents[1] / "target" / "mitsuba"
    if not found and (built / "version").exists():
        found = {(built / "version").read_text().strip(): built}
    return {release: folder for release, folder in found.items() if (folder / "plugins" / "diffraction.so").exists()}


def _choose() -> tuple[str, Path]:
    """The installed Mitsuba and its plugin's folder.

    The memory layout of Mitsuba's classes is no interface, so any other is refused before anything of it is loaded.
    """
    folders = _plugin_folders()
    if not folders:
        raise ImportError(
            f"sunbeam_mitsuba: there is no plugins/diffraction.so in {_HERE}: install the package with "
            "`pip install .`, or run `make plugin` in the checkout"
        )
    accepted = " or ".join(f"mitsuba=={release}" for release in sorted(folders, reverse=True))
    try:
        found = version("mitsuba")
    except PackageNotFoundError:
        raise ImportError(f"sunbeam_mitsuba needs {accepted}, which is not installed") from None
    if found not in folders:
        raise ImportError(
            f"sunbeam_mitsuba was compiled for {accepted}, but {found} is installed; their memory layouts differ, so "
            f"it would render garbage. Install {accepted}, or build the package with the installed one"
        )
    return found, folders[found]


#: The Mitsuba that is installed and the plugin was compiled for, and the folder that Mitsuba's file resolver has to
#: know; the plugin is below it.
MITSUBA_VERSION, PLUGIN_FOLDER = _choose()
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
