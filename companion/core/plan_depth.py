"""The way that a plan asks for, laid out leg by leg, so that it can be held against a depth map before it is accepted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from companion.core.depth_grid import Leg, offset
from companion.core.paths import Segment, circle, figure_eight, racetrack
from mavlink_bridge.imc import Goto, Loiter, LoiterDirection, LoiterKind, Maneuver

Position = tuple[float, float]

_CORNERS_PER_TURN: Final = 32


def plan_legs(maneuvers: Sequence[Maneuver], start_rad: Position | None, loiter_radius_m: float) -> list[Leg]:
    """Lay out every item that has a place: the leg that leads there, and a loiter's whole figure.

    ``start_rad``: where the vessel is; without it the first leg is its end point alone. Jumps lead over legs that are
    laid out anyway, but for the leg back; that one is added.
    """
    legs: list[Leg] = []
    ends: dict[int, Position] = {}
    last = start_rad
    for item in maneuvers:
        if isinstance(item, Goto | Loiter):
            here = (item.lat_rad, item.lon_rad)
            figure = _figure(item, loiter_radius_m) if isinstance(item, Loiter) else ()
            approach = () if last is None else (last,)
            legs.append(Leg(item.seq, (*approach, figure[0] if figure else here, *figure[1:])))
            last = ends[item.seq] = here
        target = _jump_target(item, maneuvers)
        if target is not None and last is not None:
            legs.append(Leg(item.seq, (last, target)))
    return legs


def _jump_target(item: Maneuver, maneuvers: Sequence[Maneuver]) -> Position | None:
    """Where a jump leads: the first item with a place at or after its target."""
    target_seq = getattr(item, "target_seq", None)
    if target_seq is None:
        return None
    for other in maneuvers:
        if other.seq >= target_seq and isinstance(other, Goto | Loiter):
            return other.lat_rad, other.lon_rad
    return None


def _figure(loiter: Loiter, default_radius_m: float) -> tuple[Position, ...]:
    """Corner points of a loiter's figure; nothing for a hover."""
    radius_m = abs(loiter.radius_m or default_radius_m)
    sense = -1 if loiter.direction is LoiterDirection.CCW else 1
    bearing_rad, length_m = loiter.bearing_rad or 0.0, loiter.length_m or 2.0 * radius_m
    centre = (0.0, 0.0)
    segments: tuple[Segment, ...] = ()
    if loiter.kind is LoiterKind.CIRCULAR:
        segments = circle(centre, radius_m, sense)
    elif loiter.kind is LoiterKind.RACETRACK:
        segments = racetrack(centre, radius_m, length_m, bearing_rad, sense)
    elif loiter.kind is LoiterKind.FIGURE_EIGHT:
        segments = figure_eight(centre, radius_m, length_m, bearing_rad, sense)
    points: list[Position] = []
    for segment in segments:
        turns = abs(segment.curvature) * segment.length_m / (2.0 * math.pi)
        count = max(1, math.ceil(_CORNERS_PER_TURN * turns))
        points += [segment.point(segment.length_m * i / count) for i in range(count + 1)]
    return tuple(offset(loiter.lat_rad, loiter.lon_rad, north, east) for north, east in points)
