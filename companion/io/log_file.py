"""One growing file of a run: bytes are collected, written in one go, and never at the cost of the loop.

With a writer the bytes go to its thread and are forced to the disk; without one (simulation) they are written at
once. A disk error switches the file off, tries again after 30 s, and is reported once.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Final

from .writer import Writer

RETRY_US: Final = 30_000_000
CLOSE_WAIT_S: Final = 1.0
"""How long the end of a run waits for a slow disk, for each file."""
MAX_BUFFER: Final = 8 << 20
EAGER_FLUSH: Final = 256 << 10
FILE_MODE: Final = 0o640
FOLDER_MODE: Final = 0o750
"""Runs and stores tell where a boat goes and who commands it: its owner's and his group's affair, not every account's of the computer."""
ENDS_HERE: Final = "it ends here, a replay goes no further"


def parts_of(path: Path) -> list[Path]:
    """The parts of a file of a run that are there, the oldest first."""
    numbered = re.compile(rf"{re.escape(path.stem)}-(\d{{3,}}){re.escape(path.suffix)}")
    found = [(int(name[1]), part) for part in path.parent.glob("*") if (name := numbered.fullmatch(part.name))]
    return [part for part in (path, *(part for _, part in sorted(found))) if part.is_file()]


def make_own_folder(folder: Path) -> None:
    """Make the folder of a run or a store, and those that lead there, unless they are there. Raises OSError."""
    missing = [above for above in folder.parents if not above.exists()]
    for each in (*reversed(missing), folder):
        each.mkdir(mode=FOLDER_MODE, exist_ok=True)


def sync_folder(folder: Path) -> None:
    """Force the names in a folder to the disk. Raises OSError."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


class LogFile:
    """An append-only file with bounded size.

    ``max_bytes`` rotates to ``stem-001.suffix`` and so on (0: never), ``stop_at_end`` stops instead: there, and where
    anything is lost, for what comes after a gap is of no use. ``header`` begins every part.
    """

    def __init__(
        self,
        path: Path,
        writer: Writer | None,
        report: Callable[[str], None],
        *,
        header: bytes = b"",
        max_bytes: int = 0,
        stop_at_end: bool = False,
    ) -> None:
        self.path = self.first = path
        """The part that is being written, and the first."""
        self.written = 0
        self.dropped = 0
        self.off = False
        """Set from outside to stop writing (free-space floor)."""
        self._writer = writer
        self._report = report
        self._header = header
        self._max_bytes = max_bytes
        self._stop_at_end = stop_at_end
        self.part = 0
        """Number of the part that is being written, from 0."""
        self._parts: list[bytes] = []
        self._size = 0
        self._fd = -1
        self._retry_us = 0
        self._fault = ""
        self._told = ""
        self._ended = ""
        """Why nothing more is taken."""
        self._cut = False
        """What is still on its way is not written either; the writer's."""
        self._header_due = False
        self._good_bytes = -1
        """So long is the file up to its last whole write; -1 unknown."""
        self.sums: dict[str, int | None] = {}
        """Checksum (CRC-32) of each part by its name; None where it was not written from its beginning. The writer's."""

    def add(self, data: bytes) -> None:
        """Collect bytes; ``flush`` writes them."""
        if self._size > MAX_BUFFER or self._ended:
            self._lose(len(data))
            return
        self._parts.append(data)
        self._size += len(data)

    def begin(self, header: bytes) -> None:
        """Set the header and have it written as soon as there is room, with or without anything after it."""
        self._header = header
        self._header_due = True

    def _lose(self, size: int) -> None:
        self.dropped += size
        if self._stop_at_end and size and not self._ended:
            self._ended = self._fault = ENDS_HERE

    @property
    def waiting(self) -> int:
        return self._size

    def flush(self, now_us: int, sync: bool = True, wait_s: float = 0.0) -> None:
        """Hand over what was collected; cheap, never waits with a writer, never raises."""
        if self._fault != self._told:
            self._tell(now_us)
        if not self._parts and not self._header_due:
            return
        owed = self._ended and self._parts  # from before the end; whatever the fault was, nothing comes after it
        if self.off or (self._fault and now_us < self._retry_us and not owed):
            self._drop()
            return
        if self._fault:
            self._retry_us = now_us + RETRY_US
        data = b"".join(self._parts)
        if self._writer is None:
            self._parts.clear()
            self._size = 0
            self._write(data, False)
        elif self._writer.post(lambda: self._write(data, sync), wait_s):
            self._parts.clear()
            self._size = 0

    def _tell(self, now_us: int) -> None:
        self._told = self._fault
        if self._fault:
            self._retry_us = now_us + RETRY_US
            self._report(f"{self.path.name}: {self._fault}")
        else:
            self._report(f"{self.path.name}: writing again")

    def _drop(self) -> None:
        self._lose(self._size)
        self._parts.clear()
        self._size = 0

    def _write(self, data: bytes, sync: bool) -> None:
        if self._cut:
            self.dropped += len(data)
            data = b""
        try:
            if self._max_bytes and self.written + len(data) > self._max_bytes and self.written:
                if self._stop_at_end:
                    self._cut, self._ended = True, f"full: {ENDS_HERE}"
                    self._fault = self._ended
                    return
                self._rotate()
            self._put(data, sync)
            self.written += len(data)
            self._fault = self._ended and (self._fault or self._ended)
        except OSError as error:
            reason = "no space on the disk" if error.errno == errno.ENOSPC else (error.strerror or str(error))
            self.dropped += len(data)
            if self._stop_at_end:
                self._cut, self._ended = True, self._ended or ENDS_HERE
                reason = f"{reason}; {self._ended}"
            self._fault = reason
            with contextlib.suppress(OSError):
                self._take_back()
                if self._good_bytes == 0 and self.path.is_file():
                    self.path.unlink()
            self._close_fd()

    def _put(self, data: bytes, sync: bool) -> None:
        if self._fd < 0:
            self._open(sync)
        if self._header and not self._good_bytes:
            data = self._header + data
        before = 0 if not self._good_bytes else self.sums.get(self.path.name)
        self.sums[self.path.name] = None
        rest = data
        while rest:
            rest = rest[os.write(self._fd, rest) :]
        if sync:
            os.fdatasync(self._fd)
        self._good_bytes += len(data)
        self.sums[self.path.name] = None if before is None else zlib.crc32(data, before)
        self._header_due = False

    def _open(self, sync: bool) -> None:
        if not self.path.parent.exists():
            make_own_folder(self.path.parent)  # or the reason would be that it is missing, and not why
        self._fd = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, FILE_MODE)
        if sync:
            sync_folder(self.path.parent)  # or a power cut may leave no name for the bytes
        self._take_back()
        self._good_bytes = os.fstat(self._fd).st_size

    def _take_back(self) -> None:
        """Cut off half a row, to which the next would be glued."""
        if self._fd >= 0 and 0 <= self._good_bytes < os.fstat(self._fd).st_size:
            os.ftruncate(self._fd, self._good_bytes)

    def _rotate(self) -> None:
        self._close_fd()
        self.part += 1
        self.path = self.path.with_name(
            f"{self.path.name.split('-')[0].split('.')[0]}-{self.part:03d}{self.path.suffix}"
        )
        self.written = 0
        self._good_bytes = -1

    def begin_again(self) -> bool:
        """Write on in a new file when the one that is open was deleted; True when it was. For the writer's thread."""
        if self._fd < 0 or self._is_there():
            return False
        self._close_fd()
        self.written, self._good_bytes = 0, -1
        if self._stop_at_end:
            self._cut, self._ended, self._header_due = True, self._ended or ENDS_HERE, True
            self._fault = self._ended
        return True

    def _is_there(self) -> bool:
        try:
            return os.path.samestat(self.path.stat(), os.fstat(self._fd))
        except FileNotFoundError:
            return False

    def _close_fd(self) -> None:
        fd, self._fd = self._fd, -1
        if fd >= 0:
            with contextlib.suppress(OSError):
                os.close(fd)

    def close(self, now_us: int) -> None:
        """Write the rest and close; the writer, if any, must run on until it is done."""
        self.flush(now_us, wait_s=CLOSE_WAIT_S)
        if self._writer is None or not self._writer.post(self._close_fd, CLOSE_WAIT_S):
            self._close_fd()
