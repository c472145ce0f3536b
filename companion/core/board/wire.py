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

from mavlink_bridge.crc import smbus
from mavlink_bridge.language.value import value

IDS: Final = "mMlL"
"""Wire ids in pin order: thruster 1, thruster 2, rudder 1, rudder 2."""
WIRE_LOW_US: Final = 1000
"""The least of RC servos' usual range."""
WIRE_HIGH_US: Final = 2000
"""And the most; four digits either way, which level 0 needs."""
PROTOCOL: Final = 1
"""The protocol's number, first in banner and version: it changes when a line or word changes its meaning."""
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
    return smbus(body)


def checked(body: str) -> bytes:
    """Return a body with its check digits and newline."""
    return _closed(body.encode("ascii"))


def _closed(raw: bytes) -> bytes:
    return raw + _ENDS[checksum(raw)] + b"\n"


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
    if batch:
        first, second, third, fourth = pulses_us
        if (
            WIRE_LOW_US <= first <= WIRE_HIGH_US
            and WIRE_LOW_US <= second <= WIRE_HIGH_US
            and WIRE_LOW_US <= third <= WIRE_HIGH_US
            and WIRE_LOW_US <= fourth <= WIRE_HIGH_US
        ):
            return _closed(b"m%04dM%04dl%04dL%04d" % (first, second, third, fourth))
    groups = [group(wire_id, pulse) for wire_id, pulse in zip(IDS, pulses_us, strict=True)]
    return checked("".join(groups)) if batch else b"".join(checked(item) for item in groups)


class BoardLineReader:
    """Turns the board's bytes into lines that passed their check. Bounded; never raises.

    ``good`` and ``bad`` count lines, ``foreign`` those among the bad that passed their check,
    ``odd_bytes`` bytes that no text holds (a wrong baud rate makes many).
    """

    def __init__(self) -> None:
        self._held = b""
        self._overlong = False
        self.good = 0
        self.bad = 0
        self.foreign = 0
        self.bytes_in = 0
        self.odd_bytes = 0

    def receive(self, data: bytes) -> list[BoardLine]:
        """Return the valid lines that ``data`` completes; anything else is counted and dropped."""
        self.bytes_in += len(data)
        self.odd_bytes += len(data.translate(None, _TEXT))
        lines: list[BoardLine] = []
        ended = data.split(b"\n")
        rest = ended.pop()
        for piece in ended:
            self._finish(self._held + piece, lines)
        if rest:
            rest = self._held + rest
            self._overlong = self._overlong or len(rest) > LINE_MAX_BYTES
            self._held = rest[:LINE_MAX_BYTES]
        return lines

    @property
    def garbled(self) -> bool:
        """True when no line was good and much of what came is no text: a wrong baud rate."""
        return self.good == 0 and self.bytes_in >= 16 and self.odd_bytes * 4 > self.bytes_in

    def _finish(self, raw: bytes, lines: list[BoardLine]) -> None:
        overlong = self._overlong or len(raw) > LINE_MAX_BYTES
        self._held, self._overlong = b"", False
        line = None if overlong else parse_board_line(raw)
        if line is not None:
            self.good += 1
            lines.append(line)
        elif raw[:LINE_MAX_BYTES].strip(b"\r\0"):
            self.bad += 1
            self.foreign += not overlong and _is_foreign(raw)


def _is_foreign(raw: bytes) -> bool:
    """Whether a line is a board's, well checked, and yet none that is known here. The echo of our own words has no commas."""
    body = _body(raw)
    return body is not None and body.startswith(b"#") and b"," in body


def _body(raw: bytes) -> bytes | None:
    """What a line says, without newline and check; None when the check fails."""
    raw = raw.removesuffix(b"\r")
    body = raw[:-3]
    return body if raw[-3:] == _ENDS[checksum(body)] and body.isascii() else None


def parse_board_line(raw: bytes) -> BoardLine | None:
    """Parse one line from the board, without its newline. None when it is not exactly right."""
    body = _body(raw)
    if body is None:
        return None
    text = body.decode()
    for pattern, make in _LINES:
        match = pattern.fullmatch(text)
        if match:
            return make(match.groups())
    return None


def _status(fields: tuple[str, ...]) -> Status | None:
    state, strict, silent, *counts_and_pulses, cause, millivolts = fields
    good, bad, first, second, third, fourth = map(int, counts_and_pulses)
    silent_ms = int(silent)
    if good > _COUNT_MAX or bad > _COUNT_MAX or silent_ms > _WORD_MAX:
        return None
    if first > _WORD_MAX or second > _WORD_MAX or third > _WORD_MAX or fourth > _WORD_MAX:
        return None
    return Status(
        state=STATE_NAMES[state],
        strict=strict == "1",
        silent_ms=silent_ms,
        good=good,
        bad=bad,
        applied_us=(first, second, third, fourth),
        reset_cause=RESET_CAUSES[cause],
        voltage_v=int(millivolts) / 1000.0 or None,
    )


def _banner(fields: tuple[str, ...]) -> Banner:
    return Banner(int(fields[0]), fields[1], fields[2], RESET_CAUSES[fields[3]])


def _version(fields: tuple[str, ...]) -> Version:
    return Version(int(fields[0]), fields[1], fields[2], int(fields[3]))


_COUNT_MAX: Final = 2**32 - 1
"""The board counts lines in 32 bits,"""
_WORD_MAX: Final = 2**16 - 1
"""and milliseconds and pulses in 16."""
_TEXT: Final = bytes(range(0x20, 0x7F)) + b"\r\n\t\0"
"""Every byte that an honest board sends; others tell of a wrong baud rate."""
_ENDS: Final = tuple(b"*%02X" % value for value in range(256))
_NAME: Final = "([0-9A-Za-z.]{1,12})"
_CAUSE: Final = "([" + "".join(RESET_CAUSES) + "])"
_STATE: Final = "([" + "".join(STATE_NAMES) + "])"
_SHORT: Final = "([0-9]{1,5}+)"
_LONG: Final = "([0-9]{1,10}+)"
_LINES: Final[tuple[tuple[re.Pattern[str], Callable[[tuple[str, ...]], BoardLine | None]], ...]] = (
    (
        re.compile(
            f"#S,{_STATE},([01]),{_SHORT},{_LONG},{_LONG},{_SHORT},{_SHORT},{_SHORT},{_SHORT},{_CAUSE},{_SHORT}"
        ),
        _status,
    ),
    (re.compile(f"#B,([1-9]),{_NAME},{_NAME},{_CAUSE}"), _banner),
    (re.compile(f"#V,([1-9]),{_NAME},{_NAME},{_SHORT}"), _version),
)
