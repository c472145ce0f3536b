"""The line layer of NMEA 0183: bytes in, whole checked sentences out, everything else counted.

A sentence starts at ``$`` or ``!`` (a TAG block at a backslash) and is complete with the second digit of its
checksum; no line end is needed. Any start character or line end cuts what came before, so that glued and cut
sentences lose only themselves. The same bytes give the same sentences and counters however they are chunked.
"""

from __future__ import annotations

import re
from typing import Final

BODY_MAX: Final = 250
"""Longest text between start and ``*``. The standard says 79; real talkers exceed it (TAG blocks, PASHR, XDR)."""

_START: Final = rb"$!\\"
_FRAME: Final = re.compile(
    rb"([%(s)b])(?:([^%(s)b\r\n*]{0,%(n)d}+)(?:\*([^%(s)b\r\n]{2})|\*?[^%(s)b\r\n]?(?=[%(s)b\r\n]))|[^%(s)b\r\n]{%(m)d})"
    % {b"s": _START, b"n": BODY_MAX, b"m": BODY_MAX + 3}
)
_BURST: Final = re.compile(rb"\$([ \"#%%-)+-\[\]-~]{1,%d}+)\*([0-9A-F]{2})\r\n" % BODY_MAX)
_DIGITS: Final = tuple(b"%02X" % value for value in range(256))
_whole_number: Final = int.from_bytes
_FIRST_START: Final = re.compile(rb"[%b]" % _START)
_DOLLAR: Final = b"$"
_BANG: Final = b"!"


def checksum(body: bytes) -> int:
    """XOR of all bytes between start and ``*`` (IEC 61162-1 §7). Up to 256 bytes."""
    # Folding one big integer is several times faster than a loop over bytes.
    folded = _whole_number(body, "big")
    size = len(body)
    if size > 16:
        if size > 64:
            if size > 128:
                folded ^= folded >> 1024
            folded ^= folded >> 512
        folded ^= folded >> 256
        folded ^= folded >> 128
    folded ^= folded >> 64
    folded ^= folded >> 32
    folded ^= folded >> 16
    return (folded ^ folded >> 8) & 0xFF


def frame(body: str) -> bytes:
    """Return the sentence with ``$``, checksum and CR LF around ``body``, e.g. ``GPHDT,92.40,T``."""
    raw = body.encode("ascii")
    return b"$%b*%02X\r\n" % (raw, checksum(raw))


class LineCounters:
    """What the line layer saw. ``noise_bytes`` are bytes outside any sentence, line ends not counted."""

    __slots__ = ("bad_checksum", "no_checksum", "noise_bytes", "not_text", "sentences", "tag_blocks", "too_long")

    def __init__(self) -> None:
        self.sentences = 0
        self.bad_checksum = 0
        self.no_checksum = 0
        self.too_long = 0
        self.not_text = 0
        self.tag_blocks = 0
        self.noise_bytes = 0

    def as_dict(self) -> dict[str, int]:
        return {name: getattr(self, name) for name in sorted(self.__slots__)}


class LineReader:
    """Splits a byte stream into checked sentence bodies. Never raises; holds at most ``BODY_MAX`` + 4 bytes.

    ``checksum_required`` False also accepts sentences that carry no checksum and end with a line end (old ship
    loggers); a checksum that is present must be right in any case.
    """

    def __init__(self, *, checksum_required: bool = True) -> None:
        self.checksum_required = checksum_required
        self.counters = LineCounters()
        self._rest = b""

    def receive(self, data: bytes) -> list[str]:
        """Take bytes as they came; return the bodies (between start and ``*``) of the ``$`` and ``!`` sentences."""
        if not self._rest and data[-1:] == b"\n":
            burst = self._burst(data)
            if burst:
                return burst
        buffer = self._rest + data if self._rest else bytes(data)
        bodies: list[str] = []
        end = 0
        for match in _FRAME.finditer(buffer):
            start = match.start()
            if start > end:
                self._noise(buffer[end:start])
            end = match.end()
            body = self._check(match)
            if body is not None:
                bodies.append(body)
        self._keep(buffer, end)
        return bodies

    def _burst(self, data: bytes) -> list[str] | None:
        """The bodies when the bytes are whole good sentences and nothing else, as most receivers send them; else None."""
        bodies = []
        size = 0
        for body, digits in _BURST.findall(data):
            if _DIGITS[checksum(body)] != digits:
                return None
            size += len(body) + 6
            bodies.append(body.decode())
        if size != len(data):
            return None
        self.counters.sentences += len(bodies)
        return bodies

    def _check(self, match: re.Match[bytes]) -> str | None:
        counters = self.counters
        start, body, digits = match.groups()
        if body is None:
            counters.too_long += 1
            return None
        if digits is None:
            return self._without_checksum(start, body, match)
        try:
            good = int(digits, 16) == checksum(body) and digits.isalnum()
        except ValueError:
            good = False
        if not good:
            counters.bad_checksum += 1
            return None
        if start != _DOLLAR and start != _BANG:
            counters.tag_blocks += 1
            return None
        return self._text(body)

    def _without_checksum(self, start: bytes, body: bytes, match: re.Match[bytes]) -> str | None:
        if start != _DOLLAR:
            # The closing backslash of a TAG block is an empty frame of its own.
            if start == _BANG or body:
                self.counters.no_checksum += 1
            return None
        at_line_end = match.string[match.end()] in b"\r\n" and match.end() == match.end(2)
        if self.checksum_required or not at_line_end:
            self.counters.no_checksum += 1
            return None
        return self._text(body)

    def _text(self, body: bytes) -> str | None:
        try:
            text = body.decode("ascii")
        except UnicodeDecodeError:
            text = ""
        if not text.isprintable() or not text:
            self.counters.not_text += 1
            return None
        self.counters.sentences += 1
        return text

    def _keep(self, buffer: bytes, end: int) -> None:
        found = _FIRST_START.search(buffer, end)
        first = len(buffer) if found is None else found.start()
        if first > end:
            self._noise(buffer[end:first])
        self._rest = buffer[first:]

    def _noise(self, gap: bytes) -> None:
        if gap not in (b"\r\n", b"\n", b"\r"):
            self.counters.noise_bytes += len(gap) - gap.count(b"\r") - gap.count(b"\n")
