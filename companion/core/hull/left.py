"""What is left of a vessel one of whose thrusters gives too little: the thrust, and the speeds at which rudders hold it straight.

A lone thruster beside the centre line turns the hull by all that it pushes; rudders hold against it by the flow of the
boat's way and by the race of that one propeller. Both grow with speed, the flow faster: below some speed the bow falls
off, above it the boat sails straight, up to what the thrust brings.
"""

from __future__ import annotations

import math
from typing import Final

from .forces import ForceModel
from .statics import Statics
from .thrust import ThrustLaw
from .vessel_file import VesselConfig

Shares = tuple[float, float]
"""What port and starboard thruster give, as a share of what they are told: 0 nothing, 1 all."""
WHOLE: Final[Shares] = (1.0, 1.0)
_SPARE: Final = 0.8
"""Share of the rudders that may go into holding straight: the rest steers."""
_THRUST: Final = 0.85
"""Share of the thrust that may go into the steady speed: the rest brings the speed back after a gust."""
_STEPS: Final = 40
"""Speeds looked at up to the top: 8 cm/s apart on a boat of 3 m/s, less than a gust changes."""
_TINY_N: Final = 1e-6
"""Less is rounding."""


def straight_mps(vessel: VesselConfig, shares: Shares) -> tuple[float, float] | None:
    """Return the least and the greatest steady speed through the water, m/s, at which rudders hold it straight; None = at none."""
    found = [speed for speed in _speeds(vessel) if _holds(vessel, shares, speed)]
    return (found[0], found[-1]) if found else None


def way_n(vessel: VesselConfig, shares: Shares) -> tuple[float, float]:
    """Return the thrust, N, that brings the least and the greatest speed at which rudders hold it straight; 0 = none."""
    speeds, statics = straight_mps(vessel, shares), Statics(vessel)
    return (0.0, 0.0) if speeds is None else (statics.drag_n(speeds[0]), statics.drag_n(speeds[1]))


def shared_ahead_n(vessel: VesselConfig, shares: Shares, total_n: float) -> tuple[float, float]:
    """Share a thrust ahead out to port and starboard, N: alike as far as the weaker one can."""
    (port, starboard), half_n = ThrustLaw(vessel).sides, 0.5 * total_n
    if shares[0] < shares[1]:
        port_n = min(half_n, _THRUST * shares[0] * port.ahead_n)
        return port_n, total_n - port_n
    starboard_n = min(half_n, _THRUST * shares[1] * starboard.ahead_n)
    return total_n - starboard_n, starboard_n


def _speeds(vessel: VesselConfig) -> list[float]:
    top_mps = Statics(vessel).top_mps
    return [top_mps * k / _STEPS for k in range(1, _STEPS + 1)]


def _holds(vessel: VesselConfig, shares: Shares, speed_mps: float) -> bool:
    law, model = ThrustLaw(vessel), ForceModel(vessel)
    (port, starboard), most = law.sides, _THRUST * (1.0 - law.loss * speed_mps)
    need_n = Statics(vessel).drag_n(speed_mps)
    port_n, starboard_n = shared_ahead_n(vessel, shares, need_n)
    if (
        port_n > most * port.ahead_n * shares[0] + _TINY_N
        or starboard_n > most * starboard.ahead_n * shares[1] + _TINY_N
    ):
        return False
    slope = model.rudder_slope_nm(speed_mps, port_n, starboard_n)
    rudder_nm = 0.5 * slope * math.sin(2.0 * vessel.rudder.useful_rad) if vessel.rudder.count else 0.0
    return model.lateral_m * abs(port_n - starboard_n) <= _SPARE * rudder_nm
