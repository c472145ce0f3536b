"""One command as it was asked for, whether it came as COMMAND_LONG or COMMAND_INT, with its numbers made safe to read."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from ...language.requests import RequestBody
from ...language.units import e7_to_deg
from ..wire.cmd import Cmd
from ..wire.codec import dialect
from ..wire.mapping import deg_to_rad, degE7_to_rad

COMMAND_INT: Final = dialect.MAVLINK_MSG_ID_COMMAND_INT
COMMAND_LONG: Final = dialect.MAVLINK_MSG_ID_COMMAND_LONG
_LONG: Final = struct.Struct("<7fHBBB")
"""COMMAND_LONG (76) on the wire: seven parameters, command, target system and component, confirmation."""
_INT: Final = struct.Struct("<4f2ifH5B")
"""COMMAND_INT (75): four parameters, x, y, z, command, target system and component, frame, current, autocontinue."""

ACCEPTED: Final = 0
REJECTED_NOW: Final = 1
DENIED: Final = 2
UNSUPPORTED: Final = 3
FAILED: Final = 4
IN_PROGRESS: Final = 5

_GLOBAL_FRAMES: Final = frozenset((0, 3, 5, 6, 10, 11))
"""MAV_FRAME_GLOBAL and its relative, terrain and _INT kinds: a boat ignores what they say of altitude."""


class Refused(Exception):  # noqa: N818 - an answer, not a fault
    """A command that will not be carried out: MAV_RESULT and the reason for the operator."""

    def __init__(self, result: int, reason: str) -> None:
        super().__init__(reason)
        self.result = result
        self.reason = reason


def denied(reason: str) -> Refused:
    return Refused(DENIED, reason)


@dataclass(frozen=True, slots=True)
class Command:
    """A command's content. Two copies of one command are equal: neither sequence nor confirmation is part of it."""

    id: int
    params: tuple[float, float, float, float]
    x: float
    """Param 5: degrees in a COMMAND_LONG, the raw integer in a COMMAND_INT."""
    y: float
    z: float
    frame: int | None
    """None for a COMMAND_LONG."""
    sender: tuple[int, int]

    @classmethod
    def from_message(cls, message: Any) -> Command:
        is_int = message.get_msgId() == COMMAND_INT
        return cls(
            id=message.command,
            params=(_plain(message.param1), _plain(message.param2), _plain(message.param3), _plain(message.param4)),
            x=message.x if is_int else _plain(message.param5),
            y=message.y if is_int else _plain(message.param6),
            z=_plain(message.z if is_int else message.param7),
            frame=message.frame if is_int else None,
            sender=(message.get_srcSystem(), message.get_srcComponent()),
        )

    @classmethod
    def of_set_mode(cls, message: Any) -> Command:
        """SET_MODE as the command that has taken its place: the same order, whichever way a station sends it."""
        return cls._made(Cmd.DO_SET_MODE, (float(message.base_mode & 1), float(message.custom_mode)), message)

    @classmethod
    def of_go_to(cls, item: Any) -> Command:
        """A mission item with current = 2 as if it were a command: it is one."""
        values = item.param1, item.param2, item.param3, item.param4
        return replace(cls._made(item.command, values, item), x=item.x, y=item.y, z=_plain(item.z), frame=item.frame)

    @classmethod
    def _made(cls, number: int, values: Sequence[float], message: Any) -> Command:
        first, second, third, fourth = (*map(_plain, values), *[0.0] * (4 - len(values)))
        sender = (message.get_srcSystem(), message.get_srcComponent())
        return cls(number, (first, second, third, fourth), x=0.0, y=0.0, z=0.0, frame=None, sender=sender)

    @classmethod
    def from_payload(cls, message_id: int, payload: bytes, sender: tuple[int, int]) -> tuple[Command, tuple[int, int]]:
        """What a payload without its frame says, and the system and component that it is meant for.

        ``message_id``: COMMAND_LONG or COMMAND_INT; trailing zeros may be missing, as MAVLink 2 leaves them out.
        Raises ValueError for another id.
        """
        match message_id:
            case dialect.MAVLINK_MSG_ID_COMMAND_LONG:
                *values, command, system, component, _ = _fields(_LONG, payload)
                numbers, frame = [_plain(value) for value in values], None
            case dialect.MAVLINK_MSG_ID_COMMAND_INT:
                *values, x, y, z, command, system, component, frame, _, _ = _fields(_INT, payload)
                numbers = [*(_plain(value) for value in values), x, y, _plain(z)]
            case _:
                raise ValueError(f"message {message_id} is no command")
        params = numbers[0], numbers[1], numbers[2], numbers[3]
        made = cls(command, params, x=numbers[4], y=numbers[5], z=numbers[6], frame=frame, sender=sender)
        return made, (system, component)

    def given(self, number: int) -> float | None:
        """Param 1...4, None when NaN. Infinity is refused: no meaning of it is defined for any command."""
        value = self.params[number - 1]
        if math.isinf(value):
            raise denied(f"parameter {number} is infinite")
        return None if math.isnan(value) else value

    def number(self, number: int, default: float, low: float, high: float) -> float:
        """Param 1...4 within a range, ``default`` when NaN."""
        value = self.given(number)
        if value is None:
            return default
        if not low <= value <= high:
            raise denied(f"parameter {number} = {value:g} is not between {low:g} and {high:g}")
        return value

    def whole(self, number: int, default: int, low: int, high: int) -> int:
        """Param 1...4 as a whole number within a range."""
        value = self.number(number, float(default), low, high)
        if value != int(value):
            raise denied(f"parameter {number} = {value:g} is not a whole number")
        return int(value)

    def position_rad(self, *, zero_is_here: bool = False) -> tuple[float, float] | None:
        """Latitude and longitude, None for 'here' (not given). Both zero is 'here' or refused, never a place."""
        if self.frame is not None and self.frame not in _GLOBAL_FRAMES:
            raise denied(f"frame {self.frame} is not a global frame")
        lat_rad, lon_rad = self._angles()
        if lat_rad is None and lon_rad is None:
            return None
        if lat_rad is None or lon_rad is None:
            raise denied("only one of latitude and longitude is given")
        if lat_rad == 0.0 and lon_rad == 0.0:
            if zero_is_here:
                return None
            raise denied("position 0, 0 means not set")
        return lat_rad, lon_rad

    def _angles(self) -> tuple[float | None, float | None]:
        if math.isinf(self.x) or math.isinf(self.y):
            raise denied("position is infinite")
        if self.frame is None:
            lat_deg, lon_deg = (None if math.isnan(value) else value for value in (self.x, self.y))
        else:
            lat_deg, lon_deg = (
                None if degE7_to_rad(int(value)) is None else e7_to_deg(int(value)) for value in (self.x, self.y)
            )
        if (lat_deg is not None and abs(lat_deg) > 90.0) or (lon_deg is not None and abs(lon_deg) > 180.0):
            raise denied("position is not on the globe")
        return _radians(lat_deg), _radians(lon_deg)


def _fields(layout: struct.Struct, payload: bytes) -> tuple[Any, ...]:
    return layout.unpack(payload[: layout.size].ljust(layout.size, b"\0"))


def _radians(angle_deg: float | None) -> float | None:
    if angle_deg is None:
        return None
    return math.pi if angle_deg == 180.0 else deg_to_rad(angle_deg)


def _plain(value: float) -> float:
    """One NaN for all NaNs, so that copies of a command compare equal."""
    return math.nan if value != value else value


Parse = Callable[[Command], RequestBody]
"""Turns a command into what to ask of the vessel. Raises Refused."""
