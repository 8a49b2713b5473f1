"""Checks the manifests of the workspace.

- A member built alone compiles every package with the features of the whole workspace. A package with other features
  would be compiled again for the next member; crates/unify/Cargo.toml requests the missing features.
- No dependency needs a newer Rust than `rust-version`.
- The library has at most DEPENDENCIES_MAX dependencies on every platform.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

# Members that the Makefile or a command in docs/contributing.md builds alone, by the kinds of the build's dependencies.
ALONE = {
    "normal,build": ["sunbeam-mitsuba", "sunbeam-cli", "sunbeam-c"],
    "normal,build,dev": ["sunbeam", "sunbeam-height-field", "sunbeam-realtime", "sunbeam-cli", "sunbeam-c"],
}
# Arguments of the Makefile's first build, beside the installation of Python's packages.
GROUND = " ".join(re.findall(r"^GROUND [:+]= (.*)$", Path("Makefile").read_text(), re.M)).split()
# Largest number of dependencies of the library that are neither optional nor of one target alone.
DEPENDENCIES_MAX = 15


def features(edges: str, *selection: str) -> set[str]:
    """Packages of a build with their features; `edges` are the kinds of dependencies."""
    command = ["cargo", "tree", "--locked", "--edges", edges, "--prefix", "none", "--no-dedupe"]
    listed = subprocess.run(
        [*command, "--format", "{p} with {f}", *selection], check=True, capture_output=True, text=True
    )
    return {line.replace(" (*)", "").replace(" (proc-macro)", "") for line in listed.stdout.splitlines()}


def compiled_twice() -> list[str]:
    builds = [(edges, ["--package", member]) for edges, members in ALONE.items() for member in members]
    builds.append(("normal,build", GROUND))
    together = {edges: features(edges, "--workspace") for edges in ALONE}
    return [
        f"{' '.join(selection)} alone compiles {package}"
        for edges, selection in builds
        for package in sorted(features(edges, *selection) - together[edges])
    ]


def packages() -> tuple[list[dict], list[dict]]:
    """Members of the workspace, and all packages that they depend on."""
    command = ["cargo", "metadata", "--locked", "--format-version", "1"]
    found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    members = set(found["workspace_members"])
    own = [package for package in found["packages"] if package["id"] in members]
    return own, [package for package in found["packages"] if package["id"] not in members]


def version(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split("."))


def too_new(own: list[dict], others: list[dict]) -> list[str]:
    promised = min(version(package["rust_version"]) for package in own)
    asked = [package for package in others if package["rust_version"]]
    return [
        f"{package['name']} {package['version']} needs Rust {package['rust_version']}"
        for package in asked
        if version(package["rust_version"]) > (*promised, *[0] * (3 - len(promised)))
    ]


def too_many(own: list[dict]) -> list[str]:
    (library,) = [package for package in own if package["name"] == "sunbeam"]
    needed = [
        each["name"]
        for each in library["dependencies"]
        if each["kind"] is None and not each["optional"] and each["target"] is None
    ]
    if len(needed) <= DEPENDENCIES_MAX:
        return []
    return [f"the library has {len(needed)} dependencies, more than {DEPENDENCIES_MAX}: {', '.join(sorted(needed))}"]


def main() -> int:
    own, others = packages()
    wrong = compiled_twice() + too_new(own, others) + too_many(own)
    for line in wrong:
        print(line, file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
