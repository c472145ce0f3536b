"""Allocation by authority: which actuator gives how much of the yaw moment and the thrust that are wanted.

Rudders first, up to what they can give in this flow; differential thrust for the rest; surge takes what is left. The
heading has priority, as in the seed. Works without rudders, and with one thruster and no differential.
"""

from __future__ import annotations

import math

from mavlink_bridge.language.units import clamp
from mavlink_bridge.language.value import value

from ..hull import ForceModel, VesselConfig
from ..hull.thrust import ThrustLaw

_WEAK = 0.1
_USEFUL = 0.35
"""Shares of the yaw authority at which rudders begin to be used and are used in full."""
_KICK = 0.3
"""Share of full thrust that may be spent on the rudders' flow where there is no other way to turn."""


@value
class Allocation:
    """Commands, and what they will give."""

    thruster_port: float
    thruster_starboard: float
    rudder_rad: float
    angle_rad: float
    """At which the rudders then stand: the command and the file's offset."""
    yaw_nm: float
    surge_n: float


class Allocator:
    """Turns (surge force, yaw moment) into commands for one vessel."""

    def __init__(self, vessel: VesselConfig, model: ForceModel) -> None:
        self._model = model
        self._lateral_m = model.lateral_m
        self._law = law = ThrustLaw(vessel)
        self._ahead_n, self._astern_n = law.ahead_n, law.astern_n
        self._all_ahead_n, self._all_astern_n = law.all_ahead_n, law.all_astern_n
        self._differential_n = 0.5 * (self._ahead_n + self._astern_n) if model.lateral_m > 0.0 else 0.0
        self._rudder_max = vessel.rudder.max_rad if vessel.rudder.count else 0.0
        self._offset_rad = vessel.rudder.offset_rad if vessel.rudder.count else 0.0

    def allocate(self, surge_n: float, yaw_nm: float, surge_mps: float) -> Allocation:
        """Return commands for a total thrust and a yaw moment at a speed through the water."""
        lateral_m, most_n = self._lateral_m, self._differential_n
        surge_n = clamp(surge_n, -self._all_astern_n, self._all_ahead_n)
        if most_n <= 0.0 < self._rudder_max:
            surge_n = max(surge_n, self._kick_n(yaw_nm, surge_mps))
        slope = self._model.rudder_slope_nm(surge_mps, 0.5 * surge_n, 0.5 * surge_n)
        angle_rad = self._rudder(yaw_nm, slope)
        by_rudder = 0.5 * slope * math.sin(2.0 * angle_rad)
        half_n = clamp((yaw_nm - by_rudder) / (2.0 * lateral_m), -most_n, most_n) if most_n > 0.0 else 0.0
        port, starboard = self._law.sides
        low = max(-port.astern_n - half_n, -starboard.astern_n + half_n)
        high = min(port.ahead_n - half_n, starboard.ahead_n + half_n)
        each_n = clamp(0.5 * surge_n, low, high) if low < high else 0.5 * (low + high)
        return Allocation(
            self._law.command(0, each_n + half_n, surge_mps),
            self._law.command(1, each_n - half_n, surge_mps),
            rudder_rad=clamp(angle_rad - self._offset_rad, -self._rudder_max, self._rudder_max),
            angle_rad=angle_rad,
            yaw_nm=by_rudder + 2.0 * lateral_m * half_n,
            surge_n=2.0 * each_n,
        )

    def _kick_n(self, yaw_nm: float, surge_mps: float) -> float:
        """Thrust ahead that gives rudders alone the flow for a moment which they cannot give without; bounded."""
        still = self._model.rudder_slope_nm(surge_mps, 0.0, 0.0)
        per_n = self._model.rudder_slope_nm(0.0, 0.5, 0.5)
        missing = 2.0 * abs(yaw_nm) / math.sin(2.0 * self._rudder_max) - still
        return clamp(missing / per_n, 0.0, _KICK * 2.0 * self._ahead_n)

    def _rudder(self, yaw_nm: float, slope: float) -> float:
        """Rudder angle for the moment; rudders too weak to matter stay amidships instead of working to and fro."""
        if self._rudder_max <= 0.0 or slope <= 0.0:
            return 0.0
        share = 1.0
        if self._differential_n > 0.0:
            most = slope * self._rudder_max
            most /= most + 2.0 * self._lateral_m * self._ahead_n
            if most < _USEFUL:
                share = clamp((most - _WEAK) / (_USEFUL - _WEAK), 0.0, 1.0)
        ratio = clamp(2.0 * share * yaw_nm / slope, -1.0, 1.0)
        return clamp(0.5 * math.asin(ratio), -self._rudder_max, self._rudder_max)
