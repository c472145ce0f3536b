"""How the actuator board reads its line: the Python twin of ``firmware/usv_actuator/src/decoder.cpp``, byte for byte.

Until the first valid checked line both levels are understood: groups are staged and take effect together at a
terminator, after 5 ms of silence, or when a fifth group begins (no checked line holds five); a ``*`` turns what is staged into a
checked line, which counts whole or not at all. From the first valid checked line on only those are read.
"""

from __future__ import annotations

import re
from typing import Final

from companion.core.board.wire import IDS, WIRE_HIGH_US, WIRE_LOW_US, checksum
from mavlink_bridge.language.value import value

SILENCE_US: Final = 5_000
LINE_BYTES: Final = 32
_ID_BYTES: Final = IDS.encode()
_ALL_FOUR: Final = re.compile(rb"m([0-9]{4})M([0-9]{4})l([0-9]{4})L([0-9]{4})")
"""What a companion sends every tick."""


@value
class PulseCommand:
    """Pulses for some of the pins (index, µs), to be applied together."""

    pulses: tuple[tuple[int, int], ...]
    checked: bool


@value
class Word:
    """A checked word without its check digits, e.g. '#VERS?'."""

    text: str


def parse_checked(line: bytes) -> PulseCommand | Word | None:
    """Return what a checked line (without its newline) says; None unless it is right to the last byte."""
    line = line.removesuffix(b"\r")
    body = line[:-3]
    if line[len(body) :] != b"*%02X" % checksum(body):
        return None
    if body[:1] == b"#":
        return Word(body.decode("latin-1")) if len(body) == 6 and not set(body) & set(_ID_BYTES) else None
    return _groups(body)


def _groups(body: bytes) -> PulseCommand | None:
    every = _ALL_FOUR.fullmatch(body)
    if every is not None:
        pulses_us = tuple(map(int, every.groups()))
        for pulse_us in pulses_us:
            if not WIRE_LOW_US <= pulse_us <= WIRE_HIGH_US:
                return None
        return PulseCommand(tuple(enumerate(pulses_us)), True)
    if len(body) % 5 or not 5 <= len(body) <= 20:
        return None
    pulses: dict[int, int] = {}
    for start in range(0, len(body), 5):
        pin, digits = IDS.find(chr(body[start])), body[start + 1 : start + 5]
        if pin < 0 or pin in pulses or not digits.isdigit() or not WIRE_LOW_US <= int(digits) <= WIRE_HIGH_US:
            return None
        pulses[pin] = int(digits)
    return PulseCommand(tuple(pulses.items()), True)


class Decoder:
    """Bytes in, commands and words out; ``strict`` is set by the board when it latches the checked level."""

    def __init__(self) -> None:
        self.strict = False
        self.bad = 0
        self._last_byte_us = 0
        self._newest = b""
        self._said: PulseCommand | Word | None = None
        """What the newest whole line on the checked level said: a vessel that holds its course repeats itself."""
        self._restart()

    def _restart(self) -> None:
        self._line = bytearray()
        self._overflow = False
        self._star = False
        self._staged: list[tuple[int, int]] = []
        self._pin = -1
        self._digits = 0
        self._value = 0
        self._fraction = False

    def byte(self, byte: int, now_us: int) -> PulseCommand | Word | None:
        """Take one byte. At most one thing is completed by it."""
        self._last_byte_us = now_us
        return self._strict_byte(byte) if self.strict else self._open_byte(byte)

    def take_strict(self, data: bytes) -> list[PulseCommand | Word]:
        """Take many bytes on the checked level: the same as ``byte`` for each, only faster."""
        found = []
        pieces = data.split(b"\n")
        rest = pieces.pop()
        for piece in pieces:
            if self._line:
                self._extend(piece)
                item = self._finish_checked()
            elif piece:
                item = self._whole(piece)
            else:
                continue
            if item is not None:
                found.append(item)
        if rest:
            self._extend(rest)
        return found

    def _whole(self, line: bytes) -> PulseCommand | Word | None:
        """Read a line that came in one piece, as nearly all do."""
        if line != self._newest:
            self._newest = line
            self._said = parse_checked(line) if len(line) <= LINE_BYTES else None
        if self._said is None:
            self.bad += 1
        return self._said

    def _extend(self, piece: bytes) -> None:
        room = LINE_BYTES - len(self._line)
        self._overflow = self._overflow or len(piece) > room
        self._line += piece[:room]

    def silence(self, now_us: int) -> PulseCommand | None:
        """End an unfinished level-0 command when the line has been quiet for 5 ms."""
        idle = not self._line and not self._overflow
        if self.strict or idle or now_us - self._last_byte_us < SILENCE_US:
            return None
        if self._star or self._line[:1] == b"#":
            self.bad += 1
            self._restart()
            return None
        return self._commit()

    def _append(self, byte: int) -> None:
        if len(self._line) < LINE_BYTES:
            self._line.append(byte)
        else:
            self._overflow = True

    def _strict_byte(self, byte: int) -> PulseCommand | Word | None:
        if byte != 0x0A:
            self._append(byte)
            return None
        return self._finish_checked() if self._line else None

    def _finish_checked(self) -> PulseCommand | Word | None:
        found = None if self._overflow else parse_checked(bytes(self._line))
        self._restart()
        if found is None:
            self.bad += 1
        return found

    def _open_byte(self, byte: int) -> PulseCommand | Word | None:
        word = self._line[:1] == b"#"
        if byte == 0x0A:
            return self._finish_checked() if self._star or word else self._commit()
        if byte in _ID_BYTES:
            return self._open_group(byte, word)
        if self._star or word:
            self._append(byte)
            return None
        return self._open_rest(byte)

    def _open_group(self, byte: int, word: bool) -> PulseCommand | None:
        done = None
        if self._star or word:
            self.bad += 1
            self._restart()
        else:
            self._end_group()
            if len(self._staged) == 4:
                done = self._commit()
        self._append(byte)
        self._pin, self._digits, self._value, self._fraction = _ID_BYTES.index(byte), 0, 0, False
        return done

    def _open_rest(self, byte: int) -> PulseCommand | None:
        if 0x30 <= byte <= 0x39:
            self._append(byte)
            if self._pin >= 0 and not self._fraction:
                self._digits = min(self._digits + 1, 5)
                self._value = (self._value * 10 + byte - 0x30) % 100_000
        elif byte == 0x2E and self._pin >= 0 and self._digits and not self._fraction:
            self._append(byte)
            self._fraction = True
        elif byte == 0x2A:
            self._end_group()
            self._star = True
            self._append(byte)
        else:
            done = self._commit()
            if byte == 0x23:
                self._append(byte)
            return done
        return None

    def _end_group(self) -> None:
        if self._pin < 0:
            return
        if self._digits == 4 and WIRE_LOW_US <= self._value <= WIRE_HIGH_US:
            self._staged.append((self._pin, self._value))
        else:
            self.bad += 1
        self._pin = -1

    def _commit(self) -> PulseCommand | None:
        """Give out what is staged as a level-0 command and begin a new line."""
        self._end_group()
        staged = dict(self._staged)
        self._restart()
        return PulseCommand(tuple(staged.items()), checked=False) if staged else None
