"""The most dangerous other vessel in 6 bytes behind a state: what she is to us, where, and the closest point.

Bits: 1 close, 3 role, 1 ship, 8 low bits of her number, 7 bearing, 7 range (logarithmic), 6 course, 5 speed, 5 least distance,
5 time to it.
Where is told from the boat's own place, which goes with it. Nobody else's position crosses the air.
"""

from __future__ import annotations

import math
from typing import Final

from ...language.geodesy import direct
from ...language.traffic import TCPA_MOST_S, Danger, OtherVessel, Role, TrafficPicture, VesselKind
from ...language.units import wrap_pi
from ...language.value import value
from .bits import BitReader, BitsError, BitWriter

THREAT_BYTES: Final = 6
_ROLES: Final = {
    Role.NONE: 0,
    Role.HEAD_ON: 1,
    Role.GIVE_WAY: 2,
    Role.STAND_ON: 3,
    Role.OVERTAKING: 4,
    Role.OVERTAKEN: 5,
    Role.OBSTACLE: 6,
}
_BY_CODE: Final = {code: role for role, code in _ROLES.items()}
_RANGE_M: Final = 5.0
_RANGE_FACTOR: Final = 1.06
"""Steps of 6 %, from 5 m to 7.7 km."""
_SPEED_STEP: Final = 0.75
_CPA_STEP_M: Final = 4.0
_TCPA_STEP_S: Final = 6.0
_MOST5: Final = 31
_SIGMA_M: Final = 100.0
"""Bearing and range come in steps: a place for a mark, not for a measurement."""


@value
class Threat:
    """What is told of her, in the steps of the air."""

    close: bool
    role: Role
    ship: bool
    """Class A."""
    number: int
    """The low eight bits of her MMSI."""
    bearing_rad: float
    range_m: float
    course_rad: float
    sog_mps: float
    cpa_m: float
    """0: nothing or less, 124: that or more."""
    tcpa_s: float
    """186: that or more."""


def threat_of(picture: TrafficPicture) -> Threat | None:
    """The first threat of a picture, which is the most dangerous one; None when there is none."""
    vessel = next(iter(picture.threats), None)
    if vessel is None or vessel.range_m is None or vessel.bearing_rad is None:
        return None
    return Threat(
        close=vessel.danger is Danger.CLOSE,
        role=vessel.role,
        ship=vessel.kind is VesselKind.CLASS_A,
        number=vessel.mmsi & 0xFF,
        bearing_rad=vessel.bearing_rad,
        range_m=vessel.range_m,
        course_rad=vessel.cog_rad or 0.0,
        sog_mps=0.0 if vessel.at_rest else vessel.sog_mps or 0.0,
        cpa_m=vessel.cpa_m or 0.0,
        tcpa_s=vessel.tcpa_s or 0.0,
    )


def _turn(angle_rad: float, bits: int) -> int:
    return round(angle_rad / math.tau * (1 << bits)) % (1 << bits)


def _steps(quantity: float, step: float) -> int:
    return min(max(round(quantity / step), 0), _MOST5)


def encode_threat(threat: Threat) -> bytes:
    """Six bytes."""
    writer = BitWriter()
    writer.flag(threat.close)
    writer.put(_ROLES[threat.role], 3)
    writer.flag(threat.ship)
    writer.put(threat.number & 0xFF, 8)
    writer.put(_turn(threat.bearing_rad, 7), 7)
    steps = math.log(max(threat.range_m, _RANGE_M) / _RANGE_M) / math.log(_RANGE_FACTOR)
    writer.put(min(round(steps), 127), 7)
    writer.put(_turn(threat.course_rad, 6), 6)
    writer.put(_steps(threat.sog_mps, _SPEED_STEP), 5)
    writer.put(_steps(threat.cpa_m, _CPA_STEP_M), 5)
    writer.put(_steps(threat.tcpa_s, _TCPA_STEP_S), 5)
    return writer.bytes()


def decode_threat(body: bytes) -> Threat:
    """Raises BitsError for what no encoder makes."""
    if len(body) != THREAT_BYTES:
        raise BitsError("a threat has 6 bytes")
    reader = BitReader(body)
    close, code, ship, number = reader.flag(), reader.get(3), reader.flag(), reader.get(8)
    if code not in _BY_CODE:
        raise BitsError("no such role")
    return Threat(
        close=close,
        role=_BY_CODE[code],
        ship=ship,
        number=number,
        bearing_rad=wrap_pi(reader.get(7) / 128.0 * math.tau),
        range_m=_RANGE_M * float(_RANGE_FACTOR ** reader.get(7)),
        course_rad=wrap_pi(reader.get(6) / 64.0 * math.tau),
        sog_mps=reader.get(5) * _SPEED_STEP,
        cpa_m=reader.get(5) * _CPA_STEP_M,
        tcpa_s=reader.get(5) * _TCPA_STEP_S,
    )


def picture_of(threat: Threat, lat_rad: float, lon_rad: float, t_us: int) -> TrafficPicture:
    """The shore's picture: one vessel, seen from where the boat was. Her number is only its low bits."""
    place = direct(lat_rad, lon_rad, threat.bearing_rad, threat.range_m)
    vessel = OtherVessel(
        mmsi=threat.number,
        kind=VesselKind.CLASS_A if threat.ship else VesselKind.CLASS_B,
        t_us=t_us,
        lat_rad=place[0],
        lon_rad=place[1],
        reported_lat_rad=place[0],
        reported_lon_rad=place[1],
        reported_us=t_us,
        sigma_m=_SIGMA_M,
        sog_mps=threat.sog_mps,
        cog_rad=threat.course_rad,
        range_m=threat.range_m,
        bearing_rad=threat.bearing_rad,
        cpa_m=threat.cpa_m,
        tcpa_s=threat.tcpa_s if threat.tcpa_s < _MOST5 * _TCPA_STEP_S else TCPA_MOST_S,
        role=threat.role,
        danger=Danger.CLOSE if threat.close else Danger.RISK,
    )
    return TrafficPicture((vessel,), heard=True, close=threat.close)
