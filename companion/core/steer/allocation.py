"""Allocation by authority: which actuator gives how much of the yaw moment and the thrust that are wanted.

Rudders first, up to what they can give in this flow; differential thrust for the rest; surge takes what is left. The
heading has priority, as in the seed. Works without rudders, and with one thruster and no differential.

A thruster that is known to give too little is reckoned with what it gives: the other one does its part, the rudders hold
the bow against it, and where they cannot yet, because the boat has no way, it gets way first.
"""

from __future__ import annotations

import math

from mavlink_bridge.language.units import clamp
from mavlink_bridge.language.value import value

from ..hull import ForceModel, VesselConfig
from ..hull.left import WHOLE, Shares, way_n
from ..hull.thrust import ThrustLaw

_WEAK = 0.1
_USEFUL = 0.35
"""Shares of the yaw authority at which rudders begin to be used and are used in full."""
_REST_NM = 0.05
"""Less of a moment is nobody's heading."""
_KICK = 0.6
"""Share of full thrust that may be spent on the rudders' flow where there is no other way to turn: in a strong breeze a boat with one
screw does not come round with half of it."""
_SOON_S = 0.5
"""What a rudder servo does within so long, or while slow propellers take up, counts as done."""
_LEAST_RACE = 0.06
"""Share of full thrust in whose race rudders alone are reckoned with at least."""


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
        self._vessel = vessel
        self._shares = WHOLE
        self._way_n = (0.0, 0.0)
        self._rudder_stop = vessel.rudder.max_rad if vessel.rudder.count else 0.0
        self._rudder_max = vessel.rudder.useful_rad if vessel.rudder.count else 0.0
        self._offset_rad = vessel.rudder.offset_rad if vessel.rudder.count else 0.0
        felt_radps = vessel.rudder.felt_radps
        self._soon_rad = math.inf if felt_radps is None else max(_SOON_S, vessel.thruster.lag_s) * felt_radps
        # less than that race the rudder is not told to make up for: it would go from stop to stop for a compass's noise
        least_n = _LEAST_RACE * self._all_ahead_n if self._differential_n == 0.0 else 0.0
        self._least_slope = model.rudder_slope_nm(0.0, least_n, 0.0)

    def thrusters(self, shares: Shares) -> None:
        """Reckon with what each thruster still gives, port and starboard, as a share of what it is told."""
        self._shares = shares
        self._way_n = way_n(self._vessel, shares)

    def allocate(
        self,
        surge_n: float,
        yaw_nm: float,
        surge_mps: float,
        *,
        flow_mps: float | None = None,
        may_kick: bool = True,
        standing_rad: float | None = None,
    ) -> Allocation:
        """Return commands for a total thrust and a yaw moment at a speed through the water.

        ``flow_mps``: as much flow as the rudders are sure of beside the propellers' race, where that is less. ``may_kick``: more thrust
        than asked for may give rudders alone the flow that they lack. ``standing_rad``: the angle of the rudders now: what they will not
        have given by the time that thrust has, thrust gives.
        """
        if self._shares != WHOLE:
            return self._with_what_is_left(surge_n, yaw_nm, surge_mps)
        lateral_m, most_n = self._lateral_m, self._differential_n
        surge_n = clamp(surge_n, -self._all_astern_n, self._all_ahead_n)
        if may_kick and self._rudder_max > 0.0:
            if most_n <= 0.0:
                surge_n = max(surge_n, self._kick_n(yaw_nm, surge_mps))
            else:
                kicked_n = self._kick_of_both_n(yaw_nm)
                if kicked_n > surge_n:
                    surge_n, most_n = kicked_n, min(most_n, self._ahead_n - 0.5 * kicked_n)
        flow_mps = surge_mps if flow_mps is None else flow_mps
        slope = self._model.rudder_slope_nm(flow_mps, 0.5 * surge_n, 0.5 * surge_n)
        angle_rad = self._rudder(yaw_nm, max(slope, self._least_slope))
        soon_rad = angle_rad
        if standing_rad is not None:
            soon_rad = clamp(angle_rad, standing_rad - self._soon_rad, standing_rad + self._soon_rad)
        by_rudder = 0.5 * slope * math.sin(2.0 * soon_rad)
        half_n = clamp((yaw_nm - by_rudder) / (2.0 * lateral_m), -most_n, most_n) if most_n > 0.0 else 0.0
        port, starboard = self._law.sides
        low = max(-port.astern_n - half_n, -starboard.astern_n + half_n)
        high = min(port.ahead_n - half_n, starboard.ahead_n + half_n)
        each_n = clamp(0.5 * surge_n, low, high) if low < high else 0.5 * (low + high)
        return Allocation(
            self._law.command(0, each_n + half_n, surge_mps),
            self._law.command(1, each_n - half_n, surge_mps),
            rudder_rad=clamp(angle_rad - self._offset_rad, -self._rudder_stop, self._rudder_stop),
            angle_rad=angle_rad,
            yaw_nm=by_rudder + 2.0 * lateral_m * half_n,
            surge_n=2.0 * each_n,
        )

    def _with_what_is_left(self, surge_n: float, yaw_nm: float, surge_mps: float) -> Allocation:
        """The same for two thrusters of which one gives too little."""
        lateral_m, ways = self._lateral_m, self._ways()
        port_n, starboard_n = _shared(surge_n, ways)
        angle_rad, by_rudder = self._held(yaw_nm, surge_mps, port_n, starboard_n)
        rest_nm = yaw_nm - by_rudder - lateral_m * (port_n - starboard_n)
        half_n = _within(0.5 * rest_nm / lateral_m, port_n, starboard_n, ways)
        port_n, starboard_n = port_n + half_n, starboard_n - half_n
        rest_nm -= 2.0 * lateral_m * half_n
        if abs(rest_nm) > _REST_NM:
            port_n, starboard_n = self._way_for_heading(rest_nm, port_n, starboard_n, ways)
            angle_rad, by_rudder = self._held(yaw_nm, surge_mps, port_n, starboard_n)
        port, starboard = self._commands(port_n, starboard_n, surge_mps)
        return Allocation(
            port,
            starboard,
            rudder_rad=clamp(angle_rad - self._offset_rad, -self._rudder_stop, self._rudder_stop),
            angle_rad=angle_rad,
            yaw_nm=by_rudder + lateral_m * (port_n - starboard_n),
            surge_n=port_n + starboard_n,
        )

    def _ways(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """What each side can still give: most astern (negative) and most ahead, N."""
        (port, starboard), (port_share, starboard_share) = self._law.sides, self._shares
        return (
            (-port_share * port.astern_n, port_share * port.ahead_n),
            (-starboard_share * starboard.astern_n, starboard_share * starboard.ahead_n),
        )

    def _held(self, yaw_nm: float, surge_mps: float, port_n: float, starboard_n: float) -> tuple[float, float]:
        """Rudder angle that brings what the thrusters leave of a moment, and the moment that it gives."""
        slope = self._model.rudder_slope_nm(surge_mps, port_n, starboard_n)
        angle_rad = 0.0
        if self._rudder_max > 0.0 and slope > 0.0:
            ratio = clamp(2.0 * (yaw_nm - self._lateral_m * (port_n - starboard_n)) / slope, -1.0, 1.0)
            angle_rad = clamp(0.5 * math.asin(ratio), -self._rudder_max, self._rudder_max)
        return angle_rad, 0.5 * slope * math.sin(2.0 * angle_rad)

    def _way_for_heading(
        self, rest_nm: float, port_n: float, starboard_n: float, ways: tuple[tuple[float, float], tuple[float, float]]
    ) -> tuple[float, float]:
        """Change the stronger side's thrust for the heading's sake.

        A lone thruster ahead is never eased for it: with less way the rudders hold still less. It gets what makes them hold.
        """
        side = 0 if self._shares[0] > self._shares[1] else 1
        now_n = (port_n, starboard_n)[side]
        give_n = rest_nm / self._lateral_m * (1.0 if side == 0 else -1.0)
        if min(self._shares):
            wanted_n = clamp(now_n + give_n, *ways[side])
        elif now_n < 0.0:
            wanted_n = clamp(now_n + give_n, now_n, self._way_n[0])
        else:
            least_n, most_n = self._way_n
            wanted_n = max(now_n, min(least_n + abs(give_n), most_n))
        return (wanted_n, starboard_n) if side == 0 else (port_n, wanted_n)

    def _commands(self, port_n: float, starboard_n: float, surge_mps: float) -> tuple[float, float]:
        """A thruster that gives nothing is told what the other one is: it shows at once when it gives again."""
        port_share, starboard_share = self._shares
        port = self._law.command(0, port_n / port_share, surge_mps) if port_share else None
        starboard = self._law.command(1, starboard_n / starboard_share, surge_mps) if starboard_share else None
        return (starboard or 0.0 if port is None else port), (port or 0.0 if starboard is None else starboard)

    def _kick_n(self, yaw_nm: float, surge_mps: float) -> float:
        """Thrust ahead that gives rudders alone the flow for a moment which they cannot give without; bounded."""
        still = self._model.rudder_slope_nm(surge_mps, 0.0, 0.0)
        per_n = self._model.rudder_slope_nm(0.0, 0.5, 0.5)
        missing = 2.0 * abs(yaw_nm) / math.sin(2.0 * self._rudder_max) - still
        return clamp(missing / per_n, 0.0, _KICK * 2.0 * self._ahead_n)

    def _kick_of_both_n(self, yaw_nm: float) -> float:
        """Thrust ahead of two propellers in whose race rudders give what their difference lacks of a moment; 0 = no need, no use."""
        race_per_n = self._model.rudder_slope_nm(0.0, 0.5, 0.5) * math.sin(2.0 * self._rudder_max)
        gains_per_n = race_per_n - 2.0 * self._lateral_m
        lacks_nm = abs(yaw_nm) - 2.0 * self._lateral_m * self._differential_n
        if gains_per_n <= 0.0 or lacks_nm <= 0.0:
            return 0.0
        each_n = (abs(yaw_nm) - 2.0 * self._lateral_m * self._ahead_n) / gains_per_n
        return 2.0 * clamp(each_n, 0.5 * (self._ahead_n - self._astern_n), self._ahead_n)

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


def _shared(surge_n: float, ways: tuple[tuple[float, float], tuple[float, float]]) -> tuple[float, float]:
    """Share a thrust out, alike as far as the weaker side can, N."""
    (port_back_n, port_n), (starboard_back_n, starboard_n) = ways
    half_n = clamp(0.5 * surge_n, port_back_n, port_n)
    other_n = clamp(surge_n - half_n, starboard_back_n, starboard_n)
    return clamp(surge_n - other_n, port_back_n, port_n), other_n


def _within(
    half_n: float, port_n: float, starboard_n: float, ways: tuple[tuple[float, float], tuple[float, float]]
) -> float:
    """As much of a difference as both sides can give at the same thrust, N."""
    (port_back_n, port_most_n), (starboard_back_n, starboard_most_n) = ways
    low = max(port_back_n - port_n, starboard_n - starboard_most_n)
    return clamp(half_n, low, min(port_most_n - port_n, starboard_n - starboard_back_n))
