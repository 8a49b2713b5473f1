"""Holds what the manifests of the workspace promise.

- A member that is built alone compiles no package with other features than all members together: such a package is
  compiled once more whenever another member is built, and crates/unify/Cargo.toml asks for what is missing.
- No dependency needs a newer Rust than `rust-version` says.
- The library itself has few dependencies that are neither optional nor of one target alone.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

# Members that the Makefile builds alone, and those whose tests docs/contributing.md runs alone; with the kinds of
# dependencies that a build of either takes in.
ALONE = {
    "normal,build": ["sunbeam-mitsuba", "sunbeam-cli", "sunbeam-c"],
    "normal,build,dev": ["sunbeam", "sunbeam-height-field", "sunbeam-realtime", "sunbeam-cli", "sunbeam-c"],
}
# What the Makefile compiles before there are Python's packages.
GROUND = re.search(r"^GROUND := (.*)$", Path("Makefile").read_text(), re.M)[1].split()
# Of the library.
DEPENDENCIES_MAX = 15


def features(edges: str, *selection: str) -> set[str]:
    """The packages of a build, each with its features; `edges` are the kinds of dependencies."""
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
    """The members of the workspace, and what they depend on."""
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
