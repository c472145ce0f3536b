"""Payload to report: the bit fields of ITU-R M.1371 annex 8, types 1-5, 9, 14, 18, 19, 21, 24 and 27.

A payload of a wrong length is refused whole: a message that was cut still looks like a position, elsewhere. Sentinels become
None; values that the standard does not allow (a course of 400 degrees) become None as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from mavlink_bridge.language.traffic import Sides
from mavlink_bridge.language.units import KNOT_MPS

from .identity import MmsiKind, station_of
from .reports import (
    AidToNavigation,
    AisReport,
    BaseStation,
    FixState,
    PositionReport,
    SafetyText,
    StaticReport,
    StationClass,
)
from .sixbit import Bits

_MINUTE_RAD: Final = math.radians(1.0) / 60.0
"""A minute of arc."""
_FINE: Final = _MINUTE_RAD / 10_000.0
"""Latitude and longitude come in 1/10 000 minute."""
_COARSE: Final = _MINUTE_RAD / 10.0
"""Type 27's come in 1/10 minute."""
_TENTH_DEG: Final = math.radians(0.1)
_TENTH_KNOT_MPS: Final = KNOT_MPS / 10.0
"""Speed comes in tenths of a knot;"""
_SOG_NONE: Final = 1023
"""this one says that it is unknown,"""
_SOG_MOST: Final = 1022
"""and this one 102.2 knots or more (ITU-R M.1371-5 table 48)."""
_COG_END: Final = 3600
"""Courses come in tenths of a degree; from here on they say that there is none."""
_HEADING_END: Final = 360
"""Headings come in degrees; 511 and whatever else is no heading says that there is none."""
_ROT_NONE: Final = -128
"""No turn is known."""
_ROT_FAST: Final = 127
"""Turning faster than 5 degrees in 30 s, without a turn indicator."""
_ROT_SCALE: Final = 4.733
"""The field is 4.733 times the square root of degrees a minute."""
_DEG_MIN_RADPS: Final = math.radians(1.0) / 60.0
"""Degrees a minute."""
_FLOATING_AIDS: Final = range(20, 32)
"""Aid types 20-31 swim; only these can be off their position."""

_Decode = Callable[[Bits], "tuple[AisReport, ...]"]


def _degrees(raw_lat: int, raw_lon: int, step_rad: float) -> tuple[float | None, float | None]:
    """A place; the sentinels 91 and 181 degrees, and all beyond 90 and 180, are none."""
    lat_rad, lon_rad = raw_lat * step_rad, raw_lon * step_rad
    # half a step: the last legal value must not fall to rounding
    if abs(lat_rad) > math.pi / 2 + step_rad / 2 or abs(lon_rad) > math.pi + step_rad / 2:
        return None, None
    return lat_rad, lon_rad


def _sog(raw: int, step_mps: float) -> float | None:
    return None if raw == _SOG_NONE else raw * step_mps


def _cog(raw: int) -> float | None:
    return raw * _TENTH_DEG if raw < _COG_END else None


def _heading(raw: int) -> float | None:
    return math.radians(raw) if raw < _HEADING_END else None


_FIX_STATES: Final = {
    60: FixState.NO_TIME,
    61: FixState.MANUAL,
    62: FixState.DEAD_RECKONING,
    63: FixState.INOPERATIVE,
}


def _second(raw: int) -> tuple[int | None, FixState]:
    return (raw, FixState.GOOD) if raw < 60 else (None, _FIX_STATES[raw])


def turn_of(raw: int) -> tuple[float | None, int]:
    """Rate of turn field to (rad/s, sign): 4.46 deg/min for 10; +-127 give only the sign, -128 nothing."""
    if raw == _ROT_NONE:
        return None, 0
    if abs(raw) == _ROT_FAST:
        return None, 1 if raw > 0 else -1
    root = raw / _ROT_SCALE
    return math.copysign(root * root, raw) * _DEG_MIN_RADPS, 0


def _dimensions(bits: Bits, start: int) -> Sides | None:
    made = Sides(
        bits.unsigned(start, 9), bits.unsigned(start + 9, 9), bits.unsigned(start + 18, 6), bits.unsigned(start + 24, 6)
    )
    return None if made == _NO_DIMENSIONS else made


_NO_DIMENSIONS: Final = Sides(0, 0, 0, 0)


def _class_a(bits: Bits) -> tuple[AisReport, ...]:
    lat_rad, lon_rad = _degrees(bits.signed(89, 27), bits.signed(61, 28), _FINE)
    turn_radps, turn_sign = turn_of(bits.signed(42, 8))
    sog = bits.unsigned(50, 10)
    second, fix = _second(bits.unsigned(137, 6))
    return (
        PositionReport(
            mmsi=bits.unsigned(8, 30),
            repeat=bits.unsigned(6, 2),
            sent=StationClass.CLASS_A,
            lat_rad=lat_rad,
            lon_rad=lon_rad,
            sog_mps=_sog(sog, _TENTH_KNOT_MPS),
            cog_rad=_cog(bits.unsigned(116, 12)),
            heading_rad=_heading(bits.unsigned(128, 9)),
            second=second,
            fix=fix,
            accurate=bits.flag(60),
            raim=bits.flag(148),
            sog_is_least=sog == _SOG_MOST,
            status=bits.unsigned(38, 4),
            turn_radps=turn_radps,
            turn_sign=turn_sign,
        ),
    )


def _base_station(bits: Bits) -> tuple[AisReport, ...]:
    lat_rad, lon_rad = _degrees(bits.signed(107, 27), bits.signed(79, 28), _FINE)
    year, month, day = bits.unsigned(38, 14), bits.unsigned(52, 4), bits.unsigned(56, 5)
    hour, minute, second = bits.unsigned(61, 5), bits.unsigned(66, 6), bits.unsigned(72, 6)
    known = year and 1 <= month <= 12 and day and hour < 24 and minute < 60 and second < 60
    return (
        BaseStation(
            mmsi=bits.unsigned(8, 30),
            repeat=bits.unsigned(6, 2),
            lat_rad=lat_rad,
            lon_rad=lon_rad,
            accurate=bits.flag(78),
            utc=(year, month, day, hour, minute, second) if known else None,
        ),
    )


def _static_a(bits: Bits) -> tuple[AisReport, ...]:
    imo, draught = bits.unsigned(40, 30), bits.unsigned(294, 8)
    return (
        StaticReport(
            mmsi=bits.unsigned(8, 30),
            repeat=bits.unsigned(6, 2),
            kind=5,
            name=bits.text(112, 120),
            callsign=bits.text(70, 42),
            ship_type=bits.unsigned(232, 8),
            dimensions=_dimensions(bits, 240),
            imo=imo or None,
            draught_m=draught / 10.0 if draught else None,
            destination=bits.text(302, 120),
            fix_type=bits.unsigned(270, 4),
        ),
    )


def _sar_aircraft(bits: Bits) -> tuple[AisReport, ...]:
    lat_rad, lon_rad = _degrees(bits.signed(89, 27), bits.signed(61, 28), _FINE)
    sog, altitude = bits.unsigned(50, 10), bits.unsigned(38, 12)
    second, fix = _second(bits.unsigned(128, 6))
    return (
        PositionReport(
            mmsi=bits.unsigned(8, 30),
            repeat=bits.unsigned(6, 2),
            sent=StationClass.SAR_AIRCRAFT,
            lat_rad=lat_rad,
            lon_rad=lon_rad,
            sog_mps=_sog(sog, KNOT_MPS),
            cog_rad=_cog(bits.unsigned(116, 12)),
            second=second,
            fix=fix,
            accurate=bits.flag(60),
            raim=bits.flag(147),
            sog_is_least=sog == _SOG_MOST,
            altitude_m=None if altitude == 4095 else altitude,
        ),
    )


def _safety_text(bits: Bits) -> tuple[AisReport, ...]:
    return (SafetyText(bits.unsigned(8, 30), bits.unsigned(6, 2), bits.text(40, bits.size - 40)),)


def _class_b(bits: Bits) -> PositionReport:
    lat_rad, lon_rad = _degrees(bits.signed(85, 27), bits.signed(57, 28), _FINE)
    sog = bits.unsigned(46, 10)
    second, fix = _second(bits.unsigned(133, 6))
    return PositionReport(
        mmsi=bits.unsigned(8, 30),
        repeat=bits.unsigned(6, 2),
        sent=StationClass.CLASS_B,
        lat_rad=lat_rad,
        lon_rad=lon_rad,
        sog_mps=_sog(sog, _TENTH_KNOT_MPS),
        cog_rad=_cog(bits.unsigned(112, 12)),
        heading_rad=_heading(bits.unsigned(124, 9)),
        second=second,
        fix=fix,
        accurate=bits.flag(56),
        raim=bits.flag(147) if bits.unsigned(0, 6) == 18 else bits.flag(305),
        sog_is_least=sog == _SOG_MOST,
        carrier_sense=bits.flag(141) if bits.unsigned(0, 6) == 18 else None,
    )


def _class_b_position(bits: Bits) -> tuple[AisReport, ...]:
    return (_class_b(bits),)


def _class_b_extended(bits: Bits) -> tuple[AisReport, ...]:
    static = StaticReport(
        mmsi=bits.unsigned(8, 30),
        repeat=bits.unsigned(6, 2),
        kind=19,
        name=bits.text(143, 120),
        ship_type=bits.unsigned(263, 8),
        dimensions=_dimensions(bits, 271),
        fix_type=bits.unsigned(301, 4),
        class_b=True,
    )
    return (_class_b(bits), static)


def _aid(bits: Bits) -> tuple[AisReport, ...]:
    lat_rad, lon_rad = _degrees(bits.signed(192, 27), bits.signed(164, 28), _FINE)
    aid_type, second = bits.unsigned(38, 5), bits.unsigned(253, 6)
    can_say = aid_type in _FLOATING_AIDS and second < 60
    return (
        AidToNavigation(
            mmsi=bits.unsigned(8, 30),
            repeat=bits.unsigned(6, 2),
            aid_type=aid_type,
            name=bits.text(43, 120) + (bits.text(272, bits.size - 272) if bits.size >= 278 else ""),
            lat_rad=lat_rad,
            lon_rad=lon_rad,
            accurate=bits.flag(163),
            dimensions=_dimensions(bits, 219),
            second=second if second < 60 else None,
            off_position=bits.flag(259) if can_say else None,
            virtual=bits.flag(269),
        ),
    )


def _static_b(bits: Bits) -> tuple[AisReport, ...]:
    """Type 24: part 0 is A, 1 is B; others do not exist."""
    mmsi, repeat, part = bits.unsigned(8, 30), bits.unsigned(6, 2), bits.unsigned(38, 2)
    if part == 0:
        return (StaticReport(mmsi, repeat, kind=24, name=bits.text(40, 120), class_b=True),)
    if part != 1 or bits.size < 168:
        return ()
    craft = station_of(mmsi) is MmsiKind.CRAFT
    return (
        StaticReport(
            mmsi=mmsi,
            repeat=repeat,
            kind=24,
            callsign=bits.text(90, 42),
            ship_type=bits.unsigned(40, 8),
            dimensions=None if craft else _dimensions(bits, 132),
            vendor=bits.text(48, 18),
            mothership=bits.unsigned(132, 30) if craft else None,
            class_b=True,
        ),
    )


def _long_range(bits: Bits) -> tuple[AisReport, ...]:
    lat_rad, lon_rad = _degrees(bits.signed(62, 17), bits.signed(44, 18), _COARSE)
    sog, cog = bits.unsigned(79, 6), bits.unsigned(85, 9)
    return (
        PositionReport(
            mmsi=bits.unsigned(8, 30),
            repeat=bits.unsigned(6, 2),
            sent=StationClass.LONG_RANGE,
            lat_rad=lat_rad,
            lon_rad=lon_rad,
            sog_mps=None if sog == 63 else sog * KNOT_MPS,
            cog_rad=math.radians(cog) if cog < 360 else None,
            accurate=bits.flag(38),
            raim=bits.flag(39),
            sog_is_least=sog == 62,
            status=bits.unsigned(40, 4),
            late=bits.flag(94),
        ),
    )


_TABLE: Final[dict[int, tuple[_Decode, range]]] = {
    1: (_class_a, range(168, 174)),
    2: (_class_a, range(168, 174)),
    3: (_class_a, range(168, 174)),
    4: (_base_station, range(168, 174)),
    5: (_static_a, range(420, 430)),
    9: (_sar_aircraft, range(168, 174)),
    14: (_safety_text, range(40, 1009)),
    18: (_class_b_position, range(168, 174)),
    19: (_class_b_extended, range(312, 318)),
    21: (_aid, range(272, 369)),
    24: (_static_b, range(160, 174)),
    27: (_long_range, range(96, 102)),
}
"""What reads a type, and the least and most bits that it has. Up to 5 bits of padding are in use where the fill field is not;
type 5 comes with 420 and 422 of its 424 bits, 24 A with 160 or 168, 21 filled up to whole bytes."""
_FILLED_SLOT: Final = {27: 168}
"""Some stations fill the short type 27 up to a whole slot."""


class WrongLengthError(ValueError):
    """A known type that is too short or too long to be itself."""


def decode(bits: Bits) -> tuple[AisReport, ...]:
    """Return what a payload says: one report, two for type 19, none for types that the vessel has no use for.

    Raises WrongLengthError.
    """
    kind = bits.unsigned(0, 6)
    row = _TABLE.get(kind)
    if row is None:
        return ()
    read, sizes = row
    if bits.size not in sizes and bits.size != _FILLED_SLOT.get(kind):
        raise WrongLengthError(f"type {kind} of {bits.size} bits")
    return read(bits)
