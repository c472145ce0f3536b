"""Heading, attitude, turn rate and depth sentences, standard and proprietary."""

from __future__ import annotations

import math
from typing import Any, Final

import pynmea2

from companion.core.nmea_fields import AttitudePart, DepthPart, RatePart, angle_rad, number, signed_rad
from companion.core.units import wrap_pi

_FOOT_M: Final = 0.3048
_FATHOM_M: Final = 1.8288
_DEPTH_MAX_M: Final = 12_000.0

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
SATHPR: Final = type(
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


def hdt(talker: str, heading: str) -> AttitudePart:
    return AttitudePart("HDT", talker, None, None, angle_rad(heading))


def ths(talker: str, fields: tuple[str, ...]) -> AttitudePart:
    """Mode A measured, E estimated; M manual, S simulator and V void are no heading."""
    heading, mode = fields
    return AttitudePart("THS", talker, psi_rad=angle_rad(heading) if mode in ("A", "E") else None)


def hdg(talker: str, fields: tuple[str, ...]) -> AttitudePart:
    heading, deviation, deviation_letter, variation, variation_letter = fields
    part = AttitudePart("HDG", talker, psi_magnetic_rad=angle_rad(heading))
    deviation_rad = signed_rad(deviation, deviation_letter)
    if part.psi_magnetic_rad is not None and deviation_rad is not None:
        part.psi_magnetic_rad = wrap_pi(part.psi_magnetic_rad + deviation_rad)
    part.variation_rad = signed_rad(variation, variation_letter)
    return part


def hdm(talker: str, heading: str) -> AttitudePart:
    return AttitudePart("HDM", talker, psi_magnetic_rad=angle_rad(heading))


def rot(talker: str, fields: tuple[str, ...]) -> RatePart:
    text, status = fields
    rate = number(text, -10_000.0, 10_000.0)
    if rate is None or (status and status != "A"):
        return RatePart("ROT", talker)
    return RatePart("ROT", talker, math.radians(rate) / 60.0)


def _feet_or_metres(fields: tuple[str, ...]) -> float | None:
    feet, metres, fathoms = fields
    for text, unit_m in ((metres, 1.0), (feet, _FOOT_M), (fathoms, _FATHOM_M)):
        found = number(text, 0.0, _DEPTH_MAX_M / unit_m)
        if found is not None:
            return found * unit_m
    return None


def dpt(talker: str, fields: tuple[str, ...]) -> DepthPart:
    depth, offset, range_max = fields
    return DepthPart(
        "DPT",
        talker,
        number(depth, 0.0, _DEPTH_MAX_M),
        number(offset, -100.0, 100.0),
        number(range_max, 0.0, _DEPTH_MAX_M),
    )


def dbt(talker: str, fields: tuple[str, ...]) -> DepthPart:
    return DepthPart("DBT", talker, _feet_or_metres(fields))


def dbk(talker: str, fields: tuple[str, ...]) -> DepthPart:
    return DepthPart("DBK", talker, _feet_or_metres(fields))


def dbs(talker: str, fields: tuple[str, ...]) -> DepthPart:
    return DepthPart("DBS", talker, _feet_or_metres(fields))


_ROLL_NAMES: Final = frozenset({"ROLL", "HEEL", "BOATROLL", "VESSEL ROLL"})
_PITCH_NAMES: Final = frozenset({"PITCH", "PTCH", "TRIM", "BOATPITCH", "VESSEL PITCH"})


def xdr(talker: str, fields: tuple[str, ...]) -> AttitudePart:
    """Any group of type A (angle) in degrees that is named after roll or pitch; other transducers are passed over."""
    part = AttitudePart("XDR", talker)
    for first in range(0, len(fields) - 3, 4):
        kind, value, unit, name = fields[first : first + 4]
        if kind != "A" or unit != "D":
            continue
        name = name.upper()
        if name in _ROLL_NAMES:
            part.phi_rad = angle_rad(value, -180.0, 180.0)
        elif name in _PITCH_NAMES:
            part.theta_rad = angle_rad(value, -90.0, 90.0)
    return part


def pashr(s: Any) -> AttitudePart | None:
    """The attitude form (time, heading, T, roll, pitch, heave, accuracies) and the older HPR form."""
    if isinstance(s, pynmea2.ash.ASHRHPR):
        return AttitudePart(
            "PASHR",
            "",
            phi_rad=angle_rad(s.roll, -180.0, 180.0),
            theta_rad=angle_rad(s.pitch, -90.0, 90.0),
            psi_rad=angle_rad(s.heading),
        )
    if not isinstance(s, pynmea2.ash.ASHRATT):
        return None
    part = AttitudePart("PASHR", "")
    if s.is_true_heading == "T":
        part.psi_rad = angle_rad(s.true_heading)
    part.phi_rad = angle_rad(s.roll, -180.0, 180.0)
    part.theta_rad = angle_rad(s.pitch, -90.0, 90.0)
    accuracy = number(s.heading_accuracy, 0.0, 360.0)
    part.psi_accuracy_rad = None if accuracy is None else math.radians(accuracy)
    return part


def psat(s: Any) -> AttitudePart | None:
    if s.subtype != "HPR":
        return None
    return AttitudePart(
        "PSAT",
        "",
        phi_rad=angle_rad(s.roll, -180.0, 180.0),
        theta_rad=angle_rad(s.pitch, -90.0, 90.0),
        psi_rad=angle_rad(s.heading),
    )


def psxn(s: Any) -> AttitudePart | None:
    if not isinstance(s, pynmea2.sxn.SXN23):
        return None
    return AttitudePart(
        "PSXN",
        "",
        phi_rad=angle_rad(s.roll, -180.0, 180.0),
        theta_rad=angle_rad(s.pitch, -90.0, 90.0),
        psi_rad=angle_rad(s.head),
    )


def ptnl(s: Any) -> AttitudePart | None:
    """AVR: yaw and tilt of the antenna baseline; quality 0 is no fix. Which axis tilt is depends on the mounting."""
    if not isinstance(s, pynmea2.tnl.TNLAVR):
        return None
    part = AttitudePart("PTNL", "")
    quality = number(s.gps_quality, 0, 9)
    if not quality:
        return part
    part.psi_rad = angle_rad(s.yaw_angle)
    part.theta_rad = angle_rad(s.tilt_angle, -90.0, 90.0) if s.tilt == "Tilt" else None
    part.phi_rad = angle_rad(s.roll_angle, -180.0, 180.0) if s.roll == "Roll" else None
    return part
