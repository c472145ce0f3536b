"""The clearance between us, a point, and another hull, both on straight courses over ground: closed form.

A hull is a stadium about her antenna: an axis along her heading, and half her beam around it. Seen from her we move on a
straight line, so the least distance over a time is that of two line segments, less half the beam. Distances to antennas pass
a bow at 0 m: the bridge of a ship may be 150 m behind it.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.traffic import Sides
from mavlink_bridge.language.units import clamp
from mavlink_bridge.language.value import value


@value
class Hull:
    """A stadium about the antenna, metres."""

    bow_m: float
    """End of the axis before the antenna, half a beam short of the bow."""
    stern_m: float
    half_m: float
    """Half the beam: the radius around the axis."""
    right_m: float
    """How far the axis lies to starboard of the antenna."""
    length_m: float
    """Over all. The axis is longer where the antenna's place is not said."""


_UNKNOWN_SHIP: Final = Hull(42.0, 42.0, 8.0, 0.0, 100.0)
"""Class A without dimensions is taken for a ship of 100 x 16 m."""
_UNKNOWN_BOAT: Final = Hull(4.0, 4.0, 2.0, 0.0, 12.0)
"""Class B without dimensions for a boat of 12 x 4 m."""


def hull_of(sides: Sides | None, *, ship: bool) -> Hull:
    """The stadium of a vessel's reported dimensions, or what stands for unknown ones."""
    if sides is None or not sides.bow_m + sides.stern_m:
        return _UNKNOWN_SHIP if ship else _UNKNOWN_BOAT
    bow, stern = float(sides.bow_m), float(sides.stern_m)
    length, beam = bow + stern, sides.port_m + sides.starboard_m
    half = min(0.5 * (beam or max(1.0, 0.2 * length)), 0.5 * length)
    right = 0.5 * (sides.starboard_m - sides.port_m) if beam else 0.0
    if not sides.bow_m:  # where the antenna stands is not said: as if at either end
        bow = stern
    return Hull(bow - half, stern - half, half, right, length)


def circle_of(hull: Hull) -> Hull:
    """What stands for a hull whose heading is unknown: a circle of her farthest end."""
    reach = max(hull.bow_m, hull.stern_m) + hull.half_m
    return Hull(0.0, 0.0, reach, 0.0, hull.length_m)


@value
class Clearance:
    """The closest point of two courses."""

    distance_m: float
    """Hull to us; below 0: inside."""
    time_s: float
    """Until then, 0 when the range only opens."""


def clearance(
    north_m: float, east_m: float, closing: tuple[float, float], axis: tuple[Hull, float], horizon_s: float
) -> Clearance:
    """Return the least distance within a time, and when.

    ``north_m``, ``east_m``: from us to her antenna; ``closing``: her velocity less ours, m/s; ``axis``: her hull and its heading
    in rad; ``horizon_s`` at least 0.
    """
    hull, heading_rad = axis
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
    # us as she sees us: x towards her bow, y to her starboard
    x, y = -north_m * cosine - east_m * sine, north_m * sine - east_m * cosine - hull.right_m
    vx, vy = -closing[0] * cosine - closing[1] * sine, closing[0] * sine - closing[1] * cosine
    bow, stern, half = hull.bow_m, -hull.stern_m, hull.half_m
    best = Clearance(_to_axis(x, y, stern, bow) - half, 0.0)
    # the distance to a segment is convex along a straight course: its least is at an end, abeam of an end of the axis or on the axis
    for time_s in (horizon_s, _abeam(x - bow, y, vx, vy), _abeam(x - stern, y, vx, vy), -y / vy if vy else 0.0):
        at_s = clamp(time_s, 0.0, horizon_s)
        distance = _to_axis(x + vx * at_s, y + vy * at_s, stern, bow) - half
        if distance < best.distance_m - 1e-9:
            best = Clearance(distance, at_s)
    return best


def _to_axis(x: float, y: float, stern: float, bow: float) -> float:
    return math.hypot(x - clamp(x, stern, bow), y)


def _abeam(x: float, y: float, vx: float, vy: float) -> float:
    """When a straight course is nearest to the origin."""
    speed2 = vx * vx + vy * vy
    return -(x * vx + y * vy) / speed2 if speed2 > 1e-9 else 0.0
