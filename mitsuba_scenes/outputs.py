"""Argparse types of output files and folders, which are checked before anything is rendered.

Argparse applies a type to a default only if it is a string. Defaults are given as strings, so they are checked, too.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path


def output_file(suffix: str, beside: tuple[str, ...] = ()) -> Callable[[str], Path]:
    """An argparse type: a writable file whose name ends in `suffix`, such as ".exr"; its folder may be created later.

    `suffix` is in lower case; names may have it in upper case. Files of the same name with the endings `beside`, such
    as ".png", must be writable, too.
    """

    def convert(text: str) -> Path:
        path = Path(text)
        if path.suffix.lower() != suffix:
            raise argparse.ArgumentTypeError(f"the name of {path} must end in {suffix}")
        for written in (path, *(path.with_suffix(other) for other in beside)):
            with _refusing(written):
                _check_file(written)
        return path

    return convert


def output_folder(text: str) -> Path:
    """An argparse type: a writable folder, which may be created later."""
    path = Path(text)
    with _refusing(path):
        _check_folder(path)
    return path


@contextmanager
def _refusing(path: Path) -> Iterator[None]:
    """Turns an OSError within the context into argparse's one-line error about `path`."""
    try:
        yield
    except OSError as error:
        raise argparse.ArgumentTypeError(f"{path} cannot be written: {error.strerror or error}") from error


def _check_file(path: Path) -> None:
    """Raises OSError or ArgumentTypeError unless `path` can be written or created; devices are not checked."""
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{path} is a folder")
    if path.is_file():
        # Appending checks permission without changing the file.
        path.open("ab").close()
    elif not path.exists():
        _check_folder(path.parent)


def _check_folder(folder: Path) -> None:
    """Raises OSError or ArgumentTypeError unless `folder`, or its nearest existing parent, is writable."""
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not existing.is_dir():
        raise argparse.ArgumentTypeError(f"{existing} is no folder")
    # A temporary file checks permission and leaves nothing behind.
    with tempfile.TemporaryFile(dir=existing):
        pass
