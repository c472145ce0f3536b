"""The map of a report as data: track, plan, fence and failsafes in metres east and north, over the owner's chart."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Final

from pydantic import ValidationError

from ..configuration import depth_map
from ..core.guard.depth.config import DepthMapConfig
from ..core.guard.depth.grid import DepthGrid
from ..settings import ConfigError
from .embed import differences
from .flight import Flight, FlightTrack, Series
from .map_plot import FLAT_M, Place, extent
from .shapes import ReportShapes, plan_shapes
from .verdicts import offset_m

_POINTS: Final = 4000
_DOTS: Final = 700
_CELLS: Final = 180
"""Cells of the chart that are shown along its longer side."""
_LOOKS: Final = 5
"""Looks into the chart along each side of a shown cell: the shallowest is shown."""
_TINTS_M: Final = (0.0, 2.0, 5.0, 10.0, 20.0)
"""Ends of the chart's tints, m below datum, as paper charts of harbours have them."""
_UNKNOWN: Final = "-"


def map_data(flight: Flight) -> dict[str, Any] | None:
    """All that the map shows; None without a track or a plan."""
    track = flight.tracks.get("truth") or flight.tracks.get("estimate")
    shapes = plan_shapes(flight)
    if not track and not shapes.points:
        return None
    lat0, lon0 = (track.lat[0], track.lon[0]) if track else shapes.points[0][:2]

    def place(lat: float, lon: float) -> tuple[float, float]:
        north, east = offset_m(lat0, lon0, lat, lon)
        return east, north

    box = _box(extent(flight, shapes, place))
    return {
        "origin": f"{lat0:.6f}°, {lon0:.6f}°",
        "box": [round(value, 1) for value in box],
        "tracks": [_track(name, flight.tracks[name], place) for name in ("truth", "estimate") if name in flight.tracks],
        "dots": _dots(flight, track, place) if track else None,
        "actions": _actions(flight, place),
        "chart": _chart(flight, box, (lat0, lon0), place),
        **_plan(shapes, place),
    }


def _box(points: Sequence[tuple[float, float]]) -> tuple[float, float, float, float]:
    """West, south, east, north of what is shown first, m, with some room."""
    x, y = [x for x, _ in points], [y for _, y in points]
    room = max(15.0, 0.1 * (max(x) - min(x)), 0.1 * (max(y) - min(y)))
    return min(x) - room, min(y) - room, max(x) + room, max(y) + room


def _track(name: str, track: FlightTrack, place: Place) -> dict[str, Any]:
    step = max(1, len(track.t) // _POINTS)
    picks = range(0, len(track.t), step)
    points = [place(track.lat[index], track.lon[index]) for index in picks]
    return {
        "name": name,
        "t": differences([round(track.t[index] * 100.0) for index in picks]),
        "x": differences([round(x * 100.0) for x, _ in points]),
        "y": differences([round(y * 100.0) for _, y in points]),
    }


def _dots(flight: Flight, track: FlightTrack, place: Place) -> dict[str, Any] | None:
    """Depth on the way, where the bottom is not flat."""
    truth = flight.series.get("true_depth_m")
    depth = truth or flight.series.get("altitude_m") or flight.series.get("depth_m")
    found = list(_met(depth, track, place)) if depth else []
    depths = [value for *_, value in found]
    if not found or max(depths) - min(depths) <= FLAT_M:
        return None
    name = "depth" if truth else "water under the keel"
    return {"name": name, "low": min(depths), "high": max(depths), "points": found}


def _met(depth: Series, track: FlightTrack, place: Place) -> Iterator[tuple[float, float, float]]:
    at = 0
    for index in range(0, len(track.t), max(1, len(track.t) // _DOTS)):
        while at + 1 < len(depth.t) and depth.t[at + 1] <= track.t[index]:
            at += 1
        if not math.isnan(depth.v[at]):
            x, y = place(track.lat[index], track.lon[index])
            yield round(x, 1), round(y, 1), round(depth.v[at], 2)


def _actions(flight: Flight, place: Place) -> list[Any]:
    """Where a failsafe acted, and when."""
    track = flight.tracks.get("estimate") or flight.tracks.get("truth")
    spans = [span for span in flight.spans.get("action", []) if span.value not in ("NONE", "WARN")]
    return [[*place(*track.at(span.start)), span.value, round(span.start, 1)] for span in spans[:200]] if track else []


def _plan(shapes: ReportShapes, place: Place) -> dict[str, Any]:
    line = [[*map(_metres, place(lat, lon)), label] for lat, lon, label in shapes.points]
    circles = [[*map(_metres, place(lat, lon)), radius, keep] for lat, lon, radius, keep in shapes.circles]
    polygons = [[[list(map(_metres, place(*corner))) for corner in polygon], keep] for polygon, keep in shapes.polygons]
    loiters = [[list(map(_metres, place(*point))) for point in loiter] for loiter in shapes.loiters]
    return {"points": line, "circles": circles, "polygons": polygons, "loiters": loiters}


def _metres(value: float) -> float:
    return round(value, 2)


def _chart(
    flight: Flight, box: tuple[float, float, float, float], origin: tuple[float, float], place: Place
) -> dict[str, Any] | None:
    """The owner's chart under all of it, as rows of tints from the north; a file that is no longer there is a note."""
    wanted = flight.settings.get("depth", {}).get("map")
    try:
        config = DepthMapConfig.model_validate(wanted or {})
        grid = depth_map(config)
    except (ValidationError, ConfigError) as error:
        flight.notes.append(f"the chart is not shown: {error}")
        return None
    if grid is None or config.file is None:
        return None
    # A bit more water than the first view, for who zooms out.
    west, south, east, north = box
    more = 0.5 * max(east - west, north - south)
    west, south, east, north = west - more, south - more, east + more, north + more
    cell = max(east - west, north - south) / _CELLS
    per_lat, per_lon = place(origin[0] + 1e-3, origin[1])[1] * 1e3, place(origin[0], origin[1] + 1e-3)[0] * 1e3
    looks = min(_LOOKS, math.ceil(cell / grid.pitch_m))

    def tint(column: int, row: int) -> str:
        found = [
            _look(
                grid,
                origin[0] + (north - (row + a) * cell) / per_lat,
                origin[1] + (west + (column + b) * cell) / per_lon,
            )
            for a in _inside(looks)
            for b in _inside(looks)
        ]
        known = [depth for depth in found if depth is not None]
        return str(sum(min(known) >= end for end in _TINTS_M)) if known else _UNKNOWN

    columns, rows = math.ceil((east - west) / cell), math.ceil((north - south) / cell)
    shown = ["".join(tint(column, row) for column in range(columns)) for row in range(rows)]
    if not any(row.strip(_UNKNOWN) for row in shown):
        return None
    return {"name": config.file.name, "west": west, "north": north, "cell": cell, "rows": shown, "tints_m": _TINTS_M}


def _inside(count: int) -> list[float]:
    return [(number + 0.5) / count for number in range(count)]


def _look(grid: DepthGrid, lat_deg: float, lon_deg: float) -> float | None:
    return grid.depth_at(math.radians(lat_deg), math.radians(lon_deg))
