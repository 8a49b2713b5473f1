"""Arguments of command lines that name what is written: checked when they are read, before anything is rendered."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path


def output_file(suffix: str, beside: tuple[str, ...] = ()) -> Callable[[str], Path]:
    """An argparse type: a file whose name ends in ``suffix`` and that can be written, its folder made later if need be.

    Files of the same name that end in ``beside`` can be written, too. A default has to be a string to be checked.
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
    """An argparse type: a folder in which files can be written, made later if need be. A default has to be a string."""
    path = Path(text)
    with _refusing(path):
        _check_folder(path)
    return path


@contextmanager
def _refusing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise argparse.ArgumentTypeError(f"{path} cannot be written: {error.strerror or error}") from error


def _check_file(path: Path) -> None:
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{path} is a folder")
    if path.is_file():
        # Neither changed nor emptied.
        path.open("ab").close()
    elif not path.exists():
        _check_folder(path.parent)


def _check_folder(folder: Path) -> None:
    there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not there.is_dir():
        raise argparse.ArgumentTypeError(f"{there} is no folder")
    # A file without a name leaves nothing behind.
    with tempfile.TemporaryFile(dir=there):
        pass
