"""Where a trial may be sailed: everything that is seen straight from its middle, up to an edge on each bearing.

A circle has the same way to its edge all round. Where a fence or a chart leaves less, the edge comes nearer on those
bearings: a polygon about the middle, of which every point is reached from the middle on a straight line, so that the way
back never leaves it. Plane, in metres north and east of the run's origin.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from mavlink_bridge.language.points import NorthEast

RAYS: Final = 72
"""Every 5 degrees: 7 m apart at the edge of a circle of 80 m, and what lies between two is taken as near as the nearer one."""
_STEP_SHARE: Final = 0.05
"""Share of the radius by which a bearing is looked along."""


class TrialArea:
    """Where one trial may be sailed."""

    def __init__(self, centre: NorthEast, reach_m: tuple[float, ...]) -> None:
        """``reach_m``: the way to the edge on bearings that part the circle evenly, from north on; one value = a circle."""
        self.centre = centre
        self._reach_m = tuple(min(near, reach_m[k - 1]) for k, near in enumerate(reach_m))
        self.least_m = min(reach_m)

    @property
    def words(self) -> str:
        """Say how much room there is."""
        most_m = max(self._reach_m)
        if most_m == self.least_m:
            return f"a circle of {most_m:.0f} m"
        return f"{self.least_m:.0f} to {most_m:.0f} m of free water on each side"

    def away_m(self, point: NorthEast) -> float:
        """Distance from the middle."""
        return math.hypot(point[0] - self.centre[0], point[1] - self.centre[1])

    def reach_m(self, point: NorthEast) -> float:
        """The way from the middle to the edge, towards a point."""
        bearing = math.atan2(point[1] - self.centre[1], point[0] - self.centre[0])
        count = len(self._reach_m)
        return self._reach_m[math.ceil(bearing / math.tau * count) % count]

    def room_m(self, point: NorthEast) -> float:
        """What is left to the edge on the line from the middle; negative outside."""
        return self.reach_m(point) - self.away_m(point)


def free_around(centre: NorthEast, radius_m: float, is_free: Callable[[NorthEast], bool]) -> tuple[float, ...]:
    """Look along every bearing as far as the water is free, up to ``radius_m``; return the reaches of an ``TrialArea``."""
    step_m = _STEP_SHARE * radius_m
    steps = round(1.0 / _STEP_SHARE)
    found = []
    for k in range(RAYS):
        north, east = math.cos(math.tau * k / RAYS), math.sin(math.tau * k / RAYS)
        free = 0
        while free < steps:
            away_m = (free + 1) * step_m
            if not is_free(NorthEast((centre[0] + north * away_m, centre[1] + east * away_m))):
                break
            free += 1
        found.append(free * step_m)
    return tuple(found)
