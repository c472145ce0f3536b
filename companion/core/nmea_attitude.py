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


def hdt(s: Any) -> AttitudePart:
    return AttitudePart("HDT", s.talker, psi_rad=angle_rad(s.heading))


def ths(s: Any) -> AttitudePart:
    """Mode A measured, E estimated; M manual, S simulator and V void are no heading."""
    return AttitudePart("THS", s.talker, psi_rad=angle_rad(s.heading) if s.mode_indicator in ("A", "E") else None)


def hdg(s: Any) -> AttitudePart:
    part = AttitudePart("HDG", s.talker, psi_magnetic_rad=angle_rad(s.heading))
    deviation = signed_rad(s.deviation, s.dev_dir)
    if part.psi_magnetic_rad is not None and deviation is not None:
        part.psi_magnetic_rad = wrap_pi(part.psi_magnetic_rad + deviation)
    part.variation_rad = signed_rad(s.variation, s.var_dir)
    return part


def hdm(s: Any) -> AttitudePart:
    return AttitudePart("HDM", s.talker, psi_magnetic_rad=angle_rad(s.heading))


def rot(s: Any) -> RatePart:
    rate = number(s.rate_of_turn, -10_000.0, 10_000.0)
    valid = s.status in ("A", "") and rate is not None
    return RatePart("ROT", s.talker, math.radians(rate) / 60.0 if valid and rate is not None else None)


def _feet_or_metres(feet: Any, metres: Any, fathoms: Any) -> float | None:
    for value, unit_m in ((metres, 1.0), (feet, _FOOT_M), (fathoms, _FATHOM_M)):
        found = number(value, 0.0, _DEPTH_MAX_M / unit_m)
        if found is not None:
            return found * unit_m
    return None


def dpt(s: Any) -> DepthPart:
    part = DepthPart("DPT", s.talker, number(s.depth, 0.0, _DEPTH_MAX_M))
    part.offset_m = number(s.offset, -100.0, 100.0)
    part.range_max_m = number(s.range, 0.0, _DEPTH_MAX_M)
    return part


def dbt(s: Any) -> DepthPart:
    return DepthPart("DBT", s.talker, _feet_or_metres(s.depth_feet, s.depth_meters, s.depth_fathoms))


def dbk(s: Any) -> DepthPart:
    return DepthPart("DBK", s.talker, _feet_or_metres(s.depth_feet, s.depth_meters, s.depth_fathoms))


def dbs(s: Any) -> DepthPart:
    fathoms = s.data[4] if len(s.data) > 4 else ""  # pynmea2 has a blank inside this field's name
    return DepthPart("DBS", s.talker, _feet_or_metres(s.depth_feet, s.depth_meter, fathoms))


_ROLL_NAMES: Final = frozenset({"ROLL", "HEEL", "BOATROLL", "VESSEL ROLL"})
_PITCH_NAMES: Final = frozenset({"PITCH", "PTCH", "TRIM", "BOATPITCH", "VESSEL PITCH"})


def xdr(s: Any) -> AttitudePart:
    """Any group of type A (angle) in degrees that is named after roll or pitch; other transducers are passed over."""
    part = AttitudePart("XDR", s.talker)
    data = s.data
    for first in range(0, len(data) - 3, 4):
        kind, value, unit, name = data[first : first + 4]
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
