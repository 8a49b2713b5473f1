"""Finds the plugin for the installed Mitsuba and registers its folder."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_HERE = Path(__file__).resolve().parent


def _plugin_folders() -> dict[str, Path]:
    """Folders that contain ``plugins/diffraction.so``, by the Mitsuba release for which it was compiled.

    An installed package has a folder ``plugins/RELEASE`` for each supported release. A checkout has the folder of the
    last build, ``target/mitsuba``, whose file ``version`` names the release.
    """
    folders = {folder.name: folder for folder in (_HERE / "plugins").glob("*")}
    built = _HERE.parents[1] / "target" / "mitsuba"
    if not folders and (built / "version").exists():
        folders = {(built / "version").read_text().strip(): built}
    return {release: folder for release, folder in folders.items() if (folder / "plugins" / "diffraction.so").exists()}


def _choose() -> tuple[str, Path]:
    """Returns the installed Mitsuba's version and its plugin's folder.

    The memory layout of Mitsuba's classes differs between releases. A release without a plugin is therefore refused
    with an ``ImportError`` before anything is loaded, as are a missing Mitsuba and a missing plugin.
    """
    folders = _plugin_folders()
    if not folders:
        raise ImportError(
            f"sunbeam_mitsuba: there is no plugins/diffraction.so in {_HERE}: install the package with "
            "`pip install .`, or run `make plugin` in the checkout"
        )
    accepted = " or ".join(f"mitsuba=={release}" for release in sorted(folders, reverse=True))
    try:
        installed = version("mitsuba")
    except PackageNotFoundError:
        raise ImportError(f"sunbeam_mitsuba needs {accepted}, which is not installed") from None
    if installed not in folders:
        raise ImportError(
            f"sunbeam_mitsuba was compiled for {accepted}, but {installed} is installed; their memory layouts differ, "
            f"so it would render garbage. Install {accepted}, or build the package with the installed one"
        )
    return installed, folders[installed]


#: Version of the installed Mitsuba, for which the plugin was compiled.
MITSUBA_VERSION: str
#: Folder that Mitsuba's file resolver searches; it contains ``plugins/``.
PLUGIN_FOLDER: Path
MITSUBA_VERSION, PLUGIN_FOLDER = _choose()
#: The plugin, a shared library that also exports the C interface.
PLUGIN = PLUGIN_FOLDER / "plugins" / "diffraction.so"


def register() -> None:
    """Registers the plugin with Mitsuba, in the current variant and in variants set later.

    Importing the package calls this function. Another call adds the folder no second time.
    """
    import mitsuba as mi

    # Mitsuba passes the names of the old and the new variant, which are not needed.
    def add_folder(*_: object) -> None:
        # Mitsuba's type stubs declare `file_resolver` as an object that cannot be called.
        resolver = mi.file_resolver()  # type: ignore[operator]
        if str(PLUGIN_FOLDER) not in [str(folder) for folder in resolver]:
            resolver.append(str(PLUGIN_FOLDER))

    add_folder()
    mi.detail.add_variant_callback(add_folder)
