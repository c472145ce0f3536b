"""Plan, fence and home as lines on a map, in degrees: what a watcher's chart shows. Bounded, however long the plan is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

from mavlink_bridge.language.messages import FenceArea, PlanSpecification

from ..core.guard.depth.plan_legs import plan_legs

POINTS_MAX: Final = 4000
"""Points of all lines together; a figure's outline has some hundred."""
_PLACES: Final = 6
"""A decimetre."""


def drawing(
    plan: PlanSpecification, fence: Sequence[FenceArea], loiter_radius_m: float, *, ids: tuple[int, int]
) -> dict[str, Any]:
    """Return ``legs`` (item number and line), ``areas`` (inclusion or not, line or circle) and the ids they belong to."""
    budget = POINTS_MAX
    legs: list[dict[str, Any]] = []
    for leg in plan_legs(plan.maneuvers, None, loiter_radius_m):
        points = [_place(point) for point in leg.points_rad]
        budget -= len(points)
        if budget < 0:
            break
        legs.append({"item": leg.seq, "line": points})
    areas: list[dict[str, Any]] = []
    for area in fence:
        budget -= len(area.vertices_rad) + 1
        if budget < 0:
            break
        areas.append(_area(area))
    return {"ids": list(ids), "legs": legs, "areas": areas, "whole": budget >= 0}


def _area(area: FenceArea) -> dict[str, Any]:
    if area.centre_rad is not None:
        return {"inside": area.inclusion, "centre": _place(area.centre_rad), "radius_m": area.radius_m or 0.0}
    return {"inside": area.inclusion, "line": [_place(point) for point in area.vertices_rad]}


def _place(point_rad: tuple[float, float]) -> list[float]:
    return [round(math.degrees(point_rad[0]), _PLACES), round(math.degrees(point_rad[1]), _PLACES)]
