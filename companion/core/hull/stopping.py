"""How far a vessel still runs with thrust astern, how long that takes, and at which speed the thrust is let go.

Through the water, without any reaction time; whoever uses it adds that. What a vessel makes whose propellers are only told to
stop is ``statics.stopping_distance_m``.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.units import clamp

from .left import WHOLE, Shares
from .statics import Statics
from .thrust import ThrustLaw
from .vessel_file import VesselConfig

_STEPS: Final = 16
"""Simpson's rule with so many is exact to a millimetre for drag of first and second order."""
_SPUN_UP: Final = 1.5
"""Thrust that grows as (1 - e^(-t/lag))² has given as much, in the end, as all of it from so many lags on."""
_HALF_SPUN_UP: Final = 0.4
"""Lags after that until half of all thrust is there, or somewhat more: x/(x + 0.4) is never more than what there is after x."""
_LEAST_MPS: Final = 0.05
"""Less is what a vessel at rest seems to make over ground: thrust that waits for it could push the boat astern."""
_MOST_MPS: Final = 0.15
"""What strong propellers take off while they run down; let go of earlier, the boat would still have way on."""
_IN_HAND: Final = 1.5
"""Astern thrust is allowed for so much longer than the file says: a boat that is loaded, or set by the water, takes longer."""


class Braking:
    """One vessel's, with what each thruster gives of its own and what the gate lets through. Holds no state."""

    __slots__ = ("_astern_n", "_factor", "_m11", "_runs_down_mps", "_slow_s", "_statics", "_turned_s", "until_mps")

    def __init__(
        self, vessel: VesselConfig, shares: Shares = WHOLE, least: float = -1.0, rate_per_s: float = 0.0
    ) -> None:
        """``least``: the gate's least command; ``rate_per_s``: its fastest change away from neutral, 0 = not limited."""
        law, lag_s = ThrustLaw(vessel), vessel.thruster.lag_s
        revs = law.revs(least)
        self._statics, self._m11 = Statics(vessel), vessel.hull.m11_kg
        self._factor = vessel.stopping_factor
        self._astern_n = -math.fsum(shares[side] * law.thrust_n(side, revs, 0.0) for side in (0, 1))
        """Water that comes from ahead takes nothing from it."""
        self._turned_s = lag_s * math.log1p(-1.0 / revs) if revs else 0.0
        """Propellers at full ahead stand still after this."""
        self._slow_s = _SPUN_UP * lag_s - (least / rate_per_s if rate_per_s > 0.0 else 0.0)
        """And push astern after this."""
        self._runs_down_mps = 0.5 * self._astern_n * lag_s / self._m11
        """So much way is taken off by propellers that run down from full astern."""
        self.until_mps = clamp(self._runs_down_mps, _LEAST_MPS, _MOST_MPS) if self._astern_n > 0.0 else math.inf
        """From this on the propellers, running down, take the rest off; without thrust astern nothing is ever begun."""

    def lasts_s(self, speed_mps: float) -> float:
        """How long astern thrust may be needed from a speed, s; 0 = there is none, or no way to take off."""
        speed = abs(speed_mps)
        if speed <= self.until_mps:
            return 0.0
        slow_mps = self._slowed(speed)[0]
        braked_s = self._simpson(slow_mps, 0) if slow_mps > self.until_mps else 0.0
        return _IN_HAND * self._factor * (self._turned_s + self._slow_s + braked_s)

    def left_mps(self, told_mps: float, late_s: float, since_s: float) -> float:
        """Way that is left of what was told so late, m/s; ``since_s``: since astern thrust was ordered."""
        left_mps = self._statics.coasted(told_mps, late_s)[0] if told_mps > 0.0 else told_mps
        return left_mps - self._taken_mps(since_s) + self._taken_mps(since_s - late_s)

    def _taken_mps(self, since_s: float) -> float:
        """Way that astern thrust takes off, m/s; none while the propellers turn round."""
        pushing_s, most_mps2 = max(0.0, since_s - self._turned_s), self._astern_n / self._m11
        if pushing_s >= self._slow_s:
            return most_mps2 * (pushing_s - 0.5 * self._slow_s)
        return 0.5 * most_mps2 * pushing_s * pushing_s / self._slow_s

    def way_m(self, speed_mps: float) -> float:
        """Way made from a speed to rest, m, times the file's stopping factor; without thrust astern by coasting."""
        speed, coasted_m = abs(speed_mps), self._statics.stopping_distance_m(speed_mps)
        if speed <= self.until_mps:
            return coasted_m
        slow_mps, slowed_m = self._slowed(speed)
        way_m = speed * self._turned_s + slowed_m
        if slow_mps > self.until_mps:
            way_m += self._simpson(slow_mps, 1) + self._left_m(slow_mps)
        else:
            way_m += self._statics.stopping_distance_m(slow_mps) / self._factor
        return min(coasted_m, self._factor * way_m)

    def _slowed(self, speed_mps: float) -> tuple[float, float]:
        """Speed and way while the propellers, which stand still, begin to push astern; of that push nothing is counted yet."""
        return self._statics.coasted(speed_mps, self._slow_s)

    def _simpson(self, speed_mps: float, power: int) -> float:
        """Integral of m11 u^power du / (F + (Xu + Xuu u) u) down to where the thrust is let go: the time, s, or the way, m."""
        astern_n, drag_n, least_mps = self._astern_n, self._statics.drag_n, self.until_mps
        width = (speed_mps - least_mps) / _STEPS
        inner = 0.0
        for k in range(_STEPS + 1):
            mps = least_mps + k * width
            weight = 1.0 if k in (0, _STEPS) else 4.0 if k % 2 else 2.0
            inner += weight * mps**power / (astern_n + drag_n(mps))
        return self._m11 * inner * width / 3.0

    def _left_m(self, slow_mps: float) -> float:
        """Way to rest from where the thrust is let go: what the propellers take off running down, and the rest by coasting.

        From little speed they have not come to full astern by then.
        """
        lag_s, force_n = self._statics.lag_s, self._astern_n + self._statics.drag_n(slow_mps)
        braked_s = self._m11 * (slow_mps - self.until_mps) / force_n
        spun_up = braked_s / (braked_s + _HALF_SPUN_UP * lag_s)
        taken_mps = min(self.until_mps, spun_up * self._runs_down_mps)
        rest_m = self._statics.stopping_distance_m(self.until_mps - taken_mps) / self._factor
        return 0.5 * lag_s * taken_mps + rest_m
