"""Backing and filling: a boat that only rudders turn is turned where she lies.

A kick ahead sends the screw's race over the rudder and turns the bow before the boat has got way; then a little astern takes back the
way that she has got. Seamen turn a boat of one screw so; here she keeps her point so.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.messages import Desired
from mavlink_bridge.language.units import clamp, wrap_pi

from ..hull import ForceModel, VesselConfig
from ..hull.thrust import ThrustLaw

_MOST_MPS, _MOST_FIRM_MPS = 0.12, 0.3
"""Way that a kick may bring beyond what was asked for: more, and she surges to and fro by metres; and so much more in strong wind,
which takes it back by itself."""
_EACH_S: Final = 2.5
"""No more often: five swings of the screw from side to side in 3 s are an oscillation, and cut."""
_GENTLY, _FIRMLY = 0.2, 3.0
"""Kick, share of the thrust of all screws: in light air a gentle one, or the screw is reversed each second; in a third of a strong wind
as much as the allocation gives."""
_TAKES_BACK: Final = 0.1
"""Share of the thrust ahead that there must be astern to take a kick's way back."""
_STRONG, _FAR_RAD, _FAR_S = 0.9, 0.4, 2.0
"""From this firmness on, and with the bow so far off where it is to look for so long, two propellers go ahead together for their rudders'
sake: their difference is no match for such a wind."""
_EASY_HELM_RADPS: Final = math.radians(60.0)
"""A second from stop to stop: the rudder cannot swing five times from one side to the other in 3 s."""


class Kicks:
    """One vessel's, on station."""

    def __init__(self, vessel: VesselConfig, model: ForceModel) -> None:
        self.gentle_nm = self.firm_nm = math.inf
        """Greatest yaw moment that is asked for: in light air, in strong wind."""
        self.race_nm = 0.0
        """Yaw moment of the rudders with both of two propellers full ahead, where that is more than their difference gives; else 0."""
        law = ThrustLaw(vessel)
        if vessel.rudder.count:
            whole_nm = 0.5 * model.rudder_slope_nm(0.0, law.all_ahead_n, 0.0) * math.sin(2.0 * vessel.rudder.useful_rad)
            if whole_nm > 2.0 * model.lateral_m * law.ahead_n > 0.0:
                self.race_nm = whole_nm
            self.gentle_nm, self.firm_nm = _GENTLY * whole_nm, _FIRMLY * whole_nm
        self.can = vessel.rudder.count > 0 and law.all_astern_n >= _TAKES_BACK * law.all_ahead_n
        """Whether the boat has what it takes."""
        self.clear()

    def clear(self) -> None:
        """The law is reset."""
        self._has_way = False
        """More than asked for, by kicks."""
        self._since_s = 0.0
        """Since the last kick began."""
        self._far_s = 0.0
        """For how long the bow has been far off in strong wind."""

    def far(self, dt_s: float, desired: Desired, psi_rad: float | None) -> None:
        """Take, once a tick, where the bow is to look and where it looks."""
        is_far = (
            desired.brake
            and desired.firmness > _STRONG
            and psi_rad is not None
            and desired.psi_rad is not None
            and abs(wrap_pi(desired.psi_rad - psi_rad)) > _FAR_RAD
        )
        self._far_s = self._far_s + dt_s if is_far else 0.0

    @property
    def brings_round(self) -> bool:
        """Whether two propellers may both go ahead over the rudders."""
        return self._far_s > _FAR_S

    def may(self, dt_s: float, desired: Desired, speed_error_mps: float) -> bool:
        """Return whether more thrust than asked for may go over the rudder now. Off station always.

        A kick ends when it has brought some way, and the next one waits until that is taken back.
        """
        self._since_s += dt_s
        if not self._has_way:
            self._has_way = desired.gentle and speed_error_mps < -_MOST_MPS - _MOST_FIRM_MPS * desired.firmness
        elif not desired.gentle or (speed_error_mps >= 0.0 and self._since_s >= _EACH_S):
            self._has_way, self._since_s = False, 0.0
        return not self._has_way


def eased(dt_s: float, rudder_rad: float, last_rad: float) -> float:
    """The rudder angle that an easy helm comes to from the last one: with little flow it would be told to go from stop to stop."""
    most_rad = _EASY_HELM_RADPS * dt_s
    return clamp(rudder_rad, last_rad - most_rad, last_rad + most_rad)
