"""Where the fence lets a vessel be: polygons and circles, inclusion and exclusion, as one signed distance to the edge.

Geometry is plane, in metres north and east of the run's origin.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import FenceArea
from mavlink_bridge.language.points import NorthEast


class FenceDisc:
    """A disc in the plane."""

    def __init__(self, centre: NorthEast, radius_m: float) -> None:
        self.centre = centre
        self.radius_m = radius_m

    def inside_m(self, point: NorthEast) -> float:
        """Distance to the edge, m, positive inside."""
        return self.radius_m - math.hypot(point[0] - self.centre[0], point[1] - self.centre[1])

    def cuts(self, start: NorthEast, way: NorthEast) -> list[float]:
        """Shares of a straight way at which it meets the edge."""
        north, east = start[0] - self.centre[0], start[1] - self.centre[1]
        square = way[0] * way[0] + way[1] * way[1]
        middle = -(north * way[0] + east * way[1])
        under = middle * middle - square * (north * north + east * east - self.radius_m * self.radius_m)
        if square == 0.0 or under < 0.0:
            return []
        return [(middle + side * math.sqrt(under)) / square for side in (-1.0, 1.0)]


class Polygon:
    """A simple or self-crossing polygon (even-odd rule), closed by itself."""

    def __init__(self, vertices: Sequence[NorthEast]) -> None:
        edges = ((vertices[i - 1], vertices[i]) for i in range(len(vertices)))
        self._edges = [(*begin, end[1], end[0] - begin[0], end[1] - begin[1]) for begin, end in edges]

    def inside_m(self, point: NorthEast) -> float:
        """Distance to the nearest edge, m, positive inside."""
        north, east = point
        inside = False
        nearest2 = math.inf
        for n1, e1, e2, dn, de in self._edges:
            n, e = north - n1, east - e1
            if (e1 > east) != (e2 > east) and north < n1 + dn * e / de:
                inside = not inside
            length2 = dn * dn + de * de
            share = 0.0 if length2 == 0.0 else (n * dn + e * de) / length2
            if share < 0.0:
                share = 0.0
            elif share > 1.0:
                share = 1.0
            n -= share * dn
            e -= share * de
            distance2 = n * n + e * e
            if distance2 < nearest2:
                nearest2 = distance2
        return math.sqrt(nearest2) if inside else -math.sqrt(nearest2)

    def cuts(self, start: NorthEast, way: NorthEast) -> list[float]:
        """Shares of a straight way at which it meets an edge."""
        found = []
        for n1, e1, _, dn, de in self._edges:
            across = way[0] * de - way[1] * dn
            if across == 0.0:
                continue
            n, e = n1 - start[0], e1 - start[1]
            if 0.0 <= (n * way[1] - e * way[0]) / across <= 1.0:
                found.append((n * de - e * dn) / across)
        return found


Shape = FenceDisc | Polygon


class Region:
    """Where the vessel may be: a signed distance that changes by at most one metre per metre."""

    def __init__(self, inclusions: Sequence[Shape], exclusions: Sequence[Shape], union: bool) -> None:
        self._inclusions = inclusions
        self._exclusions = exclusions
        self._union = union

    def inside_m(self, point: NorthEast) -> float:
        """Distance to the nearest edge, m, positive where the vessel may be."""
        inside = [shape.inside_m(point) for shape in self._inclusions]
        allowed_m = (max(inside) if self._union else min(inside)) if inside else math.inf
        for shape in self._exclusions:
            outside_m = -shape.inside_m(point)
            if outside_m < allowed_m:
                allowed_m = outside_m
        return allowed_m

    def leads_out(self, start: NorthEast, way: NorthEast) -> bool:
        """Whether a straight way leads from where the vessel may be to where she may not; from outside: out again.

        Between two edges it is all inside or all outside, so their middles tell.
        """
        shapes = (*self._inclusions, *self._exclusions)
        cuts = sorted(cut for shape in shapes for cut in shape.cuts(start, way) if 0.0 < cut < 1.0)
        was_inside = False
        for begin, end in pairwise((0.0, *cuts, 1.0)):
            share = 0.5 * (begin + end)
            is_inside = self.inside_m(NorthEast((start[0] + share * way[0], start[1] + share * way[1]))) >= 0.0
            if was_inside and not is_inside:
                return True
            was_inside = was_inside or is_inside
        return False


def build_region(areas: Sequence[FenceArea], frame: LocalFrame, union: bool = False) -> Region:
    """Lay fence areas into the plane about ``frame``'s origin."""
    inclusions: list[Shape] = []
    exclusions: list[Shape] = []
    for area in areas:
        if area.centre_rad is not None:
            shape: Shape = FenceDisc(frame.to_local(*area.centre_rad), area.radius_m or 0.0)
        else:
            shape = Polygon([frame.to_local(lat, lon) for lat, lon in area.vertices_rad])
        (inclusions if area.inclusion else exclusions).append(shape)
    return Region(inclusions, exclusions, union)
