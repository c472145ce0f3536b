"""Colours, and the plan as shapes to draw."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

from mavlink_bridge.language.figures import outline
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import Goto, Loiter
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.units import e7_to_deg
from mavlink_bridge.mavlink.missions.fence_mapping import compile_fence
from mavlink_bridge.mavlink.missions.plan_mapping import compile_item
from mavlink_bridge.mavlink.missions.plan_rules import DEFAULT_LIMITS

from .flight import Flight

PALETTE: Final = ("#0969da", "#bc4c00", "#1a7f37", "#cf222e", "#8250df", "#0a7ea4", "#9a6700")
PASTEL: Final = ("#b6e3ff", "#ffd8b5", "#aceebb", "#ffced3", "#e2c5ff", "#b3f0ff", "#fae17d")
STATE_COLOURS: Final = {
    "OK": "#aceebb",
    "UNKNOWN": "#d0d7de",
    "CORRECTION": "#fae17d",
    "LOCKED": "#ffaba8",
    "NONE": "#aceebb",
    "WARN": "#fae17d",
    "HOLD": "#ffd8b5",
    "RETURN": "#ffc680",
    "STOP": "#ffaba8",
    "DISARM": "#ff8182",
    "TERMINATE": "#fa4549",
    "armed": "#ffd8b5",
    "disarmed": "#d0d7de",
    "active": "#aceebb",
    "complete": "#b6e3ff",
    "paused": "#fae17d",
    "no plan": "#d0d7de",
    "not started": "#d0d7de",
}
_USUAL_RADIUS_M: Final = 20.0
"""For the picture of a loiter that leaves its radius to the vessel: the shipped LOIT_RADIUS."""
_NAV_LAST: Final = 95
"""MAV_CMD_NAV_LAST: what is below it, of another vehicle's plan too, is a place to go to."""


@dataclass(slots=True)
class ReportShapes:
    """Plan and fence in degrees and metres."""

    points: list[tuple[float, float, str]] = field(default_factory=list)
    loiters: list[list[tuple[float, float]]] = field(default_factory=list)
    """The closed line of each loiter's figure."""
    circles: list[tuple[float, float, float, bool]] = field(default_factory=list)
    """Fence circles: centre, radius in m, inclusion."""
    polygons: list[tuple[list[tuple[float, float]], bool]] = field(default_factory=list)


def plan_shapes(flight: Flight) -> ReportShapes:
    """Turn the items of plan and fence into shapes."""
    shapes = ReportShapes()
    for number, item in enumerate(flight.plan):
        maneuver = compile_item(number, item, DEFAULT_LIMITS)
        if (isinstance(maneuver, Goto | Loiter) or item.command < _NAV_LAST) and (item.x or item.y):
            shapes.points.append((e7_to_deg(item.x), e7_to_deg(item.y), str(number)))
        if isinstance(maneuver, Loiter):
            shapes.loiters += _figure(maneuver)
    for area in compile_fence(flight.fence)[0]:
        if area.centre_rad is not None and area.radius_m is not None:
            lat, lon = _degrees(area.centre_rad)
            shapes.circles.append((lat, lon, area.radius_m, area.inclusion))
        else:
            shapes.polygons.append(([_degrees(corner) for corner in area.vertices_rad], area.inclusion))
    for item in flight.rally:
        shapes.points.append((e7_to_deg(item.x), e7_to_deg(item.y), "rally"))
    return shapes


def _figure(loiter: Loiter) -> list[list[tuple[float, float]]]:
    frame = LocalFrame(loiter.lat_rad, loiter.lon_rad)
    line = [
        _degrees(frame.to_geodetic(*point)) for point in outline(loiter.figure, NorthEast((0.0, 0.0)), _USUAL_RADIUS_M)
    ]
    return [line] if line else []


def _degrees(place_rad: tuple[float, float]) -> tuple[float, float]:
    return math.degrees(place_rad[0]), math.degrees(place_rad[1])
