"""Set-points streamed by another computer or a station: position, velocity or heading with thrust. They time out in the vessel.

One from which nothing can be steered raises ``Unusable`` with the reason: its sender waits for a boat that does not move.
"""

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


class Unusable(Exception):  # noqa: N818 - a sender's mistake, not a fault of ours
    """A set-point that steers nothing; its text says why."""


def position_target(message: Any) -> GuidedTarget | GuidedHeading:
    """SET_POSITION_TARGET_GLOBAL_INT: a position when one is given, else a velocity. Raises Unusable."""
    if message.coordinate_frame not in _GLOBAL_FRAMES:
        raise Unusable(f"set-point: frame {message.coordinate_frame} is no global frame")
    if message.type_mask & _POSITION:
        return _velocity(message)
    lat_rad, lon_rad = degE7_to_rad(message.lat_int), degE7_to_rad(message.lon_int)
    if lat_rad is None or lon_rad is None or abs(lat_rad) > math.pi / 2 or abs(lon_rad) > math.pi:
        raise Unusable("set-point: the position is not on the globe")
    if message.lat_int == 0 and message.lon_int == 0:
        raise Unusable("set-point: position 0, 0 means not set")
    return GuidedTarget(lat_rad, lon_rad, None if message.type_mask & _VELOCITY else _speed_mps(message) or None)


def local_target(message: Any) -> GuidedHeading:
    """SET_POSITION_TARGET_LOCAL_NED: the velocity only, north-east-down. Raises Unusable."""
    if message.coordinate_frame != _LOCAL_NED:
        raise Unusable(
            f"set-point: local frame {message.coordinate_frame} is not steered by, only {_LOCAL_NED} (LOCAL_NED)"
        )
    if message.type_mask & _POSITION != _POSITION:
        raise Unusable("set-point: no local position is steered to: send a global one, or a velocity alone")
    return _velocity(message)


def _speed_mps(message: Any) -> float:
    speed_mps = math.hypot(message.vx, message.vy)
    if not speed_mps <= MAX_SPEED_MPS:
        raise Unusable(f"set-point: the velocity is no number up to {MAX_SPEED_MPS:g} m/s")
    return speed_mps


def _velocity(message: Any) -> GuidedHeading:
    if message.type_mask & _VELOCITY:
        raise Unusable("set-point: neither a position nor a velocity north and east is given")
    speed_mps = _speed_mps(message)
    if speed_mps > 0.0:
        return GuidedHeading(math.atan2(message.vy, message.vx), speed_mps=speed_mps, course=True, stream=True)
    given = not message.type_mask & _YAW and math.isfinite(message.yaw)
    return GuidedHeading(_wrapped(message.yaw) if given else None, speed_mps=0.0, stream=True)


def attitude_target(message: Any) -> GuidedHeading:
    """SET_ATTITUDE_TARGET: the heading of the quaternion (w, x, y, z) and the thrust, -1...1, when given. Raises Unusable."""
    if message.type_mask & _ATTITUDE_IGNORED:
        raise Unusable("set-point: an attitude is needed, turn rates alone are not steered by")
    w, x, y, z = message.q
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if not 0.5 < norm < 2.0:
        raise Unusable("set-point: the quaternion is no attitude")
    throttle: float | None = None
    if not message.type_mask & _THRUST_IGNORED:
        throttle = message.thrust
        if not -1.0 <= message.thrust <= 1.0:
            raise Unusable("set-point: the thrust is not between -1 and 1")
    psi_rad = math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return GuidedHeading(_wrapped(psi_rad), throttle=throttle, stream=True)


def _wrapped(angle_rad: float) -> float:
    return (angle_rad + math.pi) % math.tau - math.pi
