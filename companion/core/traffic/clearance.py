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
    now_m: float
    """Hull to us at the start."""


Axis = tuple[Hull, float]
"""A hull, and the heading of its axis in rad."""


def clearance(north_m: float, east_m: float, closing: tuple[float, float], axis: Axis, horizon_s: float) -> Clearance:
    """Return the least distance within a time, and when.

    ``north_m``, ``east_m``: from us to her antenna; ``closing``: her velocity less ours, m/s; ``horizon_s`` at least 0.
    """
    x, y, vx, vy = _seen_by_her(north_m, east_m, closing, axis)
    bow, stern, half = axis[0].bow_m, -axis[0].stern_m, axis[0].half_m
    now_m = least_m = _to_axis(x, y, stern, bow) - half
    least_s = 0.0
    # the distance to a segment is convex along a straight course: its least is at an end, abeam of an end of the axis or on the axis
    for time_s in (horizon_s, _abeam(x - bow, y, vx, vy), _abeam(x - stern, y, vx, vy), -y / vy if vy else 0.0):
        at_s = clamp(time_s, 0.0, horizon_s)
        distance = _to_axis(x + vx * at_s, y + vy * at_s, stern, bow) - half
        if distance < least_m - 1e-9:
            least_m, least_s = distance, at_s
    return Clearance(least_m, least_s, now_m)


def reached_s(north_m: float, east_m: float, closing: tuple[float, float], axis: Axis, reach_m: float) -> float:
    """When the hull first comes as near as ``reach_m``, 0 when it is; infinite: never on these courses."""
    x, y, vx, vy = _seen_by_her(north_m, east_m, closing, axis)
    bow, stern, reach = axis[0].bow_m, -axis[0].stern_m, axis[0].half_m + reach_m
    if _to_axis(x, y, stern, bow) <= reach:
        return 0.0
    # all within reach of an axis: two discs about its ends and the strip between them
    soonest = min(_disc_s(x - bow, y, vx, vy, reach), _disc_s(x - stern, y, vx, vy, reach))
    gap = abs(y) - reach
    if gap > 0.0 and y * vy < 0.0:
        side_s = gap / abs(vy)
        if stern <= x + vx * side_s <= bow:
            soonest = min(soonest, side_s)
    return soonest


def passed_s(north_m: float, east_m: float, closing: tuple[float, float], axis: Axis, near_m: float) -> float:
    """When the first end of her axis still to come passes within ``near_m`` of us; infinite: none will.

    Along a hull the least distance moves between its ends with every tenth of a degree; her nearer end's passing does not.
    """
    x, y, vx, vy = _seen_by_her(north_m, east_m, closing, axis)
    bow, stern, reach = axis[0].bow_m, -axis[0].stern_m, axis[0].half_m + near_m
    times = [_abeam(x - end, y, vx, vy) for end in (bow, stern)]
    near = [at_s for at_s in times if at_s > 0.0 and _to_axis(x + vx * at_s, y + vy * at_s, stern, bow) <= reach]
    return min(near, default=math.inf)


def _seen_by_her(
    north_m: float, east_m: float, closing: tuple[float, float], axis: Axis
) -> tuple[float, float, float, float]:
    """Our place and velocity as she sees us: x towards her bow, y to her starboard from her axis."""
    cosine, sine = math.cos(axis[1]), math.sin(axis[1])
    return (
        -north_m * cosine - east_m * sine,
        north_m * sine - east_m * cosine - axis[0].right_m,
        -closing[0] * cosine - closing[1] * sine,
        closing[0] * sine - closing[1] * cosine,
    )


def _to_axis(x: float, y: float, stern: float, bow: float) -> float:
    return math.hypot(x - clamp(x, stern, bow), y)


def _abeam(x: float, y: float, vx: float, vy: float) -> float:
    """When a straight course is nearest to the origin."""
    speed2 = vx * vx + vy * vy
    return -(x * vx + y * vy) / speed2 if speed2 > 1e-9 else 0.0


def _disc_s(x: float, y: float, vx: float, vy: float, radius: float) -> float:
    """When a straight course from outside first meets a disc about the origin; infinite: never."""
    towards, speed2 = -(x * vx + y * vy), vx * vx + vy * vy
    gap2 = x * x + y * y - radius * radius
    root2 = towards * towards - speed2 * gap2
    if towards <= 0.0 or root2 < 0.0:
        return math.inf
    return gap2 / (towards + math.sqrt(root2))
