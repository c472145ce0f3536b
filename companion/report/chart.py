"""Colours, an empty figure, and the plan as shapes to draw."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

from mavlink_bridge.language.requests import PlanItem

from .flight import Flight

WIDTH_IN: Final = 9.6
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
_FENCE_POLYGON_IN, _FENCE_POLYGON_OUT, _FENCE_CIRCLE_IN, _FENCE_CIRCLE_OUT = 5001, 5002, 5003, 5004
_LOITERS: Final = {17: 3, 18: 3, 19: 3, 31: 2, 34: 1}
"""Command -> parameter that holds the radius."""
_PLACES: Final = (16, 17, 18, 19, 21, 22, 31, 34, 35, 82, 94)


@dataclass(slots=True)
class Shapes:
    """Plan and fence in degrees and metres."""

    points: list[tuple[float, float, str]] = field(default_factory=list)
    circles: list[tuple[float, float, float, str]] = field(default_factory=list)
    polygons: list[tuple[list[tuple[float, float]], bool]] = field(default_factory=list)


def plan_shapes(flight: Flight) -> Shapes:
    """Turn the items of plan and fence into shapes."""
    shapes = Shapes()
    for number, item in enumerate(flight.plan):
        if item.command in _PLACES and (item.x or item.y):
            lat, lon = item.x * 1e-7, item.y * 1e-7
            shapes.points.append((lat, lon, str(number)))
            radius = _radius(item)
            if radius:
                shapes.circles.append((lat, lon, radius, "loiter"))
    _fence(flight.fence, shapes)
    for item in flight.rally:
        shapes.points.append((item.x * 1e-7, item.y * 1e-7, "rally"))
    return shapes


def _radius(item: PlanItem) -> float:
    index = _LOITERS.get(item.command)
    if index is None:
        return 0.0
    value = (item.param1, item.param2, item.param3, item.param4)[index - 1]
    return abs(value) if value == value and abs(value) < 1e5 else 0.0


def _fence(items: tuple[PlanItem, ...], shapes: Shapes) -> None:
    corners: list[tuple[float, float]] = []
    for item in items:
        lat, lon = item.x * 1e-7, item.y * 1e-7
        if item.command in (_FENCE_POLYGON_IN, _FENCE_POLYGON_OUT):
            corners.append((lat, lon))
            if len(corners) >= max(3, int(item.param1)):
                shapes.polygons.append((corners, item.command == _FENCE_POLYGON_IN))
                corners = []
        elif item.command in (_FENCE_CIRCLE_IN, _FENCE_CIRCLE_OUT):
            kind = "inclusion" if item.command == _FENCE_CIRCLE_IN else "exclusion"
            shapes.circles.append((lat, lon, item.param1, kind))


def figure(height_in: float, rows: int = 1, **options: Any) -> tuple[Any, list[Any]]:
    """A figure without any window system behind it, and its axes."""
    from matplotlib.figure import Figure

    made = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    axes = made.subplots(rows, 1, squeeze=False, **options)
    found = [row[0] for row in axes]
    for ax in found:
        ax.grid(True, color="#d8dee4", linewidth=0.6)
        ax.spines[["top", "right"]].set_visible(False)
    return made, found
