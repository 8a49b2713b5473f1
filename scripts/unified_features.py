"""Tells which packages members of the workspace would compile with other features alone than all members together.

Such a package is compiled once more whenever another member is built; crates/unify/Cargo.toml asks for what is missing.
"""

from __future__ import annotations

import subprocess
import sys

# Those that the Makefile builds alone.
ALONE = ["sunbeam-mitsuba", "sunbeam-cli", "sunbeam-c"]


def features(*selection: str) -> set[str]:
    """The packages of a build, each with its features."""
    command = ["cargo", "tree", "--locked", "--edges", "normal,build", "--prefix", "none", "--no-dedupe"]
    listed = subprocess.run(
        [*command, "--format", "{p} with {f}", *selection], check=True, capture_output=True, text=True
    )
    return {line.replace(" (*)", "").replace(" (proc-macro)", "") for line in listed.stdout.splitlines()}


def main() -> int:
    together = features("--workspace")
    found = {member: sorted(features("--package", member) - together) for member in ALONE}
    for member, packages in found.items():
        for package in packages:
            print(f"{member} alone compiles {package}", file=sys.stderr)
    return 1 if any(found.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
