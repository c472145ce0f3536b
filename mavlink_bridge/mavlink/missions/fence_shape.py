"""What is no shape for a fence: a polygon whose sides cross, so that nobody can say what is inside, and one with no room in it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Final

from ...language.geodesy import LocalFrame
from ...language.points import LatLon, NorthEast

_LEAST_M: Final = 0.5
"""Narrower than this, all along, no boat lies inside: corners on one line, or the same one again and again."""
_TOUCH_M: Final = 0.03
"""What a corner may lie beyond a side that it is drawn on: degrees are rounded to 1 cm."""

Side = tuple[NorthEast, NorthEast]


def shape_refusal(corners: Sequence[LatLon], *, inclusion: bool) -> tuple[int, str]:
    """Return why a polygon is no fence, with the number of the corner to look at; an empty text when it is one.

    An exclusion may be as thin as a line of floats. Corners that come twice in a row, or close the ring, change nothing.
    """
    frame = LocalFrame(*corners[0])
    points = [NorthEast(frame.to_local(*corner)) for corner in corners]
    crossing = _first_crossing([(points[i], points[(i + 1) % len(points)]) for i in range(len(points))])
    if crossing is not None:
        one, other = crossing
        return other, f"the polygon's sides after its corners {one + 1} and {other + 1} cross"
    if inclusion and _area_m2(points) <= _LEAST_M * _across_m(points):
        return 0, "the polygon has no room inside: its corners lie on one line"
    return 0, ""


def _first_crossing(sides: Sequence[Side]) -> tuple[int, int] | None:
    """Two sides that cross, by number; looked for from south to north, so that far sides are not held against each other."""
    spans = sorted(
        (min(a[0], b[0]), max(a[0], b[0]), min(a[1], b[1]), max(a[1], b[1]), number)
        for number, (a, b) in enumerate(sides)
    )
    for place, (_, north, west, east, number) in enumerate(spans):
        for south, _, least, most, other in itertools.islice(spans, place + 1, None):
            if south > north:
                break
            if least <= east and most >= west and _cross(sides[number], sides[other]):
                return min(number, other), max(number, other)
    return None


def _cross(one: Side, other: Side) -> bool:
    """Whether two sides go through each other; those that only touch do not."""
    return _parts(one, other) and _parts(other, one)


def _parts(line: Side, side: Side) -> bool:
    """Whether the ends of a side lie on both sides of a line."""
    begin, end = (_turn_m2(*line, corner) for corner in side)
    return begin * end < 0.0 and min(abs(begin), abs(end)) > _TOUCH_M * math.dist(*line)


def _turn_m2(a: NorthEast, b: NorthEast, c: NorthEast) -> float:
    """How far to the right of the line from a to b a point lies, times the line's length."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _area_m2(points: Sequence[NorthEast]) -> float:
    turns = (points[i - 1][0] * points[i][1] - points[i - 1][1] * points[i][0] for i in range(len(points)))
    return abs(math.fsum(turns)) / 2.0


def _across_m(points: Sequence[NorthEast]) -> float:
    norths, easts = zip(*points, strict=True)
    return math.hypot(max(norths) - min(norths), max(easts) - min(easts))
