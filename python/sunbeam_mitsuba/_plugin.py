"""Finds the plugin for the installed Mitsuba and registers its folder."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_HERE = Path(__file__).resolve().parent


def _plugin_folders() -> dict[str, Path]:
    """Folders that hold ``plugins/diffraction.so``, by the Mitsuba release of the plugin.

    A wheel holds a folder for each supported release. In a checkout, the folder is that of the last build.
    """
    found = {folder.name: folder for folder in (_HERE / "plugins").glob("*")}
    built = _HERE.parents[1] / "target" / "mitsuba"
    if not found and (built / "version").exists():
        found = {(built / "version").read_text().strip(): built}
    return {release: folder for release, folder in found.items() if (folder / "plugins" / "diffraction.so").exists()}


def _choose() -> tuple[str, Path]:
    """Returns the installed Mitsuba's version and its plugin's folder.

    The memory layout of Mitsuba's classes differs between releases, so a release without a plugin is refused before
    anything is loaded.
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


_chosen = _choose()
#: Version of the installed Mitsuba, for which the plugin was compiled.
MITSUBA_VERSION: str = _chosen[0]
#: Folder that Mitsuba's file resolver searches; it contains ``plugins/``.
PLUGIN_FOLDER: Path = _chosen[1]
PLUGIN = PLUGIN_FOLDER / "plugins" / "diffraction.so"


def register() -> None:
    """Registers the plugin with Mitsuba, in the current variant and in variants set later.

    Importing the package calls this function; another call changes nothing.
    """
    import mitsuba as mi

    def add_folder(*_: object) -> None:
        resolver = mi.file_resolver()  # type: ignore[operator]  # Mitsuba's stubs know it as an object
        if str(PLUGIN_FOLDER) not in [str(folder) for folder in resolver]:
            resolver.append(str(PLUGIN_FOLDER))

    add_folder()
    mi.detail.add_variant_callback(add_folder)
