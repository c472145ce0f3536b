"""Loiters as plan items, both ways: the commands of each figure, read and written. A new figure has its two functions here.

What MAVLink cannot say raises ``InexpressibleError`` with the reason; what it says and a boat cannot do raises ``RefusedError``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, assert_never

from ...language import messages as imc
from ...language.figures import Circle, FigureEight, Hover, Racetrack
from ...language.requests import PlanItem
from ..wire.cmd import Cmd
from ..wire.mapping import NAN, rad_to_degE7
from .plan_rules import PlanLimits, RefusedError, given, position, signed_radius, toward_next, within

POSITION_FRAME: Final = 3
"""MAV_FRAME_GLOBAL_RELATIVE_ALT, with altitude 0: what ground stations show best."""


class InexpressibleError(ValueError):
    """A manoeuvre that no plan item means."""


def _loiter(
    seq: int, item: PlanItem, limits: PlanLimits, *, duration_s: float | None, exit_toward_next: bool = False
) -> imc.Maneuver:
    """A circle by radius, or station keeping when the radius is exactly 0."""
    latitude, longitude = position(item)
    radius, direction = signed_radius(item, 3, limits)
    return imc.Loiter(
        seq,
        latitude,
        longitude,
        figure=Hover() if radius == 0.0 else Circle(radius_m=radius, direction=direction),
        duration_s=duration_s,
        exit_toward_next=exit_toward_next,
    )


def _loiter_unlimited(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    return _loiter(seq, item, limits, duration_s=None)


def _loiter_time(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    duration = within(item, 1, "loiter time", limits.max_duration_s)
    return _loiter(seq, item, limits, duration_s=duration, exit_toward_next=toward_next(item, 2))


def _loiter_turns(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    turns = within(item, 1, "number of turns", limits.max_turns)
    latitude, longitude = position(item)
    radius, direction = signed_radius(item, 3, limits)
    return imc.Loiter(
        seq,
        latitude,
        longitude,
        figure=Circle(radius_m=radius or None, direction=direction),
        turns=turns,
        exit_toward_next=toward_next(item, 2),
    )


def _loiter_to_altitude(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    latitude, longitude = position(item)
    radius, direction = signed_radius(item, 2, limits)
    return imc.Loiter(
        seq,
        latitude,
        longitude,
        figure=Circle(radius_m=radius or None, direction=direction),
        duration_s=0.0,
        exit_toward_next=toward_next(item, 1),
    )


def _orbit(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    latitude, longitude = position(item)
    radius, direction = signed_radius(item, 1, limits)
    speed = within(item, 2, "speed", limits.max_speed_mps, 0.0)
    orbits_rad = within(item, 4, "orbits", limits.max_turns * math.tau, 0.0)
    return imc.Loiter(
        seq,
        latitude,
        longitude,
        figure=Circle(radius_m=radius or None, direction=direction),
        speed_mps=speed or None,
        turns=orbits_rad / math.tau if orbits_rad else None,
    )


def _figure_eight(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    latitude, longitude = position(item)
    major, direction = signed_radius(item, 1, limits)
    minor = within(item, 2, "minor radius", limits.max_length_m, 0.0) or None
    duration = within(item, 3, "duration", limits.max_duration_s, 0.0)
    bearing = given(item, 4) or 0.0
    if abs(bearing) > math.tau:
        raise RefusedError(4, f"orientation {bearing:g} is outside -2 pi to 2 pi rad")
    if major is not None and (minor is None or major < 2.0 * minor):
        raise RefusedError(1, "the major radius must be at least twice the given minor radius")
    return imc.Loiter(
        seq,
        latitude,
        longitude,
        figure=FigureEight(
            length_m=None if major is None or minor is None else 2.0 * (major - minor),
            radius_m=minor,
            bearing_rad=bearing,
            direction=direction,
        ),
        duration_s=duration or None,
    )


def _racetrack(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    latitude, longitude = position(item)
    duration = within(item, 1, "duration", limits.max_duration_s, 0.0)
    length = within(item, 2, "length", limits.max_length_m)
    radius, direction = signed_radius(item, 3, limits)
    bearing = within(item, 4, "bearing in degrees", 360.0, 0.0)
    return imc.Loiter(
        seq,
        latitude,
        longitude,
        figure=Racetrack(
            length_m=length, radius_m=radius or None, bearing_rad=math.radians(bearing), direction=direction
        ),
        duration_s=duration or None,
    )


def _loiter_choice(seq: int, item: PlanItem, limits: PlanLimits) -> imc.Maneuver:
    latitude, longitude = position(item)
    duration = within(item, 1, "duration", limits.max_duration_s, 0.0)
    turns = within(item, 2, "number of turns", limits.max_turns, 0.0)
    radius = within(item, 3, "radius", limits.max_length_m, 0.0)
    choice = given(item, 4) or 0.0
    if choice not in (0.0, 1.0):
        raise RefusedError(4, "direction must be 0 (vessel's choice) or 1 (into the drift)")
    return imc.Loiter(
        seq,
        latitude,
        longitude,
        figure=Circle(
            radius_m=radius or None, direction=imc.LoiterDirection.INTO_DRIFT if choice else imc.LoiterDirection.VESSEL
        ),
        duration_s=duration or None,
        turns=turns or None,
    )


FIGURE_READERS: Final[dict[int, Callable[[int, PlanItem, PlanLimits], imc.Maneuver]]] = {
    Cmd.LOITER_UNLIM: _loiter_unlimited,
    Cmd.LOITER_TURNS: _loiter_turns,
    Cmd.LOITER_TIME: _loiter_time,
    Cmd.LOITER_TO_ALT: _loiter_to_altitude,
    Cmd.DO_ORBIT: _orbit,
    Cmd.DO_FIGURE_EIGHT: _figure_eight,
    Cmd.RACETRACK: _racetrack,
    Cmd.LOITER_CHOICE: _loiter_choice,
}
"""What each command of a loiter means; raises RefusedError."""

# ---- and back


def item_of(loiter: imc.Loiter) -> PlanItem:
    """Return the item that means this loiter. Raises InexpressibleError."""
    figure = loiter.figure
    if isinstance(figure, Circle):
        return _circle(loiter, figure)
    if loiter.turns is not None:
        raise InexpressibleError(f"item {loiter.seq}: {figure.name} cannot be counted in turns")
    match figure:
        case Hover():
            return _circle_by_time(loiter, 0.0)
        case FigureEight():
            return _eight_item(loiter, figure)
        case Racetrack():
            return _racetrack_item(loiter, figure)
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
        return at_place(loiter, Cmd.LOITER_CHOICE, *times, choice)
    if loiter.duration_s is not None and loiter.turns is not None:
        raise InexpressibleError(f"item {loiter.seq}: a loiter ends by time or by turns, not by both")
    if circle.radius_m is None and sign < 0.0:
        raise InexpressibleError(f"item {loiter.seq}: the default radius always goes clockwise")
    radius = NAN if circle.radius_m is None else sign * circle.radius_m
    if loiter.turns is not None:
        return at_place(
            loiter, Cmd.LOITER_TURNS, loiter.turns, param2=float(loiter.exit_toward_next), param3=radius, param4=1.0
        )
    return _circle_by_time(loiter, radius)


def _circle_by_time(loiter: imc.Loiter, radius: float) -> PlanItem:
    if loiter.duration_s is None:
        return at_place(loiter, Cmd.LOITER_UNLIM, 0.0, param2=0.0, param3=radius, param4=NAN)
    return at_place(
        loiter, Cmd.LOITER_TIME, loiter.duration_s, param2=float(loiter.exit_toward_next), param3=radius, param4=1.0
    )


def _eight_item(loiter: imc.Loiter, eight: FigureEight) -> PlanItem:
    sign = _sign(loiter, eight)
    minor = NAN if eight.radius_m is None else eight.radius_m
    major = NAN
    if eight.radius_m is not None and eight.length_m is not None:
        # shorter than two radii the loops would overlap: raised to it, as DUNE does
        major = sign * (max(eight.length_m, 2.0 * eight.radius_m) / 2.0 + eight.radius_m)
    elif sign < 0.0 or eight.length_m is not None:
        raise InexpressibleError(f"item {loiter.seq}: an eight needs a radius to have a length or go ccw")
    bearing = math.remainder(eight.bearing_rad or 0.0, math.tau)
    return at_place(
        loiter, Cmd.DO_FIGURE_EIGHT, major, param2=minor, param3=_or_zero(loiter.duration_s), param4=bearing
    )


def _racetrack_item(loiter: imc.Loiter, track: Racetrack) -> PlanItem:
    sign = _sign(loiter, track)
    if track.length_m is None:
        raise InexpressibleError(f"item {loiter.seq}: a racetrack needs a length")
    if track.radius_m is None and sign < 0.0:
        raise InexpressibleError(f"item {loiter.seq}: the default radius always goes clockwise")
    radius = NAN if track.radius_m is None else sign * track.radius_m
    bearing = math.degrees(track.bearing_rad or 0.0) % 360.0
    return at_place(
        loiter, Cmd.RACETRACK, _or_zero(loiter.duration_s), param2=track.length_m, param3=radius, param4=bearing
    )


def _or_zero(value: float | None) -> float:
    """Fields whose 0 means 'not limited' or 'the default'."""
    return 0.0 if value is None else value


def at_place(
    place: imc.Goto | imc.Loiter, command: int, param1: float, param2: float, param3: float, param4: float
) -> PlanItem:
    """Return an item at a manoeuvre's place."""
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
