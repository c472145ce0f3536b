"""Manoeuvres back to plan items: for plan files, the seed's JSON and the round-trip tests of ``plan_mapping``.

Speed is a property of a manoeuvre in IMC and sticks in MAVLink, so a manoeuvre with a speed gets a DO_CHANGE_SPEED before it, and a
manoeuvre without one after it gets the plan's speed back; jump targets move along. What MAVLink cannot say raises
``InexpressibleError``, with the reason.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...language import messages as imc
from ...language.requests import PlanItem
from ..wire.cmd import Cmd
from ..wire.mapping import NAN, rad_to_degE7
from .figure_items import POSITION_FRAME, InexpressibleError, at_place, item_of
from .plan_rules import MISSION_FRAME

__all__ = ["InexpressibleError", "items_from_maneuvers"]


def items_from_maneuvers(maneuvers: Sequence[imc.Maneuver]) -> tuple[PlanItem, ...]:
    """Plan items that compile to the same manoeuvres, apart from the speeds, which become items of their own.

    Raises InexpressibleError.
    """
    items: list[PlanItem] = []
    places: list[int] = []
    set_speed: float | None = None
    speed: float | None = None
    for maneuver in maneuvers:
        places.append(len(items))
        if isinstance(maneuver, imc.ChangeSpeed):
            set_speed = speed = maneuver.speed_mps
        elif isinstance(maneuver, imc.Goto | imc.Loiter):
            wanted = set_speed if maneuver.speed_mps is None else maneuver.speed_mps
            if wanted != speed:
                items.append(_speed_item(wanted))
                speed = wanted
        items.append(_item(maneuver))
    return tuple(_with_target(item, places) for item in items)


def _speed_item(speed_mps: float | None) -> PlanItem:
    return _plain(Cmd.DO_CHANGE_SPEED, 1.0, -2.0 if speed_mps is None else speed_mps, -1.0)


def _with_target(item: PlanItem, places: Sequence[int]) -> PlanItem:
    if item.command != Cmd.DO_JUMP:
        return item
    target = int(item.param1)
    if not 0 <= target < len(places):
        raise InexpressibleError(f"jump target {target} is not in the plan")
    return _plain(Cmd.DO_JUMP, float(places[target]), item.param2)


def _item(maneuver: imc.Maneuver) -> PlanItem:
    match maneuver:
        case imc.Goto():
            return at_place(
                maneuver, Cmd.WAYPOINT, maneuver.hold_s, param2=maneuver.acceptance_m or 0.0, param3=0.0, param4=NAN
            )
        case imc.Loiter():
            return item_of(maneuver)
        case imc.ChangeSpeed():
            return _speed_item(maneuver.speed_mps)
        case imc.Delay():
            return _delay(maneuver)
        case imc.Jump():
            return _plain(Cmd.DO_JUMP, float(maneuver.target_seq), float(maneuver.repeats))
        case imc.ReturnHome():
            return _plain(Cmd.RETURN_TO_LAUNCH)
        case imc.SetHome():
            return _set_home(maneuver)
        case imc.FenceEnable():
            return _plain(Cmd.DO_FENCE_ENABLE, float(maneuver.enable))
        case imc.Noted():
            return _plain(maneuver.command)


def _plain(command: int, param1: float = 0.0, param2: float = 0.0, param3: float = 0.0) -> PlanItem:
    return PlanItem(
        command=command, frame=MISSION_FRAME, param1=param1, param2=param2, param3=param3, param4=0.0, x=0, y=0, z=0.0
    )


def _delay(delay: imc.Delay) -> PlanItem:
    if delay.until_utc_s_of_day is None:
        return PlanItem(
            command=Cmd.NAV_DELAY,
            frame=MISSION_FRAME,
            param1=delay.duration_s or 0.0,
            param2=-1.0,
            param3=-1.0,
            param4=-1.0,
            x=0,
            y=0,
            z=0.0,
        )
    minutes, second = divmod(delay.until_utc_s_of_day, 60.0)
    hour, minute = divmod(minutes, 60.0)
    return PlanItem(
        command=Cmd.NAV_DELAY,
        frame=MISSION_FRAME,
        param1=-1.0,
        param2=hour,
        param3=minute,
        param4=second,
        x=0,
        y=0,
        z=0.0,
    )


def _set_home(home: imc.SetHome) -> PlanItem:
    if home.lat_rad is None or home.lon_rad is None:
        return _plain(Cmd.DO_SET_HOME, 1.0)
    x, y = rad_to_degE7(home.lat_rad), rad_to_degE7(home.lon_rad)
    return PlanItem(
        command=Cmd.DO_SET_HOME, frame=POSITION_FRAME, param1=0.0, param2=0.0, param3=0.0, param4=0.0, x=x, y=y, z=0.0
    )
