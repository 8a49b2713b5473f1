"""Checks the manifests of the workspace, and the library's syntax. Run it in the repository (`make lint`).

- Features: a member built alone must compile every package with the features that the whole workspace gives it.
  Otherwise a build of another member compiles the package and all its dependents again. Features that a member lacks
  are added in crates/unify/Cargo.toml, on which the members depend.
- `rust-version`: no dependency of a member declares a newer Rust than the member. The packages of the library declare
  the same Rust.
- Syntax: the library has no `let` chains, which need Rust 1.88. Clippy's lint `incompatible_msrv`, on by default, finds
  newer functions of the standard library, but no syntax.
- The library has at most DEPENDENCIES_MAX direct dependencies, not counting optional ones and those of one target.

Prints a line on stderr for each violation. Exit status: 0 without violations, 1 otherwise.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

# Members that are built alone, by the kinds of dependencies that the build compiles (`cargo tree --edges`). Those of
# "normal,build" are built by the Makefile. Those of "normal,build,dev" are built with their tests, as
# docs/contributing.md says.
ALONE = {
    "normal,build": ["sunbeam-mitsuba", "sunbeam-cli", "sunbeam-c"],
    "normal,build,dev": ["sunbeam", "sunbeam-height-field", "sunbeam-realtime", "sunbeam-cli", "sunbeam-c"],
}
# Value of the Makefile's variable EARLY: arguments `-p PACKAGE … --features FEATURE` of its first build, which runs
# while pip downloads. It is the first assignment (`:=`) and its additions (`+=`).
EARLY = " ".join(re.findall(r"^EARLY +[:+]= (.*)$", Path("Makefile").read_text(), re.M)).split()
# Packages that make up the library and its C interface.
LIBRARY = ["sunbeam", "sunbeam-c", "sunbeam-fourier", "sunbeam-guard", "sunbeam-height-field", "sunbeam-rigorous"]
# Limit on the library's direct dependencies, equal to their current number, so that every addition is a deliberate one.
DEPENDENCIES_MAX = 15


def tree(edges: str, form: str, *selection: str) -> set[str]:
    """Packages of a build, each in the format `form` of `cargo tree --format`.

    `edges` are the kinds of dependencies, such as "normal,build". `selection` are arguments that select packages.
    """
    command = ["cargo", "tree", "--locked", "--edges", edges, "--prefix", "none", "--no-dedupe", "--format", form]
    listed = subprocess.run([*command, *selection], check=True, capture_output=True, text=True)
    # Cargo marks repeated packages and procedural macros, which would make equal packages differ.
    return {line.replace(" (*)", "").replace(" (proc-macro)", "") for line in listed.stdout.splitlines()}


def features(edges: str, *selection: str) -> set[str]:
    """Packages of a build in the form "NAME VERSION with FEATURES". Arguments are those of `tree`."""
    return tree(edges, "{p} with {f}", *selection)


def compiled_twice() -> list[str]:
    """A line for each package that a member built alone compiles with other features than the whole workspace."""
    builds = [(edges, ["--package", member]) for edges, members in ALONE.items() for member in members]
    builds.append(("normal,build", EARLY))
    together = {edges: features(edges, "--workspace") for edges in ALONE}
    return [
        f"{' '.join(selection)} alone compiles {package}"
        for edges, selection in builds
        for package in sorted(features(edges, *selection) - together[edges])
    ]


def packages() -> tuple[list[dict], list[dict]]:
    """Members of the workspace, and their direct and indirect dependencies, as `cargo metadata` describes packages."""
    command = ["cargo", "metadata", "--locked", "--format-version", "1"]
    found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    members = set(found["workspace_members"])
    own = [package for package in found["packages"] if package["id"] in members]
    return own, [package for package in found["packages"] if package["id"] not in members]


def version(text: str) -> tuple[int, int, int]:
    """A version number such as "1.85", with zeros for omitted parts."""
    parts = [int(part) for part in text.split(".")]
    major, minor, patch = (*parts, 0, 0)[:3]
    return major, minor, patch


def too_new(own: list[dict], others: list[dict]) -> list[str]:
    """A line for each package that declares a newer Rust than a member that needs it; every member declares one.

    There is a further line if the library's packages declare different versions. `own` are the members and `others`
    their dependencies, as `packages` returns them.
    """
    # Declared Rust by "NAME vVERSION", the form of `cargo tree`.
    declared = {
        f"{package['name']} v{package['version']}": package["rust_version"]
        for package in own + others
        if package["rust_version"]
    }
    wrong = []
    for member in own:
        needed = tree("normal,build", "{p}", "--package", member["name"], "--all-features", "--target", "all")
        # Members are listed as "NAME vVERSION (PATH)".
        names = {re.sub(r" \(.*\)$", "", package) for package in needed}
        wrong += [
            f"{member['name']} declares Rust {member['rust_version']}, but {package} needs {declared[package]}"
            for package in sorted(names & set(declared))
            if version(declared[package]) > version(member["rust_version"])
        ]
    library_versions = {member["rust_version"] for member in own if member["name"] in LIBRARY}
    if len(library_versions) > 1:
        listed = ", ".join(sorted(library_versions))
        wrong.append(f"packages of the library declare different versions of Rust: {listed}")
    return wrong


def let_chains(own: list[dict]) -> list[str]:
    """A line for each place in the library with a chain of `let`, which rustfmt refuses in edition 2021."""
    folders = [Path(member["manifest_path"]).parent / "src" for member in own if member["name"] in LIBRARY]
    files = sorted(str(file) for folder in folders for file in folder.rglob("*.rs"))
    command = ["rustfmt", "--edition", "2021", "--check", "--quiet", *files]
    messages = subprocess.run(command, check=False, capture_output=True, text=True).stderr
    places = set(re.findall(r"let chains are only allowed[^\n]*\n\s*--> (\S+)", messages))
    return [f"a chain of `let` needs Rust 1.88: {place}" for place in sorted(places)]


def too_many(own: list[dict]) -> list[str]:
    """A line if the library has more than DEPENDENCIES_MAX direct dependencies."""
    (library,) = [package for package in own if package["name"] == "sunbeam"]
    # The kind is None for normal dependencies, and otherwise "dev" or "build".
    needed = [
        dependency["name"]
        for dependency in library["dependencies"]
        if dependency["kind"] is None and not dependency["optional"] and dependency["target"] is None
    ]
    if len(needed) <= DEPENDENCIES_MAX:
        return []
    return [f"the library has {len(needed)} dependencies, more than {DEPENDENCIES_MAX}: {', '.join(sorted(needed))}"]


def main() -> int:
    """Prints all violations. Returns the exit status."""
    own, others = packages()
    wrong = compiled_twice() + too_new(own, others) + let_chains(own) + too_many(own)
    for line in wrong:
        print(line, file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
