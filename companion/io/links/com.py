"""Serial ports through pyserial alone, for computers without POSIX terminals (``serial:COM5?baud=9600`` on Windows)."""

from __future__ import annotations

import contextlib
from typing import Self

import serial

from .link import Closed, LinkEvent, Opened, Received
from .serial_line import serial_line
from .stream import READ_LIMIT, Backoff
from .url import LinkUrl

_WRITE_S = 1.0


class ComLink:
    """A serial port that is polled. A write waits until the driver has taken it: a radio frame, 65 ms at most at 9600 baud."""

    datagrams = False

    def __init__(self, name: str, path: str, baud: int = 115200, parity: str = "N", stop_bits: int = 1) -> None:
        self.name = name
        self.path = path
        self._line = (baud, parity, stop_bits)
        self._port: serial.Serial | None = None
        self._backoff = Backoff()
        self._fault = ""
        self._shut = False

    @classmethod
    def check(cls, url: LinkUrl) -> None:
        serial_line(url)

    @classmethod
    def from_url(cls, name: str, url: LinkUrl) -> Self:
        return cls(name, *serial_line(url))

    def poll(self, now_us: int) -> list[LinkEvent]:
        if self._shut:
            return []
        if self._port is None:
            return self._try_open(now_us)
        try:
            waiting = min(self._port.in_waiting, READ_LIMIT)
            data = self._port.read(waiting) if waiting else b""
        except (OSError, serial.SerialException) as error:
            return self._lost(str(error), now_us)
        return [Received(0, bytes(data))] if data else []

    def _try_open(self, now_us: int) -> list[LinkEvent]:
        if not self._backoff.due(now_us):
            return []
        baud, parity, stop_bits = self._line
        try:
            self._port = serial.Serial(
                self.path, baud, parity=parity, stopbits=stop_bits, timeout=0, write_timeout=_WRITE_S
            )
        except (OSError, ValueError, serial.SerialException) as error:
            self._fault = str(error)
            self._backoff.failed(now_us)
            return []
        self._fault = ""
        self._backoff.worked()
        return [Opened(0, self.path)]

    def _lost(self, reason: str, now_us: int) -> list[LinkEvent]:
        self._release()
        self._fault = reason
        self._backoff.failed(now_us)
        return [Closed(0, reason)]

    def write(self, channel: int, data: bytes) -> int:
        if self._port is None or channel != 0:
            return 0
        try:
            return int(self._port.write(data) or 0)
        except (OSError, serial.SerialException):
            return 0

    def filenos(self) -> list[int]:
        """Nothing to select on: the loop polls at each tick."""
        return []

    def describe(self) -> str:
        state = "open" if self._port is not None else self._fault or "closed"
        return f"{self.path} {self._line[0]} ({state})"

    def close(self) -> None:
        self._shut = True
        self._release()

    def _release(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            with contextlib.suppress(OSError, serial.SerialException):
                port.close()
