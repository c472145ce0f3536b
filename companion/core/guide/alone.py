"""Keeping a place with one thruster of two and rudders: there is no astern, and no turn at rest.

Thrust turns the bow its own way and the rudders hold against it only under way. Where nothing pushes, the boat rests at its
point and sails back when it has left it. Where wind and current push it circles the point, the way round that the lone
thruster turns it by itself: that turn it can always make.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.figures import Circle
from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.points import NorthEast

from ..hull import VesselConfig
from ..hull.left import Shares, straight_mps
from .paths import Chain

_CALM_MPS: Final = 0.3
"""Water and wind that carry the boat slower than this let it rest and sail back: the steerage way is thrice as much."""
_ROUND_M: Final = 8.0
"""Four lengths of a boat of 2 m: near enough to be held, wide enough for a gust in the turn."""
_TURNING: Final = 0.8
"""Share of the greatest speed on one thruster at which bends are sailed: rudders need flow, a gust needs spare thrust."""


class Alone:
    """What one vessel can do with the thruster that is left."""

    def __init__(self, vessel: VesselConfig, shares: Shares) -> None:
        speeds = straight_mps(vessel, shares)
        self.least_mps, self.most_mps = speeds or (0.0, 0.0)
        """Steady speeds through the water at which rudders hold it straight."""
        self.sense = -1 if shares[0] < shares[1] else 1
        """1 clockwise: the side to which the lone thruster turns it."""
        self._round: Chain | None = None

    def begin(self) -> None:
        """Another point."""
        self._round = None

    def way_round(self, state: EstimatedState, point: NorthEast, tightest_m: float) -> tuple[Chain | None, str]:
        """Return the circle to sail about the point, None where nothing pushes; and what to tell when it begins."""
        drift_mps = math.hypot(state.drift_n_mps or 0.0, state.drift_e_mps or 0.0)
        if drift_mps <= (_CALM_MPS if self._round is None else 0.5 * _CALM_MPS):
            self._round = None
        elif self._round is None:
            radius_m = max(_ROUND_M, tightest_m)
            self._round = Chain(Circle().segments(point, radius_m, self.sense), closed=True)
            self._round.nearest(state.x_m or 0.0, state.y_m or 0.0)
            return self._round, f"one thruster: circling the point at {radius_m:.0f} m, it cannot be held"
        return self._round, ""

    @property
    def turning_mps(self) -> float:
        """Speed through the water at which rudders turn it well both ways."""
        return max(_TURNING * self.most_mps, self.least_mps)
