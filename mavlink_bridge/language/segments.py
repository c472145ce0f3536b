"""Straight lines and arcs on the local plane: what every path is made of, sailed, drawn or held against a fence or a chart.

Metres north and east; courses in radians from north; curvature 1/m, positive to starboard; cross-track positive to
starboard of the path, as everywhere.
"""

from __future__ import annotations

import math

from .points import NorthEast
from .units import wrap_pi
from .value import value


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

    def __init__(self, start: NorthEast, end: NorthEast) -> None:
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

    def point(self, along_m: float) -> NorthEast:
        return NorthEast((self.start[0] + along_m * self._cos, self.start[1] + along_m * self._sin))


class Arc:
    """A circular segment from ``start_rad`` (bearing from the centre), turning to starboard when ``sense`` is 1."""

    def __init__(self, centre: NorthEast, radius_m: float, start_rad: float, sense: int, sweep_rad: float) -> None:
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

    def point(self, along_m: float) -> NorthEast:
        bearing, radius_m = self.start_rad + self.sense * along_m / self.radius_m, self.radius_m
        return NorthEast((self.centre[0] + radius_m * math.cos(bearing), self.centre[1] + radius_m * math.sin(bearing)))


Segment = Line | Arc
