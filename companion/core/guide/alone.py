"""Keeping a place with what turns only under way: one thruster left of two, or one screw and a rudder whose law does not back and fill.

A lone thruster beside the centre line turns the bow its own way, and the rudders hold against it only under way; a rudder behind
a screw that rests turns nothing. Where nothing pushes, the boat rests at its point and sails back when it has left it. Where wind
and current push, a boat with one screw lies against them, with the screw's race on its rudder; one with a lone thruster circles the
point, the way round that the thruster turns it by itself: that turn it can always make. So it makes any turn that way which does
not get on the other way.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.figures import Circle
from mavlink_bridge.language.messages import Desired, EstimatedState
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.units import wrap_pi

from ..hull import ForceModel, VesselConfig
from ..hull.left import Shares, straight_mps
from .paths import Chain

_CALM_MPS: Final = 0.3
"""Water and wind that carry the boat slower than this let it rest and sail back: the steerage way is thrice as much."""
_ROUND_M: Final = 8.0
"""Four lengths of a boat of 2 m: near enough to be held, wide enough for a gust in the turn."""
_TURNING: Final = 0.8
"""Share of the greatest speed on one thruster at which bends are sailed: rudders need flow, a gust needs spare thrust."""
_LIES_MPS: Final = 0.4
"""Current in which a screw gives its rudder a race worth steering by. In 0.3 m/s the rudder went from stop to stop until the thrust was
cut; wind alone asks for less thrust still, and in gusts."""
_STOPS_LYING: Final = 0.85
"""Share of it below which the boat lets go."""
_FAR_RAD: Final = math.radians(60.0)
"""What is nearer than this is course keeping, not a turn."""
_GETS_ON_RAD: Final = math.radians(20.0)
_STUCK_S: Final = 8.0
"""A turn against the lone thruster that brings no more for so long, a gust or two, is not made: the wind holds the bow as well."""
_LED_RAD: Final = math.radians(90.0)
"""So far ahead the bow is led the other way round: as firm a turn as any."""
_WHOLE_TURNING: Final = 0.5
"""Nothing turns a hull with one screw off its course: half its speed is flow enough, and spare enough."""


def turns_under_way(vessel: VesselConfig, shares: Shares, *, backs_and_fills: bool) -> Alone | None:
    """Return how a vessel stays anywhere that turns only under way; None when it turns where it lies, and can hold its place.

    ``backs_and_fills``: the steering law turns it by kicks over the rudder.
    """
    turns = backs_and_fills or ForceModel(vessel).turns_at_rest
    return None if turns and min(shares) > 0.0 else Alone(vessel, shares)


class Alone:
    """What one vessel can do with the thruster that it has, or that is left."""

    def __init__(self, vessel: VesselConfig, shares: Shares) -> None:
        """``shares``: what port and starboard thruster give of what they are told."""
        speeds = straight_mps(vessel, shares)
        self._steers = speeds is not None
        self.least_mps, self.most_mps = speeds or (0.0, 0.0)
        """Steady speeds through the water at which rudders hold it straight."""
        self.sense = -1 if shares[0] < shares[1] else 1
        """1 clockwise: the side to which the lone thruster turns it."""
        self.turning_mps = max((_TURNING if min(shares) == 0.0 else _WHOLE_TURNING) * self.most_mps, self.least_mps)
        """Speed through the water at which rudders turn it well both ways."""
        self._whole, self._lies = min(shares) > 0.0, False
        self._round: Chain | None = None
        self._is_led = False
        self._best_rad, self._stuck_s = 0.0, 0.0
        """The heading that a turn against the thruster came to, and for how long it has come no further."""

    def lies(self, push_mps: float) -> bool:
        """Whether it can lie against what would carry it this fast, m/s: with thrust enough for the rudder, all of the time."""
        self._lies = self._whole and push_mps > (_STOPS_LYING if self._lies else 1.0) * _LIES_MPS
        return self._lies

    def begin(self) -> None:
        """Another manoeuvre."""
        self._round, self._is_led = None, False

    def way_round(self, state: EstimatedState, point: NorthEast, tightest_m: float) -> tuple[Chain | None, str]:
        """Return the circle to sail about the point, None where nothing pushes or it can lie; and what to tell when it begins.

        None, too, for a hull that cannot be steered by one thruster: she is stopped, and drifts.
        """
        drift_mps = math.hypot(state.drift_n_mps or 0.0, state.drift_e_mps or 0.0)
        if self._whole or not self._steers or drift_mps <= (_CALM_MPS if self._round is None else 0.5 * _CALM_MPS):
            self._round = None
        elif self._round is None:
            radius_m = max(_ROUND_M, tightest_m)
            self._round = Chain(Circle().segments(point, radius_m, self.sense), closed=True)
            self._round.nearest(state.x_m or 0.0, state.y_m or 0.0)
            return self._round, f"one thruster: circling the point at {radius_m:.0f} m, it cannot be held"
        return self._round, ""

    def led(self, dt_s: float, psi_rad: float | None, desired: Desired) -> Desired:
        """Return the order, with the bow led round the way that the lone thruster turns it where the other way does not get on.

        At full rudder against thruster and wind a boat lay on one heading for minutes, and sailed away on it.
        """
        if self._whole or psi_rad is None or desired.psi_rad is None:
            return desired
        left_rad = -self.sense * wrap_pi(desired.psi_rad - psi_rad)
        if left_rad < _FAR_RAD or -self.sense * wrap_pi(psi_rad - self._best_rad) > _GETS_ON_RAD:
            self._best_rad, self._stuck_s = psi_rad, 0.0
        else:
            self._stuck_s += dt_s
        self._is_led = abs(left_rad) > _FAR_RAD and (self._is_led or self._stuck_s > _STUCK_S)
        if not self._is_led:
            return desired
        return replace(desired, psi_rad=wrap_pi(psi_rad + self.sense * _LED_RAD), r_radps=0.0)
