"""Serial ports: opened by pyserial, read and written on the bare descriptor, never waiting.

pyserial's own ``write`` can spin on a full buffer and its ``flush`` can wait for ever, so only its opening and its
settings are used. The port is held exclusively; a second program gets told who holds it. A stable name (by-id, a
udev link) is resolved anew at every opening and watched while open, so that a device that comes back under another
number is found (fault rows 8, 9, 18).
"""

from __future__ import annotations

import contextlib
import errno
import os
import termios
from pathlib import Path
from typing import Final, Self

import serial

from .serial_line import serial_line
from .stream import StreamLink
from .url import LinkUrl

_WATCH_US: Final = 500_000


class SerialLink(StreamLink):
    """``serial:/dev/ttyUSB0?baud=115200&parity=N&stop=1`` or just ``/dev/ttyS0``."""

    def __init__(
        self, name: str, path: str, baud: int = 115200, parity: str = "N", stop_bits: int = 1, silence_s: float = 0.0
    ) -> None:
        super().__init__(name, f"{path} {baud} 8{parity}{stop_bits}", silence_s)
        self.path = path
        self.baud = baud
        self.parity = parity
        self.stop_bits = stop_bits
        self._port: serial.Serial | None = None
        self._watch_us = 0
        self._tried: int | None = None

    @classmethod
    def check(cls, url: LinkUrl) -> None:
        cls._arguments(url)

    @classmethod
    def from_url(cls, name: str, url: LinkUrl) -> Self:
        return cls(name, *cls._arguments(url))

    @staticmethod
    def _arguments(url: LinkUrl) -> tuple[str, int, str, int, float]:
        return *serial_line(url), url.number("silence", 0.0, 0.0, 3600.0)

    def _device(self) -> int | None:
        try:
            return Path(self.path).stat().st_rdev
        except OSError:
            return None

    def _appeared(self) -> bool:
        device = self._device()
        return device is not None and device != self._tried

    def _connect(self, now_us: int) -> bool:
        self._tried = self._device()
        try:
            self._port = self._open_port(self.parity, self.stop_bits)
        except termios.error as error:
            # A pseudo-terminal has no line: it refuses parity, and carries the bytes all the same.
            if not os.path.realpath(self.path).startswith("/dev/pts/"):
                raise OSError(error.args[0], f"settings refused: {error.args[-1]}") from error
            self._port = self._open_port("N", 1)
        self._fd = self._port.fileno()
        os.set_blocking(self._fd, False)
        with contextlib.suppress(termios.error):
            settings = termios.tcgetattr(self._fd)
            # With VMIN 0 "nothing there" and "unplugged" both read as empty.
            settings[6][termios.VMIN] = 1
            termios.tcsetattr(self._fd, termios.TCSANOW, settings)
        self._watch_us = now_us + _WATCH_US
        return True

    def _open_port(self, parity: str, stop_bits: int) -> serial.Serial:
        try:
            return serial.Serial(
                self.path, self.baud, parity=parity, stopbits=stop_bits, timeout=0, write_timeout=None, exclusive=True
            )
        except serial.SerialException as error:
            if error.errno in (errno.EAGAIN, errno.EWOULDBLOCK) or "lock" in str(error).lower():
                raise OSError(errno.EBUSY, f"in use by {holder_of(self.path)}") from error
            raise OSError(error.errno or errno.EIO, os.strerror(error.errno) if error.errno else str(error)) from error
        except ValueError as error:
            raise OSError(errno.EINVAL, str(error)) from error

    def _changed(self, now_us: int) -> str:
        if now_us < self._watch_us:
            return ""
        self._watch_us = now_us + _WATCH_US
        device = self._device()
        if device is None:
            return "the device is gone"
        return "" if device == os.fstat(self._fd).st_rdev else "the name points at another device"

    def _release(self) -> None:
        port, self._port, self._fd = self._port, None, -1
        if port is not None:
            with contextlib.suppress(OSError, termios.error):
                port.close()


def holder_of(path: str) -> str:
    """Name the process that has ``path`` open, as far as this user may see."""
    target = os.path.realpath(path)
    for process in Path("/proc").glob("[0-9]*"):
        if process.name == str(os.getpid()):
            continue
        with contextlib.suppress(OSError):
            if any(os.path.realpath(fd) == target for fd in (process / "fd").iterdir()):
                return f"process {process.name} ({(process / 'comm').read_text().strip()})"
    return "another program"
