"""One growing file of a run: bytes are collected, written in one go, and never at the cost of the loop.

With a writer the bytes go to its thread and are forced to the disk; without one (simulation) they are written at
once. A disk error switches the file off, tries again after 30 s, and is reported once.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

from companion.io.writer import Writer

RETRY_US: Final = 30_000_000
CLOSE_WAIT_S: Final = 1.0
"""How long the end of a run waits for a slow disk, for each file."""
MAX_BUFFER: Final = 8 << 20
EAGER_FLUSH: Final = 256 << 10


def parts_of(path: Path) -> list[Path]:
    """The parts of a file of a run that are there, the oldest first."""
    numbered = re.compile(rf"{re.escape(path.stem)}-(\d{{3,}}){re.escape(path.suffix)}")
    found = [(int(name[1]), part) for part in path.parent.glob("*") if (name := numbered.fullmatch(part.name))]
    return [part for part in (path, *(part for _, part in sorted(found))) if part.is_file()]


def sync_folder(folder: Path) -> None:
    """Force the names in a folder to the disk. Raises OSError."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


class LogFile:
    """An append-only file with bounded size.

    ``max_bytes`` rotates to ``stem-001.suffix`` and so on (0: never), ``stop_at_end`` stops instead. ``header`` begins
    every part.
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
        self.path = path
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
        self._ended = False

    def add(self, data: bytes) -> None:
        """Collect bytes; ``flush`` writes them."""
        if self._size > MAX_BUFFER or self._ended:
            self.dropped += len(data)
            return
        self._parts.append(data)
        self._size += len(data)

    @property
    def waiting(self) -> int:
        return self._size

    def flush(self, now_us: int, sync: bool = True, wait_s: float = 0.0) -> None:
        """Hand over what was collected; cheap, never waits with a writer, never raises."""
        if self._fault != self._told:
            self._tell(now_us)
        if not self._parts:
            return
        if self.off or (self._fault and now_us < self._retry_us):
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
        self.dropped += self._size
        self._parts.clear()
        self._size = 0

    def _write(self, data: bytes, sync: bool) -> None:
        try:
            if self._max_bytes and self.written + len(data) > self._max_bytes and self.written:
                if self._stop_at_end:
                    self._ended = True
                    self._fault = "full: recording stopped"
                    return
                self._rotate()
            if self._fd < 0:
                self._fd = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o644)
                if sync:
                    sync_folder(self.path.parent)  # or a power cut may leave no name for the bytes
                if self._header and os.fstat(self._fd).st_size == 0:
                    data = self._header + data
            view = memoryview(data)
            while view:
                view = view[os.write(self._fd, view) :]
            self.written += len(data)
            if sync:
                os.fdatasync(self._fd)
            self._fault = ""
        except OSError as error:
            self._fault = "no space on the disk" if error.errno == errno.ENOSPC else (error.strerror or str(error))
            self.dropped += len(data)
            self._close_fd()

    def _rotate(self) -> None:
        self._close_fd()
        self.part += 1
        self.path = self.path.with_name(
            f"{self.path.name.split('-')[0].split('.')[0]}-{self.part:03d}{self.path.suffix}"
        )
        self.written = 0

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
