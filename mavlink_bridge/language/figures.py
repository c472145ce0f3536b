"""The figures of a loiter: a closed sum type. Each has its own fields, its own geometry and its own words.

Whoever sails, draws, fences, charts, reports or writes a loiter asks its figure. A new one is a class here, a member of
``Figure``, and its rows in the plan items (``mavlink/missions``); whoever forgets it is told by the type checker.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar, Final, get_args

from .points import NorthEast
from .segments import Arc, Line, Segment
from .units import wrap_pi


class LoiterDirection(Enum):
    """IMC Loiter.direction."""

    CW = "cw"
    CCW = "ccw"
    INTO_DRIFT = "into-drift"
    VESSEL = "vessel"


@dataclass(frozen=True, slots=True)
class Circle:
    """Round a point. ``radius_m`` None = the vessel's default."""

    name: ClassVar[str] = "circular"
    goes_round: ClassVar[bool] = True

    radius_m: float | None = None
    direction: LoiterDirection = LoiterDirection.CW

    def segments(self, centre: NorthEast, radius_m: float, sense: int) -> tuple[Segment, ...]:
        return (Arc(centre, radius_m, 0.0, sense, 2.0 * math.pi),)

    def error_m(self, centre: NorthEast, radius_m: float, here: NorthEast, sense: int) -> float:
        """How far outside the circle a place is; inside is negative."""
        return math.dist(here, centre) - radius_m

    def words(self) -> tuple[str, ...]:
        return (_radius(self.radius_m), self.direction.value)


@dataclass(frozen=True, slots=True)
class Racetrack:
    """Two straights of ``length_m`` along ``bearing_rad`` joined by half circles; the first is sailed along the bearing.

    ``length_m`` None = twice the radius.
    """

    name: ClassVar[str] = "racetrack"
    goes_round: ClassVar[bool] = True

    length_m: float | None = None
    radius_m: float | None = None
    bearing_rad: float | None = None
    direction: LoiterDirection = LoiterDirection.CW

    def segments(self, centre: NorthEast, radius_m: float, sense: int) -> tuple[Segment, ...]:
        bearing_rad = self.bearing_rad or 0.0
        ahead = (math.cos(bearing_rad), math.sin(bearing_rad))
        side = (-ahead[1] * -sense, ahead[0] * -sense)

        def at(along: float, across: float) -> NorthEast:
            north = centre[0] + along * ahead[0] + across * side[0]
            return NorthEast((north, centre[1] + along * ahead[1] + across * side[1]))

        half = 0.5 * (self.length_m or 2.0 * radius_m)
        outward = math.atan2(side[1], side[0])
        return (
            Line(at(-half, radius_m), at(half, radius_m)),
            Arc(at(half, 0.0), radius_m, outward, sense, math.pi),
            Line(at(half, -radius_m), at(-half, -radius_m)),
            Arc(at(-half, 0.0), radius_m, wrap_pi(outward + math.pi), sense, math.pi),
        )

    def error_m(self, centre: NorthEast, radius_m: float, here: NorthEast, sense: int) -> float:
        """Distance of a place to the figure."""
        return distance_m(self.segments(centre, radius_m, sense), *here)

    def words(self) -> tuple[str, ...]:
        return (_radius(self.radius_m), self.direction.value, *_axis(self.length_m, self.bearing_rad))


@dataclass(frozen=True, slots=True)
class FigureEight:
    """Two loops of opposite sense, their centres ``length_m`` apart along ``bearing_rad``, joined by crossing tangents.

    ``length_m`` below twice the radius is raised to it (the loops touch), None likewise. The loop at the bearing's end turns
    by the direction.
    """

    name: ClassVar[str] = "figure-eight"
    goes_round: ClassVar[bool] = True

    length_m: float | None = None
    radius_m: float | None = None
    bearing_rad: float | None = None
    direction: LoiterDirection = LoiterDirection.CW

    def segments(self, centre: NorthEast, radius_m: float, sense: int) -> tuple[Segment, ...]:
        bearing_rad = self.bearing_rad or 0.0
        half = max(0.5 * (self.length_m or 2.0 * radius_m), radius_m)
        ahead = (math.cos(bearing_rad), math.sin(bearing_rad))
        far = NorthEast((centre[0] + half * ahead[0], centre[1] + half * ahead[1]))
        near = NorthEast((centre[0] - half * ahead[0], centre[1] - half * ahead[1]))
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

    def error_m(self, centre: NorthEast, radius_m: float, here: NorthEast, sense: int) -> float:
        """Distance of a place to the figure."""
        return distance_m(self.segments(centre, radius_m, sense), *here)

    def words(self) -> tuple[str, ...]:
        return (_radius(self.radius_m), self.direction.value, *_axis(self.length_m, self.bearing_rad))


@dataclass(frozen=True, slots=True)
class Hover:
    """Keep station at the point."""

    name: ClassVar[str] = "hover"
    goes_round: ClassVar[bool] = False

    def segments(self, centre: NorthEast, radius_m: float, sense: int) -> tuple[Segment, ...]:
        return ()

    def error_m(self, centre: NorthEast, radius_m: float, here: NorthEast, sense: int) -> float:
        """Distance of a place to the point."""
        return math.dist(here, centre)

    def words(self) -> tuple[str, ...]:
        return ()


Round = Circle | Racetrack | FigureEight
"""Figures that are sailed round and round."""
Figure = Round | Hover
FIGURES: Final[dict[str, type[Figure]]] = {figure.name: figure for figure in get_args(Figure)}
"""By the names that files and command lines use."""

_CORNERS_PER_TURN: Final = 32


def figure_of(
    name: str,
    *,
    radius_m: float | None = None,
    length_m: float | None = None,
    bearing_rad: float | None = None,
    direction: LoiterDirection = LoiterDirection.CW,
) -> Figure:
    """Make the figure of a name from what a file says of it; what the figure does not have is left out.

    Raises KeyError for a name that is none of ``FIGURES``.
    """
    found = FIGURES[name]
    said: dict[str, Any] = {
        "radius_m": radius_m,
        "length_m": length_m,
        "bearing_rad": bearing_rad,
        "direction": direction,
    }
    return found(**{field: value for field, value in said.items() if field in found.__dataclass_fields__})


def radius_of(figure: Figure, default_m: float) -> float:
    """The radius that a figure is sailed with, m; a hover has none: 0."""
    return abs(figure.radius_m or default_m) if not isinstance(figure, Hover) else 0.0


def sense_of(figure: Figure) -> int:
    """1 clockwise, -1 counter-clockwise, as far as the figure says; a direction chosen on the water is drawn clockwise."""
    return -1 if not isinstance(figure, Hover) and figure.direction is LoiterDirection.CCW else 1


def outline(figure: Figure, centre: NorthEast, default_radius_m: float) -> list[NorthEast]:
    """The closed line of a figure as points north and east, for whoever draws it or holds it against something."""
    points: list[NorthEast] = []
    for segment in figure.segments(centre, radius_of(figure, default_radius_m), sense_of(figure)):
        turns = abs(segment.curvature) * segment.length_m / (2.0 * math.pi)
        count = max(1, math.ceil(_CORNERS_PER_TURN * turns))
        points += [segment.point(segment.length_m * i / count) for i in range(count + 1)]
    return points


def distance_m(segments: Sequence[Segment], north_m: float, east_m: float) -> float:
    """Distance to the nearest point of a chain of segments."""
    best = math.inf
    for segment in segments:
        along = min(max(segment.project(north_m, east_m).along_m, 0.0), segment.length_m)
        best = min(best, math.dist((north_m, east_m), segment.point(along)))
    return best


def _radius(radius_m: float | None) -> str:
    return "default radius" if radius_m is None else f"radius {radius_m:g} m"


def _axis(length_m: float | None, bearing_rad: float | None) -> tuple[str, ...]:
    if length_m is None:
        return ()
    return (f"length {length_m:g} m on {math.degrees(bearing_rad or 0.0) % 360.0:03.0f}",)
