"""The sentences that make up a GNSS epoch: ZDA, GGA, GNS, GLL, RMC, VTG, GST, GSA to ``EpochPart``."""

from __future__ import annotations

import math
from typing import Any, Final

from companion.core.nmea_fields import (
    EpochPart,
    MalformedError,
    angle_rad,
    coordinate_rad,
    count,
    date_day,
    day_number,
    full_year,
    number,
    signed_rad,
    speed_mps,
    time_of_day_us,
)
from mavlink_bridge.imc import FixType

_STEP_M: Final = tuple(1852.0 * 10.0**-decimals for decimals in range(10))
"""One unit of the last digit, by the number of decimals of the minutes."""
_HEIGHT_MAX_M: Final = 100_000.0
_SIGMA_MAX_M: Final = 1.0e6


def _position(part: EpochPart, sentence: Any) -> None:
    part.lat_rad = coordinate_rad(sentence.lat, sentence.lat_dir, "N", "S", 90)
    part.lon_rad = coordinate_rad(sentence.lon, sentence.lon_dir, "E", "W", 180)
    if part.lat_rad is None or part.lon_rad is None:
        part.lat_rad = part.lon_rad = None
        part.fix_type = FixType.NONE
        return
    decimals = len(sentence.lat) - 5 if sentence.lat[4:5] == "." else 0
    part.step_m = _STEP_M[min(decimals, len(_STEP_M) - 1)]


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
    part.fix_type = _MODE.get(letter, FixType.NONE)
    part.dead_reckoning = letter == "E"
    part.simulated = letter in ("M", "S")


def zda(s: Any) -> EpochPart:
    part = EpochPart("ZDA", s.talker, tod_us=time_of_day_us(s.data[0]))
    year, month, day = (number(value, 0, 2200) for value in (s.year, s.month, s.day))
    if year is not None and month is not None and day is not None:
        full = int(year) if year >= 100 else full_year(int(year))  # some plotters send two digits
        part.day = day_number(full, int(month), int(day))
    return part


def gga(s: Any) -> EpochPart:
    part = EpochPart("GGA", s.talker, tod_us=time_of_day_us(s.data[0]))
    quality = number(s.gps_qual, 0, 9)
    part.fix_type = FixType.NONE if quality is None else _QUALITY[int(quality)]
    part.dead_reckoning = quality == 6
    part.simulated = quality in (7, 8)
    _position(part, s)
    part.satellites = count(s.num_sats)
    if part.satellites == 0 and quality is not None and quality <= 5:
        part.doubtful = True  # some receivers keep the last quality when all satellites are lost, some never count
    part.hdop = number(s.horizontal_dil, 0.0, 1000.0)
    part.height_msl_m = number(s.altitude, -_HEIGHT_MAX_M, _HEIGHT_MAX_M)
    part.geoid_separation_m = number(s.geo_sep, -1000.0, 1000.0)
    return part


def gns(s: Any) -> EpochPart:
    part = EpochPart("GNS", s.talker, tod_us=time_of_day_us(s.data[0]))
    letters = s.mode_indicator
    if letters.strip(_MODE_RANK):
        raise MalformedError("mode")
    _mode(part, max(letters, key=_MODE_RANK.index, default="N"))
    if part.fix_type == FixType.FIX_2D and not part.dead_reckoning and s.altitude:
        part.fix_type = FixType.FIX_3D
    _position(part, s)
    part.satellites = count(s.num_sats)
    part.hdop = number(s.hdop, 0.0, 1000.0)
    part.height_msl_m = number(s.altitude, -_HEIGHT_MAX_M, _HEIGHT_MAX_M)
    part.geoid_separation_m = number(s.geo_sep, -1000.0, 1000.0)
    return part


def _status(part: EpochPart, status: str, letter: str) -> None:
    if status == "A":
        _mode(part, letter or "A")
    else:
        part.fix_type = FixType.NONE


def gll(s: Any) -> EpochPart:
    data = s.data
    part = EpochPart("GLL", s.talker, tod_us=time_of_day_us(data[4]) if len(data) > 4 else None)
    # Before version 2.0 of the standard GLL ended with the longitude.
    _status(part, s.status if len(data) > 5 else "A", s.faa_mode)
    _position(part, s)
    return part


def rmc(s: Any) -> EpochPart:
    part = EpochPart("RMC", s.talker, tod_us=time_of_day_us(s.data[0]))
    date = s.data[8] if len(s.data) > 8 else ""
    if date:
        part.day = date_day(date)
    _status(part, s.status, s.mode_indicator)
    _position(part, s)
    if part.fix_type != FixType.NONE:
        part.sog_mps = speed_mps(s.spd_over_grnd, "")
        part.cog_rad = angle_rad(s.true_course)
        part.variation_rad = signed_rad(s.mag_variation, s.mag_var_dir)
    return part


def vtg(s: Any) -> EpochPart:
    part = EpochPart("VTG", s.talker)
    if s.true_track_sym not in ("T", ""):
        raise MalformedError("course unit")
    if s.faa_mode == "N":
        return part
    part.cog_rad = angle_rad(s.true_track)
    part.sog_mps = speed_mps(s.spd_over_grnd_kts, s.spd_over_grnd_kmph)
    return part


def gst(s: Any) -> EpochPart:
    part = EpochPart("GST", s.talker, tod_us=time_of_day_us(s.data[0]))
    north = number(s.std_dev_latitude, 0.0, _SIGMA_MAX_M)
    east = number(s.std_dev_longitude, 0.0, _SIGMA_MAX_M)
    if north is not None and east is not None:
        part.hacc_m = math.hypot(north, east)
    part.vacc_m = number(s.std_dev_altitude, 0.0, _SIGMA_MAX_M)
    return part


def gsa(s: Any) -> EpochPart:
    part = EpochPart("GSA", s.talker)
    part.vdop = number(s.vdop, 0.0, 1000.0)
    return part
