"""How fast the vessel should turn by what was sent to thrusters and rudders alone: a compass that is stuck cannot hold this back."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import ActuatorOutput
from mavlink_bridge.language.units import clamp

from ..hull import ForceModel, VesselConfig
from ..hull.actuator_model import ActuatorModel
from ..hull.left import Shares

_MOST_RADPS: Final = 2.0
"""Faster than any of these hulls spins: a model that runs away ends here."""
_RATE_TAU_S: Final = 0.3
"""Pole of the turn rate while it is measured: a compass of 10 Hz gives three values in it."""
_UNTOLD_S: Final = 5.0
"""What holds against a wind is learnt in a gust or two, what a compass that has just got stuck feigns is not."""
_STEP_MAX_S: Final = 0.2
"""A late tick is not carried on over: the model would step past its own damping."""


class ModelledTurn:
    """Begins at the turn rate that is measured, and goes on without it from when the compass says what it said before.

    Without sway: what a slip that nobody measures does to the turn makes some hulls turn by themselves. What holds against wind, or
    against a rudder that stands off, is learnt while the compass is alive, and turns nothing later.
    """

    def __init__(self, vessel: VesselConfig) -> None:
        self._model, self._actuators = ForceModel(vessel), ActuatorModel(vessel)
        self._r_radps = self._untold_radps2 = 0.0

    def thrusters(self, shares: Shares) -> None:
        """Reckon with what each thruster still gives."""
        self._actuators.shares = shares

    def step(self, dt_s: float, sent: ActuatorOutput | None, u_mps: float, measured_radps: float | None) -> float:
        """Advance by one tick with what was sent during it, at a speed through the water; return the turn rate.

        ``measured_radps``: the turn rate while the compass is alive; None while it repeats itself.
        """
        dt_s = clamp(dt_s, 0.0, _STEP_MAX_S)
        actuators = self._actuators
        actuators.step(dt_s, sent, u_mps)
        _, _, dr_radps2 = self._model.rates(
            u_mps,
            0.0,
            self._r_radps,
            thrust_port_n=actuators.port_n,
            thrust_starboard_n=actuators.starboard_n,
            rudder_port_rad=actuators.rudder_rad,
            rudder_starboard_rad=actuators.rudder_rad,
        )
        self._r_radps += (dr_radps2 + self._untold_radps2) * dt_s
        if measured_radps is not None:
            off = min(dt_s / _RATE_TAU_S, 1.0) * (measured_radps - self._r_radps)
            self._r_radps += off
            self._untold_radps2 += off / _UNTOLD_S
        self._r_radps = clamp(self._r_radps, -_MOST_RADPS, _MOST_RADPS)
        return self._r_radps
