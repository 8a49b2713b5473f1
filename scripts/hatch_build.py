"""Puts the plugin into the wheel: Cargo builds it against the Mitsuba that the building interpreter has."""

from __future__ import annotations

import importlib.metadata
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PLUGIN = "release/libsunbeam_mitsuba.so"


def stripped(plugin: Path, folder: Path) -> Path:
    """The plugin without what only a debugger reads, which is nine tenths of it; as it is where there is no `strip`."""
    if not shutil.which("strip"):
        return plugin
    folder.mkdir(parents=True, exist_ok=True)
    made = folder / "diffraction.so"
    subprocess.run(["strip", "--strip-debug", "-o", str(made), str(plugin)], check=True)
    return made


class PluginBuildHook(BuildHookInterface):
    """Runs ``cargo build`` and names the platform that the result is for.

    The wheel holds the plugin for the Mitsuba of the building interpreter; with ``SUNBEAM_ALL_RELEASES=1`` (`make
    wheel`) those for all releases that `scripts/versions.py` has built.
    """

    def initialize(self, version: str, build_data: dict) -> None:
        """Called by hatchling before it collects the files of a wheel."""
        root = Path(self.root)
        environment = {"CARGO_TARGET_DIR": str(root / "target"), **os.environ}
        # What the build needs of Mitsuba is asked of this interpreter, which has what pyproject.toml requires. That of
        # the checkout is asked anyway; naming it would make Cargo build anew what `make plugin` has built.
        if Path(sys.prefix) != root / ".venv":
            environment.setdefault("SUNBEAM_PYTHON", sys.executable)
        command = ["cargo", "build", "--release", "--package", "sunbeam-mitsuba"]
        try:
            subprocess.run(command, cwd=root, env=environment, check=True)
        except FileNotFoundError:
            raise SystemExit("sunbeam-mitsuba needs Rust to be built: see https://rustup.rs") from None
        except subprocess.CalledProcessError as error:
            raise SystemExit(f"`{' '.join(command)}` failed with status {error.returncode}") from None
        plugins = {importlib.metadata.version("mitsuba"): Path(environment["CARGO_TARGET_DIR"], PLUGIN)}
        if os.environ.get("SUNBEAM_ALL_RELEASES") == "1":
            built = (root / "target" / "versions").glob("*/plugins/diffraction.so")
            plugins = {path.parents[1].name: path for path in built}
        for release, plugin in plugins.items():
            inside = f"sunbeam_mitsuba/plugins/{release}/plugins/diffraction.so"
            build_data["force_include"][str(stripped(root / plugin, root / "target" / "wheel" / release))] = inside
        # Any Python that Mitsuba runs in, but this platform alone.
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"
