"""When each line of a recorded NMEA log came: by the logger's own stamp, else by the UTC in its sentences.

A logger's stamp stands at the beginning of a line (ISO 8601, seconds or milliseconds since 1970) or in a TAG block (NMEA 0183
v4, ``\\c:...*hh\\``). Without one the sentences' UTC tells: each talker and sentence has a clock of its own, since on one line
devices differ by a second and more. A gap longer than a minute is taken as one second, so that a joined log does not stall.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from typing import Final

_DAY_US: Final = 86_400_000_000
_HALF_DAY_US: Final = _DAY_US // 2
_LONGEST_GAP_US: Final = 60_000_000
_STEP_US: Final = 1_000_000
_BACK_US: Final = 3_000_000
"""A clock this far behind its own earlier readings has been set back; less is jitter between the devices of one line."""
_ADDRESSES_MAX: Final = 64
_TIME: Final = re.compile(
    rb"\$(..(?:GGA|RMC|ZDA|GNS|GST|GBS)|PASHR|PSAT,HPR|..GLL)(?:(?<=GLL),[^,]*,[^,]*,[^,]*,[^,]*|),"
    rb"(\d\d)(\d\d)(\d\d)(\.\d{1,6})?[,*]"
)
_ISO: Final = re.compile(rb"^\W?(\d{4}-\d\d-\d\d)[T ](\d\d:\d\d:\d\d)([.,]\d{1,9})?")
_EPOCH: Final = re.compile(rb"^[(\[]?(\d{9,10}\.\d{1,9}|\d{12,13}|\d{10})[)\]]?[;:,\s]")
_TAG: Final = re.compile(rb"^\\[^\\]*\bc:(\d{9,13})[,*]")


def _of_day_us(found: re.Match[bytes]) -> int | None:
    hours, minutes, seconds = int(found[2]), int(found[3]), int(found[4])
    if hours > 23 or minutes > 59 or seconds > 60:
        return None
    return (hours * 3600 + minutes * 60 + seconds) * 1_000_000 + round(float(found[5] or 0) * 1e6)


def logger_stamp_us(line: bytes) -> int | None:
    """Return the stamp that a logger put before a sentence, microseconds since 1970, or None."""
    if (found := _ISO.match(line)) is not None:
        try:
            moment = datetime.fromisoformat(f"{found[1].decode()}T{found[2].decode()}").replace(tzinfo=UTC)
        except ValueError:
            return None
        fraction = (found[3] or b".0")[1:].decode()
        return round(moment.timestamp()) * 1_000_000 + round(float(f"0.{fraction}") * 1e6)
    found = _TAG.match(line) or _EPOCH.match(line)
    if found is None:
        return None
    text = found[1].decode()
    return round(float(text) * (1e3 if len(text) >= 12 and "." not in text else 1e6))


class LogClock:
    """Takes the lines in order and tells when each came, microseconds after the first."""

    def __init__(self, line_us: float) -> None:
        """``line_us``: time of a line of a log that has no time at all, or none yet."""
        self._line_us = line_us
        self._at_us = 0.0
        self._stamp_us: int | None = None
        self._clocks: dict[bytes, float] = {}
        """For each talker and sentence: what its time of day lacks to the log's own time."""

    def at_us(self, line: bytes) -> float:
        stamp_us = logger_stamp_us(line)
        if stamp_us is not None:
            if self._stamp_us is not None:
                self._at_us += self._gap(stamp_us - self._stamp_us)
            self._stamp_us = stamp_us
        elif self._stamp_us is None:
            self._by_utc(line)
        return self._at_us

    @staticmethod
    def _gap(gap_us: int) -> int:
        if gap_us < 0:
            return 0
        return gap_us if gap_us <= _LONGEST_GAP_US else _STEP_US

    def _by_utc(self, line: bytes) -> None:
        found = _TIME.search(line)
        time_us = None if found is None else _of_day_us(found)
        if found is None or time_us is None:
            if not self._clocks:
                self._at_us += self._line_us
            return
        lacks_us = self._clocks.get(found[1])
        new = lacks_us is None
        if lacks_us is None:
            # Until a device has shown that it lags, its time counts as all others' do: a log may begin amid an epoch.
            lacks_us = min(self._clocks.values(), default=self._at_us - time_us)
        ahead_us = (time_us + lacks_us - self._at_us + _HALF_DAY_US) % _DAY_US - _HALF_DAY_US
        if ahead_us > _LONGEST_GAP_US:
            skipped_us = ahead_us - _STEP_US
            self._clocks = {address: lacks - skipped_us for address, lacks in self._clocks.items()}
            ahead_us = _STEP_US
        self._at_us += max(ahead_us, 0.0)
        if (new and len(self._clocks) < _ADDRESSES_MAX) or ahead_us < -_BACK_US:
            self._clocks[found[1]] = self._at_us - time_us


def timed(lines: Iterable[bytes], line_us: float) -> Iterator[tuple[float, bytes]]:
    """Yield (microseconds after the first line, line)."""
    clock = LogClock(line_us)
    for line in lines:
        yield clock.at_us(line), line
