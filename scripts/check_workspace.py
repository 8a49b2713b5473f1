"""Checks the manifests of the workspace.

- Features: a member built alone compiles every package with the features of the whole workspace. Otherwise the package
  and all that depend on it are compiled again whenever another member is built. crates/unify/Cargo.toml lists features
  that are missing.
- `rust-version`: no dependency of a member declares a newer Rust, and the packages of the library declare the same one.
- Syntax: the library has no `let` chains, which edition 2024 allows only from Rust 1.88 on. (Functions of the standard
  library that are newer than `rust-version` are found by clippy's lint `incompatible_msrv`, which is on by default.)
- The library has at most DEPENDENCIES_MAX dependencies, apart from optional ones and those of one target.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

# Members that the Makefile builds alone, and members whose tests docs/contributing.md runs alone. Keys are the kinds of
# dependencies that the build compiles.
ALONE = {
    "normal,build": ["sunbeam-mitsuba", "sunbeam-cli", "sunbeam-c"],
    "normal,build,dev": ["sunbeam", "sunbeam-height-field", "sunbeam-realtime", "sunbeam-cli", "sunbeam-c"],
}
# Packages that the Makefile compiles first, while Python's packages are installed.
GROUND = " ".join(re.findall(r"^GROUND [:+]= (.*)$", Path("Makefile").read_text(), re.M)).split()
# Packages that make up the library and its C interface.
LIBRARY = ["sunbeam", "sunbeam-c", "sunbeam-fourier", "sunbeam-guard", "sunbeam-height-field", "sunbeam-rigorous"]
# Limit on the library's dependencies. Chosen: it had this number when the limit was set.
DEPENDENCIES_MAX = 15


def features(edges: str, *selection: str) -> set[str]:
    """Packages of a build in the form "NAME VERSION with FEATURES"; `edges` are the kinds of dependencies."""
    return tree(edges, "{p} with {f}", *selection)


def tree(edges: str, form: str, *selection: str) -> set[str]:
    """Packages of a build as `cargo tree --format` prints them."""
    command = ["cargo", "tree", "--locked", "--edges", edges, "--prefix", "none", "--no-dedupe", "--format", form]
    listed = subprocess.run([*command, *selection], check=True, capture_output=True, text=True)
    return {line.replace(" (*)", "").replace(" (proc-macro)", "") for line in listed.stdout.splitlines()}


def compiled_twice() -> list[str]:
    """Packages that a member built alone compiles with other features than the workspace."""
    builds = [(edges, ["--package", member]) for edges, members in ALONE.items() for member in members]
    builds.append(("normal,build", GROUND))
    together = {edges: features(edges, "--workspace") for edges in ALONE}
    return [
        f"{' '.join(selection)} alone compiles {package}"
        for edges, selection in builds
        for package in sorted(features(edges, *selection) - together[edges])
    ]


def packages() -> tuple[list[dict], list[dict]]:
    """Members of the workspace, and their dependencies, direct and indirect."""
    command = ["cargo", "metadata", "--locked", "--format-version", "1"]
    found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    members = set(found["workspace_members"])
    own = [package for package in found["packages"] if package["id"] in members]
    return own, [package for package in found["packages"] if package["id"] not in members]


def version(text: str) -> tuple[int, int, int]:
    """A version number, with zeros for omitted parts."""
    parts = [int(part) for part in text.split(".")]
    major, minor, patch = (*parts, 0, 0)[:3]
    return major, minor, patch


def too_new(own: list[dict], others: list[dict]) -> list[str]:
    """Dependencies, members included, that declare a newer Rust than a member that needs them."""
    declared = {
        f"{each['name']} v{each['version']}": each["rust_version"] for each in own + others if each["rust_version"]
    }
    wrong = []
    for member in own:
        needed = tree("normal,build", "{p}", "--package", member["name"], "--all-features", "--target", "all")
        names = {re.sub(r" \(.*\)$", "", package) for package in needed}
        wrong += [
            f"{member['name']} declares Rust {member['rust_version']}, but {package} needs {declared[package]}"
            for package in sorted(names & set(declared))
            if version(declared[package]) > version(member["rust_version"])
        ]
    promised = {member["rust_version"] for member in own if member["name"] in LIBRARY}
    if len(promised) > 1:
        wrong.append(f"packages of the library declare different versions of Rust: {', '.join(sorted(promised))}")
    return wrong


def let_chains(own: list[dict]) -> list[str]:
    """Files of the library with chains of `let`; rustfmt refuses them in edition 2021."""
    folders = [Path(member["manifest_path"]).parent / "src" for member in own if member["name"] in LIBRARY]
    files = sorted(str(file) for folder in folders for file in folder.rglob("*.rs"))
    command = ["rustfmt", "--edition", "2021", "--check", "--quiet", *files]
    told = subprocess.run(command, check=False, capture_output=True, text=True).stderr
    places = set(re.findall(r"let chains are only allowed[^\n]*\n\s*--> (\S+)", told))
    return [f"a chain of `let` needs Rust 1.88: {place}" for place in sorted(places)]


def too_many(own: list[dict]) -> list[str]:
    """Dependencies of the library beyond the limit."""
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
    wrong = compiled_twice() + too_new(own, others) + let_chains(own) + too_many(own)
    for line in wrong:
        print(line, file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
