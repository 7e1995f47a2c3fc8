"""Writing to a disk that may be full: whole lines or nothing, whole files or nothing, and a reserve.

A run folder stays readable whatever happens. Logs lose a half line at once; other files appear under
their name only when they are complete; and room for the files written at the end is set aside at the
start, so that a disk that fills up during the run still takes what was recorded.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import NoReturn

from xgv_cosim.errors import RecordingError

MIB = 1 << 20
_NEW_FILE = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0)
_ANY_FILE = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_CLOEXEC", 0)


def fail(path: Path, error: OSError, remains: str) -> NoReturn:
    """Raise a ``RecordingError`` that names the file, the reason and what remains readable."""
    reason = error.strerror or str(error)
    raise RecordingError(f"cannot write {path}: {reason}. {remains}") from error


def write_all(descriptor: int, data: bytes) -> None:
    """Write every byte of ``data``; the system may take it in several parts."""
    view = memoryview(data)
    while view:
        view = view[os.write(descriptor, view) :]


def write_whole_file(path: Path, data: bytes) -> None:
    """Write ``data`` under a temporary name and rename it to ``path``, so that no half file shows.

    Raises:
        OSError: The disk is full or the folder cannot be written; ``path`` is as it was before.
    """
    draft = path.with_name(f".{path.name}.part")
    try:
        descriptor = os.open(draft, _ANY_FILE, 0o644)
        try:
            write_all(descriptor, data)
            os.fsync(descriptor)  # a full disk may show only when the data leave the cache
        finally:
            os.close(descriptor)
        draft.replace(path)
    except OSError:
        with contextlib.suppress(OSError):  # the first error is the one to report
            draft.unlink(missing_ok=True)
        raise


class LineLog:
    """A text file that grows line by line and never ends in half a line.

    Each line is handed to the system at once, so that another process can read it at any moment.

    Args:
        path: A file that does not exist yet.

    Raises:
        OSError: The file cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._descriptor: int | None = os.open(path, _NEW_FILE, 0o644)
        self._size = 0

    def append(self, line: str) -> None:
        """Append ``line`` and a line feed.

        Raises:
            OSError: The line could not be written; the file ends after the line before.
        """
        if self._descriptor is None:
            raise RecordingError(f"cannot write {self.path}: the recording is closed")
        data = line.encode() + b"\n"
        try:
            write_all(self._descriptor, data)
        except OSError:
            os.ftruncate(self._descriptor, self._size)
            os.lseek(self._descriptor, self._size, os.SEEK_SET)
            raise
        self._size += len(data)

    def close(self) -> None:
        """Close the file; does nothing when it is closed."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None


class Reserve:
    """Room on the disk, to be given up when the disk is full.

    It is held by a file without a name, so that the system gives it back even if the process dies.

    Args:
        path: Where the file shows for a moment while it is made.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.size_bytes = 0
        self._descriptor: int | None = None

    def hold(self, num_bytes: int) -> None:
        """Make the reserve at least ``num_bytes`` large; it never shrinks.

        Raises:
            OSError: There is not that much room; the reserve stays as large as it was.
        """
        if num_bytes <= self.size_bytes:
            return
        if self._descriptor is None:
            self._descriptor = os.open(self.path, _NEW_FILE, 0o600)
            self.path.unlink()
        try:
            _allocate(self._descriptor, self.size_bytes, num_bytes)
        except OSError:
            os.ftruncate(self._descriptor, self.size_bytes)
            raise
        self.size_bytes = num_bytes

    def give_up(self) -> bool:
        """Free the room; return whether there was any."""
        freed = self.size_bytes > 0
        self.size_bytes = 0
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None
        return freed


def _allocate(descriptor: int, start: int, end: int) -> None:
    """Really occupy the bytes from ``start`` to ``end`` (a hole in the file would reserve nothing)."""
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(descriptor, start, end - start)
        return
    os.lseek(descriptor, start, os.SEEK_SET)
    write_all(descriptor, bytes(end - start))
    os.fsync(descriptor)
