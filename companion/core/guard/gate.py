"""The gate: the one place that decides what reaches the actuators, and the only maker of ``ActuatorOutput``.

Permission starts false and is asked for anew every tick: armed, an action that allows thrust, a ready actuator board,
a fresh and finite demand. Whatever is missing, odd or unknown gives neutral (thrusters stopped, rudders centred),
at once and without a slew limit. It shares no code with the controllers, on purpose: a fault there must not be a
fault here. The eight invariants of architecture-study §4.7 are tested as properties.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.messages import Action, ActuatorDemand, ActuatorOutput
from mavlink_bridge.language.value import value

from ..config import Config, param

_ALLOWED: Final = (Action.NONE, Action.WARN, Action.HOLD, Action.RETURN)
_TERMINATE: Final = Action.TERMINATE
_NEUTRAL: Final = (0.0, 0.0, 0.0, 0.0)
"""No thrust, rudders amidships: the order is that of the fields."""
_STALE_PERIODS: Final = 2
"""A demand of the tick before may stand in once; an older one is nobody's."""


class GateConfig(Config):
    """Limits of the last stage before the actuators."""

    thruster_min: float = param(-1.0, "GATE_THR_MIN", "Least thruster output (full astern is -1)", ge=-1, le=0)
    thruster_max: float = param(1.0, "GATE_THR_MAX", "Greatest thruster output", ge=0, le=1)
    thruster_rate: float = param(
        0.0,
        "GATE_THR_RATE",
        "Fastest change of a thruster away from neutral; 0 = not limited",
        unit="1/s",
        ge=0,
        le=100,
    )
    rudder_rate_degps: float = param(
        0.0, "GATE_RUD_RATE", "Fastest rudder change away from centre; 0 = not limited", unit="deg/s", ge=0, le=3600
    )


@value
class Evidence:
    """What must be true for thrust, gathered in this tick. The defaults say no."""

    actuator_ready: bool = False
    """The board is connected, negotiated and not in a fault."""
    reason: str = "no evidence"
    """Why not, for the operator; used when ``actuator_ready`` is False."""
    manual: bool = False
    """The demand comes from an operator's sticks; only recorded in the output's cause."""
    emergency_stop: bool = False
    """The board's stop input is pressed."""
    most: float = 1.0
    """Greatest size of a thruster's output, 0...1, ahead and astern (a failsafe lowers it); not a number counts as none."""


class Gate:
    """Keeps the last output, for the slew limit, and the termination latch. Nothing else."""

    def __init__(self, config: GateConfig, rudder_max_rad: float, period_us: int) -> None:
        """``rudder_max_rad``: of the hull. ``period_us``: of the tick; a demand older than two of these counts as missing."""
        self.rudder_max_rad, self.period_us = rudder_max_rad, period_us
        self._stale_us = period_us * _STALE_PERIODS
        self._last = _NEUTRAL
        self._last_us: int | None = None
        self._terminated = False
        self.configure(config)

    def configure(self, config: GateConfig) -> None:
        """Take new limits at once; a tighter range applies to the very next output."""
        self._thruster_min, self._thruster_max = config.thruster_min, config.thruster_max
        self._thruster_rate = config.thruster_rate or math.inf
        self._rudder_rate = math.radians(config.rudder_rate_degps) or math.inf

    @property
    def terminated(self) -> bool:
        """True once TERMINATE was seen; only a restart ends it."""
        return self._terminated

    def decide(
        self, now_us: int, demand: ActuatorDemand | None, action: Action, armed: bool, evidence: Evidence
    ) -> ActuatorOutput:
        """Return this tick's output: the demand within limits, or neutral with the cause. Never raises."""
        try:
            if action == _TERMINATE:
                self._terminated = True
            cause = self._refusal(now_us, demand, action, armed, evidence)
            if cause is None:
                assert demand is not None
                return self._pass(now_us, demand, evidence)
        except Exception as error:  # an odd input must end in neutral, never in silence
            cause = f"fault: {type(error).__name__}"
        return self.neutral(now_us, cause)

    def neutral(self, now_us: int, cause: str) -> ActuatorOutput:
        """Return thrusters stopped and rudders centred, at once. Always allowed."""
        self._last = _NEUTRAL
        self._last_us = now_us
        return ActuatorOutput(
            t_us=now_us,
            thruster_port=0.0,
            thruster_starboard=0.0,
            rudder_port_rad=0.0,
            rudder_starboard_rad=0.0,
            cause=cause,
        )

    def _refusal(
        self, now_us: int, demand: ActuatorDemand | None, action: Action, armed: bool, evidence: Evidence
    ) -> str | None:
        if self._terminated:
            return "terminated"
        if armed is not True:
            return "disarmed"
        if action not in _ALLOWED:
            return f"failsafe {action.name}" if isinstance(action, Action) else "unknown action"
        if evidence.emergency_stop is not False:
            return "emergency stop"
        if evidence.actuator_ready is not True:
            return evidence.reason or "actuators not ready"
        if demand is None:
            return "no demand"
        if not 0 <= now_us - demand.t_us <= self._stale_us:
            return "stale demand"
        finite = math.isfinite(demand.thruster_port) and math.isfinite(demand.thruster_starboard)
        finite = finite and math.isfinite(demand.rudder_port_rad) and math.isfinite(demand.rudder_starboard_rad)
        return None if finite else "demand is not a number"

    def _pass(self, now_us: int, demand: ActuatorDemand, evidence: Evidence) -> ActuatorOutput:
        most, low, high, rudder_max = (
            evidence.most,
            self._thruster_min,
            self._thruster_max,
            self.rudder_max_rad,
        )
        if not most > 0.0:
            most = 0.0
        if -most > low:
            low = -most
        if most < high:
            high = most
        dt_s = self._elapsed_s(now_us)
        port, starboard, rudder_port, rudder_starboard = self._last
        port = _limited(demand.thruster_port, port, low, high=high, rate=self._thruster_rate, dt_s=dt_s)
        starboard = _limited(demand.thruster_starboard, starboard, low, high=high, rate=self._thruster_rate, dt_s=dt_s)
        low, high = -rudder_max, rudder_max
        rudder_port = _limited(demand.rudder_port_rad, rudder_port, low, high=high, rate=self._rudder_rate, dt_s=dt_s)
        rudder_starboard = _limited(
            demand.rudder_starboard_rad, rudder_starboard, low, high=high, rate=self._rudder_rate, dt_s=dt_s
        )
        self._last = (port, starboard, rudder_port, rudder_starboard)
        self._last_us = now_us
        cause = "manual" if evidence.manual else "demand"
        return ActuatorOutput(
            t_us=now_us,
            thruster_port=port,
            thruster_starboard=starboard,
            rudder_port_rad=rudder_port,
            rudder_starboard_rad=rudder_starboard,
            cause=cause,
        )

    def _elapsed_s(self, now_us: int) -> float:
        """Time since the last output, s; never negative and at most two periods, so that a pause buys no step."""
        if self._last_us is None or now_us < self._last_us:
            return 0.0
        elapsed_us = now_us - self._last_us
        if elapsed_us > self._stale_us:
            elapsed_us = self._stale_us
        return elapsed_us / 1e6


def _limited(wanted: float, last: float, low: float, high: float, rate: float, dt_s: float) -> float:
    """Keep one channel within its range and, where it has a rate (1/s), within that on the way from neutral."""
    if low > wanted:
        wanted = low
    if high < wanted:
        wanted = high
    return wanted if rate == math.inf else _toward(last, wanted, rate * dt_s)


def _toward(last: float, wanted: float, step: float) -> float:
    """Move from ``last`` to ``wanted``; away from zero by at most ``step``, toward zero freely.

    Crossing zero spends nothing on the way in: the far side starts from zero.
    """
    start = last if last * wanted > 0.0 else 0.0
    return math.copysign(min(abs(wanted), abs(start) + step), wanted)
