"""What follows from a vessel file without integrating anything: drag, steady speeds, thrust and commands, the way to rest."""

from __future__ import annotations

import math
from typing import Final

from .thrust import ThrustLaw
from .vessel_file import VesselConfig

_SOONER: Final = 4.0
"""The lag beside the hull's own time: with this, hulls with lags up to 5 s come to rest 0 to 5 % short of what is said, none beyond it."""


def drag_n(vessel: VesselConfig, surge_mps: float) -> float:
    """Return the resistance at a speed through the water, N, with the sign of the speed."""
    return Statics(vessel).drag_n(surge_mps)


def thrust_n(vessel: VesselConfig, command: float) -> float:
    """Return the steady thrust of the port thruster (a single one: all of it) for a command -1...1, at rest."""
    law = ThrustLaw(vessel)
    return law.thrust_n(0, law.revs(command), 0.0) * (2.0 if vessel.thruster.count == 1 else 1.0)


def command_for_thrust(vessel: VesselConfig, force_n: float) -> float:
    """Return the command -1...1 for a thrust of the port thruster at rest; the inverse of ``thrust_n``, saturated."""
    return ThrustLaw(vessel).command(0, force_n * (0.5 if vessel.thruster.count == 1 else 1.0), 0.0)


def speed_for_thrust(vessel: VesselConfig, total_n: float) -> float:
    """Return the steady speed through the water, m/s, for a total thrust ahead of at least 0 N."""
    return Statics(vessel).speed_for_thrust(total_n)


def top_speed_mps(vessel: VesselConfig) -> float:
    """Return the greatest steady speed through the water."""
    return Statics(vessel).top_mps


def throttle_to_speed(vessel: VesselConfig, throttle: float) -> float:
    """Return the steady speed through the water, m/s, at a thrust command 0...1 of all thrusters."""
    return Statics(vessel).throttle_to_speed(throttle)


def stopping_distance_m(vessel: VesselConfig, speed_mps: float) -> float:
    """Return the way made through the water from steady speed to rest, once the propellers are told to stop."""
    return Statics(vessel).stopping_distance_m(speed_mps)


class Statics:
    """One vessel's numbers at hand, for what asks every tick. Holds no state."""

    __slots__ = ("_farther", "_law", "_m11", "_xu", "_xuu", "lag_s", "top_mps")

    def __init__(self, vessel: VesselConfig) -> None:
        self._m11, self._xu, self._xuu = vessel.hull.m11_kg, vessel.hull.xu, vessel.hull.xuu
        self._farther, self.lag_s = vessel.stopping_factor, vessel.thruster.lag_s
        self._law = law = ThrustLaw(vessel)
        self.top_mps = self._settled(law.all_ahead_n, law.steady_loss(1.0))
        """Greatest steady speed through the water."""

    def most_command(self, share: float) -> float:
        """Return the greatest command 0...1 at which no thruster gives more than this share of its full thrust."""
        return self._law.most_command(share)

    def drag_n(self, surge_mps: float) -> float:
        """Return the resistance at a speed through the water, N, with the sign of the speed."""
        return (self._xu + self._xuu * abs(surge_mps)) * surge_mps

    def speed_for_thrust(self, total_n: float) -> float:
        """Return the steady speed through the water, m/s, for a total thrust ahead of at least 0 N."""
        return self._settled(total_n, 0.0)

    def _settled(self, total_n: float, lost: float) -> float:
        xu, xuu = self._xu + lost, self._xuu
        if xuu < 1e-9:
            return total_n / max(xu, 1e-9)
        return (math.sqrt(xu * xu + 4.0 * xuu * total_n) - xu) / (2.0 * xuu)

    def throttle_to_speed(self, throttle: float) -> float:
        """Return the steady speed through the water, m/s, at a thrust command 0...1 of all thrusters."""
        law = self._law
        revs = law.revs(throttle) if throttle > 0.0 else 0.0
        return self._settled(law.all_ahead_n * revs * revs, law.steady_loss(revs))

    def coasted(self, speed_mps: float, seconds: float) -> tuple[float, float]:
        """Return the speed that is left after a time without thrust, and the way made meanwhile, m; best estimates."""
        slower, faster = max(self._xu, 1e-9) / self._m11, self._xuu * speed_mps / self._m11
        gone = -math.expm1(-slower * seconds) / slower
        left_mps = speed_mps * (1.0 - slower * gone) / (1.0 + faster * gone)
        return left_mps, speed_mps * gone if faster < 1e-9 else speed_mps * math.log1p(faster * gone) / faster

    def stopping_distance_m(self, speed_mps: float) -> float:
        """Return the way made through the water from steady speed to rest, once the propellers are told to stop.

        Times the file's stopping factor. Closed form of m u' = -(Xu + Xuu u) u, and what the propellers still push.
        """
        xu, xuu, speed = self._xu, self._xuu, abs(speed_mps)
        if xu < 1e-9:
            raise ValueError("without linear surge damping the vessel coasts for ever: give hull.xu")
        lag_m = self._lag_way_m(speed)
        if xuu < 1e-9:
            return self._farther * (self._m11 * speed / xu + lag_m)
        return self._farther * (self._m11 / xuu * math.log1p(xuu * speed / xu) + lag_m)

    def _lag_way_m(self, speed_mps: float) -> float:
        """Way that propellers add which run down with their lag.

        Thrust equals the drag at first and dies with e^(-2 t/lag): that is half the lag at full speed, whatever the drag. Where
        the hull slows down sooner than they do, the push that is left takes it farther against a drag of second order.
        """
        xuu_n, lag_s = self._xuu * speed_mps, self.lag_s
        later = xuu_n * lag_s / (_SOONER * self._m11 + (self._xu + xuu_n) * lag_s)
        return 0.5 * lag_s * speed_mps * (1.0 + later)
