"""What a serial port's URL may say of the line, for every way to open one: ``serial:PATH?baud=9600&parity=N&stop=1``."""

from __future__ import annotations

from typing import Final

from .url import LinkUrl

PARITIES: Final = {"n": "N", "e": "E", "o": "O", "none": "N", "even": "E", "odd": "O"}
STOP_BITS: Final = {"1": "1", "2": "2"}


def serial_line(url: LinkUrl) -> tuple[str, int, str, int]:
    """Return (path, baud 50 to 4 000 000, parity N, E or O, stop bits 1 or 2). Raises LinkConfigError."""
    url.allow("baud", "parity", "stop", "silence")
    baud = int(url.number("baud", 115200, 50, 4_000_000))
    return url.path(), baud, url.choice("parity", "N", PARITIES), int(url.choice("stop", "1", STOP_BITS))
