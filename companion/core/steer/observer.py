"""Motion through the water, modelled from the actuation that was really sent.

A boat with a GNSS compass measures its speed over ground only. The force model, driven by the commands that went out
and the measured yaw rate, says what it makes through the water; the difference is the drift (vessel-control §2.1). The
model's accelerations also carry measured surge and yaw rate from tick to tick, so that they can be filtered without lag.
"""

from __future__ import annotations

import math

from mavlink_bridge.language.messages import ActuatorOutput, EstimatedState
from mavlink_bridge.language.units import clamp

from ..hull import ForceModel, VesselConfig
from ..hull.actuator_model import ActuatorModel
from ..hull.left import Shares
from ..hull.statics import top_speed_mps

_RATE_TAU_S = 0.15
"""Pole of the observer's turn rate: a compass of 10 Hz gives one and a half values in it."""
_UNTOLD_S = 1.0
"""How long what the model does not know of yaw takes to be found. Four times the rate's pole would be critical damping; this lets
waves be waves."""
_SURGE_TAU_S = 0.8
"""Pole of its surge: longer than a wave's orbital push lasts."""
_HISTORY = 30
"""Ticks that are kept, for velocities that come late: 1.5 s at 20 Hz."""
_BEYOND = 3.0
"""Times the top speed: no file's slip, tow or way astern comes near it, and a model that has run away is past it in a few ticks."""
_RATE_BEYOND_RADPS = 2.0 * math.pi
"""The most that the estimator can be told to believe of a turn rate."""
_FILTER_LAG_S = 0.12
"""How far the estimator's velocity filter lags behind its fixes."""


_RIGHT_SHARE = 0.1
"""A file that is right to a tenth stands: wind along the way looks like as much. From twice that on it is believed to be wrong."""


def believed(made_share: float) -> float:
    """What the hull makes more than its file says, as far as it is more than wind could feign."""
    return made_share * clamp(abs(made_share) / _RIGHT_SHARE - 1.0, 0.0, 1.0)


class WaterSpeedObserver:
    """Integrates surge and sway through the water; yaw rate is taken as measured."""

    def __init__(self, vessel: VesselConfig, model: ForceModel) -> None:
        self._rates = model.rates
        self._actuators = ActuatorModel(vessel)
        self._most_mps = _BEYOND * top_speed_mps(vessel)
        self._clear()

    def _clear(self) -> None:
        self._started = False
        self.u_mps = 0.0
        self.v_mps = 0.0
        self.surge_mps: float | None = None
        """Surge over ground, measured, carried by the model."""
        self.rate_radps: float | None = None
        """Yaw rate, likewise."""
        self._untold_radps2 = 0.0
        """Yaw acceleration that the model does not know of: wind, a file that is wrong. Left out, the rate would stand off by it."""
        self.gains_mps2 = 0.0
        """Surge that the hull gains now by what was sent."""
        self._along_mps = 0.0
        self._gained: list[float] = []
        self._newer_mps = 0.0
        self._actuators.clear()

    @property
    def rudder_rad(self) -> float:
        """Angle of the rudders."""
        return self._actuators.rudder_rad

    def thrusters(self, shares: Shares, through_mps: tuple[float, float] | None = None) -> None:
        """Reckon with what each thruster still gives of what it is told.

        ``through_mps``: surge and sway that the vessel makes in truth, where they are known. What was carried forward was made by
        thrust that is not there.
        """
        self._actuators.shares = shares
        if through_mps is not None:
            self.u_mps, self.v_mps = through_mps
            self._gained.clear()
            self._newer_mps = 0.0

    def idle(self, dt_s: float, state: EstimatedState, sent: ActuatorOutput | None) -> None:
        """Keep up with the vessel while no loop steers it: the model goes on with what was sent, measurements start anew.

        The very first time the way on is what ground velocity and a known drift say, else none.
        """
        if not self._started:
            self._started = True
            self._begin(state)
        elif dt_s > 0.0:
            self._advance(dt_s if dt_s < 0.2 else 0.2, state, sent)
        self.surge_mps = self.rate_radps = None

    def _begin(self, state: EstimatedState) -> None:
        """Take the way on from ground velocity and a known drift, else none; the thrusters turn as they did."""
        self.u_mps = self.v_mps = self.gains_mps2 = self._newer_mps = self._untold_radps2 = 0.0
        self.surge_mps = self.rate_radps = None
        self._gained.clear()
        if state.u_mps is not None and state.psi_rad is not None and state.drift_n_mps is not None:
            drift_e = state.drift_e_mps or 0.0
            along = state.drift_n_mps * math.cos(state.psi_rad) + drift_e * math.sin(state.psi_rad)
            self.u_mps = state.u_mps - along
        if not self._is_possible():
            self.u_mps = 0.0

    def _is_possible(self, rate_radps: float = 0.0) -> bool:
        """Whether the hull can do what is modelled; what is not a number it cannot."""
        most = self._most_mps
        is_slow = -most <= self.u_mps <= most and -most <= self.v_mps <= most
        return is_slow and -_RATE_BEYOND_RADPS <= rate_radps <= _RATE_BEYOND_RADPS

    def step(self, dt_s: float, state: EstimatedState, sent: ActuatorOutput | None) -> None:
        """Advance by one tick with what was sent during it; nothing sent is neutral."""
        du, dr = self._advance(dt_s, state, sent)
        self._carry(dt_s, state, du, dr)

    def _advance(self, dt_s: float, state: EstimatedState, sent: ActuatorOutput | None) -> tuple[float, float]:
        """Carry the speed through the water on; return the accelerations of surge and yaw."""
        actuators = self._actuators
        actuators.step(dt_s, sent, self.u_mps)
        angle = actuators.rudder_rad
        rate = self.rate_radps if self.rate_radps is not None else state.r_radps or 0.0
        du, dv, dr = self._rates(
            self.u_mps,
            self.v_mps,
            rate,
            thrust_port_n=actuators.port_n,
            thrust_starboard_n=actuators.starboard_n,
            rudder_port_rad=angle,
            rudder_starboard_rad=angle,
        )
        self.gains_mps2 = du
        self.u_mps += du * dt_s
        self.v_mps += dv * dt_s
        if not self._is_possible(rate):
            self._begin(state)
            return 0.0, 0.0
        self._age(dt_s, state.position_age_s or 0.0, du * dt_s)
        return du, dr

    def _age(self, dt_s: float, age_s: float, gained_mps: float) -> None:
        """Keep what was gained since the moment that the estimate's velocity is of."""
        gained = self._gained
        gained.append(gained_mps)
        if len(gained) > 2 * _HISTORY:
            del gained[:_HISTORY]
        newer = round((age_s + _FILTER_LAG_S) / (dt_s if dt_s > 1e-3 else 1e-3))
        self._newer_mps = math.fsum(gained[-(newer if newer < _HISTORY else _HISTORY) :]) if newer > 0 else 0.0

    def aligned_mps(self) -> float:
        """Surge through the water at the moment that the estimate's ground velocity is of: the pair to take drift from."""
        return self.u_mps - self._newer_mps

    def _carry(self, dt_s: float, state: EstimatedState, du: float, dr: float) -> None:
        measured = state.r_radps
        if measured is None or self.rate_radps is None:
            self.rate_radps, self._untold_radps2 = measured, 0.0
        else:
            predicted = self.rate_radps + (dr + self._untold_radps2) * dt_s
            share = dt_s / _RATE_TAU_S if dt_s < _RATE_TAU_S else 1.0
            self.rate_radps = predicted + share * (measured - predicted)
            self._untold_radps2 += share * (measured - predicted) / _UNTOLD_S
        psi = state.psi_rad
        if state.u_mps is None or psi is None:
            self.surge_mps = None
            return
        along = (state.current_n_mps or 0.0) * math.cos(psi) + (state.current_e_mps or 0.0) * math.sin(psi)
        if self.surge_mps is None:
            self.surge_mps = state.u_mps
        else:
            # the drift's share changes with the heading, the rest by the forces
            predicted = self.surge_mps + du * dt_s + along - self._along_mps
            # the estimate's speed is as old as its fix: compare it with what the model had then
            then = predicted - self._newer_mps
            share = dt_s / _SURGE_TAU_S if dt_s < _SURGE_TAU_S else 1.0
            self.surge_mps = predicted + share * (state.u_mps - then)
        self._along_mps = along
