"""Plan items as they cross the wire: to and from MISSION_ITEM_INT, and with or without ArduPilot's home item.

Inside, a mission has no home item. A persona that shows one puts it in front on the way out and takes it off on the way in, which
shifts every item number and every DO_JUMP target by one; this file is the only place that knows.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any, Final

from ...language.requests import PlanItem, PlanKind
from ..wire.cmd import Cmd
from ..wire.codec import dialect
from ..wire.mapping import INT32_UNKNOWN, deg_to_degE7, rad_to_degE7
from .plan_rules import GLOBAL_FRAMES, PlanError

ALL_KINDS: Final = 255
"""MAV_MISSION_TYPE_ALL, which only MISSION_CLEAR_ALL may name."""

_HOME_FRAMES: Final = frozenset({0, 5})


def kind_of(mission_type: int) -> PlanKind | None:
    """MAV_MISSION_TYPE to the kind of plan; None for ALL and for numbers without a meaning."""
    return PlanKind(mission_type) if 0 <= mission_type <= 2 else None


def item_from_message(message: Any) -> PlanItem:
    """The item in a MISSION_ITEM_INT, or in a MISSION_ITEM (float degrees), as sent."""
    if message.get_type() == "MISSION_ITEM":
        x, y = (_degrees(value, message.frame) for value in (message.x, message.y))
    else:
        x, y = message.x, message.y
    return PlanItem(
        command=message.command,
        frame=message.frame,
        param1=message.param1,
        param2=message.param2,
        param3=message.param3,
        param4=message.param4,
        x=x,
        y=y,
        z=message.z,
        autocontinue=message.autocontinue,
    )


def _degrees(value: float, frame: int) -> int:
    """A float x or y of the old message: degrees in a global frame, a plain number otherwise."""
    if frame in GLOBAL_FRAMES:
        return deg_to_degE7(value)
    return round(value) if math.isfinite(value) and abs(value) < INT32_UNKNOWN else INT32_UNKNOWN


def item_to_message(item: PlanItem, seq: int, system: int, component: int, kind: PlanKind) -> Any:
    """MISSION_ITEM_INT for one receiver. ``current`` marks the first item, as clients that send a plan on want it."""
    return dialect.MAVLink_mission_item_int_message(
        target_system=system,
        target_component=component,
        seq=seq,
        frame=item.frame,
        command=item.command,
        current=1 if seq == 0 and kind is PlanKind.MISSION else 0,
        autocontinue=item.autocontinue,
        param1=item.param1,
        param2=item.param2,
        param3=item.param3,
        param4=item.param4,
        x=item.x,
        y=item.y,
        z=item.z,
        mission_type=kind.value,
    )


def with_home(items: tuple[PlanItem, ...], home_rad: tuple[float, float] | None) -> tuple[PlanItem, ...]:
    """A canonical mission with the home item in front; an empty mission stays empty."""
    if not items:
        return ()
    latitude, longitude = home_rad or (0.0, 0.0)
    home = PlanItem(
        command=Cmd.WAYPOINT,
        frame=0,
        param1=0.0,
        param2=0.0,
        param3=0.0,
        param4=0.0,
        x=rad_to_degE7(latitude),
        y=rad_to_degE7(longitude),
        z=0.0,
    )
    return (home, *(shift_jump(item, 1) for item in items))


def without_home(items: tuple[PlanItem, ...]) -> tuple[PlanItem, ...]:
    """The canonical mission of an upload whose item 0 is the home item."""
    return tuple(shift_jump(item, -1) for item in items[1:])


def shift_jump(item: PlanItem, by: int) -> PlanItem:
    """A DO_JUMP with its target moved; any other item as it is."""
    if not by or item.command != Cmd.DO_JUMP:
        return item
    return dataclasses.replace(item, param1=item.param1 + by)


def home_problem(item: PlanItem) -> str:
    """Why an item cannot be the home item, or an empty string."""
    if item.command != Cmd.WAYPOINT:
        return f"item 0 must be the home position, and command {item.command} is not a waypoint"
    if item.frame not in _HOME_FRAMES and not (item.frame in GLOBAL_FRAMES and item.x == 0 and item.y == 0):
        # 0/0 is nobody's waypoint: MAVSDK clears an ArduPilot with one such item in frame 3
        return f"item 0 must be the home position in frame 0 or 5 (absolute altitude), not frame {item.frame}"
    if abs(item.x) > 900_000_000 or abs(item.y) > 1_800_000_000:
        return "item 0 must be the home position, and its latitude or longitude is out of range"
    return ""


def describe(error: PlanError, item: PlanItem | None, shift: int = 0) -> str:
    """One sentence for the operator, with the item's number as the ground station counts it and the command's name."""
    name = f" ({command_name(item.command)})" if item is not None else ""
    return f"item {error.seq + shift}{name}: {error.reason}"


def command_name(command: int) -> str:
    """What MAVLink calls a command, or its number."""
    entry = dialect.enums["MAV_CMD"].get(command)
    return str(entry.name).removeprefix("MAV_CMD_") if entry is not None else f"command {command}"
