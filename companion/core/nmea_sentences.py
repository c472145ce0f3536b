"""The meaning of single NMEA 0183 sentences: a checked body in, one typed part in SI units out.

pynmea2 lays out the fields (which field is where, plain numbers); this module adds what it lacks: bounds, blank =
unknown, leap seconds, strict coordinates, and sentences it does not know. A sentence with any field out of bounds is
refused whole, so that half a lie never enters an epoch.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import pynmea2

from companion.core.units import knots_to_mps, wrap_pi
from mavlink_bridge.imc import FixType

SECOND_US: Final = 1_000_000
DAY_US: Final = 86_400 * SECOND_US
_SPEED_MAX_KN: Final = 500.0
_MINUTE_M: Final = 1852.0
_KMH_MPS: Final = 1.0 / 3.6
_FOOT_M: Final = 0.3048
_FATHOM_M: Final = 1.8288
_DEPTH_MAX_M: Final = 12_000.0
_HEIGHT_MAX_M: Final = 100_000.0
_SIGMA_MAX_M: Final = 1.0e6


class MalformedError(ValueError):
    """A field that is present but cannot be true."""


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
    dead_reckoning: bool = False
    simulated: bool = False
    doubtful: bool = False
    """Claims a fix with no satellite: only believed beside an RMC or GLL that is valid."""


@dataclass(slots=True)
class AttitudePart:
    """Heading, roll, pitch: only the axes that the sentence measures."""

    kind: str
    talker: str
    phi_rad: float | None = None
    theta_rad: float | None = None
    psi_rad: float | None = None
    psi_magnetic_rad: float | None = None
    variation_rad: float | None = None
    psi_accuracy_rad: float | None = None


@dataclass(slots=True)
class RatePart:
    """Turn rate, starboard positive."""

    kind: str
    talker: str
    r_radps: float | None = None


@dataclass(slots=True)
class DepthPart:
    """Depth as the sentence gives it; ``kind`` says below what (DBT, DPT transducer, DBS surface, DBK keel)."""

    kind: str
    talker: str
    value_m: float | None = None
    offset_m: float | None = None
    range_max_m: float | None = None


Part = EpochPart | AttitudePart | RatePart | DepthPart

# Sentences that pynmea2 does not know, added the way its own are made.
_THS: Final = type(
    "THS", (pynmea2.TalkerSentence,), {"fields": (("Heading", "heading", float), ("Mode", "mode_indicator"))}
)
_DBK: Final = type(
    "DBK",
    (pynmea2.TalkerSentence,),
    {
        "fields": (
            ("Depth below keel, feet", "depth_feet", float),
            ("Feet", "unit_feet"),
            ("Depth below keel, metres", "depth_meters", float),
            ("Metres", "unit_meters"),
            ("Depth below keel, fathoms", "depth_fathoms", float),
            ("Fathoms", "unit_fathoms"),
        )
    },
)
_SATHPR: Final = type(
    "SATHPR",
    (pynmea2.ProprietarySentence,),
    {
        "fields": (
            ("Blank", "_blank"),
            ("Subtype", "subtype"),
            ("Timestamp", "timestamp"),
            ("Heading", "heading", float),
            ("Pitch", "pitch", float),
            ("Roll", "roll", float),
            ("Source of the angles", "source"),
        )
    },
)


def number(value: Any, low: float, high: float) -> float | None:
    """Blank to None; anything that is not a number in [low, high] is malformed."""
    if value is None or value == "":
        return None
    try:
        result = float(value)
    except ValueError:
        raise MalformedError("not a number") from None
    if not low <= result <= high:
        raise MalformedError("out of bounds")
    return result


def time_of_day_us(text: str) -> int | None:
    """``hhmmss[.s...]`` to microseconds of the day. Second 60 is a leap second (ITU-R TF.460)."""
    if not text:
        return None
    if len(text) < 6 or not text[:6].isdigit():
        raise MalformedError("time")
    hours, minutes, seconds = int(text[:2]), int(text[2:4]), int(text[4:6])
    if hours > 23 or minutes > 59 or seconds > 60:
        raise MalformedError("time")
    fraction_us = 0
    if len(text) > 6:
        digits = text[7:13]
        if text[6] != "." or (digits and not digits.isdigit()):
            raise MalformedError("time")
        fraction_us = int(digits.ljust(6, "0"))
    return ((hours * 60 + minutes) * 60 + seconds) * SECOND_US + fraction_us


def day_number(year: int, month: int, day: int) -> int:
    """Days from 1970-01-01 to a date of the Gregorian calendar; malformed when there is no such date."""
    if not (1 <= month <= 12 and 1 <= day <= _month_length(year, month) and 1900 <= year <= 2200):
        raise MalformedError("date")
    # Counting years from March puts the leap day last.
    shifted_year = year - (month <= 2)
    day_of_year = (153 * (month + (-3 if month > 2 else 9)) + 2) // 5 + day - 1
    return 365 * shifted_year + shifted_year // 4 - shifted_year // 100 + shifted_year // 400 + day_of_year - 719_468


def _month_length(year: int, month: int) -> int:
    if month == 2:
        return 29 if year % 4 == 0 and (year % 100 != 0 or year % 400 == 0) else 28
    return 30 if month in (4, 6, 9, 11) else 31


def coordinate_rad(text: str, hemisphere: str, positive: str, negative: str, limit_deg: int) -> float | None:
    """``dddmm.mmmm`` with its hemisphere letter to radians; blank to None."""
    if not text:
        return None
    point = text.find(".")
    whole = text if point < 0 else text[:point]
    if (
        len(whole) < 3
        or not whole.isdigit()
        or not (point < 0 or text[point + 1 :].isdigit() or point + 1 == len(text))
    ):
        raise MalformedError("coordinate")
    degrees = int(whole[:-2])
    minutes = float(text[len(whole) - 2 :])
    if minutes >= 60.0:
        raise MalformedError("minutes of arc")
    value = degrees + minutes / 60.0
    if value > limit_deg:
        raise MalformedError("coordinate")
    if hemisphere == negative:
        return -math.radians(value)
    if hemisphere != positive:
        raise MalformedError("hemisphere")
    return math.radians(value)


def _angle(value: Any, low_deg: float = 0.0, high_deg: float = 360.0) -> float | None:
    degrees = number(value, low_deg, high_deg)
    return None if degrees is None else wrap_pi(math.radians(degrees))


def _signed(value: Any, letter: str, low_deg: float = 0.0, high_deg: float = 180.0) -> float | None:
    """A value with E or W behind it, east positive. Some talkers sign the number instead and give no letter."""
    degrees = number(value, -high_deg, high_deg)
    if degrees is None:
        return None
    if letter == "W":
        degrees = -degrees
    elif letter not in ("E", ""):
        raise MalformedError("E or W")
    return math.radians(degrees)


def _speed(knots: Any, kmh: Any) -> float | None:
    """km/h first: it has the finer step (0.1 km/h = 0.05 kn) when both are cut to the same decimals."""
    from_kmh = number(kmh, 0.0, _SPEED_MAX_KN * 1.852)
    if from_kmh is not None:
        return from_kmh * _KMH_MPS
    from_knots = number(knots, 0.0, _SPEED_MAX_KN)
    return None if from_knots is None else knots_to_mps(from_knots)


def _count(value: Any) -> int | None:
    found = number(value, 0, 255)
    return None if found is None else int(found)


def _position(part: EpochPart, sentence: Any) -> None:
    part.lat_rad = coordinate_rad(sentence.lat, sentence.lat_dir, "N", "S", 90)
    part.lon_rad = coordinate_rad(sentence.lon, sentence.lon_dir, "E", "W", 180)
    if part.lat_rad is None or part.lon_rad is None:
        part.lat_rad = part.lon_rad = None
        part.fix_type = FixType.NONE
        return
    part.step_m = _MINUTE_M * 10.0 ** -len(sentence.lat.partition(".")[2])


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


def _zda(s: Any) -> EpochPart:
    part = EpochPart("ZDA", s.talker, tod_us=time_of_day_us(s.data[0]))
    year, month, day = (number(value, 0, 2200) for value in (s.year, s.month, s.day))
    if year is not None and month is not None and day is not None:
        full = int(year) if year >= 100 else _full_year(int(year))  # some plotters send two digits
        part.day = day_number(full, int(month), int(day))
    return part


def _gga(s: Any) -> EpochPart:
    part = EpochPart("GGA", s.talker, tod_us=time_of_day_us(s.data[0]))
    quality = number(s.gps_qual, 0, 9)
    part.fix_type = FixType.NONE if quality is None else _QUALITY[int(quality)]
    part.dead_reckoning = quality == 6
    part.simulated = quality in (7, 8)
    _position(part, s)
    part.satellites = _count(s.num_sats)
    if part.satellites == 0 and quality is not None and quality <= 5:
        part.doubtful = True  # some receivers keep the last quality when all satellites are lost, some never count
    part.hdop = number(s.horizontal_dil, 0.0, 1000.0)
    part.height_msl_m = number(s.altitude, -_HEIGHT_MAX_M, _HEIGHT_MAX_M)
    part.geoid_separation_m = number(s.geo_sep, -1000.0, 1000.0)
    return part


def _gns(s: Any) -> EpochPart:
    part = EpochPart("GNS", s.talker, tod_us=time_of_day_us(s.data[0]))
    letters = s.mode_indicator
    if letters.strip(_MODE_RANK):
        raise MalformedError("mode")
    _mode(part, max(letters, key=_MODE_RANK.index, default="N"))
    if part.fix_type == FixType.FIX_2D and not part.dead_reckoning and s.altitude:
        part.fix_type = FixType.FIX_3D
    _position(part, s)
    part.satellites = _count(s.num_sats)
    part.hdop = number(s.hdop, 0.0, 1000.0)
    part.height_msl_m = number(s.altitude, -_HEIGHT_MAX_M, _HEIGHT_MAX_M)
    part.geoid_separation_m = number(s.geo_sep, -1000.0, 1000.0)
    return part


def _status(part: EpochPart, status: str, letter: str) -> None:
    if status == "A":
        _mode(part, letter or "A")
    else:
        part.fix_type = FixType.NONE


def _gll(s: Any) -> EpochPart:
    data = s.data
    part = EpochPart("GLL", s.talker, tod_us=time_of_day_us(data[4]) if len(data) > 4 else None)
    # Before version 2.0 of the standard GLL ended with the longitude.
    _status(part, s.status if len(data) > 5 else "A", s.faa_mode)
    _position(part, s)
    return part


def _rmc(s: Any) -> EpochPart:
    part = EpochPart("RMC", s.talker, tod_us=time_of_day_us(s.data[0]))
    date = s.data[8] if len(s.data) > 8 else ""
    if date:
        if len(date) != 6 or not date.isdigit():
            raise MalformedError("date")
        part.day = day_number(_full_year(int(date[4:])), int(date[2:4]), int(date[:2]))
    _status(part, s.status, s.mode_indicator)
    _position(part, s)
    if part.fix_type != FixType.NONE:
        part.sog_mps = _speed(s.spd_over_grnd, "")
        part.cog_rad = _angle(s.true_course)
        part.variation_rad = _signed(s.mag_variation, s.mag_var_dir)
    return part


def _full_year(two_digits: int) -> int:
    return 2000 + two_digits if two_digits < 80 else 1900 + two_digits


def _vtg(s: Any) -> EpochPart:
    part = EpochPart("VTG", s.talker)
    if s.true_track_sym not in ("T", ""):
        raise MalformedError("course unit")
    if s.faa_mode == "N":
        return part
    part.cog_rad = _angle(s.true_track)
    part.sog_mps = _speed(s.spd_over_grnd_kts, s.spd_over_grnd_kmph)
    return part


def _gst(s: Any) -> EpochPart:
    part = EpochPart("GST", s.talker, tod_us=time_of_day_us(s.data[0]))
    north = number(s.std_dev_latitude, 0.0, _SIGMA_MAX_M)
    east = number(s.std_dev_longitude, 0.0, _SIGMA_MAX_M)
    if north is not None and east is not None:
        part.hacc_m = math.hypot(north, east)
    part.vacc_m = number(s.std_dev_altitude, 0.0, _SIGMA_MAX_M)
    return part


def _gsa(s: Any) -> EpochPart:
    part = EpochPart("GSA", s.talker)
    part.vdop = number(s.vdop, 0.0, 1000.0)
    return part


def _hdt(s: Any) -> AttitudePart:
    return AttitudePart("HDT", s.talker, psi_rad=_angle(s.heading))


def _ths(s: Any) -> AttitudePart:
    """Mode A measured, E estimated; M manual, S simulator and V void are no heading."""
    return AttitudePart("THS", s.talker, psi_rad=_angle(s.heading) if s.mode_indicator in ("A", "E") else None)


def _hdg(s: Any) -> AttitudePart:
    part = AttitudePart("HDG", s.talker, psi_magnetic_rad=_angle(s.heading))
    deviation = _signed(s.deviation, s.dev_dir)
    if part.psi_magnetic_rad is not None and deviation is not None:
        part.psi_magnetic_rad = wrap_pi(part.psi_magnetic_rad + deviation)
    part.variation_rad = _signed(s.variation, s.var_dir)
    return part


def _hdm(s: Any) -> AttitudePart:
    return AttitudePart("HDM", s.talker, psi_magnetic_rad=_angle(s.heading))


def _rot(s: Any) -> RatePart:
    rate = number(s.rate_of_turn, -10_000.0, 10_000.0)
    valid = s.status in ("A", "") and rate is not None
    return RatePart("ROT", s.talker, math.radians(rate) / 60.0 if valid and rate is not None else None)


def _feet_or_metres(feet: Any, metres: Any, fathoms: Any) -> float | None:
    for value, unit_m in ((metres, 1.0), (feet, _FOOT_M), (fathoms, _FATHOM_M)):
        found = number(value, 0.0, _DEPTH_MAX_M / unit_m)
        if found is not None:
            return found * unit_m
    return None


def _dpt(s: Any) -> DepthPart:
    part = DepthPart("DPT", s.talker, number(s.depth, 0.0, _DEPTH_MAX_M))
    part.offset_m = number(s.offset, -100.0, 100.0)
    part.range_max_m = number(s.range, 0.0, _DEPTH_MAX_M)
    return part


def _dbt(s: Any) -> DepthPart:
    return DepthPart("DBT", s.talker, _feet_or_metres(s.depth_feet, s.depth_meters, s.depth_fathoms))


def _dbk(s: Any) -> DepthPart:
    return DepthPart("DBK", s.talker, _feet_or_metres(s.depth_feet, s.depth_meters, s.depth_fathoms))


def _dbs(s: Any) -> DepthPart:
    fathoms = s.data[4] if len(s.data) > 4 else ""  # pynmea2 has a blank inside this field's name
    return DepthPart("DBS", s.talker, _feet_or_metres(s.depth_feet, s.depth_meter, fathoms))


_ROLL_NAMES: Final = frozenset({"ROLL", "HEEL", "BOATROLL", "VESSEL ROLL"})
_PITCH_NAMES: Final = frozenset({"PITCH", "PTCH", "TRIM", "BOATPITCH", "VESSEL PITCH"})


def _xdr(s: Any) -> AttitudePart:
    """Any group of type A (angle) in degrees that is named after roll or pitch; other transducers are passed over."""
    part = AttitudePart("XDR", s.talker)
    data = s.data
    for first in range(0, len(data) - 3, 4):
        kind, value, unit, name = data[first : first + 4]
        if kind != "A" or unit != "D":
            continue
        name = name.upper()
        if name in _ROLL_NAMES:
            part.phi_rad = _angle(value, -180.0, 180.0)
        elif name in _PITCH_NAMES:
            part.theta_rad = _angle(value, -90.0, 90.0)
    return part


def _pashr(s: Any) -> AttitudePart | None:
    """The attitude form (time, heading, T, roll, pitch, heave, accuracies) and the older HPR form."""
    if isinstance(s, pynmea2.ash.ASHRHPR):
        return AttitudePart(
            "PASHR",
            "",
            phi_rad=_angle(s.roll, -180.0, 180.0),
            theta_rad=_angle(s.pitch, -90.0, 90.0),
            psi_rad=_angle(s.heading),
        )
    if not isinstance(s, pynmea2.ash.ASHRATT):
        return None
    part = AttitudePart("PASHR", "")
    if s.is_true_heading == "T":
        part.psi_rad = _angle(s.true_heading)
    part.phi_rad = _angle(s.roll, -180.0, 180.0)
    part.theta_rad = _angle(s.pitch, -90.0, 90.0)
    accuracy = number(s.heading_accuracy, 0.0, 360.0)
    part.psi_accuracy_rad = None if accuracy is None else math.radians(accuracy)
    return part


def _psat(s: Any) -> AttitudePart | None:
    if s.subtype != "HPR":
        return None
    return AttitudePart(
        "PSAT",
        "",
        phi_rad=_angle(s.roll, -180.0, 180.0),
        theta_rad=_angle(s.pitch, -90.0, 90.0),
        psi_rad=_angle(s.heading),
    )


def _psxn(s: Any) -> AttitudePart | None:
    if not isinstance(s, pynmea2.sxn.SXN23):
        return None
    return AttitudePart(
        "PSXN",
        "",
        phi_rad=_angle(s.roll, -180.0, 180.0),
        theta_rad=_angle(s.pitch, -90.0, 90.0),
        psi_rad=_angle(s.head),
    )


def _ptnl(s: Any) -> AttitudePart | None:
    """AVR: yaw and tilt of the antenna baseline; quality 0 is no fix. Which axis tilt is depends on the mounting."""
    if not isinstance(s, pynmea2.tnl.TNLAVR):
        return None
    part = AttitudePart("PTNL", "")
    quality = number(s.gps_quality, 0, 9)
    if not quality:
        return part
    part.psi_rad = _angle(s.yaw_angle)
    part.theta_rad = _angle(s.tilt_angle, -90.0, 90.0) if s.tilt == "Tilt" else None
    part.phi_rad = _angle(s.roll_angle, -180.0, 180.0) if s.roll == "Roll" else None
    return part


_TALKER: Final[dict[str, Callable[[Any], Part | None]]] = {
    "ZDA": _zda,
    "GGA": _gga,
    "GNS": _gns,
    "GLL": _gll,
    "RMC": _rmc,
    "VTG": _vtg,
    "GST": _gst,
    "GSA": _gsa,
    "HDT": _hdt,
    "THS": _ths,
    "HDG": _hdg,
    "HDM": _hdm,
    "ROT": _rot,
    "DPT": _dpt,
    "DBT": _dbt,
    "DBS": _dbs,
    "DBK": _dbk,
    "XDR": _xdr,
}
_PROPRIETARY: Final[dict[str, tuple[Any, Callable[[Any], Part | None]]]] = {
    "PASHR": (pynmea2.ash.ASH, _pashr),
    "PSAT": (_SATHPR, _psat),
    "PSXN": (pynmea2.sxn.SXN, _psxn),
    "PTNL": (pynmea2.tnl.TNL, _ptnl),
}
_LAYOUT: Final[dict[str, Any]] = {kind: pynmea2.TalkerSentence.sentence_types[kind] for kind in _TALKER}

KINDS: Final = frozenset(_TALKER) | frozenset(_PROPRIETARY)
"""The formatters understood: three letters, or the proprietary name."""


def kind_of(address: str) -> tuple[str, str]:
    """Split an address field into (talker, formatter): ``GPGGA`` to GP, GGA; proprietary ones have no talker."""
    if address.startswith("P") and address in _PROPRIETARY:
        return "", address
    if len(address) == 5:
        return address[:2], address[2:]
    return "", address


def parse(body: str) -> Part | None:
    """Decode one checked body. None when the sentence is unknown or says nothing here.

    Raises MalformedError for a known sentence with an impossible field.
    """
    address, _, rest = body.partition(",")
    talker, kind = kind_of(address)
    handler = _TALKER.get(kind)
    if handler is not None and talker:
        if "_" in rest:
            raise MalformedError("underscore")
        return handler(_LAYOUT[kind](talker, kind, rest.split(",")))
    if address in _PROPRIETARY:
        return _parse_proprietary(address, rest)
    return None


def _parse_proprietary(address: str, rest: str) -> Part | None:
    if "_" in rest:
        raise MalformedError("underscore")
    layout, handler = _PROPRIETARY[address]
    fields = rest.split(",")
    if address == "PASHR" and fields[0][:6].isdigit():
        fields[0] = "000000.00"  # pynmea2 knows the attitude form by a time of two or three decimals only
    return handler(layout(address[1:4], ["R" if address == "PASHR" else "", *fields]))
