"""The sentences that make up a GNSS epoch: ZDA, GGA, GNS, GLL, RMC, VTG, GST, GSA to ``EpochPart``."""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.messages import FixType
from mavlink_bridge.language.units import NAUTICAL_MILE_M

from .fields import (
    BadFieldError,
    EpochPart,
    angle_rad,
    coordinate_rad,
    count,
    date_day,
    full_date_day,
    number,
    signed_rad,
    speed_mps,
    time_of_day_us,
)

_STEP_M: Final = tuple(NAUTICAL_MILE_M * 10.0**-decimals for decimals in range(10))
"""One unit of the last digit, by the number of decimals of the minutes."""
_DECIMALS: Final = len(_STEP_M)
_NONE: Final = FixType.NONE
_HEIGHT_MAX_M: Final = 100_000.0
"""Beyond any receiver's range of heights: the field is damaged."""
_SIGMA_MAX_M: Final = 1.0e6
"""Receivers write large numbers where they know nothing; larger ones are damage."""


def _position(part: EpochPart, lat: str, lat_letter: str, lon: str, lon_letter: str) -> None:
    lat_rad = coordinate_rad(lat, lat_letter, "N", "S", 90)
    lon_rad = coordinate_rad(lon, lon_letter, "E", "W", 180)
    if lat_rad is None or lon_rad is None:
        part.fix_type = _NONE
        return
    part.lat_rad, part.lon_rad = lat_rad, lon_rad
    decimals = len(lat) - 5 if lat[4:5] == "." else 0
    part.step_m = _STEP_M[decimals] if decimals < _DECIMALS else _STEP_M[-1]


_QUALITY: Final = {
    0: FixType.NONE,
    1: FixType.FIX_3D,
    2: FixType.DGPS,
    3: FixType.FIX_3D,
    4: FixType.RTK_FIXED,
    5: FixType.RTK_FLOAT,
    6: FixType.FIX_2D,
    7: FixType.FIX_3D,
    8: FixType.FIX_3D,
    9: FixType.DGPS,  # NovAtel and others: SBAS
}
_MODE: Final = {
    "A": FixType.FIX_2D,
    "D": FixType.DGPS,
    "E": FixType.FIX_2D,
    "F": FixType.RTK_FLOAT,
    "M": FixType.FIX_2D,
    "P": FixType.FIX_2D,
    "R": FixType.RTK_FIXED,
    "S": FixType.FIX_2D,
    "N": FixType.NONE,
}
_MODE_RANK: Final = "NSMEAPDFR"


def _mode(part: EpochPart, letter: str) -> None:
    part.fix_type = _MODE.get(letter, _NONE)
    part.dead_reckoning = letter == "E"
    part.simulated = letter in ("M", "S")


def zda(talker: str, fields: tuple[str, ...]) -> EpochPart:
    time, year, month, day = fields
    return EpochPart("ZDA", talker, time_of_day_us(time), full_date_day(year, month, day))


def gga(talker: str, fields: tuple[str, ...]) -> EpochPart:
    time, lat, lat_letter, lon, lon_letter, quality_text, satellites, hdop, height, separation = fields
    part = EpochPart("GGA", talker, time_of_day_us(time))
    quality = number(quality_text, 0.0, 9.0)
    part.fix_type = _NONE if quality is None else _QUALITY[int(quality)]
    part.dead_reckoning = quality == 6
    part.simulated = quality in (7, 8)
    _position(part, lat, lat_letter, lon, lon_letter)
    part.satellites = count(satellites)
    if part.satellites == 0 and quality is not None and quality <= 5:
        part.doubtful = True  # some receivers keep the last quality when all satellites are lost, some never count
    part.hdop = number(hdop, 0.0, 1000.0)
    part.height_msl_m = number(height, -_HEIGHT_MAX_M, _HEIGHT_MAX_M)
    part.geoid_separation_m = number(separation, -1000.0, 1000.0)
    return part


def gns(talker: str, fields: tuple[str, ...]) -> EpochPart:
    time, lat, lat_letter, lon, lon_letter, letters, satellites, hdop, height, separation = fields
    part = EpochPart("GNS", talker, time_of_day_us(time))
    if letters.strip(_MODE_RANK):
        raise BadFieldError("mode")
    _mode(part, max(letters, key=_MODE_RANK.index, default="N"))
    if part.fix_type is FixType.FIX_2D and not part.dead_reckoning and height:
        part.fix_type = FixType.FIX_3D
    _position(part, lat, lat_letter, lon, lon_letter)
    part.satellites = count(satellites)
    part.hdop = number(hdop, 0.0, 1000.0)
    part.height_msl_m = number(height, -_HEIGHT_MAX_M, _HEIGHT_MAX_M)
    part.geoid_separation_m = number(separation, -1000.0, 1000.0)
    return part


def _status(part: EpochPart, status: str, letter: str) -> None:
    if status == "A":
        _mode(part, letter or "A")
    else:
        part.fix_type = _NONE


def gll(talker: str, fields: tuple[str, ...]) -> EpochPart:
    time, lat, lat_letter, lon, lon_letter, status, mode = fields
    part = EpochPart("GLL", talker, time_of_day_us(time))
    _status(part, status, mode)
    _position(part, lat, lat_letter, lon, lon_letter)
    return part


def rmc(talker: str, fields: tuple[str, ...]) -> EpochPart:
    time, date, status, lat, lat_letter, lon, lon_letter, knots, course, variation, variation_letter, mode = fields
    part = EpochPart("RMC", talker, time_of_day_us(time), date_day(date) if date else None)
    _status(part, status, mode)
    _position(part, lat, lat_letter, lon, lon_letter)
    if part.fix_type is not _NONE:
        part.sog_mps = speed_mps(knots, "")
        part.cog_rad = angle_rad(course)
        part.variation_rad = signed_rad(variation, variation_letter)
    return part


def vtg(talker: str, fields: tuple[str, ...]) -> EpochPart:
    course, unit, knots, kmh, mode = fields
    part = EpochPart("VTG", talker)
    if unit not in ("T", ""):
        raise BadFieldError("course unit")
    if mode == "N":
        return part
    part.cog_rad = angle_rad(course)
    part.sog_mps = speed_mps(knots, kmh)
    return part


def gst(talker: str, fields: tuple[str, ...]) -> EpochPart:
    time, latitude, longitude, height = fields
    part = EpochPart("GST", talker, time_of_day_us(time))
    north = number(latitude, 0.0, _SIGMA_MAX_M)
    east = number(longitude, 0.0, _SIGMA_MAX_M)
    if north is not None and east is not None:
        part.hacc_m = math.hypot(north, east)
    part.vacc_m = number(height, 0.0, _SIGMA_MAX_M)
    return part


def gsa(talker: str, fields: tuple[str, ...]) -> EpochPart:
    mode, vdop = fields
    part = EpochPart("GSA", talker)
    part.dimensions = int(mode) if mode in ("2", "3") else None
    part.vdop = number(vdop, 0.0, 1000.0)
    return part
