"""Paths on the local plane: corners between straight lines, and the track that is being sailed.

Metres north and east; courses in radians from north; curvature 1/m, positive to starboard; cross-track positive to
starboard of the path, as everywhere.
"""

from __future__ import annotations

import math

from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.segments import (
    Arc as Arc,
    Line as Line,
    Place as Place,
    Projection as Projection,
    Segment as Segment,
)
from mavlink_bridge.language.units import wrap_pi

_WAY_POINTS = 200
"""No path that is looked along has more; one that closes in itself ends here."""
_LEAST_REACH_M = 0.1
"""A leg that has no more of its way to give has no room for an arc: one without a radius has no curvature."""


def fillet(
    start: NorthEast,
    corner: NorthEast,
    end: NorthEast,
    cut_m: float,
    least_m: float,
    reach_m: float,
    way_m: float = 0.0,
) -> Arc | None:
    """Return the arc that rounds a corner, leaving both legs by at most ``cut_m``; None when it is straight,
    reverses, or a leg has no way for it.

    No tighter than ``least_m``, nor shorter than ``way_m``, though that cuts more; but first of all no longer than the legs have way for
    it: ``reach_m`` and half of each bound the part that the arc may take.
    """
    inbound, outbound = Line(start, corner), Line(corner, end)
    if inbound.length_m < 1e-6 or outbound.length_m < 1e-6:
        return None
    turn = wrap_pi(outbound.course_rad - inbound.course_rad)
    half = 0.5 * abs(turn)
    if half < math.radians(0.5) or half > math.radians(80.0):
        return None
    reach = min(reach_m, 0.5 * inbound.length_m, 0.5 * outbound.length_m)
    if reach < _LEAST_REACH_M:
        return None
    radius = min(max(cut_m / (1.0 - math.cos(half)), least_m, way_m / abs(turn)), reach / math.tan(half))
    sense = 1 if turn > 0.0 else -1
    begin = inbound.point(inbound.length_m - radius * math.tan(half))
    to_centre = inbound.course_rad + sense * 0.5 * math.pi
    centre = NorthEast((begin[0] + radius * math.cos(to_centre), begin[1] + radius * math.sin(to_centre)))
    return Arc(centre, radius, wrap_pi(to_centre + math.pi), sense, abs(turn))


class Chain:
    """A chain of segments being sailed, once or round and round; remembers which one is under the keel."""

    def __init__(self, segments: tuple[Segment, ...], *, closed: bool, index: int = 0) -> None:
        self.segments = segments
        self.closed = closed
        self.endless = closed and len(segments) == 1
        """One circle, round and round."""
        self.lap_m = math.fsum(segment.length_m for segment in segments)
        self.tightest_m = min((part.radius_m for part in segments if isinstance(part, Arc)), default=math.inf)
        """Radius of the tightest bend; infinite without any."""
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

    def way(self, reach_m: float) -> list[NorthEast]:
        """Points from where the vessel was located last, ``reach_m`` on or to the end; bends in steps of at most 2 m.

        A vessel beside the track is thought to join it at 45 degrees: the way begins that much farther on.
        """
        index, along, left = self.index, max(0.0, self._along_m or 0.0) + abs(self._cross_m), reach_m
        if not self.endless:
            along = min(along, self.segment.length_m)
        points: list[NorthEast] = [self.segment.point(along)]
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


def straight_on(begin: NorthEast, corner: NorthEast, onward: NorthEast) -> bool:
    """True when the way on needs hardly any turn."""
    inbound, outbound = Line(begin, corner), Line(corner, onward)
    return abs(wrap_pi(outbound.course_rad - inbound.course_rad)) < math.radians(20.0) or outbound.length_m < 1e-6
