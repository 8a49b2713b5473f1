"""The output folder of a sweep: results are written atomically, and a lock admits one sweep at a time.

A *case* is a surface under a setting, a row of the table of results. The *driver* is the process that runs the sweep
and holds the lock; its *workers* compute cases and write results.

``results/`` has a JSON file for each case, its record (work.record_of), and ``pictures/`` its pictures. Files are in
subfolders named by the first two digits of the case's identity, since folders with 10⁵ files are slow.

``sweep.json``, which is written before any result, marks a folder as a sweep's. Nothing is deleted or replaced in other
folders. In a sweep's folder only files with the names below are deleted.
"""

from __future__ import annotations

import json
import os
import re
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

#: File name of the table of results.
TABLE = "sweep.parquet"
#: File name of the table of computing times.
TIMES = "times.parquet"
#: File name of the contact sheet.
SHEET = "index.html"
#: File name of the summary, which also marks the folder as a sweep's.
SUMMARY = "sweep.json"
# Files that the driver writes after the cases.
_FILES = (TABLE, TIMES, SHEET)
# Folders that the workers write to.
_FOLDERS = ("results", "pictures")
# Names of the files that workers write: records, pictures and unfinished files (write_whole). An identity has 20
# hexadecimal digits (spec.py).
_WORKER_FILE = re.compile(r"[0-9a-f]{20}(\.json|-.+)|\..+\.part")
# File name of the lock.
_LOCK = ".lock"
# Age in seconds from which an unfinished file is removed. No write takes this long, so its worker has died.
_ABANDONED_SECONDS = 600.0


class StoreError(Exception):
    """A result cannot be written (full disk, quota, missing permission). The message is one line."""


def write_whole(path: Path, content: bytes) -> None:
    """Writes a file under a temporary name and renames it, so that readers see all of it or nothing.

    Its folder is created where it is missing. Raises :class:`StoreError` where writing fails.
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


def picture_path(identity: str, ending: str) -> str:
    """Path of a picture relative to the sweep's folder. ``ending``, such as ``map.exr``, is unique within a case."""
    return f"pictures/{identity[:2]}/{identity}-{ending}"


def result_path(folder: Path, identity: str) -> Path:
    """Path of a case's record in the sweep's folder."""
    return folder / "results" / identity[:2] / f"{identity}.json"


def write_result(folder: Path, record: Mapping[str, Any], pictures: Mapping[str, bytes]) -> None:
    """Writes the pictures by their endings, then the record, which marks the case as finished.

    In the stored record the key ``pictures`` has their sizes in bytes by ending. Raises :class:`StoreError` where
    writing fails.
    """
    identity = record["identity"]
    sizes = {}
    for ending, content in pictures.items():
        write_whole(folder / picture_path(identity, ending), content)
        sizes[ending] = len(content)
    text = json.dumps({**record, "pictures": sizes}, allow_nan=False, sort_keys=True)
    write_whole(result_path(folder, identity), text.encode())


def read_result(folder: Path, identity: str) -> dict[str, Any] | None:
    """Reads the record of a case; ``None`` where the record or one of its pictures is missing or damaged."""
    try:
        record = json.loads(result_path(folder, identity).read_bytes())
    except (OSError, ValueError):
        return None
    if not isinstance(record, dict) or record.get("identity") != identity:
        return None
    pictures = record.get("pictures")
    if not isinstance(pictures, dict):
        return None
    for ending, size in pictures.items():
        try:
            if os.stat(folder / picture_path(identity, ending)).st_size != size:
                return None
        except OSError:
            return None
    return cast("dict[str, Any]", record)


def input_of(path: Path) -> dict[str, Any]:
    """Checksum, size and modification time of an input file, for the record's key ``input``. Raises ``OSError``."""
    status = os.stat(path)
    digest = _checksum(str(path), status.st_size, status.st_mtime_ns)
    return {"sha256": digest, "bytes": status.st_size, "mtime_ns": status.st_mtime_ns}


@lru_cache(maxsize=4096)
def _checksum(path: str, size: int, mtime_ns: int) -> str:
    """SHA-256 of a file in hexadecimal digits. Size and modification time are only parts of the cache key."""
    digest = sha256()
    with open(path, "rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def is_current(record: Mapping[str, Any], path: Path | None) -> bool:
    """Whether the input file at ``path`` is unchanged since the record was written: by size and time, or by checksum.

    ``path`` is ``None`` for a case without a file. A file that could not be read when the record was written, and still
    cannot be read, counts as unchanged.
    """
    recorded = record.get("input")
    if path is None:
        return True
    try:
        status = os.stat(path)
        if recorded is None:
            return False
        if (status.st_size, status.st_mtime_ns) == (recorded["bytes"], recorded["mtime_ns"]):
            return True
        return bool(input_of(path)["sha256"] == recorded["sha256"])
    except OSError:
        return recorded is None


def _can_hold_files(folder: Path) -> bool:
    """Whether the path is free, or a folder in which this process can create files."""
    return not folder.exists() or (folder.is_dir() and os.access(folder, os.W_OK | os.X_OK))


class Store:
    """The sweep's folder, locked for this process from ``open`` to ``close``."""

    def __init__(self, folder: Path):
        self.folder = folder
        self._lock = FileLock(str(folder / _LOCK))

    def close(self) -> None:
        """Unlocks the folder."""
        self._lock.release()

    def open(self, fresh: bool) -> None:
        """Locks the folder and creates it where it is missing; ``fresh`` removes an earlier sweep's results.

        Raises :class:`SweepError` where another sweep has locked the folder, where it is not empty and not a sweep's,
        and where it cannot be written. The folder is then not locked by this process.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._lock.acquire(timeout=0)
            self._check_writable()
            self._check_owner()
            if fresh:
                self._remove_results()
            self._remove_abandoned()
        except Timeout:
            raise SweepError(
                f"another sweep is writing to {self.folder}; wait for it, or name another output"
            ) from None
        except OSError as error:
            self.close()
            raise SweepError(f"{self.folder} cannot be written: {error.strerror or error}") from error
        except BaseException:
            self.close()
            raise

    def _check_writable(self) -> None:
        """Raises :class:`SweepError` where a file or folder of the sweep could not be written.

        Reasons are a folder with the name of a file, a file with the name of a folder, and a read-only folder. The
        check comes before hours of work.
        """
        blocked = [name for name in (*_FILES, SUMMARY) if (self.folder / name).is_dir()]
        blocked += [name for name in _FOLDERS if not _can_hold_files(self.folder / name)]
        if blocked:
            raise SweepError(f"{self.folder / blocked[0]} cannot be written; remove it, or name another output")

    def _check_owner(self) -> None:
        """Raises :class:`SweepError` where the folder has files that no sweep wrote, and no summary of a sweep."""
        if (self.folder / SUMMARY).exists():
            return
        # A sweep that died before it wrote its summary leaves its lock and unfinished files.
        names = [entry.name for entry in os.scandir(self.folder)]
        others = [name for name in names if name != _LOCK and not (name.startswith(".") and name.endswith(".part"))]
        if others:
            raise SweepError(
                f"{self.folder} holds other things ({others[0]}) and no {SUMMARY} of a sweep; "
                "name an empty or a new folder as output"
            )

    def _remove_results(self) -> None:
        """Removes records, pictures, tables and sheet. The summary stays, and so do files that no sweep wrote."""
        for name in _FOLDERS:
            for file in list(self.folder.glob(f"{name}/[0-9a-f][0-9a-f]/*")):
                if _WORKER_FILE.fullmatch(file.name):
                    file.unlink(missing_ok=True)
            for folder in [*self.folder.glob(f"{name}/[0-9a-f][0-9a-f]"), self.folder / name]:
                # Folders that still hold files stay.
                with suppress(OSError):
                    folder.rmdir()
        for name in _FILES:
            (self.folder / name).unlink(missing_ok=True)

    def _remove_abandoned(self) -> None:
        """Removes unfinished files (write_whole) that dead workers left."""
        oldest_kept = time.time() - _ABANDONED_SECONDS
        unfinished = [*self.folder.glob(".*.part")]
        for name in _FOLDERS:
            unfinished += self.folder.glob(f"{name}/*/.*.part")
        for part in unfinished:
            try:
                if part.stat().st_mtime < oldest_kept:
                    part.unlink()
            except OSError:
                # Another process has removed it, or it cannot be removed and does no harm.
                continue
