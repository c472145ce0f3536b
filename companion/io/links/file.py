"""A recorded NMEA log as a link: each line comes when the log says (``log_time``), at a chosen speed.

A log without any time comes at a fixed number of lines a second.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final, Self

from .link import Closed, LinkEvent, Opened, Received
from .log_time import timed
from .stream import explain
from .url import LinkConfigError, LinkUrl

_LONGEST_LINE: Final = 4096
_LINES_PER_POLL: Final = 2000


class FileLink:
    """``file:PATH?speed=1&lines_per_s=10&loop=0``: speed 0.01...1000 times the log's own."""

    datagrams = False

    def __init__(self, name: str, path: str, speed: float = 1.0, lines_per_s: float = 10.0, loop: bool = False) -> None:
        self.name = name
        self.path = path
        self._speed = speed
        self._line_us = 1e6 / lines_per_s
        self._loop = loop
        self._file: BinaryIO | None = self._open_file()
        self._schedule: Iterator[tuple[float, bytes]] = iter(())
        self._next: tuple[float, bytes] | None = None
        self._start_us: int | None = None
        self._state = "ready"

    @classmethod
    def check(cls, url: LinkUrl) -> None:
        url.allow("speed", "lines_per_s", "loop")
        url.number("speed", 1.0, 0.01, 1000.0)
        url.number("lines_per_s", 10.0, 0.01, 100_000.0)
        if not Path(url.path()).is_file():
            raise LinkConfigError(f"{url.text}: there is no file {url.path()}; give the path of a recorded NMEA log")

    @classmethod
    def from_url(cls, name: str, url: LinkUrl) -> Self:
        cls.check(url)
        return cls(
            name,
            url.path(),
            url.number("speed", 1.0, 0.01, 1000.0),
            url.number("lines_per_s", 10.0, 0.01, 100_000.0),
            url.choice("loop", "0", {"0": "0", "1": "1"}) == "1",
        )

    def _open_file(self) -> BinaryIO:
        try:
            return Path(self.path).open("rb")
        except OSError as error:
            raise LinkConfigError(f"file:{self.path}: {explain(error)}; give a readable NMEA log") from error

    def _lines(self, file: BinaryIO) -> Iterator[tuple[float, bytes]]:
        """Yield (microseconds after the start, line)."""
        lines = iter(lambda: file.readline(_LONGEST_LINE), b"")
        return ((at_us / self._speed, line) for at_us, line in timed(lines, self._line_us))

    def poll(self, now_us: int) -> list[LinkEvent]:
        events: list[LinkEvent] = []
        if self._file is None:
            return events
        if self._start_us is None:
            self._start_us, self._state = now_us, "playing"
            self._schedule = self._lines(self._file)
            self._next = next(self._schedule, None)
            events.append(Opened(0, self.path))
        due: list[bytes] = []
        try:
            for _ in range(_LINES_PER_POLL):
                if self._next is None or now_us - self._start_us < self._next[0]:
                    break
                due.append(self._next[1])
                self._next = next(self._schedule, None)
        except OSError as error:
            self._next, self._state = None, explain(error)
        if due:
            events.append(Received(0, b"".join(due)))
        if self._next is None:
            self._finish(events)
        return events

    def _finish(self, events: list[LinkEvent]) -> None:
        assert self._file is not None
        events.append(Closed(0, "end of the file" if self._state == "playing" else self._state))
        self._start_us = None
        if self._loop and self._state == "playing":
            self._file.seek(0)
            return
        self._state = "finished"
        self.close()

    def write(self, channel: int, data: bytes) -> int:
        """Take and drop: a recording listens to nobody."""
        return len(data) if channel == 0 and self._start_us is not None else 0

    def filenos(self) -> list[int]:
        return []

    def describe(self) -> str:
        return f"file:{self.path} at {self._speed:g}x ({self._state})"

    def close(self) -> None:
        if self._file is not None:
            self._file.close()
        self._file = None
