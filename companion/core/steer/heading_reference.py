"""The heading and yaw rate that the law asks of a hull: a second-order reference with limits on rate and acceleration.

It turns no faster than the vessel can at her speed, ends a turn no harder than she can brake it, and is no quicker than her yaw authority.
Guidance's yaw rate goes in ahead of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from mavlink_bridge.language.messages import Desired
from mavlink_bridge.language.units import clamp, wrap_pi

_BRAKED: Final = 0.7
"""Share of the acceleration by which the reference ends a turn: a boat that turns slowly would swing past, and back."""
_OF_TURN: Final = 0.95
"""Share of the turn that the hull can keep up: the rest is the feedback's."""


@dataclass(frozen=True, slots=True)
class TurnLimits:
    """What may be asked for at one speed."""

    quick_radps: float
    """Bandwidth of the reference."""
    turn_radps: float
    """Yaw rate that the hull can keep up."""
    least_radps: float
    """Yaw rate that may be asked for whatever she can keep up: a boat at rest is turned by kicks."""
    most_radps: float
    """Yaw rate that is never exceeded."""
    acceleration_radps2: float

    @property
    def rate_radps(self) -> float:
        """Greatest yaw rate."""
        return min(max(_OF_TURN * self.turn_radps, self.least_radps), self.most_radps)


class HeadingReference:
    """One vessel's; ``step`` once per tick."""

    def __init__(self) -> None:
        self.psi_rad: float | None = None
        """None where no heading is steered."""
        self.r_radps = self.a_radps2 = 0.0

    def forget(self) -> None:
        """No heading is steered: begin anew from the bow when one is."""
        self.psi_rad, self.a_radps2 = None, 0.0

    def step(self, dt_s: float, desired: Desired, limits: TurnLimits, *, psi_rad: float, r_radps: float) -> float:
        """Return the heading to steer now. ``psi_rad``, ``r_radps``: the hull's own, from which a turn begins."""
        assert desired.psi_rad is not None
        reference = self.psi_rad
        if reference is None:
            reference, self.r_radps = psi_rad, r_radps
        left_rad = wrap_pi(desired.psi_rad - reference)
        most = limits.acceleration_radps2
        stopped_radps = math.sqrt(2.0 * _BRAKED * most * abs(left_rad))
        wanted = clamp(0.5 * limits.quick_radps * left_rad, -stopped_radps, stopped_radps) + desired.r_radps
        rate = limits.rate_radps
        wanted = clamp(wanted, -rate, rate)
        self.a_radps2 = clamp((wanted - self.r_radps) * 2.0 * limits.quick_radps, -most, most)
        self.r_radps += self.a_radps2 * dt_s
        self.psi_rad = reference = wrap_pi(reference + self.r_radps * dt_s)
        return reference
