"""The bytes between the companion and the actuator board: both levels of the command protocol, and the board's answers.

Level 0 is the seed's: an id letter and four digits (``m1500``), nothing else. Level 1 puts one to four such groups on
a line, then ``*``, two upper-case hexadecimal digits of CRC-8 (polynomial 0x07, start 0, over everything before the
``*``) and a newline. Words to the board start with ``#``, are checked alike, are ten bytes long and hold none of the id letters,
so that no older sketch can misread them, not even one that reads blocks of five bytes. What the board says are
checked lines that start with ``#B`` (banner), ``#V`` (version) or ``#S`` (status). Design: firmware-reliability §A.4, §A.5.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from fastcrc import crc8

from mavlink_bridge.value import value

IDS: Final = "mMlL"
"""Wire ids in pin order: thruster 1, thruster 2, rudder 1, rudder 2."""
WIRE_LOW_US: Final = 1000
WIRE_HIGH_US: Final = 2000
VERSION_QUERY: Final = "#VERS?"
ALL_NEUTRAL: Final = "#NEUTR"
CLEAR_COUNTERS: Final = "#ZERO0"
LINE_MAX_BYTES: Final = 96
"""Longest line accepted from the board; its own longest is 68 bytes."""

Microseconds = tuple[int, int, int, int]

STATE_NAMES: Final = {
    "B": "boot",
    "A": "active",
    "C": "active-checked",
    "F": "failsafe",
    "I": "interlock",
    "E": "emergency-stop",
}
RESET_CAUSES: Final = {"P": "power-on", "X": "external", "O": "brown-out", "W": "watchdog", "U": "unknown"}


@dataclass(frozen=True, slots=True)
class Banner:
    """The first line after a reset."""

    protocol: int
    version: str
    board: str
    reset_cause: str


@dataclass(frozen=True, slots=True)
class Version:
    """The answer to the version query."""

    protocol: int
    version: str
    board: str
    silence_ms: int


@value
class Status:
    """The unsolicited status line, 10 Hz. Pulse widths in pin order; voltage None when not measured."""

    state: str
    strict: bool
    silent_ms: int
    good: int
    bad: int
    applied_us: Microseconds
    reset_cause: str
    voltage_v: float | None


BoardLine = Banner | Version | Status


def checksum(body: bytes) -> int:
    """CRC-8, polynomial 0x07, start 0, no reflection: 0xF4 for b'123456789'."""
    return int(crc8.smbus(body))


def checked(body: str) -> bytes:
    """Return a body with its check digits and newline."""
    raw = body.encode("ascii")
    return b"%s*%02X\n" % (raw, checksum(raw))


def silence_word(limit_ms: int) -> bytes:
    """Return the line that sets the board's silence limit. Raises ValueError outside 200...2000 ms."""
    if not 200 <= limit_ms <= 2000:
        raise ValueError(f"silence limit {limit_ms} ms: must be 200 to 2000")
    return checked(f"#T{limit_ms:04d}")


def group(wire_id: str, pulse_us: int) -> str:
    """Return one id-and-value group. Raises ValueError for what must never be on the wire."""
    if len(wire_id) != 1 or wire_id not in IDS:
        raise ValueError(f"wire id {wire_id!r}: must be one of {IDS}")
    if not WIRE_LOW_US <= pulse_us <= WIRE_HIGH_US:
        raise ValueError(f"pulse {pulse_us} us: must be {WIRE_LOW_US} to {WIRE_HIGH_US}")
    return f"{wire_id}{pulse_us:04d}"


def encode_level0(pulses_us: Sequence[int], terminator: str) -> bytes:
    """Return the four commands in pin order, each followed by ``terminator``."""
    groups = (group(wire_id, pulse) for wire_id, pulse in zip(IDS, pulses_us, strict=True))
    return "".join(item + terminator for item in groups).encode("ascii")


def encode_level1(pulses_us: Sequence[int], *, batch: bool = True) -> bytes:
    """Return the four commands in pin order as one checked line, or as four when not ``batch``."""
    groups = [group(wire_id, pulse) for wire_id, pulse in zip(IDS, pulses_us, strict=True)]
    return checked("".join(groups)) if batch else b"".join(checked(item) for item in groups)


class LineReader:
    """Turns the board's bytes into lines that passed their check. Bounded; never raises.

    ``good`` and ``bad`` count lines, ``odd_bytes`` bytes that no text holds (a wrong baud rate makes many).
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._overlong = False
        self.good = 0
        self.bad = 0
        self.bytes_in = 0
        self.odd_bytes = 0

    def receive(self, data: bytes) -> list[BoardLine]:
        """Return the valid lines that ``data`` completes; anything else is counted and dropped."""
        self.bytes_in += len(data)
        if not data.isascii() or data.translate(None, _TEXT):
            self.odd_bytes += len(data.translate(None, _TEXT))
        lines: list[BoardLine] = []
        *ended, rest = data.split(b"\n")
        for piece in ended:
            self._append(piece)
            self._finish(lines)
        self._append(rest)
        return lines

    def _append(self, piece: bytes) -> None:
        room = LINE_MAX_BYTES - len(self._buffer)
        self._overlong = self._overlong or len(piece) > room
        self._buffer += piece[:room]

    def _finish(self, lines: list[BoardLine]) -> None:
        raw, overlong = bytes(self._buffer), self._overlong
        self._buffer.clear()
        self._overlong = False
        if not raw.strip(b"\r\0"):
            return
        line = None if overlong else parse_board_line(raw)
        if line is None:
            self.bad += 1
        else:
            self.good += 1
            lines.append(line)


def parse_board_line(raw: bytes) -> BoardLine | None:
    """Parse one line from the board, without its newline. None when it is not exactly right."""
    body, star, digits = raw.removesuffix(b"\r").rpartition(b"*")
    if not star or digits != b"%02X" % checksum(body):
        return None
    for pattern, make in _LINES:
        match = pattern.fullmatch(body)
        if match:
            return make([field.decode("ascii") for field in match.groups()])
    return None


def _status(fields: list[str]) -> Status | None:
    numbers = [int(field) for field in fields[1:9]]
    strict, silent_ms, good, bad, first, second, third, fourth = numbers
    if max(good, bad) >= 2**32 or max(silent_ms, first, second, third, fourth) > 65535:
        return None
    millivolts = int(fields[10])
    return Status(
        state=STATE_NAMES[fields[0]],
        strict=strict == 1,
        silent_ms=silent_ms,
        good=good,
        bad=bad,
        applied_us=(first, second, third, fourth),
        reset_cause=RESET_CAUSES[fields[9]],
        voltage_v=millivolts / 1000.0 if millivolts else None,
    )


def _banner(fields: list[str]) -> Banner:
    return Banner(int(fields[0]), fields[1], fields[2], RESET_CAUSES[fields[3]])


def _version(fields: list[str]) -> Version:
    return Version(int(fields[0]), fields[1], fields[2], int(fields[3]))


_TEXT: Final = bytes(range(0x20, 0x7F)) + b"\r\n\t\0"
_NAME: Final = rb"([0-9A-Za-z.]{1,12})"
_CAUSE: Final = b"([" + "".join(RESET_CAUSES).encode() + b"])"
_STATE: Final = b"([" + "".join(STATE_NAMES).encode() + b"])"
_LINES: Final[tuple[tuple[re.Pattern[bytes], Callable[[list[str]], BoardLine | None]], ...]] = (
    (
        re.compile(
            rb"#S,%b,([01]),(\d{1,5}),(\d{1,10}),(\d{1,10}),(\d{1,5}),(\d{1,5}),(\d{1,5}),(\d{1,5}),%b,(\d{1,5})"
            % (_STATE, _CAUSE)
        ),
        _status,
    ),
    (re.compile(rb"#B,([1-9]),%b,%b,%b" % (_NAME, _NAME, _CAUSE)), _banner),
    (re.compile(rb"#V,([1-9]),%b,%b,(\d{1,5})" % (_NAME, _NAME)), _version),
)
