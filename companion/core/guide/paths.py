"""Paths on the local plane: straight lines and arcs, joined tangentially into legs, corners and loiter patterns.

Metres north and east; courses in radians from north; curvature 1/m, positive to starboard; cross-track positive to
starboard of the path, as everywhere.
"""

from __future__ import annotations

import math

from mavlink_bridge.language.units import wrap_pi
from mavlink_bridge.language.value import value

Point = tuple[float, float]
"""North and east, m."""

_WAY_POINTS = 200


@value
class Projection:
    """Where a point is relative to a segment: run along it, offset, and the path's course and curvature there."""

    along_m: float
    cross_m: float
    course_rad: float
    curvature: float


Place = tuple[float, float, float]
"""The first three of them: along, cross, course."""


class Line:
    """A straight segment. A line of no length points north."""

    curvature = 0.0
    round_m = 0.0
    """No bearing of its ends starts anew."""

    def __init__(self, start: Point, end: Point) -> None:
        self.start, self.end = start, end
        north, east = end[0] - start[0], end[1] - start[1]
        self.length_m = math.hypot(north, east)
        self.course_rad = math.atan2(east, north)
        self._cos, self._sin = math.cos(self.course_rad), math.sin(self.course_rad)

    def place(self, north_m: float, east_m: float) -> Place:
        north, east = north_m - self.start[0], east_m - self.start[1]
        cos, sin = self._cos, self._sin
        return north * cos + east * sin, east * cos - north * sin, self.course_rad

    def project(self, north_m: float, east_m: float) -> Projection:
        return Projection(*self.place(north_m, east_m), 0.0)

    def point(self, along_m: float) -> Point:
        return self.start[0] + along_m * self._cos, self.start[1] + along_m * self._sin


class Arc:
    """A circular segment from ``start_rad`` (bearing from the centre), turning to starboard when ``sense`` is 1."""

    def __init__(self, centre: Point, radius_m: float, start_rad: float, sense: int, sweep_rad: float) -> None:
        self.centre, self.radius_m, self.start_rad, self.sense = centre, radius_m, start_rad, sense
        self.sweep_rad = sweep_rad
        """Positive; a full circle or more is allowed."""
        self.length_m = radius_m * sweep_rad
        self.curvature = sense / radius_m
        self.round_m = 2.0 * math.pi * radius_m
        """Once round the whole circle."""
        self._half_sweep = 0.5 * sweep_rad
        self._quarter = sense * 0.5 * math.pi

    def place(self, north_m: float, east_m: float) -> Place:
        north, east = north_m - self.centre[0], east_m - self.centre[1]
        bearing = math.atan2(east, north)
        radius, sense, half = self.radius_m, self.sense, self._half_sweep
        swept = wrap_pi((bearing - self.start_rad) * sense - half) + half
        return swept * radius, sense * (radius - math.hypot(north, east)), wrap_pi(bearing + self._quarter)

    def project(self, north_m: float, east_m: float) -> Projection:
        return Projection(*self.place(north_m, east_m), self.curvature)

    def point(self, along_m: float) -> Point:
        bearing = self.start_rad + self.sense * along_m / self.radius_m
        return self.centre[0] + self.radius_m * math.cos(bearing), self.centre[1] + self.radius_m * math.sin(bearing)


Segment = Line | Arc


def fillet(start: Point, corner: Point, end: Point, cut_m: float, least_m: float, reach_m: float) -> Arc | None:
    """Return the arc that rounds a corner, leaving both legs by at most ``cut_m``; None when it is straight or reverses.

    No tighter than ``least_m``, though that cuts more; ``reach_m`` bounds the part of either leg that the arc may take.
    """
    inbound, outbound = Line(start, corner), Line(corner, end)
    if inbound.length_m < 1e-6 or outbound.length_m < 1e-6:
        return None
    turn = wrap_pi(outbound.course_rad - inbound.course_rad)
    half = 0.5 * abs(turn)
    if half < math.radians(0.5) or half > math.radians(80.0):
        return None
    reach = min(reach_m, 0.5 * inbound.length_m, 0.5 * outbound.length_m)
    radius = min(max(cut_m / (1.0 - math.cos(half)), least_m), reach / math.tan(half))
    sense = 1 if turn > 0.0 else -1
    begin = inbound.point(inbound.length_m - radius * math.tan(half))
    to_centre = inbound.course_rad + sense * 0.5 * math.pi
    centre = begin[0] + radius * math.cos(to_centre), begin[1] + radius * math.sin(to_centre)
    return Arc(centre, radius, wrap_pi(to_centre + math.pi), sense, abs(turn))


def circle(centre: Point, radius_m: float, sense: int) -> tuple[Segment, ...]:
    return (Arc(centre, radius_m, 0.0, sense, 2.0 * math.pi),)


def racetrack(centre: Point, radius_m: float, length_m: float, bearing_rad: float, sense: int) -> tuple[Segment, ...]:
    """Two straights of ``length_m`` along ``bearing_rad`` joined by half circles; sails the first straight along the bearing."""
    ahead = (math.cos(bearing_rad), math.sin(bearing_rad))
    side = (-ahead[1] * -sense, ahead[0] * -sense)

    def at(along: float, across: float) -> Point:
        return centre[0] + along * ahead[0] + across * side[0], centre[1] + along * ahead[1] + across * side[1]

    half = 0.5 * length_m
    outward = math.atan2(side[1], side[0])
    return (
        Line(at(-half, radius_m), at(half, radius_m)),
        Arc(at(half, 0.0), radius_m, outward, sense, math.pi),
        Line(at(half, -radius_m), at(-half, -radius_m)),
        Arc(at(-half, 0.0), radius_m, wrap_pi(outward + math.pi), sense, math.pi),
    )


def figure_eight(
    centre: Point, radius_m: float, length_m: float, bearing_rad: float, sense: int
) -> tuple[Segment, ...]:
    """Two loops of opposite sense, their centres ``length_m`` apart along ``bearing_rad``, joined by crossing tangents.

    ``length_m`` below twice the radius is raised to it (the loops touch). The loop at the bearing's end turns by ``sense``.
    """
    half = max(0.5 * length_m, radius_m)
    ahead = (math.cos(bearing_rad), math.sin(bearing_rad))
    far = (centre[0] + half * ahead[0], centre[1] + half * ahead[1])
    near = (centre[0] - half * ahead[0], centre[1] - half * ahead[1])
    opening = math.acos(min(1.0, radius_m / half))
    sweep = 2.0 * (math.pi - opening)
    # the tangent points lie at +-opening from the line to the other loop's centre
    back = bearing_rad + math.pi
    far_arc = Arc(far, radius_m, wrap_pi(back + sense * opening), sense, sweep)
    near_arc = Arc(near, radius_m, wrap_pi(bearing_rad - sense * opening), -sense, sweep)
    segments: list[Segment] = []
    for arc, other in ((far_arc, near_arc), (near_arc, far_arc)):
        segments.append(arc)
        link = Line(arc.point(arc.length_m), other.point(0.0))
        if link.length_m > 1e-6:
            segments.append(link)
    return tuple(segments)


class Track:
    """A chain of segments being sailed, once or round and round; remembers which one is under the keel."""

    def __init__(self, segments: tuple[Segment, ...], *, closed: bool, index: int = 0) -> None:
        self.segments = segments
        self.closed = closed
        self.endless = closed and len(segments) == 1
        """One circle, round and round."""
        self.lap_m = math.fsum(segment.length_m for segment in segments)
        self.run_m = 0.0
        """Length of the segments left behind, m."""
        self._along_m: float | None = None
        self._cross_m = 0.0
        self._take(index)

    def _take(self, index: int) -> None:
        self.index = index
        self.segment = self.segments[index]

    def nearest(self, north_m: float, east_m: float) -> None:
        """Start on the segment that is closest."""
        self._take(min(range(len(self.segments)), key=lambda k: _gap_m(self.segments[k], north_m, east_m)))

    def locate(self, north_m: float, east_m: float) -> Projection:
        """Advance to the segment in force and return the projection on it."""
        here = self._project(north_m, east_m)
        while here.along_m >= self.segment.length_m and self._advance():
            self._along_m = None
            here = self._project(north_m, east_m)
            if here.along_m < 0.5 * self.segment.length_m:
                break
        return here

    def _project(self, north_m: float, east_m: float) -> Projection:
        """Let the run along an arc go on where its bearing starts anew; a circle counts its laps."""
        segment = self.segment
        along, cross, course = segment.place(north_m, east_m)
        lap, last = segment.round_m, self._along_m
        if lap:
            if last is not None:
                along += lap * round((last - along) / lap)
            elif along > 0.9 * lap:  # a full loop's end looks like its beginning
                along -= lap
        self._along_m, self._cross_m = along, cross
        return Projection(along, cross, course, segment.curvature)

    def _advance(self) -> bool:
        if self.index + 1 < len(self.segments):
            self.run_m += self.segment.length_m
            self._take(self.index + 1)
            return True
        if self.closed and len(self.segments) > 1:
            self.run_m += self.segment.length_m
            self._take(0)
            return True
        return False

    def ahead(self, along_m: float, distance_m: float) -> float:
        """Return the curvature at ``distance_m`` beyond ``along_m`` of the present segment; beyond the end it is 0."""
        segment, rest = self.segment, along_m + distance_m
        if self.endless or rest < segment.length_m:
            return segment.curvature
        index = self.index
        for _ in range(len(self.segments) + 1):
            segment = self.segments[index]
            if rest < segment.length_m:
                return segment.curvature
            rest -= segment.length_m
            index += 1
            if index == len(self.segments):
                if not self.closed:
                    return 0.0
                index = 0
        return 0.0

    def bends(self, along_m: float, horizon_m: float) -> list[tuple[float, float]]:
        """Return (distance to its start, curvature) of each segment within the horizon, the present one at 0."""
        result = [(0.0, self.segment.curvature)]
        distance, index = self.segment.length_m - along_m, self.index
        while distance < horizon_m and len(result) < 8:
            index += 1
            if index == len(self.segments):
                if not self.closed or self.endless:
                    break
                index = 0
            result.append((max(0.0, distance), self.segments[index].curvature))
            distance += self.segments[index].length_m
        return result

    def way(self, reach_m: float) -> list[Point]:
        """Points from where the vessel was located last, ``reach_m`` on or to the end; bends in steps of at most 2 m.

        A vessel beside the track is thought to join it at 45 degrees: the way begins that much farther on.
        """
        index, along, left = self.index, max(0.0, self._along_m or 0.0) + abs(self._cross_m), reach_m
        if not self.endless:
            along = min(along, self.segment.length_m)
        points: list[Point] = [self.segment.point(along)]
        while left > 0.0 and len(points) < _WAY_POINTS:
            segment = self.segments[index]
            part = left if self.endless else min(left, max(0.0, segment.length_m - along))
            steps = max(1, math.ceil(0.5 * part)) if segment.curvature else 1
            points += [segment.point(along + part * step / steps) for step in range(1, steps + 1)]
            left -= part
            index, along = index + 1, 0.0
            if index == len(self.segments):
                if not self.closed:
                    break
                index = 0
        return points

    def rest_m(self, along_m: float) -> float:
        """Return the way to the end of an open track."""
        return math.fsum(segment.length_m for segment in self.segments[self.index :]) - along_m


def _gap_m(segment: Segment, north_m: float, east_m: float) -> float:
    along = min(max(segment.project(north_m, east_m).along_m, 0.0), segment.length_m)
    north, east = segment.point(along)
    return math.hypot(north_m - north, east_m - east)
