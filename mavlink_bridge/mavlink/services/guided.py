"""Set-points streamed by another computer or a station: position, velocity or heading with thrust. They time out in the vessel."""

from __future__ import annotations

import math
from typing import Any, Final

from ...language.requests import GuidedHeading, GuidedTarget
from ..wire.mapping import degE7_to_rad

_POSITION: Final = 0b11
_VELOCITY: Final = 0b11000
_YAW: Final = 1 << 10
_ATTITUDE_IGNORED: Final = 0x80
_THRUST_IGNORED: Final = 0x40
_GLOBAL_FRAMES: Final = frozenset((0, 3, 5, 6, 10, 11))
_LOCAL_NED: Final = 1
MAX_SPEED_MPS: Final = 50.0


def position_target(message: Any) -> GuidedTarget | GuidedHeading | None:
    """SET_POSITION_TARGET_GLOBAL_INT: a position when one is given, else a velocity; None when nothing usable is in it."""
    if message.coordinate_frame not in _GLOBAL_FRAMES:
        return None
    if message.type_mask & _POSITION:
        return _velocity(message)
    lat_rad, lon_rad = degE7_to_rad(message.lat_int), degE7_to_rad(message.lon_int)
    if lat_rad is None or lon_rad is None or abs(lat_rad) > math.pi / 2 or abs(lon_rad) > math.pi:
        return None
    if message.lat_int == 0 and message.lon_int == 0:
        return None
    speed_mps = None
    if not message.type_mask & _VELOCITY:
        speed_mps = math.hypot(message.vx, message.vy)
        if not speed_mps <= MAX_SPEED_MPS:
            return None
    return GuidedTarget(lat_rad, lon_rad, speed_mps or None)


def local_target(message: Any) -> GuidedHeading | None:
    """SET_POSITION_TARGET_LOCAL_NED: the velocity only, north-east-down."""
    if message.coordinate_frame != _LOCAL_NED or message.type_mask & _POSITION != _POSITION:
        return None
    return _velocity(message)


def _velocity(message: Any) -> GuidedHeading | None:
    if message.type_mask & _VELOCITY:
        return None
    speed_mps = math.hypot(message.vx, message.vy)
    if not speed_mps <= MAX_SPEED_MPS:
        return None
    if speed_mps > 0.0:
        return GuidedHeading(math.atan2(message.vy, message.vx), speed_mps=speed_mps, course=True, stream=True)
    given = not message.type_mask & _YAW and math.isfinite(message.yaw)
    return GuidedHeading(_wrapped(message.yaw) if given else None, speed_mps=0.0, stream=True)


def attitude_target(message: Any) -> GuidedHeading | None:
    """SET_ATTITUDE_TARGET: the heading of the quaternion (w, x, y, z) and the thrust, -1...1, when given."""
    if message.type_mask & _ATTITUDE_IGNORED:
        return None
    w, x, y, z = message.q
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if not 0.5 < norm < 2.0:
        return None
    throttle: float | None = None
    if not message.type_mask & _THRUST_IGNORED:
        throttle = message.thrust
        if not -1.0 <= message.thrust <= 1.0:
            return None
    psi_rad = math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return GuidedHeading(_wrapped(psi_rad), throttle=throttle, stream=True)


def _wrapped(angle_rad: float) -> float:
    return (angle_rad + math.pi) % math.tau - math.pi
