"""Runs the command line tool `sunbeam` from Python."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from .environment import REPOSITORY, SetupError

# Path of the executable: the environment variable SUNBEAM, or the checkout's release build.
TOOL = Path(os.environ.get("SUNBEAM", REPOSITORY / "target" / "release" / "sunbeam"))


def sunbeam(*words, tool: Path = TOOL, stdin: str | None = None) -> str:
    """Runs `sunbeam` and returns its standard output.

    `words` are the arguments, at least one, such as strings, numbers and paths. `stdin` is the text of the standard
    input. Raises SetupError where the command is missing or fails.
    """
    if not tool.exists():
        raise SetupError(f"the command line tool {tool} is missing: run `make tool`")
    done = subprocess.run([str(tool), *map(str, words)], input=stdin, capture_output=True, text=True)
    if done.returncode != 0:
        raise SetupError(f"`sunbeam {words[0]}` failed: {done.stderr.strip() or done.returncode}")
    return done.stdout
