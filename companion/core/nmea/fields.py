"""Fields of NMEA sentences: blank = unknown, strict numbers with bounds, and the typed parts that sentences become.

A field that is present but cannot be true raises ``BadFieldError``: the sentence is then refused whole, so that half a
lie never enters an epoch. pynmea2 says which field is where; what a field may hold is decided here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

from mavlink_bridge.language.messages import AngularVelocity, Distance, EulerAngles, FixType
from mavlink_bridge.language.units import knots_to_mps, wrap_pi

SECOND_US: Final = 1_000_000
"""Times are microseconds."""
DAY_US: Final = 86_400 * SECOND_US
"""NMEA gives times of the day; leap seconds are smeared or skipped by receivers."""
_SPEED_MAX_KN: Final = 500.0
"""No receiver on a boat is faster than this: its sentence is damaged."""
_SPEED_MAX_KMH: Final = _SPEED_MAX_KN * 1.852
_KMH_MPS: Final = 1.0 / 3.6
"""An hour has 3600 s, a kilometre 1000 m."""

# The sentences of one epoch repeat time, date and position: three small memories save a third of the decoding.


class BadFieldError(ValueError):
    """A field that is present but cannot be true."""


class PassedOverError(Exception):
    """A sentence of a known name in a form that says nothing to the vessel."""


@dataclass(slots=True)
class EpochPart:
    """What one sentence adds to a GNSS epoch. None = the sentence does not say."""

    kind: str
    talker: str
    tod_us: int | None = None
    """UTC time of day, microseconds; a leap second gives 86 400 s and more."""
    day: int | None = None
    """UTC days since 1970-01-01."""
    fix_type: FixType | None = None
    lat_rad: float | None = None
    lon_rad: float | None = None
    step_m: float = 0.0
    """One unit of the position's last digit."""
    height_msl_m: float | None = None
    geoid_separation_m: float | None = None
    satellites: int | None = None
    hdop: float | None = None
    vdop: float | None = None
    hacc_m: float | None = None
    vacc_m: float | None = None
    sog_mps: float | None = None
    cog_rad: float | None = None
    variation_rad: float | None = None
    dimensions: int | None = None
    """2 or 3, as GSA says that the receiver solves for."""
    dead_reckoning: bool = False
    simulated: bool = False
    doubtful: bool = False
    """Claims a fix with no satellite: only believed beside an RMC or GLL that is valid."""


Part = EpochPart | EulerAngles | AngularVelocity | Distance
"""What one sentence becomes: a part of an epoch, or a measurement by itself."""


def number(value: Any, low: float, high: float) -> float | None:
    """Blank to None; anything that is not a number in [low, high] is malformed."""
    if value is None or value == "":
        return None
    try:
        result = float(value)
    except ValueError:
        raise BadFieldError("not a number") from None
    if not low <= result <= high:
        raise BadFieldError("out of bounds")
    return result


@lru_cache(maxsize=16)
def time_of_day_us(text: str) -> int | None:
    """``hhmmss[.s...]`` to microseconds of the day. Second 60 is a leap second (ITU-R TF.460)."""
    if not text:
        return None
    whole, _, digits = text.partition(".")
    digits = digits[:6]
    if len(whole) != 6 or not whole.isdigit() or (digits and not digits.isdigit()):
        raise BadFieldError("time")
    clock = int(whole)
    hours, minutes, seconds = clock // 10_000, clock // 100 % 100, clock % 100
    if hours > 23 or minutes > 59 or seconds > 60:
        raise BadFieldError("time")
    fraction_us = int(digits.ljust(6, "0")) if digits else 0
    return ((hours * 60 + minutes) * 60 + seconds) * SECOND_US + fraction_us


@lru_cache(maxsize=16)
def day_number(year: int, month: int, day: int) -> int:
    """Days from 1970-01-01 to a date of the Gregorian calendar; malformed when there is no such date."""
    if not (1 <= month <= 12 and 1 <= day <= _month_length(year, month) and 1900 <= year <= 2200):
        raise BadFieldError("date")
    # Counting years from March puts the leap day last.
    shifted_year = year - (month <= 2)
    day_of_year = (153 * (month + (-3 if month > 2 else 9)) + 2) // 5 + day - 1
    return 365 * shifted_year + shifted_year // 4 - shifted_year // 100 + shifted_year // 400 + day_of_year - 719_468


def _month_length(year: int, month: int) -> int:
    if month == 2:
        return 29 if year % 4 == 0 and (year % 100 != 0 or year % 400 == 0) else 28
    return 30 if month in (4, 6, 9, 11) else 31


@lru_cache(maxsize=16)
def coordinate_rad(text: str, hemisphere: str, positive: str, negative: str, limit_deg: int) -> float | None:
    """``dddmm.mmmm`` with its hemisphere letter to radians; blank to None."""
    if not text:
        return None
    whole, _, decimals = text.partition(".")
    if len(whole) < 3 or not whole.isdigit() or (decimals and not decimals.isdigit()):
        raise BadFieldError("coordinate")
    degrees = int(whole[:-2])
    minutes = float(text[len(whole) - 2 :])
    if minutes >= 60.0:
        raise BadFieldError("minutes of arc")
    value = degrees + minutes / 60.0
    if value > limit_deg:
        raise BadFieldError("coordinate")
    if hemisphere == negative:
        return -math.radians(value)
    if hemisphere != positive:
        raise BadFieldError("hemisphere")
    return math.radians(value)


def angle_rad(value: Any, low_deg: float = 0.0, high_deg: float = 360.0) -> float | None:
    degrees = number(value, low_deg, high_deg)
    return None if degrees is None else wrap_pi(math.radians(degrees))


def signed_rad(value: str, letter: str, low_deg: float = 0.0, high_deg: float = 180.0) -> float | None:
    """A value with E or W behind it, east positive. Some talkers sign the number instead and give no letter."""
    degrees = number(value, -high_deg, high_deg) if value else None
    if degrees is None:
        return None
    if letter == "W":
        degrees = -degrees
    elif letter not in ("E", ""):
        raise BadFieldError("E or W")
    return math.radians(degrees)


def speed_mps(knots: str, kmh: str) -> float | None:
    """km/h first: it has the finer step (0.1 km/h = 0.05 kn) when both are cut to the same decimals."""
    from_kmh = number(kmh, 0.0, _SPEED_MAX_KMH) if kmh else None
    if from_kmh is not None:
        return from_kmh * _KMH_MPS
    from_knots = number(knots, 0.0, _SPEED_MAX_KN)
    return None if from_knots is None else knots_to_mps(from_knots)


def count(value: str) -> int | None:
    found = number(value, 0.0, 255.0)
    return None if found is None else int(found)


def full_year(two_digits: int) -> int:
    """1980 to 2079."""
    return 2000 + two_digits if two_digits < 80 else 1900 + two_digits


@lru_cache(maxsize=16)
def date_day(text: str) -> int:
    """``ddmmyy`` to days from 1970-01-01."""
    if len(text) != 6 or not text.isdigit():
        raise BadFieldError("date")
    return day_number(full_year(int(text[4:])), int(text[2:4]), int(text[:2]))


@lru_cache(maxsize=16)
def full_date_day(year: str, month: str, day: str) -> int | None:
    """Three fields to days from 1970-01-01; None when one is blank. Some plotters send years of two digits."""
    years, months, days = number(year, 0.0, 2200.0), number(month, 0.0, 2200.0), number(day, 0.0, 2200.0)
    if years is None or months is None or days is None:
        return None
    return day_number(int(years) if years >= 100 else full_year(int(years)), int(months), int(days))
