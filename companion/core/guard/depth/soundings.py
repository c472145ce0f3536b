"""Soundings from text: XYZ, CSV with a header, and the DUNE simulator's ini. Pure parsing; files are ``io``'s.

Every parser names the line it cannot read. Depths are positive down, in metres.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator
from typing import Final, Literal

from .grid import Sounding, offset

Order = Literal["lon-lat", "lat-lon"]

_NAMES: Final = {
    "lat": ("lat", "latitude", "latitude_deg", "lat_deg", "y"),
    "lon": ("lon", "long", "longitude", "longitude_deg", "lon_deg", "x"),
    "depth": ("depth", "depth_m", "z"),
    "elevation": ("elevation", "elevation_m", "height"),
}


UNKNOWN_M: Final = (-9999.0, -99999.0, -999999.0, -32768.0, -32767.0, 32767.0, 9999.0, 99999.0, -2147483648.0)
"""Values by which programs say 'unknown' without telling; no chart has one of them as a depth."""
_UNKNOWN: Final = frozenset(map(abs, UNKNOWN_M))
"""The same of a depth whose sign was changed."""
_UNIT: Final = re.compile(r"\s*[(\[]\s*(m|metres?|meters?|deg|degrees|°)\s*[)\]]$")
"""What a header may say behind a name. Of feet it would be another column, and none of ours."""
_COMMA: Final = re.compile(r"[-+]?\d+,\d+")
"""A number with a decimal comma, among fields that blanks separate."""
_BOM: Final = "\ufeff"
"""A spreadsheet's "CSV UTF-8" begins with it."""


def parse(text: str, name: str, order: Order = "lon-lat") -> list[Sounding]:
    """Choose the parser by the file's name: ``.ini`` DUNE, ``.csv`` CSV, anything else XYZ."""
    lower, text = name.lower(), text.removeprefix(_BOM)
    if lower.endswith(".ini"):
        return parse_dune(text)
    if lower.endswith(".csv"):
        return parse_csv(text)
    return parse_xyz(text, order)


def cell_of(text: str) -> tuple[float, float] | None:
    """Extent in latitude and longitude, rad, of the chart cells that an XYZ file of ``companion depth convert`` says in its head."""
    found = re.match(r"(?:#[^\n]*\n)*?#\s*cell_deg\s+(\S+)\s+(\S+)\s*\n", text.removeprefix(_BOM))
    if found is None:
        return None
    size = math.radians(_number(found[1], 1)), math.radians(_number(found[2], 1))
    if not all(0.0 < each < 0.2 for each in size):
        raise ValueError("line with cell_deg: two extents in degrees expected")
    return size


def parse_xyz(text: str, order: Order = "lon-lat") -> list[Sounding]:
    """Lines of longitude, latitude (degrees) and depth, separated by blanks, commas or semicolons; # starts a comment."""
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split("#", 1)[0].strip()
        if "," in words:
            _refuse_commas(words, number)
        fields = re.split(r"[\s,;]+", words)
        if fields == [""]:
            continue
        if len(fields) < 3:
            raise ValueError(f"line {number}: three numbers expected")
        first, second, depth = (_number(field, number) for field in fields[:3])
        lon, lat = (first, second) if order == "lon-lat" else (second, first)
        found.append(_sounding(lat, lon, depth, number))
    return found


def _refuse_commas(words: str, line: int) -> None:
    """Raises ValueError for decimal commas: with the comma as a separator they give another place and depth."""
    fields = re.split(r"[\s;]+", words)
    comma = next((field for field in fields[:3] if _COMMA.fullmatch(field)), None) if len(fields) > 1 else None
    if comma is not None:
        raise ValueError(
            f"line {line}: {comma!r} has a decimal comma; write decimal points ({comma.replace(',', '.')})"
        )


def parse_csv(text: str) -> list[Sounding]:
    """CSV with a header that names latitude, longitude (degrees) and depth (or elevation, positive up)."""
    first = text.split("\n", 1)[0]
    rows = csv.reader(text.splitlines(), delimiter=next((mark for mark in ";\t" if mark in first), ","))
    header = [_UNIT.sub("", name.strip().lower()) for name in next(rows, [])]
    lat, lon = _column(header, "lat"), _column(header, "lon")
    depth, elevation = _column(header, "depth"), _column(header, "elevation")
    if lat is None or lon is None or (depth is None and elevation is None):
        named = ", ".join(header) or "nothing"
        raise ValueError(f"the header must name latitude, longitude and depth (or elevation), in m; it names {named}")
    value, sign = (depth, 1.0) if depth is not None else (elevation, -1.0)
    assert value is not None
    found = []
    for number, row in enumerate(rows, 2):
        if not any(field.strip() for field in row):
            continue
        if len(row) < len(header):
            raise ValueError(f"line {number}: {len(header)} fields expected")
        cells = _number(row[lat], number), _number(row[lon], number), sign * _number(row[value], number)
        found.append(_sounding(*cells, number))
    return found


def parse_dune(text: str) -> list[Sounding]:
    """The [Bathymetry] section: a reference position and triples north, east, depth in metres."""
    lat = math.radians(_setting(text, "Latitude"))
    lon = math.radians(_setting(text, "Longitude"))
    return [Sounding(*offset(lat, lon, north, east), depth) for north, east, depth in _triples(text)]


def dune_reference(text: str) -> tuple[float, float]:
    """The reference position of a DUNE ini, (lat, lon) in rad."""
    return math.radians(_setting(text, "Latitude")), math.radians(_setting(text, "Longitude"))


def _triples(text: str) -> Iterator[tuple[float, float, float]]:
    start = re.search(r"^\s*Data\s*=", text, re.MULTILINE)
    if start is None:
        raise ValueError("no Data in [Bathymetry]")
    first = text.count("\n", 0, start.end()) + 1
    for number, line in enumerate(text[start.end() :].splitlines(), first):
        for triple in line.split("#", 1)[0].split(","):
            fields = triple.split()
            if not fields:
                continue
            if len(fields) != 3:
                raise ValueError(f"line {number}: triples of north, east, depth expected")
            yield _number(fields[0], number), _number(fields[1], number), _number(fields[2], number)


def _setting(text: str, name: str) -> float:
    found = re.search(rf"^\s*{name}[^=\n]*=\s*(\S+)", text, re.MULTILINE)
    if found is None:
        raise ValueError(f"no {name} in [Bathymetry]")
    return _number(found.group(1), text.count("\n", 0, found.start(1)) + 1)


def _column(header: list[str], kind: str) -> int | None:
    return next((i for i, name in enumerate(header) if name in _NAMES[kind]), None)


def _number(field: str, line: int) -> float:
    try:
        value = float(field)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"line {line}: {field.strip()!r} is not a number")
    return value


def _sounding(lat_deg: float, lon_deg: float, depth_m: float, line: int) -> Sounding:
    if abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0:
        raise ValueError(f"line {line}: no such position (degrees; is the order of the columns right?)")
    if abs(depth_m) in _UNKNOWN:
        raise ValueError(f"line {line}: {depth_m:g} is 'unknown', not a depth; leave the line out")
    return Sounding(math.radians(lat_deg), math.radians(lon_deg), depth_m)
