"""The law that brings a vessel onto a path and keeps it there: a vector field with integral and drift triangle.

Course: the path's, turned towards it by a field whose curvature the vessel can sail (line-of-sight near the path,
Nelson's orbit field on arcs, both with the integral of ILOS). Heading: that course with the estimated drift taken off
by the triangle of velocities. Yaw rate: the derivative of all of it, so that the heading loop has no lag to make up.
"""

from __future__ import annotations

import math
from dataclasses import replace

from mavlink_bridge.language.units import clamp, wrap_pi
from mavlink_bridge.language.value import value

_STEERAGE_MPS = 0.3
"""A boat slower than this through the water answers no rudder."""
MOST_SLOPE = 0.5
"""The integral alone holds against a current of half the boat's way."""
_MOST_GAIN = 1.6
"""Turn of the bow over that of the course, at most, on a bend."""
_STRAIGHT_GAIN = 1.3
"""The same on a leg. Water that runs with the boat asks for more, but a file that says too little speed looks just like it there, and
would swing the boat about the leg, rudders hard over: she comes back a little later instead."""
_CLOSES = 0.07
"""Slope towards a path that gusts, waves and a receiver's noise feign: 4 degrees of course."""
_DOUBTFUL_GAIN = 1.3
"""On a bend where the voyage shows that the file is wrong: what is left of such water then is partly the file's, in every turn anew."""
_FEIGNED_SHARE = 0.15
"""A right file seems wrong by as much in a strong wind along the way; from twice that on it is wrong for certain."""


def approach(offset_m: float, look_ahead_m: float, turn_m: float, into_m: float) -> tuple[float, float]:
    """Return (angle towards the path, its derivative per metre of offset) for an offset from it.

    Near the path atan(offset / look-ahead); farther off the angle chi at which ``into_m`` sailed on and then an arc of
    radius ``turn_m`` would still run into the path tangentially, offset = into sin(chi) + turn (1 - cos(chi)), whichever
    is smaller. Up to 90 degrees. Both may be zero: at the end of a track nothing is planned, and the arc is none.
    """
    size = abs(offset_m)
    linear = math.atan(size / look_ahead_m)
    slope = look_ahead_m / (look_ahead_m * look_ahead_m + size * size)
    if size < turn_m + into_m:
        reach_m = math.hypot(turn_m, into_m)
        tangential = math.acos((turn_m - size) / reach_m) - math.acos(turn_m / reach_m)
        # of an offset that is nothing the arc's angle is rounded to none, and its slope has no end
        if 0.0 < tangential < linear:
            linear = tangential
            slope = 1.0 / math.sqrt(into_m * into_m + size * (2.0 * turn_m - size))
    return math.copysign(linear, offset_m), slope


def standing_share(cross_m: float, look_ahead_m: float, speed_mps: float, across_mps: float) -> float:
    """Return the share of an offset that stands: 0 where she closes it as the field has it, 1 where she does not come nearer.

    ``across_mps``: speed over ground to starboard of the path. What is being closed is no standing error: summed up on the way to a
    path it carried her past it, by 0.3 m for 20 m.
    """
    closing_mps = math.copysign(1.0, -cross_m) * across_mps
    planned = abs(cross_m) / math.hypot(cross_m, look_ahead_m)
    return clamp(1.0 - closing_mps / (speed_mps * (planned + _CLOSES)), 0.0, 1.0)


class Integrator:
    """The integral of ILOS: z' = D e / (D² + (e + k z)²), of offsets that stand, frozen outside its corridor, bounded."""

    def __init__(self) -> None:
        self.z_m = 0.0
        self.most_slope = MOST_SLOPE
        """Slope towards the path that it may come to."""

    def step(
        self, dt_s: float, cross_m: float, look_ahead_m: float, *, gain: float, corridor_m: float, standing: float
    ) -> float:
        """Return the offset to steer by: the cross-track error plus the integral's share.

        ``standing``: share of the offset that stands, see ``standing_share``.
        """
        z_m = self.z_m
        if -corridor_m < cross_m < corridor_m and gain > 0.0:
            total = cross_m + gain * z_m
            z_m += standing * dt_s * look_ahead_m * cross_m / (look_ahead_m * look_ahead_m + total * total)
            bound = self.most_slope * look_ahead_m / gain
            self.z_m = z_m = clamp(z_m, -bound, bound)
        return cross_m + gain * z_m


@value
class SteeredHeading:
    """The triangle of velocities, solved."""

    psi_rad: float
    rate_factor: float
    """d(heading)/d(course)."""
    ground_mps: float
    """Speed along the course that the vessel can make: less than asked for where the drift is too strong across or
    against, more where the water carries it faster than that and it needs steerage way."""
    water_mps: float
    """Speed through the water for it."""


def triangle(
    course_rad: float, speed_mps: float, drift: tuple[float, float], top_mps: float, now_mps: float
) -> SteeredHeading:
    """Return the heading that makes good a course over ground at a speed in a drift (NED, m/s).

    ``top_mps`` is the greatest speed through the water; ``now_mps`` the present one, which decides the angle until
    the wanted one is reached.
    """
    cos, sin = math.cos(course_rad), math.sin(course_rad)
    along = drift[0] * cos + drift[1] * sin
    across = drift[1] * cos - drift[0] * sin
    spare2 = top_mps * top_mps - across * across
    ground, least = speed_mps, along + _STEERAGE_MPS
    if least > ground:
        ground = least
    most = along + (math.sqrt(spare2) if spare2 > 0.0 else 0.0)
    if most < ground:
        ground = most
    water = math.hypot(ground - along, across)
    reference = now_mps if now_mps > 0.6 * water else 0.6 * water
    if reference < _STEERAGE_MPS:
        reference = _STEERAGE_MPS
    angle = math.asin(clamp(across / reference, -0.97, 0.97))
    cosine = math.cos(angle)
    factor = clamp(1.0 + along / (reference * cosine), 0.2, 3.0) if abs(cosine) > 0.2 else 1.0
    return SteeredHeading(wrap_pi(course_rad - angle), factor, ground, water)


def bow(
    path_rad: float,
    course_rad: float,
    speed_mps: float,
    drift: tuple[float, float],
    *,
    top_mps: float,
    now_mps: float,
    made_share: float,
    is_bend: bool,
) -> SteeredHeading:
    """Return the triangle's heading for a course towards a path, turned from the path's own by no more than a gain allows.

    ``made_share``: what the hull makes more through the water than her file says, over what it says. The gain is ``_STRAIGHT_GAIN``
    on a leg; on a bend ``_MOST_GAIN`` where the file stands, ``_DOUBTFUL_GAIN`` where it is wrong.
    """
    found = triangle(course_rad, speed_mps, drift, top_mps, now_mps)
    along = triangle(path_rad, speed_mps, drift, top_mps, now_mps)
    doubt = clamp(abs(made_share) / _FEIGNED_SHARE - 1.0, 0.0, 1.0)
    gain = _MOST_GAIN + doubt * (_DOUBTFUL_GAIN - _MOST_GAIN) if is_bend else _STRAIGHT_GAIN
    most_rad = gain * abs(wrap_pi(course_rad - path_rad))
    off_rad = wrap_pi(found.psi_rad - along.psi_rad)
    if abs(off_rad) <= most_rad:
        return found
    psi_rad = wrap_pi(along.psi_rad + math.copysign(most_rad, off_rad))
    return replace(found, psi_rad=psi_rad, rate_factor=min(found.rate_factor, gain))
