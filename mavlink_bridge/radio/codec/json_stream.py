"""Finds JSON values in a byte stream: one a line, or none, or cut in pieces by a radio."""

from __future__ import annotations

from typing import Final

MAX_BYTES: Final = 4096
_STALL_US: Final = 6_000_000
_OPEN, _CLOSE = b"{[", b"}]"
_BLANK: Final = b" \t\r\n\0"


class JsonStream:
    """Cuts out whole objects and lists by their brackets. Bounded; a value that stops coming is given up after 6 s."""

    def __init__(self) -> None:
        self.bad = 0
        """Values given up: too long, or never finished."""
        self.stray_bytes = 0
        """Bytes outside any value that are no white space."""
        self._buffer = bytearray()
        self._depth = 0
        self._in_text = False
        self._escaped = False
        self._line_start = False
        self._last_us = 0

    def receive(self, data: bytes, now_us: int) -> list[bytes]:
        """Take bytes as read; return the values that they complete."""
        if self._buffer and now_us - self._last_us > _STALL_US:
            self._give_up()
        if data:
            self._last_us = now_us
        found: list[bytes] = []
        for value in data:
            if self._take(value):
                found.append(bytes(self._buffer))
                self._clear()
            elif len(self._buffer) >= MAX_BYTES:
                self._give_up()
        return found

    def _take(self, value: int) -> bool:
        """Add a byte; True when it closes the value."""
        if self._depth == 0:
            if value in _OPEN:
                self._depth = 1
                self._buffer.append(value)
            elif value not in _BLANK:
                self.stray_bytes += 1
            return False
        if value in b"\n\r":
            self._end_line()
            return False
        if self._line_start and value == self._buffer[0] == 0x7B:
            # an object holds no line that starts with another one: the first lost its end on the way
            self._give_up()
            return self._take(value)
        self._line_start = False
        self._buffer.append(value)
        if self._in_text:
            self._in_text = self._escaped or value != 0x22
            self._escaped = not self._escaped and value == 0x5C
        elif value == 0x22:
            self._in_text = True
        elif value in _OPEN:
            self._depth += 1
        elif value in _CLOSE:
            self._depth -= 1
        return self._depth == 0

    def _end_line(self) -> None:
        """White space between members; inside a text it cannot be, so that value is broken."""
        if self._in_text:
            self._give_up()
        else:
            self._buffer.append(0x20)
            self._line_start = True

    def _give_up(self) -> None:
        self.bad += 1
        self._clear()

    def _clear(self) -> None:
        self._buffer.clear()
        self._depth = 0
        self._in_text = self._escaped = self._line_start = False
