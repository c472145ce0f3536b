"""The seed's law: SimpleHeadingAndSpeed with two PIDs, a speed-dependent thruster share, and heading priority.

Parity with dune-imc §1.4 ("The seed's law"), without the faults listed there as C5-C7: the heading error's derivative
is of wrapped differences and starts at zero, and a pause in the calls does not reach the integral.
"""

from __future__ import annotations

from mavlink_bridge.language.messages import ActuatorDemand, ActuatorOutput, Desired, EstimatedState
from mavlink_bridge.language.snapshot import ControlTrace
from mavlink_bridge.language.units import clamp, knots_to_mps, wrap_pi

from ..hull import ForceModel, VesselConfig
from .law import SeedConfig, SteeringConfig, SteeringError, mix
from .loop_control import Loop, LoopControl
from .observer import WaterSpeedObserver
from .pid import DiscretePid, Parcels

_IDLE = Parcels(0.0, 0.0, 0.0, 0.0)
_LONGEST_STEP_S = 0.5
"""A loop that was asleep for longer begins anew, as its integral is of another time."""


class SeedController:
    """Profile ``seed``. Refuses to be built without gains, as the seed's task refuses to start."""

    def __init__(self, config: SteeringConfig, vessel: VesselConfig) -> None:
        self._vessel = vessel
        self.loops = LoopControl()
        """ControlLoops and Abort; loops that are off are neutral and forget."""
        self._observer = WaterSpeedObserver(vessel, ForceModel(vessel))
        self._config = _checked(config.seed)
        gains = self._config
        assert gains.heading_gains is not None
        assert gains.speed_gains is not None
        self._heading = DiscretePid(gains.heading_gains, gains.max_thruster_output)
        self._speed = DiscretePid(gains.speed_gains, gains.max_thruster_output)
        self._clear()

    def _clear(self) -> None:
        self._heading.reset()
        self._speed.reset()
        self._fast = self._speed_runs = False
        self._last_angles: tuple[float, float] | None = None
        self._last = (0.0, 0.0)

    def reset(self, state: EstimatedState, dt_s: float = 0.0, sent: ActuatorOutput | None = None) -> None:
        self._clear()
        self._observer.idle(dt_s, state, sent)

    def configure(self, config: SteeringConfig) -> None:
        before, new = self._config, _checked(config.seed)
        assert new.heading_gains is not None
        assert new.speed_gains is not None
        if (before.heading_gains, before.speed_gains) != (new.heading_gains, new.speed_gains):
            self._heading.reset()  # the original begins both anew when the gains of one change
            self._speed.reset()
            self._speed_runs = False
        self._config = new
        self._heading.configure(new.heading_gains, new.max_thruster_output)
        self._speed.configure(new.speed_gains, new.max_thruster_output)

    def water_speed_mps(self) -> float | None:
        return self._observer.aligned_mps()

    @property
    def water_sway_mps(self) -> float:
        """The modelled sway through the water, to starboard positive."""
        return self._observer.v_mps

    def step(
        self, now_us: int, dt_s: float, state: EstimatedState, desired: Desired, sent: ActuatorOutput | None
    ) -> tuple[ActuatorDemand, ControlTrace]:
        config, loops = self._config, self.loops
        if loops.active is not Loop.BOTH:
            if loops.active is Loop.NONE:
                self._clear()
                self._observer.step(clamp(dt_s, 0.0, 0.2), state, sent)
                return ActuatorDemand(now_us), ControlTrace()
            desired = Desired(
                desired.psi_rad if Loop.HEADING in loops.active else None,
                desired.speed_mps if Loop.SPEED in loops.active else None,
                desired.r_radps,
                desired.through_water,
                desired.brake,
            )
        self._observer.step(clamp(dt_s, 0.0, 0.2), state, sent)
        heading, heading_error = self._heading_loop(dt_s, state, desired)
        speed, speed_error = self._speed_loop(dt_s, state, desired)
        share = self._thruster_share(state)
        limit = config.max_thruster_differential
        differential = clamp(share * heading.output, -limit, limit)
        port, starboard = self._rate_limited(mix(speed.output, differential, config.max_thruster_output), dt_s)
        rudder_rad = clamp((1.0 - share) * heading.output, -1.0, 1.0) * self._vessel.rudder.max_rad
        demand = ActuatorDemand(now_us, port, starboard, rudder_rad, rudder_rad)
        return demand, _trace(desired, heading, heading_error, speed, speed_error)

    def _heading_loop(self, dt_s: float, state: EstimatedState, desired: Desired) -> tuple[Parcels, float | None]:
        if desired.psi_rad is None or state.psi_rad is None:
            self._last_angles = None
            self._heading.reset()
            return _IDLE, None
        error = wrap_pi(desired.psi_rad - state.psi_rad)
        late = not 0.0 < dt_s <= _LONGEST_STEP_S
        slope = 0.0
        if self._last_angles is not None and not late:
            # wrapped one by one: wrapping their difference would kick the wrong way on a reference step near 180 degrees
            wanted, measured = self._last_angles
            slope = (wrap_pi(desired.psi_rad - wanted) - wrap_pi(state.psi_rad - measured)) / dt_s
        self._last_angles = desired.psi_rad, state.psi_rad
        return self._heading.step(0.0 if late else dt_s, error, slope), error

    def _speed_loop(self, dt_s: float, state: EstimatedState, desired: Desired) -> tuple[Parcels, float | None]:
        if desired.speed_mps is None or state.u_mps is None:
            self._speed.reset()
            self._speed_runs = False
            return _IDLE, None
        measured = self._observer.u_mps if desired.through_water else state.u_mps
        error = desired.speed_mps - measured
        late, first = not 0.0 < dt_s <= _LONGEST_STEP_S, not self._speed_runs
        self._speed_runs = True
        # a first error has no slope: taken from none it would be a kick
        return self._speed.step(0.0 if late else dt_s, error, 0.0 if late or first else None), error

    def _thruster_share(self, state: EstimatedState) -> float:
        """Share of the heading output for the thrusters, by speed with hysteresis; none where they do not turn the hull."""
        if not self._vessel.thruster.turns:
            return 0.0
        config = self._config
        threshold = knots_to_mps(config.high_speed_threshold_kn)
        margin = knots_to_mps(config.high_speed_hysteresis_kn)
        speed = state.sog_mps if state.sog_mps is not None else abs(state.u_mps or 0.0)
        self._fast = speed > threshold - margin if self._fast else speed > threshold + margin
        return config.high_speed_thruster_share if self._fast else config.low_speed_thruster_share

    def _rate_limited(self, wanted: tuple[float, float], dt_s: float) -> tuple[float, float]:
        """Limit the change of both thrusters, up and down, from what was asked last."""
        rate = self._config.max_thruster_rate
        if rate > 0.0:
            most = rate * min(dt_s, _LONGEST_STEP_S)
            port = clamp(wanted[0], self._last[0] - most, self._last[0] + most)
            starboard = clamp(wanted[1], self._last[1] - most, self._last[1] + most)
            wanted = port, starboard
        self._last = wanted
        return wanted


def _checked(config: SeedConfig) -> SeedConfig:
    missing = [name for name in ("heading_gains", "speed_gains") if getattr(config, name) is None]
    if missing:
        keys = " and ".join(f"steering.seed.{name}" for name in missing)
        raise SteeringError(f"profile 'seed' has no default gains: set {keys} (kp, ki, kd)")
    return config


def _trace(
    desired: Desired, heading: Parcels, heading_error: float | None, speed: Parcels, speed_error: float | None
) -> ControlTrace:
    return ControlTrace(
        heading_error_rad=heading_error,
        heading_p=heading.p,
        heading_i=heading.i,
        heading_d=heading.d,
        speed_error_mps=speed_error,
        speed_p=speed.p,
        speed_i=speed.i,
        speed_d=speed.d,
        psi_ref_rad=desired.psi_rad,
        speed_ref_mps=desired.speed_mps,
    )
