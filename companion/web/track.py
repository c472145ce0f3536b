"""The way that was sailed, for the page's map: bounded, coarser as it grows longer. No I/O."""

from __future__ import annotations

import math
from typing import Any, Final

POINTS_MAX: Final = 1200
_STEP_M: Final = 2.0
"""Points closer than this to the last are passed over; doubled whenever the track is thinned."""
_M_PER_DEG: Final = 111_195.0
_UNIT_DEG: Final = 1e-6
"""A decimetre: what the points are counted in."""
NO_DEPTH: Final = -1
Point = tuple[float, float, float | None]


class PageTrack:
    """Places in their order, each with the water under the keel there, m."""

    def __init__(self) -> None:
        self._points: list[Point] = []
        self._step_m = _STEP_M

    def __len__(self) -> int:
        return len(self._points)

    def add(self, lat_deg: float, lon_deg: float, keel_m: float | None) -> None:
        """Take a place, unless it is where the last one was."""
        if self._points and _apart_m(self._points[-1], (lat_deg, lon_deg, None)) < self._step_m:
            return
        self._points.append((lat_deg, lon_deg, keel_m))
        if len(self._points) > POINTS_MAX:
            self._points = self._points[::2]
            self._step_m *= 2.0

    def fields(self) -> dict[str, Any]:
        """The track as JSON has it: an origin, and whole numbers of 1e-6 degrees from it, with decimetres of water."""
        return packed(self._points)


def packed(points: list[Point]) -> dict[str, Any]:
    """Places with a depth, small: origin (deg), then north, east (1e-6 deg) and decimetres (-1 = unknown) of each."""
    if not points:
        return {"origin": None, "points": []}
    lat0, lon0 = points[0][0], points[0][1]
    flat: list[int] = []
    for lat, lon, depth_m in points:
        depth = NO_DEPTH if depth_m is None else max(0, round(depth_m * 10.0))
        flat += (round((lat - lat0) / _UNIT_DEG), round((lon - lon0) / _UNIT_DEG), depth)
    return {"origin": [lat0, lon0], "points": flat}


def _apart_m(one: Point, other: Point) -> float:
    north_m = (other[0] - one[0]) * _M_PER_DEG
    east_m = (other[1] - one[1]) * _M_PER_DEG * math.cos(math.radians(one[0]))
    return math.hypot(north_m, east_m)
