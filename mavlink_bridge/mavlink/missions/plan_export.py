"""Manoeuvres back to plan items: for plan files, the seed's JSON and the round-trip tests of ``plan_mapping``.

Speed is a property of a manoeuvre in IMC and sticks in MAVLink, so a manoeuvre with a speed gets a DO_CHANGE_SPEED before it, and a
manoeuvre without one after it gets the plan's speed back; jump targets move along. What MAVLink cannot say raises
``InexpressibleError``, with the reason.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, assert_never

from ...language import messages as imc
from ...language.figures import Circle, FigureEight, Hover, Racetrack
from ...language.requests import PlanItem
from ..wire.cmd import Cmd
from ..wire.mapping import NAN, rad_to_degE7
from .plan_rules import MISSION_FRAME

POSITION_FRAME: Final = 3
"""MAV_FRAME_GLOBAL_RELATIVE_ALT, with altitude 0: what ground stations show best."""


class InexpressibleError(ValueError):
    """A manoeuvre that no plan item means."""


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
            return _at(
                maneuver, Cmd.WAYPOINT, maneuver.hold_s, param2=maneuver.acceptance_m or 0.0, param3=0.0, param4=NAN
            )
        case imc.Loiter():
            return _loiter(maneuver)
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


def _at(
    place: imc.Goto | imc.Loiter, command: int, param1: float, param2: float, param3: float, param4: float
) -> PlanItem:
    x, y = rad_to_degE7(place.lat_rad), rad_to_degE7(place.lon_rad)
    return PlanItem(
        command=command,
        frame=POSITION_FRAME,
        param1=param1,
        param2=param2,
        param3=param3,
        param4=param4,
        x=x,
        y=y,
        z=0.0,
    )


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


def _loiter(loiter: imc.Loiter) -> PlanItem:
    figure = loiter.figure
    if isinstance(figure, Circle):
        return _circle(loiter, figure)
    if loiter.turns is not None:
        raise InexpressibleError(f"item {loiter.seq}: {figure.name} cannot be counted in turns")
    match figure:
        case Hover():
            return _circle_by_time(loiter, 0.0)
        case FigureEight():
            return _figure_eight(loiter, figure)
        case Racetrack():
            return _racetrack(loiter, figure)
        case _ as never:
            assert_never(never)


_CIRCLING: Final = {imc.LoiterDirection.CW: 1.0, imc.LoiterDirection.CCW: -1.0}


def _sign(loiter: imc.Loiter, figure: Racetrack | FigureEight) -> float:
    sign = _CIRCLING.get(figure.direction)
    if sign is None:
        raise InexpressibleError(f"item {loiter.seq}: {figure.name} needs a direction, cw or ccw")
    return sign


def _circle(loiter: imc.Loiter, circle: Circle) -> PlanItem:
    sign = _CIRCLING.get(circle.direction)
    if sign is None:
        choice = float(circle.direction is imc.LoiterDirection.INTO_DRIFT)
        times = (_or_zero(loiter.duration_s), _or_zero(loiter.turns), _or_zero(circle.radius_m))
        return _at(loiter, Cmd.LOITER_CHOICE, *times, choice)
    if loiter.duration_s is not None and loiter.turns is not None:
        raise InexpressibleError(f"item {loiter.seq}: a loiter ends by time or by turns, not by both")
    if circle.radius_m is None and sign < 0.0:
        raise InexpressibleError(f"item {loiter.seq}: the default radius always goes clockwise")
    radius = NAN if circle.radius_m is None else sign * circle.radius_m
    if loiter.turns is not None:
        return _at(
            loiter, Cmd.LOITER_TURNS, loiter.turns, param2=float(loiter.exit_toward_next), param3=radius, param4=1.0
        )
    return _circle_by_time(loiter, radius)


def _circle_by_time(loiter: imc.Loiter, radius: float) -> PlanItem:
    if loiter.duration_s is None:
        return _at(loiter, Cmd.LOITER_UNLIM, 0.0, param2=0.0, param3=radius, param4=NAN)
    return _at(
        loiter, Cmd.LOITER_TIME, loiter.duration_s, param2=float(loiter.exit_toward_next), param3=radius, param4=1.0
    )


def _figure_eight(loiter: imc.Loiter, eight: FigureEight) -> PlanItem:
    sign = _sign(loiter, eight)
    minor = NAN if eight.radius_m is None else eight.radius_m
    major = NAN
    if eight.radius_m is not None and eight.length_m is not None:
        # shorter than two radii the loops would overlap: raised to it, as DUNE does
        major = sign * (max(eight.length_m, 2.0 * eight.radius_m) / 2.0 + eight.radius_m)
    elif sign < 0.0 or eight.length_m is not None:
        raise InexpressibleError(f"item {loiter.seq}: an eight needs a radius to have a length or go ccw")
    bearing = math.remainder(eight.bearing_rad or 0.0, math.tau)
    return _at(loiter, Cmd.DO_FIGURE_EIGHT, major, param2=minor, param3=_or_zero(loiter.duration_s), param4=bearing)


def _racetrack(loiter: imc.Loiter, track: Racetrack) -> PlanItem:
    sign = _sign(loiter, track)
    if track.length_m is None:
        raise InexpressibleError(f"item {loiter.seq}: a racetrack needs a length")
    if track.radius_m is None and sign < 0.0:
        raise InexpressibleError(f"item {loiter.seq}: the default radius always goes clockwise")
    radius = NAN if track.radius_m is None else sign * track.radius_m
    bearing = math.degrees(track.bearing_rad or 0.0) % 360.0
    return _at(loiter, Cmd.RACETRACK, _or_zero(loiter.duration_s), param2=track.length_m, param3=radius, param4=bearing)


def _or_zero(value: float | None) -> float:
    """Fields whose 0 means 'not limited' or 'the default'."""
    return 0.0 if value is None else value
