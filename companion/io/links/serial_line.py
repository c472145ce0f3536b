"""What a serial port's URL may say of the line, for every way to open one: ``serial:PATH?baud=9600&parity=N&stop=1``."""

from __future__ import annotations

from typing import Final

from .url import LinkConfigError, LinkUrl

PARITIES: Final = {"n": "N", "e": "E", "o": "O", "none": "N", "even": "E", "odd": "O"}
BAUDS: Final = (
    *(
        50,
        75,
        110,
        134,
        150,
        200,
        300,
        600,
        1200,
        1800,
        2400,
        4800,
        9600,
        14400,
        19200,
        28800,
        38400,
        57600,
        74880,
        76800,
    ),
    *(
        115200,
        128000,
        230400,
        250000,
        256000,
        460800,
        500000,
        576000,
        921600,
        1_000_000,
        1_152_000,
        1_500_000,
        2_000_000,
    ),
    *(2_500_000, 3_000_000, 3_500_000, 4_000_000),
)
"""What operating systems, Arduino cores and radio modules know; anything else is a slip of the pen (the original's 112500)."""
STOP_BITS: Final = {"1": "1", "2": "2"}


def serial_line(url: LinkUrl) -> tuple[str, int, str, int]:
    """Return (path, a baud rate of ``BAUDS``, parity N, E or O, stop bits 1 or 2). Raises LinkConfigError."""
    url.allow("baud", "parity", "stop", "silence")
    baud = int(url.number("baud", 115200, 50, 4_000_000))
    if baud not in BAUDS:
        nearest = min(BAUDS, key=lambda rate: abs(rate - baud))
        raise LinkConfigError(f"{url.text}: baud={baud} is no rate of serial ports; the nearest is {nearest}")
    return url.path(), baud, url.choice("parity", "N", PARITIES), int(url.choice("stop", "1", STOP_BITS))
