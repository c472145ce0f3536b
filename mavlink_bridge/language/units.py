"""Conversions of units and wrapping of angles: the only home of knots, degrees and minutes of arc."""

from __future__ import annotations

import math

_PI = math.pi
_TURN = 2.0 * math.pi
NAUTICAL_MILE_M = 1852.0
"""One international nautical mile, a minute of arc of latitude as charts and NMEA 0183 reckon it (BIPM)."""
KNOT_MPS = NAUTICAL_MILE_M / 3600.0
"""One international knot in m/s."""
E7 = 1e7
"""MAVLink's and the plan files' whole numbers of a degree: degrees times this."""


def e7_to_deg(value: float) -> float:
    """Degrees * 1e7 to degrees."""
    return value / E7


def e7_to_rad(value: float) -> float:
    """Degrees * 1e7 to rad."""
    return math.radians(value / E7)


def rad_to_e7(angle_rad: float) -> int:
    """Rad to degrees * 1e7, rounded to the nearest (1.1 cm of latitude)."""
    return round(math.degrees(angle_rad) * E7)


def wrap_pi(angle_rad: float) -> float:
    """Wrap to [-pi, pi); +pi maps to -pi (the convention of dune-imc §1.1)."""
    turned = angle_rad + _PI
    if 0.0 <= turned < _TURN:
        return turned - _PI
    wrapped = math.fmod(turned, _TURN)
    if wrapped < 0.0:
        wrapped += _TURN
    result = wrapped - _PI
    return -_PI if result >= _PI else result


def wrap_2pi(angle_rad: float) -> float:
    """Wrap to [0, 2 pi)."""
    wrapped = math.fmod(angle_rad, 2.0 * math.pi)
    if wrapped < 0.0:
        wrapped += 2.0 * math.pi
    return 0.0 if wrapped >= 2.0 * math.pi else wrapped


def knots_to_mps(speed_kn: float) -> float:
    return speed_kn * KNOT_MPS


def mps_to_knots(speed_mps: float) -> float:
    return speed_mps / KNOT_MPS


def clamp(value: float, low: float, high: float) -> float:
    """Limit to [low, high]; NaN becomes ``low``."""
    if value > low:
        return value if value <= high else high
    return low
