"""The rules of plan items: command numbers, results, limits, and how each field of an item is read and refused.

Every reader raises ``RefusedError`` with the number of the field, from which the sender gets MISSION_ACK INVALID_PARAMn and the
operator one sentence. Sources: MAVLink common.xml.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Final

from mavlink_bridge.language.units import e7_to_deg

from ...language.messages import LoiterDirection
from ...language.requests import PlanItem, PlanKind, Result
from ..wire.cmd import CAMERA_AND_GIMBAL, Cmd
from ..wire.mapping import INT32_UNKNOWN, degE7_to_rad

NOTED: Final = CAMERA_AND_GIMBAL
"""Items that are accepted, logged, passed over."""

_HERE: Final = frozenset((Cmd.LOITER_UNLIM, Cmd.LOITER_TURNS, Cmd.LOITER_TIME, Cmd.LOITER_TO_ALT))
_SAILED_TO: Final = _HERE | {Cmd.WAYPOINT, Cmd.DO_ORBIT, Cmd.DO_FIGURE_EIGHT, Cmd.RACETRACK, Cmd.LOITER_CHOICE}
MISSION_FRAME: Final = 2
GLOBAL_FRAMES: Final = frozenset({0, 3, 5, 6, 10, 11})
FRAMES: Final = GLOBAL_FRAMES | {MISSION_FRAME}
MAX_ITEMS: Final = 829
"""Mission items that fit: the figure ground stations know from ArduPilot."""


class MissionResult(IntEnum):
    """MAV_MISSION_RESULT."""

    ACCEPTED = 0
    ERROR = 1
    UNSUPPORTED_FRAME = 2
    UNSUPPORTED = 3
    NO_SPACE = 4
    INVALID = 5
    INVALID_PARAM1 = 6
    INVALID_PARAM2 = 7
    INVALID_PARAM3 = 8
    INVALID_PARAM4 = 9
    INVALID_PARAM5_X = 10
    INVALID_PARAM6_Y = 11
    INVALID_PARAM7 = 12
    INVALID_SEQUENCE = 13
    DENIED = 14
    OPERATION_CANCELLED = 15


MISSION_RESULT: Final = {
    Result.ACCEPTED: MissionResult.ACCEPTED,
    Result.REJECTED_NOW: MissionResult.DENIED,
    Result.DENIED: MissionResult.DENIED,
    Result.UNSUPPORTED: MissionResult.UNSUPPORTED,
    Result.FAILED: MissionResult.ERROR,
}
"""What a request's result is to who sent the plan."""


@dataclass(frozen=True, slots=True)
class PlanError:
    """Why an item is refused. ``seq`` counts canonical items; ``field`` is 1...7, or None when it is not about one."""

    seq: int
    field: int | None
    reason: str
    result: MissionResult


@dataclass(frozen=True, slots=True)
class PlanLimits:
    """What a plan may ask for. Speeds in m/s, lengths in m."""

    max_items: int = MAX_ITEMS
    max_speed_mps: float = 50.0
    max_length_m: float = 100_000.0
    max_duration_s: float = 31_536_000.0
    max_turns: float = 100_000.0


DEFAULT_LIMITS: Final = PlanLimits()


class RefusedError(Exception):
    def __init__(self, field_number: int | None, reason: str, result: MissionResult | None = None) -> None:
        super().__init__(reason)
        self.field = field_number
        if result is None:
            result = MissionResult.INVALID if field_number is None else MissionResult(5 + field_number)
        self.result = result


def plan_id(items: Sequence[PlanItem]) -> int:
    """CRC-32 of the canonical items, never 0 for a plan that has items; 0 = no plan."""
    if not items:
        return 0
    crc = 0
    for item in items:
        crc = zlib.crc32(_ITEM.pack(*_fields(item)), crc)
    return crc or 1


_ITEM: Final = struct.Struct("<HBffffiifB")


def _fields(item: PlanItem) -> tuple[float, ...]:
    return (
        *(item.command, item.frame, item.param1, item.param2, item.param3, item.param4),
        *(item.x, item.y, item.z, item.autocontinue),
    )


# Fields of an item. Each raises RefusedError with the field's number.


def parameter(item: PlanItem, number: int) -> float:
    return (item.param1, item.param2, item.param3, item.param4)[number - 1]


def given(item: PlanItem, number: int) -> float | None:
    """A parameter, None when NaN; infinity is refused."""
    value = parameter(item, number)
    if math.isnan(value):
        return None
    if math.isinf(value):
        raise RefusedError(number, f"parameter {number} is infinite")
    return value


def within(item: PlanItem, number: int, what: str, high: float, default: float | None = None) -> float:
    """A parameter from 0 to ``high``; NaN gives the default, or is refused when there is none."""
    value = given(item, number)
    if value is None:
        value = default
    if value is None:
        raise RefusedError(number, f"{what} is not given")
    if not 0.0 <= value <= high:
        raise RefusedError(number, f"{what} {value:g} is outside 0 to {high:g}")
    return value


def position(item: PlanItem) -> tuple[float, float]:
    """Latitude and longitude in rad. 0/0 and INT32_MAX mean that no place was given, and are refused."""
    if item.frame not in GLOBAL_FRAMES:
        raise RefusedError(None, f"frame {item.frame} has no position", MissionResult.UNSUPPORTED_FRAME)
    if abs(item.x) >= INT32_UNKNOWN or (item.x == 0 and item.y == 0):
        raise RefusedError(5, f"no position is given{', and no item before it has one' * is_here(item)}")
    if abs(item.y) >= INT32_UNKNOWN:
        raise RefusedError(6, "no longitude is given")
    if abs(item.x) > 900_000_000:
        raise RefusedError(5, f"latitude {e7_to_deg(item.x):.7f} is outside -90 to 90")
    if abs(item.y) > 1_800_000_000:
        raise RefusedError(6, f"longitude {e7_to_deg(item.y):.7f} is outside -180 to 180")
    latitude, longitude = degE7_to_rad(item.x), degE7_to_rad(item.y)
    assert latitude is not None
    assert longitude is not None
    return latitude, longitude


def unheeded(kind: PlanKind, items: Sequence[PlanItem], offset: int) -> str:
    """What of a plan is taken and not done, in words; "" when nothing is. ``offset``: of the station's numbers.

    Clients that fill fields with zeros say autocontinue = 0 of every item, and ArduPilot goes on all the same: refused, no plan of
    theirs would load. The ground stations always say 1. Behind the last item nothing goes on anyhow.
    """
    waiting = (seq for seq, item in enumerate(items[:-1]) if item.autocontinue == 0) if kind is PlanKind.MISSION else ()
    first = next(iter(waiting), None)
    return "" if first is None else f"item {first + offset}: autocontinue = 0 is not heeded, the plan goes on by itself"


def is_here(item: PlanItem) -> bool:
    """A loiter of ArduPilot's at 0/0: it stays where the boat is when it comes to it."""
    return item.command in _HERE and item.frame in GLOBAL_FRAMES and item.x == 0 and item.y == 0


def with_places(items: Sequence[PlanItem]) -> tuple[PlanItem, ...]:
    """The plan with such loiters at the place to which the boat has been sent before them; one that nothing comes before stays as it is."""
    found: list[PlanItem] = []
    place: tuple[int, int] | None = None
    for item in items:
        if is_here(item) and place is not None:
            item = replace(item, x=place[0], y=place[1])
        if item.command in _SAILED_TO and (item.x or item.y):
            place = item.x, item.y
        elif item.command == Cmd.RETURN_TO_LAUNCH:
            place = None
        found.append(item)
    return tuple(found)


def signed_radius(item: PlanItem, number: int, limits: PlanLimits) -> tuple[float | None, LoiterDirection]:
    """Radius and direction of a signed radius parameter (+ clockwise); None when NaN. Zero comes back as 0.0."""
    radius = given(item, number)
    if radius is None:
        return None, LoiterDirection.CW
    if abs(radius) > limits.max_length_m:
        raise RefusedError(number, f"radius {radius:g} m is above {limits.max_length_m:g} m")
    direction = LoiterDirection.CCW if radius < 0.0 else LoiterDirection.CW
    return abs(radius), direction


def toward_next(item: PlanItem, number: int) -> bool:
    return bool(given(item, number) or 0.0)
