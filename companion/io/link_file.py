"""A recorded NMEA log as a link: each line comes when its own time stamp says, at a chosen speed.

Lines without a time of day belong to the epoch before them. A gap longer than a minute, or a step back, is taken as
one second, so that a joined log does not stall. A log without any time comes at a fixed number of lines a second.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final, Self

from companion.io.link import Closed, LinkEvent, Opened, Received
from companion.io.link_stream import explain
from companion.io.link_url import LinkConfigError, LinkUrl

_DAY_US: Final = 86_400_000_000
_LONGEST_GAP_US: Final = 60_000_000
_STEP_US: Final = 1_000_000
_LONGEST_LINE: Final = 4096
_LINES_PER_POLL: Final = 2000
_TIME: Final = re.compile(
    rb"\$(?:..(?:GGA|RMC|ZDA|GNS|GST),|..GLL,[^,]*,[^,]*,[^,]*,[^,]*,)(\d\d)(\d\d)(\d\d)(\.\d{1,6})?[,*]"
)


def time_of_day_us(line: bytes) -> int | None:
    """Return the UTC time of day that an NMEA line carries, microseconds, or None."""
    found = _TIME.search(line)
    if found is None:
        return None
    hours, minutes, seconds = int(found[1]), int(found[2]), int(found[3])
    if hours > 23 or minutes > 59 or seconds > 60:
        return None
    return (hours * 3600 + minutes * 60 + seconds) * 1_000_000 + round(float(found[4] or 0) * 1e6)


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
        at_us, last, timed = 0.0, None, False
        while line := file.readline(_LONGEST_LINE):
            stamp = time_of_day_us(line)
            if stamp is not None:
                timed = True
                if last is not None:
                    gap_us = (stamp - last) % _DAY_US
                    at_us += gap_us if gap_us <= _LONGEST_GAP_US else _STEP_US
                last = stamp
            elif not timed:
                at_us += self._line_us
            yield at_us / self._speed, line

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
