"""Heading, attitude, turn rate and depth sentences, standard and proprietary."""

from __future__ import annotations

import math
from typing import Any, Final

import pynmea2

from mavlink_bridge.language.messages import AngularVelocity, Distance, EulerAngles
from mavlink_bridge.language.units import wrap_pi

from .fields import PassedOverError, angle_rad, number, signed_rad

_FOOT_M: Final = 0.3048
_FATHOM_M: Final = 1.8288
_DEPTH_MAX_M: Final = 12_000.0
"""The deepest trench is 10 935 m."""

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
STI036: Final = type(
    "STI036",
    (pynmea2.ProprietarySentence,),
    {
        "fields": (
            ("Blank", "_blank"),
            ("Subtype", "subtype"),
            ("UTC", "timestamp"),
            ("Date", "datestamp"),
            ("Heading", "heading", float),
            ("Pitch", "pitch", float),
            ("Roll", "roll", float),
            ("Mode indicator", "mode_indicator"),
        )
    },
)
TNTHTM: Final = type(
    "TNTHTM",
    (pynmea2.ProprietarySentence,),
    {
        "fields": (
            ("Blank", "_blank"),
            ("Heading", "heading"),
            ("Magnetometer status", "heading_status"),
            ("Pitch", "pitch"),
            ("Pitch status", "pitch_status"),
            ("Roll", "roll"),
            ("Roll status", "roll_status"),
            ("Dip", "dip"),
            ("Horizontal field", "field"),
        )
    },
)
_TNT_GOOD: Final = frozenset("MNO")
"""Normal, and warned of as low or high; the others are alarms (True North Revolution manual)."""
_TNT_COUNT_DEG: Final = 360.0 / 65_536.0
"""A turn in 16 bits."""


def hdt(t_us: int, fields: tuple[str, str]) -> EulerAngles | None:
    """One that calls itself magnetic, or anything else than true, is no true heading."""
    heading, letter = fields
    return _true(t_us, heading) if letter in ("T", "") else None


def _true(t_us: int, heading: str) -> EulerAngles | None:
    psi_rad = angle_rad(heading)
    return None if psi_rad is None else EulerAngles(t_us, None, None, psi_rad)


def ths(t_us: int, fields: tuple[str, ...]) -> EulerAngles | None:
    """Mode A measured, E estimated; M manual, S simulator and V void are no heading."""
    heading, mode = fields
    return _true(t_us, heading) if mode in ("A", "E") else None


def hdg(t_us: int, fields: tuple[str, ...]) -> EulerAngles | None:
    heading, deviation, deviation_letter, variation, variation_letter = fields
    magnetic_rad = angle_rad(heading)
    deviation_rad = signed_rad(deviation, deviation_letter)
    variation_rad = signed_rad(variation, variation_letter)
    if magnetic_rad is None:
        return None
    if deviation_rad is not None:
        magnetic_rad = wrap_pi(magnetic_rad + deviation_rad)
    return EulerAngles(t_us, psi_magnetic_rad=magnetic_rad, variation_rad=variation_rad)


def hdm(t_us: int, heading: str) -> EulerAngles | None:
    magnetic_rad = angle_rad(heading)
    return None if magnetic_rad is None else EulerAngles(t_us, psi_magnetic_rad=magnetic_rad)


def rot(t_us: int, fields: tuple[str, ...]) -> AngularVelocity | None:
    text, status = fields
    rate = number(text, -10_000.0, 10_000.0)
    if rate is None or (status and status != "A"):
        return None
    return AngularVelocity(t_us, math.radians(rate) / 60.0)


def dpt(t_us: int, fields: tuple[str, ...]) -> Distance:
    depth, offset, range_max = fields
    return Distance(
        t_us, number(depth, 0.0, _DEPTH_MAX_M), number(offset, -100.0, 100.0), number(range_max, 0.0, _DEPTH_MAX_M)
    )


def depth(t_us: int, fields: tuple[str, ...]) -> Distance:
    """DBT, DBS, DBK: the depth in feet, metres and fathoms, metres first; the sentence's name says below what."""
    feet, metres, fathoms = fields
    for text, unit_m in ((metres, 1.0), (feet, _FOOT_M), (fathoms, _FATHOM_M)):
        found = number(text, 0.0, _DEPTH_MAX_M / unit_m)
        if found is not None:
            return Distance(t_us, found * unit_m)
    return Distance(t_us, None)


_ROLL_NAMES: Final = frozenset({"ROLL", "HEEL", "BOATROLL", "VESSEL ROLL"})
_PITCH_NAMES: Final = frozenset({"PITCH", "PTCH", "TRIM", "BOATPITCH", "VESSEL PITCH"})


def xdr(t_us: int, fields: list[str]) -> EulerAngles | None:
    """Any group of type A (angle) in degrees that is named after roll or pitch; other transducers are passed over."""
    phi_rad = theta_rad = None
    for first in range(0, len(fields) - 3, 4):
        kind, value, unit, name = fields[first : first + 4]
        if kind != "A" or unit != "D":
            continue
        name = name.upper()
        if name in _ROLL_NAMES:
            phi_rad = angle_rad(value, -180.0, 180.0)
        elif name in _PITCH_NAMES:
            theta_rad = angle_rad(value, -90.0, 90.0)
    return _angles(t_us, phi_rad, theta_rad, None)


def _angles(
    t_us: int, phi_rad: float | None, theta_rad: float | None, psi_rad: float | None, accuracy_rad: float | None = None
) -> EulerAngles | None:
    """The attitude, when any axis is measured."""
    if phi_rad is None and theta_rad is None and psi_rad is None:
        return None
    return EulerAngles(
        t_us=t_us,
        phi_rad=phi_rad,
        theta_rad=theta_rad,
        psi_rad=psi_rad,
        psi_magnetic_rad=None,
        psi_accuracy_rad=accuracy_rad,
    )


def _roll_pitch_heading(t_us: int, roll: Any, pitch: Any, heading: Any) -> EulerAngles | None:
    return _angles(t_us, angle_rad(roll, -180.0, 180.0), angle_rad(pitch, -90.0, 90.0), angle_rad(heading))


_VAGUE_DEG: Final = 20.0
"""A heading that its own sensor knows no better than this steers nothing; not aligned yet, they say 99.999."""


def pashr(t_us: int, s: Any) -> EulerAngles | None:
    """The attitude form (time, heading, T, roll, pitch, heave, accuracies, quality) and the older HPR form.

    Quality 0 is no position: there is no heading then, whatever number stands for it.
    """
    if isinstance(s, pynmea2.ash.ASHRHPR):
        return _roll_pitch_heading(t_us, s.roll, s.pitch, s.heading)
    if not isinstance(s, pynmea2.ash.ASHRATT):
        raise PassedOverError
    accuracy = number(s.heading_accuracy, 0.0, 360.0)
    is_solved = number(s.aiding_status, 0.0, 9.0) != 0.0 and (accuracy or 0.0) <= _VAGUE_DEG
    psi_rad = angle_rad(s.true_heading) if is_solved and s.is_true_heading == "T" else None
    phi_rad, theta_rad = angle_rad(s.roll, -180.0, 180.0), angle_rad(s.pitch, -90.0, 90.0)
    return _angles(t_us, phi_rad, theta_rad, psi_rad, None if accuracy is None else math.radians(accuracy))


def psat(t_us: int, s: Any) -> EulerAngles | None:
    if s.subtype != "HPR":
        raise PassedOverError
    return _roll_pitch_heading(t_us, s.roll, s.pitch, s.heading)


def psxn(t_us: int, s: Any) -> EulerAngles | None:
    if not isinstance(s, pynmea2.sxn.SXN23):
        raise PassedOverError
    return _roll_pitch_heading(t_us, s.roll, s.pitch, s.head)


_AVR_SOLVED: Final = (2.0, 3.0)
"""Float and fixed. Of one receiver alone (1) and by code differences (4) a baseline of a metre points anywhere."""


def ptnl(t_us: int, s: Any) -> EulerAngles | None:
    """AVR: yaw and tilt of the antenna baseline, where carrier phases solve it. Which axis tilt is depends on the mounting."""
    if not isinstance(s, pynmea2.tnl.TNLAVR):
        raise PassedOverError
    if number(s.gps_quality, 0, 9) not in _AVR_SOLVED:
        return None
    return _angles(
        t_us,
        angle_rad(s.roll_angle if s.roll == "Roll" else "", -180.0, 180.0),
        angle_rad(s.tilt_angle if s.tilt == "Tilt" else "", -90.0, 90.0),
        angle_rad(s.yaw_angle, -180.0, 360.0),
    )


def psti(t_us: int, s: Any) -> EulerAngles | None:
    """SkyTraq 036: heading and pitch of the antenna baseline; a single baseline has no roll, and says 0.00."""
    if s.subtype != "036":
        raise PassedOverError
    if s.mode_indicator not in ("A", "D", "F", "R"):
        return None
    return _roll_pitch_heading(t_us, s.roll if number(s.roll, -180.0, 180.0) else "", s.pitch, s.heading)


def ptnthtm(t_us: int, s: Any) -> EulerAngles | None:
    """True North Revolution: heading with the deviation and variation that the compass was set to, pitch and roll."""
    texts = ((s.roll, s.roll_status), (s.pitch, s.pitch_status), (s.heading, s.heading_status))
    roll, pitch, heading = (value if status in _TNT_GOOD else "" for value, status in texts)
    if heading and "." not in heading:  # set to counts instead of degrees, 65 536 to the turn
        roll, pitch = _counts_deg(roll), _counts_deg(pitch)
        heading = _counts_deg(heading) % 360.0
    return _roll_pitch_heading(t_us, roll, pitch, heading)


def _counts_deg(value: Any) -> Any:
    counts = number(value, -65_536.0, 65_536.0)
    return "" if counts is None else counts * _TNT_COUNT_DEG
