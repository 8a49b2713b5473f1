"""The folder of a sweep: results that are written whole, read back, and never shared by two sweeps at once.

``results/`` holds a JSON file a case, with its settings, version, the input's checksum and the time; ``pictures/`` the
pictures. Both are divided by the first two digits of the case's identity, since folders with 10⁵ files are slow.
"""

from __future__ import annotations

import json
import os
import shutil
import socket
import time
import uuid
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any, cast

from filelock import FileLock, Timeout

from .errors import SweepError

#: What the table, the sheet and the summary are called.
TABLE, TIMES, SHEET, SUMMARY = "sweep.parquet", "times.parquet", "index.html", "sweep.json"
_FOLDERS = ("results", "pictures")
_LOCK = ".lock"
# A file that was not finished is left by a worker that died; no write takes so many seconds.
_ABANDONED_SECONDS = 600.0


class StoreError(Exception):
    """A result cannot be written: a full disk, a quota, a folder without permission. The message is one line."""


def write_whole(path: Path, content: bytes) -> None:
    """Writes a file under a temporary name and renames it, so that no reader ever sees half of it.

    Raises :class:`StoreError`; nothing is left behind then.
    """
    part = path.with_name(f".{path.name}.{socket.gethostname()}.{os.getpid()}.{uuid.uuid4().hex[:8]}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(content)
        os.replace(part, path)
    except OSError as error:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error


def picture_name(identity: str, ending: str) -> str:
    """A picture's name below the sweep's folder."""
    return f"pictures/{identity[:2]}/{identity}-{ending}"


def result_path(folder: Path, identity: str) -> Path:
    """Where the result of a case is."""
    return folder / "results" / identity[:2] / f"{identity}.json"


def write_result(folder: Path, record: Mapping[str, Any], pictures: Mapping[str, bytes]) -> None:
    """Writes the pictures, then the record: where that is, all is. Raises :class:`StoreError`."""
    identity = record["identity"]
    sizes = {}
    for ending, content in pictures.items():
        write_whole(folder / picture_name(identity, ending), content)
        sizes[ending] = len(content)
    text = json.dumps({**record, "pictures": sizes}, allow_nan=False, sort_keys=True)
    write_whole(result_path(folder, identity), text.encode())


def read_result(folder: Path, identity: str) -> dict[str, Any] | None:
    """The record of a case, or nothing where there is none, or not all of it."""
    try:
        record = json.loads(result_path(folder, identity).read_bytes())
    except (OSError, ValueError):
        return None
    if not isinstance(record, dict) or record.get("identity") != identity:
        return None
    for ending, size in record["pictures"].items():
        try:
            if os.stat(folder / picture_name(identity, ending)).st_size != size:
                return None
        except OSError:
            return None
    return cast("dict[str, Any]", record)


def input_of(path: Path) -> dict[str, Any]:
    """Checksum, size and time of change of a file. Raises ``OSError``."""
    status = os.stat(path)
    digest = _checksum(str(path), status.st_size, status.st_mtime_ns)
    return {"sha256": digest, "bytes": status.st_size, "mtime_ns": status.st_mtime_ns}


@lru_cache(maxsize=4096)
def _checksum(path: str, size: int, mtime_ns: int) -> str:
    digest = sha256()
    with open(path, "rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def is_current(record: Mapping[str, Any], path: Path | None) -> bool:
    """Whether the input file is what it was: of the same size and time, or else of the same checksum."""
    known = record.get("input")
    if path is None:
        return True
    if known is None:
        # It could not be read then.
        return not path.exists()
    try:
        status = os.stat(path)
        if (status.st_size, status.st_mtime_ns) == (known["bytes"], known["mtime_ns"]):
            return True
        return bool(input_of(path)["sha256"] == known["sha256"])
    except OSError:
        return False


def _can_hold_files(folder: Path) -> bool:
    return not folder.exists() or (folder.is_dir() and os.access(folder, os.W_OK | os.X_OK))


class Store:
    """The folder, held by this process alone from ``open`` to ``close``."""

    def __init__(self, folder: Path):
        self.folder = folder
        self._lock = FileLock(str(folder / _LOCK))

    def open(self, fresh: bool) -> None:
        """Takes the folder, making it where it is missing; ``fresh`` removes what an earlier sweep left in it.

        Raises :class:`SweepError` where another sweep has it, where it holds other things, and where it cannot be
        written.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._lock.acquire(timeout=0)
        except Timeout:
            raise SweepError(
                f"another sweep is writing to {self.folder}; wait for it, or name another output"
            ) from None
        except OSError as error:
            raise SweepError(f"{self.folder} cannot be written: {error.strerror or error}") from error
        own = {*_FOLDERS, TABLE, TIMES, SHEET, SUMMARY, _LOCK}
        others = [entry.name for entry in os.scandir(self.folder) if entry.name not in own]
        others = [name for name in others if not (name.startswith(".") and name.endswith(".part"))]
        if others and not (self.folder / SUMMARY).exists():
            self.close()
            raise SweepError(f"{self.folder} holds other things ({others[0]}); name an empty or a new folder as output")
        self._check_places()
        if fresh:
            for name in _FOLDERS:
                shutil.rmtree(self.folder / name, ignore_errors=True)
            for name in (TABLE, TIMES, SHEET, SUMMARY):
                (self.folder / name).unlink(missing_ok=True)
        self._remove_abandoned()

    def _check_places(self) -> None:
        """Refuses what is in the way of a file or a folder of the sweep, which would else be told after hours."""
        blocked = [name for name in (TABLE, TIMES, SHEET, SUMMARY) if (self.folder / name).is_dir()]
        blocked += [name for name in _FOLDERS if not _can_hold_files(self.folder / name)]
        if blocked:
            self.close()
            raise SweepError(f"{self.folder / blocked[0]} cannot be written; remove it, or name another output")

    def close(self) -> None:
        """Gives the folder back."""
        self._lock.release()

    def _remove_abandoned(self) -> None:
        oldest = time.time() - _ABANDONED_SECONDS
        for part in [*self.folder.glob(".*.part"), *self.folder.glob("*/*/.*.part")]:
            try:
                if part.stat().st_mtime < oldest:
                    part.unlink()
            except OSError:
                continue
