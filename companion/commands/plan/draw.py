"""A plan drawn: with letters for a terminal, as SVG for a browser. North is up."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Final

from mavlink_bridge.language import messages as imc
from mavlink_bridge.language.figures import outline
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.mavlink.missions.fence_mapping import compile_fence, compile_rally
from mavlink_bridge.mavlink.missions.plan_mapping import compile_items
from mavlink_bridge.plans import PlanFile

WIDTH: Final = 72
HEIGHT: Final = 24
_USUAL_RADIUS_M: Final = 20.0
"""For the picture of a loiter that leaves its radius to the vessel."""
Points = list[tuple[float, float]]
"""North and east in metres."""
Put = Callable[[tuple[float, float], str], None]


class PlanShapes:
    """What is to be drawn, in metres about the first position."""

    def __init__(self, plan: PlanFile, unknown_rad: Sequence[tuple[float, float]] = ()) -> None:
        maneuvers = compile_items(plan.mission).plan.maneuvers
        stops = [item for item in maneuvers if isinstance(item, imc.Goto | imc.Loiter)]
        areas = compile_fence(plan.fence)[0]
        rally = compile_rally(plan.rally)[0]
        corners = [corner for area in areas for corner in (area.vertices_rad or (area.centre_rad,)) if corner]
        anchors = [(stop.lat_rad, stop.lon_rad) for stop in stops] + corners + list(rally)
        frame = LocalFrame(*anchors[0]) if anchors else LocalFrame(0.0, 0.0)
        self.stops = [(stop.seq, frame.to_local(stop.lat_rad, stop.lon_rad)) for stop in stops]
        self.rings = [
            ring
            for stop in stops
            if isinstance(stop, imc.Loiter)
            if (ring := outline(stop.figure, frame.to_local(stop.lat_rad, stop.lon_rad), _USUAL_RADIUS_M))
        ]
        self.fences = [(area.inclusion, _outline(area, frame)) for area in areas]
        self.rally = [frame.to_local(*point) for point in rally]
        self.unknown = [frame.to_local(*point) for point in unknown_rad]
        """On the way, where the chart knows no depth."""

    @property
    def all_points(self) -> Points:
        """Everything that must be on the map."""
        points = [place for _, place in self.stops] + self.rally
        points += [place for ring in self.rings for place in ring]
        return points + [corner for _, outline in self.fences for corner in outline]


def _outline(area: imc.FenceArea, frame: LocalFrame) -> Points:
    if area.vertices_rad:
        return [frame.to_local(*corner) for corner in area.vertices_rad]
    if area.centre_rad is None or area.radius_m is None:
        return []
    north, east = frame.to_local(*area.centre_rad)
    return _ring((north, east), area.radius_m)


def _ring(centre: tuple[float, float], radius: float, count: int = 48) -> Points:
    angles = [math.tau * step / count for step in range(count)]
    return [(centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)) for angle in angles]


def ascii_map(plan: PlanFile, unknown_rad: Sequence[tuple[float, float]] = ()) -> str:
    """The way with letters: digits are items (their last digit), dots the legs, ? where the chart
    knows no depth, o circles, # fence, R rally points.
    """
    shapes = PlanShapes(plan, unknown_rad)
    points = shapes.all_points
    if not points:
        return "  (nothing to draw)"
    south, north = min(p[0] for p in points), max(p[0] for p in points)
    west, east = min(p[1] for p in points), max(p[1] for p in points)
    # a letter is twice as high as wide
    metres = max((east - west) / (WIDTH - 1), (north - south) / (HEIGHT - 1) / 2.0, 0.1)
    columns = int((east - west) / metres) + 1
    rows = int((north - south) / metres / 2.0) + 1
    sheet = [[" "] * columns for _ in range(rows)]

    def put(place: tuple[float, float], letter: str) -> None:
        row = min(rows - 1, max(0, round((north - place[0]) / metres / 2.0)))
        column = min(columns - 1, max(0, round((place[1] - west) / metres)))
        sheet[row][column] = letter

    for _, corners in shapes.fences:
        _line(put, [*corners, *corners[:1]], metres, "#")
    for ring in shapes.rings:
        _line(put, [*ring, *ring[:1]], metres, "o")
    _line(put, [place for _, place in shapes.stops], metres, ".")
    for place in shapes.unknown:
        put(place, "?")
    for place in shapes.rally:
        put(place, "R")
    for seq, place in shapes.stops:
        put(place, str(seq % 10))
    lines = ["  " + "".join(row).rstrip() for row in sheet]
    marks = [("digits items", shapes.stops), (". the way", shapes.stops[1:]), ("o a loiter", shapes.rings)]
    marks += [("# fence", shapes.fences), ("R rally point", shapes.rally)]
    marks.append(("? unknown water", shapes.unknown))
    legend = ", ".join(text for text, shown in marks if shown)
    return "\n".join([*lines, f"  north up, one letter is {metres:.1f} m wide; {legend}"])


def _line(put: Put, points: Points, metres: float, letter: str) -> None:
    for (north1, east1), (north2, east2) in itertools.pairwise(points):
        steps = max(1, int(math.hypot(north2 - north1, east2 - east1) / metres))
        for step in range(steps + 1):
            share = step / steps
            put((north1 + share * (north2 - north1), east1 + share * (east2 - east1)), letter)


def svg_map(plan: PlanFile, unknown_rad: Sequence[tuple[float, float]] = ()) -> str:
    """The same as a picture of 800 units' width."""
    shapes = PlanShapes(plan, unknown_rad)
    points = shapes.all_points or [(0.0, 0.0)]
    south, north = min(p[0] for p in points), max(p[0] for p in points)
    west, east = min(p[1] for p in points), max(p[1] for p in points)
    scale = 760.0 / max(east - west, north - south, 1.0)

    def at(place: tuple[float, float]) -> str:
        return f"{20 + (place[1] - west) * scale:.1f},{20 + (north - place[0]) * scale:.1f}"

    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 800 {40 + (north - south) * scale:.0f}">']
    parts += [
        f'<polygon points="{" ".join(at(corner) for corner in outline)}" fill="none" stroke="{"green" if inside else "red"}"/>'
        for inside, outline in shapes.fences
    ]
    parts += [
        f'<polygon points="{" ".join(at(place) for place in ring)}" fill="none" stroke="blue"/>'
        for ring in shapes.rings
    ]
    parts.append(f'<polyline points="{" ".join(at(place) for _, place in shapes.stops)}" fill="none" stroke="blue"/>')
    parts += [_svg_circle(at(place), 2.0, "grey") for place in shapes.unknown]
    parts += [_svg_circle(at(place), 5.0, "orange") for place in shapes.rally]
    for seq, place in shapes.stops:
        x, y = at(place).split(",")
        parts.append(f'<text x="{x}" y="{y}" font-size="14">{seq}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def _svg_circle(centre: str, radius: float, fill: str) -> str:
    x, y = centre.split(",")
    return f'<circle cx="{x}" cy="{y}" r="{radius:.1f}" fill="{fill}" stroke="blue"/>'
