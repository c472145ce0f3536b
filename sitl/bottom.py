"""The bottom under the simulated vessel: synthetic slope, shoal, hole and flat, or a grid from soundings.

Depth is water depth in metres, positive down, at metres north and east of the simulation's origin; None = unknown
(outside a map). The true altitude is this depth, plus the tide, less the keel's depth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol


class Bottom(Protocol):
    """Anything with a depth."""

    def depth_at(self, north_m: float, east_m: float) -> float | None:
        """Water depth, m; None where nobody knows."""
        ...


@dataclass(frozen=True, slots=True)
class Flat:
    """The same depth everywhere."""

    depth_m: float = 20.0

    def depth_at(self, north_m: float, east_m: float) -> float | None:
        return self.depth_m


@dataclass(frozen=True, slots=True)
class Slope:
    """A plane that rises toward ``bearing_rad`` by ``gradient`` metres per metre, between two depths."""

    depth_m: float = 20.0
    """At the origin."""
    gradient: float = 0.05
    bearing_rad: float = 0.0
    depth_min_m: float = 0.2
    depth_max_m: float = 100.0

    def depth_at(self, north_m: float, east_m: float) -> float | None:
        along_m = north_m * math.cos(self.bearing_rad) + east_m * math.sin(self.bearing_rad)
        return min(max(self.depth_m - self.gradient * along_m, self.depth_min_m), self.depth_max_m)


@dataclass(frozen=True, slots=True)
class Mound:
    """A shoal (``height_m`` positive) or a hole (negative) of cosine shape on any other bottom."""

    base: Bottom
    north_m: float
    east_m: float
    radius_m: float
    height_m: float
    depth_min_m: float = 0.2

    def depth_at(self, north_m: float, east_m: float) -> float | None:
        depth_m = self.base.depth_at(north_m, east_m)
        away_m = math.hypot(north_m - self.north_m, east_m - self.east_m)
        if depth_m is None or away_m >= self.radius_m:
            return depth_m
        rise_m = self.height_m * 0.5 * (1.0 + math.cos(math.pi * away_m / self.radius_m))
        return max(depth_m - rise_m, self.depth_min_m)


def synthetic() -> Bottom:
    """The shipped bottom: 20 m at the origin, rising northward at 1:40, with a shoal 150 m east and a hole west."""
    slope = Slope(depth_m=20.0, gradient=0.025)
    shoal = Mound(slope, north_m=60.0, east_m=150.0, radius_m=40.0, height_m=16.0)
    return Mound(shoal, north_m=60.0, east_m=-150.0, radius_m=40.0, height_m=-15.0)
