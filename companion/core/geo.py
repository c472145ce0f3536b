"""Geodesy on WGS-84 by geographiclib: positions to local metres and back, range and bearing.

The local plane is the azimuthal equidistant map about an origin: distances and bearings *from the origin* are exact
at any range, and the round trip is exact to micrometres (the seed accepted 6 m). Over 10 km the scale across the
radius differs from one by 4e-7.
"""

from __future__ import annotations

import math
from typing import Final

from geographiclib.geodesic import Geodesic

_WGS84: Final = Geodesic.WGS84
_MASK: Final = Geodesic.DISTANCE | Geodesic.AZIMUTH


def inverse(lat1_rad: float, lon1_rad: float, lat2_rad: float, lon2_rad: float) -> tuple[float, float]:
    """Return (distance in m, initial bearing in rad from north, (-pi, pi]) of the geodesic from point 1 to 2."""
    line = _WGS84.Inverse(
        math.degrees(lat1_rad), math.degrees(lon1_rad), math.degrees(lat2_rad), math.degrees(lon2_rad), _MASK
    )
    return line["s12"], math.radians(line["azi1"])


def direct(lat_rad: float, lon_rad: float, bearing_rad: float, distance_m: float) -> tuple[float, float]:
    """Return (lat, lon) in rad of the point at a bearing and distance."""
    line = _WGS84.Direct(
        math.degrees(lat_rad),
        math.degrees(lon_rad),
        math.degrees(bearing_rad),
        distance_m,
        Geodesic.LATITUDE | Geodesic.LONGITUDE,
    )
    return math.radians(line["lat2"]), math.radians(line["lon2"])


class LocalFrame:
    """North-east plane about a fixed origin."""

    __slots__ = ("lat_rad", "lon_rad")

    def __init__(self, lat_rad: float, lon_rad: float) -> None:
        self.lat_rad = lat_rad
        self.lon_rad = lon_rad

    def to_local(self, lat_rad: float, lon_rad: float) -> tuple[float, float]:
        """Return (north, east) in metres."""
        distance_m, bearing_rad = inverse(self.lat_rad, self.lon_rad, lat_rad, lon_rad)
        return distance_m * math.cos(bearing_rad), distance_m * math.sin(bearing_rad)

    def to_geodetic(self, north_m: float, east_m: float) -> tuple[float, float]:
        """Return (lat, lon) in rad."""
        return direct(self.lat_rad, self.lon_rad, math.atan2(east_m, north_m), math.hypot(north_m, east_m))
