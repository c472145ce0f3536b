"""AIS messages of simulated vessels as sentences: types 1, 5, 14, 18 and 24 (ITU-R M.1371 annex 8, IEC 61162-1 VDM)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from companion.core.nmea.line import checksum
from mavlink_bridge.language.units import mps_to_knots

_ARMOUR: Final = "0123456789:;<=>?@ABCDEFGHIJKLMNOPQRSTUVW`abcdefghijklmnopqrstuvw"
_TEXT: Final = "@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_ !\"#$%&'()*+,-./0123456789:;<=>?"
_PART_CHARS: Final = 56
"""A sentence has at most 82 characters (IEC 61162-1)."""
Field = tuple[int, int]
"""Value and width in bits; a negative value is written as two's complement."""


def sentences(fields: Sequence[Field], sequence: int, channel: str = "A") -> bytes:
    """Return a message's sentences, each with its line end. ``sequence`` 0-9 is used where there are several."""
    word = size = 0
    for value, width in fields:
        word = word << width | value & (1 << width) - 1
        size += width
    fill = -size % 6
    word, count = word << fill, (size + fill) // 6
    payload = "".join(_ARMOUR[word >> 6 * place & 63] for place in range(count - 1, -1, -1))
    parts = [payload[at : at + _PART_CHARS] for at in range(0, count, _PART_CHARS)]
    return b"".join(
        _framed(
            f"AIVDM,{len(parts)},{n},{sequence if len(parts) > 1 else ''},{channel},{part},{fill if n == len(parts) else 0}"
        )
        for n, part in enumerate(parts, 1)
    )


def _framed(body: str) -> bytes:
    raw = body.encode("ascii")
    return b"!%b*%02X\r\n" % (raw, checksum(raw))


def text(words: str, width: int) -> Field:
    """Six-bit ASCII, filled up with ``@``."""
    letters = words.upper()[: width // 6].ljust(width // 6, "@")
    word = 0
    for letter in letters:
        word = word << 6 | max(_TEXT.find(letter), 0)
    return word, width


def _place(lat_rad: float, lon_rad: float) -> tuple[Field, Field]:
    """Longitude and latitude, in the order of the messages."""
    return (round(math.degrees(lon_rad) * 600_000), 28), (round(math.degrees(lat_rad) * 600_000), 27)


def _speed(sog_mps: float | None) -> Field:
    return 1023 if sog_mps is None else min(round(mps_to_knots(sog_mps) * 10), 1022), 10


def _course(cog_rad: float | None) -> Field:
    return 3600 if cog_rad is None else round(math.degrees(cog_rad) % 360 * 10) % 3600, 12


def _heading(heading_rad: float | None) -> Field:
    return 511 if heading_rad is None else round(math.degrees(heading_rad) % 360) % 360, 9


def _turn(turn_radps: float | None) -> Field:
    if turn_radps is None:
        return -128, 8
    deg_min = math.degrees(turn_radps) * 60
    return round(math.copysign(min(4.733 * math.sqrt(abs(deg_min)), 126), deg_min)), 8


class StationReport:
    """What a station sends of herself at one moment."""

    __slots__ = (
        "accurate",
        "cog_rad",
        "heading_rad",
        "lat_rad",
        "lon_rad",
        "mmsi",
        "second",
        "sog_mps",
        "status",
        "turn_radps",
    )

    def __init__(self, mmsi: int, lat_rad: float, lon_rad: float, second: int) -> None:
        self.mmsi = mmsi
        self.lat_rad, self.lon_rad = lat_rad, lon_rad
        self.second = second
        self.sog_mps: float | None = None
        self.cog_rad: float | None = None
        self.heading_rad: float | None = None
        self.turn_radps: float | None = None
        self.status = 0
        self.accurate = True

    def class_a(self) -> list[Field]:
        """Type 1."""
        lon, lat = _place(self.lat_rad, self.lon_rad)
        head: list[Field] = [(1, 6), (0, 2), (self.mmsi, 30), (self.status, 4), _turn(self.turn_radps)]
        course = [_course(self.cog_rad), _heading(self.heading_rad), (self.second, 6)]
        return [*head, _speed(self.sog_mps), (self.accurate, 1), lon, lat, *course, (0, 2), (0, 3), (0, 1), (0, 19)]

    def class_b(self) -> list[Field]:
        """Type 18, carrier sense."""
        lon, lat = _place(self.lat_rad, self.lon_rad)
        head: list[Field] = [(18, 6), (0, 2), (self.mmsi, 30), (0, 8), _speed(self.sog_mps), (self.accurate, 1)]
        course = [_course(self.cog_rad), _heading(self.heading_rad), (self.second, 6)]
        return [*head, lon, lat, *course, (0, 2), (1, 1), (0, 4), (0, 1), (0, 1), (0, 20)]


def _sides(length_m: float, beam_m: float) -> list[Field]:
    """The antenna stands in the middle."""
    bow, port = round(length_m / 2), round(beam_m / 2)
    stern, starboard = max(0, round(length_m) - bow), max(0, round(beam_m) - port)
    return [(min(bow, 511), 9), (min(stern, 511), 9), (min(port, 63), 6), (min(starboard, 63), 6)]


def static_a(mmsi: int, name: str, ship_type: int, length_m: float, beam_m: float) -> list[Field]:
    """Type 5."""
    head: list[Field] = [(5, 6), (0, 2), (mmsi, 30), (0, 2), (0, 30), text("", 42), text(name, 120), (ship_type, 8)]
    return [*head, *_sides(length_m, beam_m), (1, 4), (0, 20), (0, 8), text("", 120), (0, 1), (0, 1)]


def static_b(mmsi: int, name: str, ship_type: int, length_m: float, beam_m: float) -> tuple[list[Field], list[Field]]:
    """Type 24, parts A and B."""
    head: list[Field] = [(24, 6), (0, 2), (mmsi, 30)]
    part_a = [*head, (0, 2), text(name, 120), (0, 8)]
    part_b = [*head, (1, 2), (ship_type, 8), text("", 42), text("", 42), *_sides(length_m, beam_m), (0, 6)]
    return part_a, part_b


def safety(mmsi: int, words: str) -> list[Field]:
    """Type 14."""
    return [(14, 6), (0, 2), (mmsi, 30), (0, 2), text(words, 6 * len(words))]
