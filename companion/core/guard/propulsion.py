"""Whether a thruster gives what it is told to: weed on a propeller, a lost one, a broken lead.

What is missing on one side leaves two traces at once: a turning moment towards that side that neither rudder nor hull
explains, and way that is not made. The moment alone may be wind or a bent rudder, the way alone a current; only both,
of the size of the thrust that is missing, are taken for a thruster. Judged only where that thrust stands clear of what a
gale does to the hull. Nothing is changed on the water by it: it is told.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.messages import ActuatorOutput, EstimatedState
from mavlink_bridge.language.value import value

from ..hull import ForceModel, VesselConfig
from ..hull.actuator_model import ActuatorModel
from ..hull.statics import Statics

_TAU_S: Final = 2.5
"""Everything is compared after the same low-pass: waves turn a hull to and fro within 3 s."""
_GALE_MPS: Final = 10.0
"""More wind than such boats are sent out in: what it turns the hull by must never be taken for a thruster."""
_CLEAR: Final = 1.6
"""The moment that is missing must be this much more than what such a wind turns the hull by."""
_SHARE, _WHOLE = 0.6, 1.4
"""So much of one side's thrust must be missing; more than all of it, and of the rudder that stands in its race, cannot be."""
_WAY_SHARE, _WAY_WHOLE = 0.5, 2.5
"""And so much of it must be missing in the way made, at one time or another of the last ``_WAY_S``."""
_WAY_S: Final = 12.0
"""A boat of some 55 kg has lost its way long before, so both traces fall into it."""
_HELD_S: Final = 7.5
"""Three of the low-pass's times: what a wave or a gust leaves is gone by then."""
_GONE_S: Final = 20.0
"""A blade that clears for some seconds and fouls again is one fault, told once."""
_SMALL_NM: Final = 1.0
"""Below this a hull's moment is lost in the noise of any gyro or compass."""
_USUAL_S: Final = 30.0
"""Ten waves and more: long enough for a mean."""
_TIMES_USUAL: Final = 8.0
"""In quieter weather than a gale: this many times what is usually unexplained, once that is known for ``_USUAL_S``."""


@value
class ThrustFlags:
    """Of the thrusters; names as in the failsafe table."""

    thruster_weak: bool = False
    """A thruster gives much less than it is told to, as far as the hull's motion shows."""


class PropulsionWatch:
    """One vessel's thrusters; one call per tick. A vessel with one thruster, or with both on the centre line, is not judged."""

    def __init__(self, vessel: VesselConfig) -> None:
        self._model = ForceModel(vessel)
        self._actuators = ActuatorModel(vessel)
        self._vessel, self._statics = vessel, Statics(vessel)
        hull, wind = vessel.hull, vessel.windage
        self._lateral_m = self._model.lateral_m
        self._m11, self._inertia = hull.m11_kg, hull.m33_kgm2 - hull.m23_kgm * hull.m23_kgm / hull.m22_kg
        gale_nm = 0.6125 * wind.cn * wind.lateral_m2 * hull.length_m * _GALE_MPS * _GALE_MPS
        self._least_nm = max(_SMALL_NM, 0.1 * self._lateral_m * vessel.thruster.ahead_n)
        self._most_nm = max(self._least_nm, _CLEAR * gale_nm)
        self.clear()

    def clear(self) -> None:
        """Forget: disarmed, or steered by hand."""
        self._smooth: list[float] | None = None
        self._held_s, self._weak_s = [0.0, 0.0], [math.inf, math.inf]
        self._slow_s = [math.inf, math.inf]
        self._usual_nm = self._known_s = 0.0
        self.weak = (False, False)
        """Port, starboard: this thruster gives much less than it is told to."""

    @property
    def flags(self) -> ThrustFlags:
        """What the failsafe should know of the thrusters."""
        return ThrustFlags(thruster_weak=any(self.weak))

    def step(self, dt_s: float, state: EstimatedState, sent: ActuatorOutput | None) -> tuple[bool, bool]:
        """Take one tick; return which thrusters, port and starboard, are weak."""
        psi, u, v, r = state.psi_rad, state.u_mps, state.v_mps, state.r_radps
        if not self._lateral_m or psi is None or u is None or v is None or r is None or not 0.0 < dt_s < 0.5:
            self._actuators.step(dt_s, sent)
            self._smooth = None
            return self.weak
        drift_n, drift_e = state.drift_n_mps or 0.0, state.drift_e_mps or 0.0
        cos, sin = math.cos(psi), math.sin(psi)
        water_u, water_v = u - drift_n * cos - drift_e * sin, v + drift_n * sin - drift_e * cos
        self._actuators.step(dt_s, sent, water_u)
        port_n, starboard_n, angle = self._actuators.port_n, self._actuators.starboard_n, self._actuators.rudder_rad
        _, dv, dr = self._model.rates(
            water_u,
            water_v,
            r,
            thrust_port_n=port_n,
            thrust_starboard_n=starboard_n,
            rudder_port_rad=angle,
            rudder_starboard_rad=angle,
        )
        hull = self._vessel.hull
        moment_nm = hull.m23_kgm * dv + hull.m33_kgm2 * dr
        held_n = port_n + starboard_n - self._statics.drag_n(water_u)
        rudder_nm = abs(self._model.rudder_slope_nm(water_u, port_n, starboard_n) * angle)
        values = [r, moment_nm, port_n, starboard_n, held_n, u, rudder_nm]
        if self._smooth is None:
            self._smooth = values
            return self.weak
        smooth, share = self._smooth, dt_s / _TAU_S
        for k, newest in enumerate(values):
            smooth[k] += share * (newest - smooth[k])
        missing_nm = hull.m33_kgm2 * (r - smooth[0]) / _TAU_S - smooth[1]
        lost_n = smooth[4] - self._m11 * (u - smooth[5]) / _TAU_S
        self._judge(dt_s, missing_nm, lost_n)
        return self.weak

    def _floor(self, dt_s: float, missing_nm: float) -> float:
        """Thrust's moment from which on a thruster can be judged."""
        if self._held_s == [0.0, 0.0] and abs(missing_nm) < self._most_nm:
            self._known_s += dt_s
            size_nm = abs(missing_nm)
            self._usual_nm += (
                dt_s / (self._known_s if self._known_s < _USUAL_S else _USUAL_S) * (size_nm - self._usual_nm)
            )
        if self._known_s < _USUAL_S:
            return self._most_nm
        return min(self._most_nm, max(self._least_nm, _TIMES_USUAL * self._usual_nm))

    def _judge(self, dt_s: float, missing_nm: float, lost_n: float) -> None:
        smooth = self._smooth
        assert smooth is not None
        floor_nm = self._floor(dt_s, missing_nm)
        for side, sense in ((0, -1.0), (1, 1.0)):
            thrust_n = smooth[2 + side]
            told_nm = self._lateral_m * abs(thrust_n)
            lacks_nm = sense * math.copysign(missing_nm, missing_nm * thrust_n) if thrust_n else 0.0
            way_share = lost_n * math.copysign(1.0, thrust_n) / max(abs(thrust_n), 1e-3)
            slow = _WAY_SHARE < way_share < _WAY_WHOLE and told_nm > 0.5 * floor_nm
            self._slow_s[side] = 0.0 if slow else self._slow_s[side] + dt_s
            weak = told_nm > floor_nm and _SHARE * told_nm < lacks_nm < _WHOLE * (told_nm + smooth[6])
            weak = weak and self._slow_s[side] < _WAY_S
            self._held_s[side] = self._held_s[side] + dt_s if weak else max(0.0, self._held_s[side] - dt_s)
            self._weak_s[side] = 0.0 if self._held_s[side] > _HELD_S else self._weak_s[side] + dt_s
        self.weak = (self._weak_s[0] < _GONE_S, self._weak_s[1] < _GONE_S)
