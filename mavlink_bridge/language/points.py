"""Two kinds of point that must not be taken for each other: a place on the earth, and a place on the run's local plane.

Both are pairs; a type checker refuses one where the other is meant. ``LocalFrame`` (geodesy) turns one into the other.
"""

from __future__ import annotations

from typing import NewType

LatLon = NewType("LatLon", tuple[float, float])
"""Latitude and longitude, radians, WGS-84."""
NorthEast = NewType("NorthEast", tuple[float, float])
"""Metres north and east of the run's origin."""
