"""The way that a plan asks for, laid out leg by leg, so that it can be held against a depth map before it is accepted."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mavlink_bridge.language.figures import outline
from mavlink_bridge.language.messages import Goto, Loiter, Maneuver
from mavlink_bridge.language.points import LatLon, NorthEast
from mavlink_bridge.language.units import wrap_pi

from .grid import PlanLeg, offset


def plan_legs(maneuvers: Sequence[Maneuver], start_rad: LatLon | None, loiter_radius_m: float) -> list[PlanLeg]:
    """Lay out every item that has a place: the leg that leads there, and a loiter's whole figure from where it is joined.

    ``start_rad``: where the vessel is; without it the first leg is its end point alone. So is one behind a loiter that may
    be left anywhere on its figure. Jumps lead over legs that are laid out anyway, but for the leg back; that one is added.
    """
    legs: list[PlanLeg] = []
    last = start_rad
    for item in maneuvers:
        if isinstance(item, Goto | Loiter):
            way = _way(item, last, loiter_radius_m)
            legs.append(PlanLeg(item.seq, way if last is None else (last, *way)))
            last = _end(item, way)
        target = _jump_target(item, maneuvers)
        if target is not None and last is not None:
            legs.append(PlanLeg(item.seq, (last, _way(target, last, loiter_radius_m)[0])))
    return legs


def _way(item: Goto | Loiter, last: LatLon | None, loiter_radius_m: float) -> tuple[LatLon, ...]:
    """An item's points; a figure is closed, and begins where it is nearest to where the vessel comes from."""
    figure = _figure(item, loiter_radius_m) if isinstance(item, Loiter) else ()
    if not figure:
        return (LatLon((item.lat_rad, item.lon_rad)),)
    if last is None:
        return figure
    narrow = math.cos(last[0])
    joined = min(
        range(len(figure)), key=lambda k: math.hypot(figure[k][0] - last[0], narrow * wrap_pi(figure[k][1] - last[1]))
    )
    return (*figure[joined:], *figure[1 : joined + 1])


def _end(item: Goto | Loiter, way: Sequence[LatLon]) -> LatLon | None:
    """Where the next leg begins: the point, or where a figure was joined when whole laps are sailed; None = not known."""
    if isinstance(item, Goto) or len(way) == 1:
        return way[0]
    whole = item.turns is not None and item.turns == round(item.turns)
    return way[0] if whole and item.duration_s is None and not item.exit_toward_next else None


def _jump_target(item: Maneuver, maneuvers: Sequence[Maneuver]) -> Goto | Loiter | None:
    """Where a jump leads: the first item with a place at or after its target."""
    target_seq = getattr(item, "target_seq", None)
    if target_seq is None:
        return None
    for other in maneuvers:
        if other.seq >= target_seq and isinstance(other, Goto | Loiter):
            return other
    return None


def _figure(loiter: Loiter, default_radius_m: float) -> tuple[LatLon, ...]:
    """Corner points of a loiter's figure; nothing for a hover."""
    points = outline(loiter.figure, NorthEast((0.0, 0.0)), default_radius_m)
    return tuple(offset(loiter.lat_rad, loiter.lon_rad, north, east) for north, east in points)
