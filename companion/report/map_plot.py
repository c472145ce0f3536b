"""The map of a report: track, plan, fence, depth on the way, and where a failsafe acted."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final

from .flight import Flight, FlightTrack
from .plots import figure
from .shapes import ReportShapes, plan_shapes
from .verdicts import offset_m

FLAT_M: Final = 0.3
"""A bottom with less relief than this is not worth colours."""
WIDE: Final = 2.0
"""A fence so many times as wide as track and plan is left outside."""
SHAPE: Final = 1.45
"""Width over height of the map."""
Place = Callable[[float, float], tuple[float, float]]
"""Latitude and longitude in degrees to metres east and north."""


def draw_map(flight: Flight) -> Any | None:
    """Track over plan and fence, coloured by depth where depth is known, else by mode."""
    track = flight.tracks.get("truth") or flight.tracks.get("estimate")
    shapes = plan_shapes(flight)
    if not track and not shapes.points:
        return None
    lat0, lon0 = (track.lat[0], track.lon[0]) if track else shapes.points[0][:2]
    made, (ax,) = figure(6.2)

    def place(lat: float, lon: float) -> tuple[float, float]:
        north, east = offset_m(lat0, lon0, lat, lon)
        return east, north

    _draw_plan(ax, shapes, place)
    if track:
        _draw_depth(made, ax, flight, place)
        _draw_track(ax, flight, place)
    _draw_actions(ax, flight, place)
    _frame(ax, extent(flight, shapes, place))
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlabel("east, m")
    ax.set_ylabel("north, m")
    ax.legend(loc="best", fontsize=8, framealpha=0.85)
    ax.set_title(f"0, 0 is {lat0:.6f}°, {lon0:.6f}°", fontsize=8, color="#57606a", loc="right")
    return made


def extent(flight: Flight, shapes: ReportShapes, place: Place) -> list[tuple[float, float]]:
    """What the picture must hold, m: the track and the plan; a fence far around it may lie outside."""
    found = [place(lat, lon) for lat, lon, _ in shapes.points]
    found += [place(*point) for line in shapes.loiters for point in line]
    for track in flight.tracks.values():
        found += [place(min(track.lat), min(track.lon)), place(max(track.lat), max(track.lon))]
    fence = [place(*corner) for polygon, _ in shapes.polygons for corner in polygon]
    for lat, lon, radius, _ in shapes.circles:
        x, y = place(lat, lon)
        fence += [(x - radius, y - radius), (x + radius, y + radius)]
    return found + fence if _size(found + fence) <= WIDE * _size(found) else found


def _size(points: Sequence[tuple[float, float]]) -> float:
    """The longer side of the box around points, m."""
    return float(max(max(axis) - min(axis) for axis in zip(*points, strict=True)))


def _frame(ax: Any, points: Sequence[tuple[float, float]]) -> None:
    """Hold all points with some room, in the shape of the picture."""
    x, y = [x for x, _ in points], [y for _, y in points]
    room = max(15.0, 0.12 * (max(x) - min(x)), 0.12 * (max(y) - min(y)))
    height = max(max(y) - min(y) + 2 * room, (max(x) - min(x) + 2 * room) / SHAPE)
    for limits, values, size in ((ax.set_xlim, x, SHAPE * height), (ax.set_ylim, y, height)):
        middle = 0.5 * (min(values) + max(values))
        limits(middle - 0.5 * size, middle + 0.5 * size)


def _draw_actions(ax: Any, flight: Flight, place: Place) -> None:
    """Where a failsafe acted."""
    track = flight.tracks.get("estimate") or flight.tracks.get("truth")
    spans = [span for span in flight.spans.get("action", []) if span.value not in ("NONE", "WARN")]
    if not track or not spans:
        return
    where = [place(*track.at(span.start)) for span in spans]
    ax.plot([x for x, _ in where], [y for _, y in where], "X", color="#cf222e", markersize=9, label="failsafe action")
    for (x, y), span in zip(where[:12], spans, strict=False):
        note = f"{span.value}, {span.start / 60.0:.0f} min"
        ax.annotate(note, (x, y), textcoords="offset points", xytext=(9, -11), fontsize=8, color="#cf222e")


def _draw_plan(ax: Any, shapes: ReportShapes, place: Place) -> None:
    from matplotlib.patches import Circle

    for polygon, inclusion in shapes.polygons:
        points = [place(*corner) for corner in [*polygon, polygon[0]]]
        ax.plot(
            [x for x, _ in points],
            [y for _, y in points],
            color="#1a7f37" if inclusion else "#cf222e",
            linestyle="--",
            linewidth=1.3,
            label="fence, stay inside" if inclusion else "fence, keep out",
        )
    for line in shapes.loiters:
        points = [place(*point) for point in line]
        ax.plot([x for x, _ in points], [y for _, y in points], color="#8250df", linestyle="--", linewidth=1.2)
    for lat, lon, radius, inclusion in shapes.circles:
        colour = "#1a7f37" if inclusion else "#cf222e"
        ax.add_patch(Circle(place(lat, lon), radius, fill=False, edgecolor=colour, linestyle="--", linewidth=1.2))
    route = [place(lat, lon) for lat, lon, _ in shapes.points]
    if route:
        ax.plot(
            [x for x, _ in route], [y for _, y in route], color="#8250df", linestyle=":", linewidth=1.2, label="plan"
        )
        ax.plot([x for x, _ in route], [y for _, y in route], "o", color="#8250df", markersize=5)
        for (x, y), (_, _, label) in zip(route, shapes.points, strict=True):
            ax.annotate(label, (x, y), textcoords="offset points", xytext=(6, 6), fontsize=8, color="#6639ba")


def _draw_depth(made: Any, ax: Any, flight: Flight, place: Place) -> None:
    depth = flight.series.get("true_depth_m") or flight.series.get("altitude_m") or flight.series.get("depth_m")
    track = flight.tracks.get("truth") or flight.tracks.get("estimate")
    if not depth or not track:
        return
    step = max(1, len(track.t) // 700)
    where, colours, at = [], [], 0
    for index in range(0, len(track.t), step):
        while at + 1 < len(depth.t) and depth.t[at + 1] <= track.t[index]:
            at += 1
        if not math.isnan(depth.v[at]):
            where.append(place(track.lat[index], track.lon[index]))
            colours.append(depth.v[at])
    if where and max(colours) - min(colours) > FLAT_M:
        dots = ax.scatter(
            [x for x, _ in where], [y for _, y in where], c=colours, cmap="viridis_r", s=26, alpha=0.55, linewidths=0
        )
        name = "depth, m" if "true_depth_m" in flight.series else "water under the keel, m"
        made.colorbar(dots, ax=ax, label=name, shrink=0.7, pad=0.01)


def _draw_track(ax: Any, flight: Flight, place: Place) -> None:
    if "truth" in flight.tracks:
        x, y = _curve(flight.tracks["truth"], place)
        ax.plot(x, y, color="#57606a", linewidth=2.2, alpha=0.6, label="track (truth)")
    if "estimate" in flight.tracks:
        x, y = _curve(flight.tracks["estimate"], place)
        ax.plot(x, y, color="#0969da", linewidth=1.0, label="track (estimate)")
        ax.plot(x[0], y[0], ">", color="#1a7f37", markersize=9, label="start")
        ax.plot(x[-1], y[-1], "s", color="#cf222e", markersize=7, label="end")


def _curve(track: FlightTrack, place: Place) -> tuple[list[float], list[float]]:
    step = max(1, len(track.t) // 4000)
    points = [place(track.lat[index], track.lon[index]) for index in range(0, len(track.t), step)]
    return [x for x, _ in points], [y for _, y in points]
