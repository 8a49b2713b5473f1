"""Build hook of the wheel: builds the plugin with Cargo against Mitsuba.

The release of Mitsuba is that of the interpreter `SUNBEAM_PYTHON`, by default the one that builds the wheel. Hatchling,
the build backend, runs the hook for `pip install` and `pip wheel` (pyproject.toml).
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Path of the plugin's library in Cargo's target folder.
PLUGIN = "release/libsunbeam_mitsuba.so"


def stripped(plugin: Path, folder: Path) -> Path:
    """Copies the plugin to `diffraction.so` in `folder`, without debug information, which is nine tenths of the file.

    Returns the copy's path, or the plugin's own where the program `strip` is missing.
    """
    if not shutil.which("strip"):
        return plugin
    folder.mkdir(parents=True, exist_ok=True)
    copy = folder / "diffraction.so"
    subprocess.run(["strip", "--strip-debug", "-o", str(copy), str(plugin)], check=True)
    return copy


class PluginBuildHook(BuildHookInterface):
    """Runs ``cargo build`` and tags the wheel with its platform.

    The wheel has the plugin for the release of Mitsuba that the interpreter has. With ``SUNBEAM_ALL_RELEASES=1``
    (`make wheel`) it has a plugin for every release that `scripts/versions.py` has built.
    """

    def initialize(self, version: str, build_data: dict) -> None:
        """Builds and adds the plugins. Hatchling calls it before it collects the files of a wheel.

        `version` is the kind of wheel, standard or editable; both are built alike. The files to add and the wheel's tag
        are written to `build_data`. Raises SystemExit with one line where Cargo is missing or fails.
        """
        root = Path(self.root)
        environment = {"CARGO_TARGET_DIR": str(root / "target"), **os.environ}
        # cpp_shim/build.rs finds Mitsuba through the interpreter SUNBEAM_PYTHON, by default the checkout's. The
        # default is not named, since another value of the variable makes Cargo rebuild the plugin that `make plugin`
        # has built.
        if Path(sys.prefix) != root / ".venv":
            environment.setdefault("SUNBEAM_PYTHON", sys.executable)
        command = ["cargo", "build", "--release", "--package", "sunbeam-mitsuba"]
        try:
            subprocess.run(command, cwd=root, env=environment, check=True)
        except FileNotFoundError:
            raise SystemExit("sunbeam-mitsuba needs Rust to be built: see https://rustup.rs") from None
        except subprocess.CalledProcessError as error:
            raise SystemExit(f"`{' '.join(command)}` failed with status {error.returncode}") from None
        # Asked of the interpreter that build.rs uses, which may have another Mitsuba than this one.
        question = "from importlib.metadata import version; print(version('mitsuba'))"
        python = environment.get("SUNBEAM_PYTHON", sys.executable)
        answer = subprocess.run(
            [python, "-c", question], env=environment, check=True, stdout=subprocess.PIPE, text=True
        )
        # Plugins by their release of Mitsuba.
        plugins = {answer.stdout.strip(): Path(environment["CARGO_TARGET_DIR"], PLUGIN)}
        if os.environ.get("SUNBEAM_ALL_RELEASES") == "1":
            # Paths are target/versions/RELEASE/plugins/diffraction.so.
            built = (root / "target" / "versions").glob("*/plugins/diffraction.so")
            plugins = {path.parents[1].name: path for path in built}
            if not plugins:
                raise SystemExit("target/versions has no plugins: run `python scripts/versions.py build` first")
        for release, plugin in plugins.items():
            # Cargo's target folder may be relative to the repository.
            source = stripped(root / plugin, root / "target" / "wheel" / release)
            # Path in the wheel, by path on this machine. Mitsuba expects a folder `plugins` in the release's folder.
            build_data["force_include"][str(source)] = f"sunbeam_mitsuba/plugins/{release}/plugins/diffraction.so"
        # The wheel serves all versions of Python on this platform.
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"
