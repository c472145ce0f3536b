"""A vessel in its water with guidance and control around it, and nothing else: no links, no modes, no failsafes.

The bench and the tests of control quality run here, hundreds of times faster than real time. Where the vessel's state
comes from is a plug: ``IdealState`` is the truth, ``tools.benches.cells.sensed.SensedState`` goes through the sensors' sentences.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from companion.core.guard.gate import Evidence, Gate, GateConfig
from companion.core.guide import Guidance, GuidanceConfig, GuidanceOutput
from companion.core.hull import VesselConfig
from companion.core.steer import SteeringConfig, make_controller, sway_through_water_mps
from companion.core.steer.law import backs_and_fills, steady_speed_mps, turn_rate_radps
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import (
    Action,
    ActuatorDemand,
    ActuatorOutput,
    Desired,
    EstimatedState,
    FixType,
    Goto,
    Loiter,
)
from mavlink_bridge.language.snapshot import ControlTrace
from mavlink_bridge.language.units import wrap_pi
from sitl.plant import SimVessel, Water, WaterConfig

ORIGIN_RAD = (math.radians(41.185), math.radians(-8.706))
TICK_S = 0.05
_SUBSTEPS = 3
_DRIFT_TAU_S = 10.0
_WARM_UP_TICKS = 60
_READY = Evidence(actuator_ready=True)


class StateSource(Protocol):
    """Turns truth into what the vessel knows."""

    def sense(
        self, now_us: int, vessel: SimVessel, water_mps: float | None, sway_mps: float = 0.0
    ) -> EstimatedState: ...


class IdealState:
    """The truth, with a heading bias on request and a drift estimate as slow as a real one."""

    def __init__(self, heading_bias_rad: float = 0.0) -> None:
        self._bias = heading_bias_rad
        self._drift: list[float] | None = None

    def sense(self, now_us: int, vessel: SimVessel, water_mps: float | None, sway_mps: float = 0.0) -> EstimatedState:
        psi = wrap_pi(vessel.psi_rad + self._bias)
        cos, sin = math.cos(psi), math.sin(psi)
        vn, ve = vessel.vn_mps, vessel.ve_mps
        if water_mps is not None:
            seen = (vn - cos * water_mps, ve - sin * water_mps)
            if self._drift is None:
                self._drift = list(seen)
            for k in (0, 1):
                self._drift[k] += (seen[k] - self._drift[k]) * TICK_S / _DRIFT_TAU_S
        drift = (None, None) if self._drift is None else (self._drift[0], self._drift[1])
        return EstimatedState(
            t_us=now_us,
            lat_rad=ORIGIN_RAD[0],
            lon_rad=ORIGIN_RAD[1],
            origin_lat_rad=ORIGIN_RAD[0],
            origin_lon_rad=ORIGIN_RAD[1],
            x_m=vessel.north_m,
            y_m=vessel.east_m,
            vx_mps=vn,
            vy_mps=ve,
            u_mps=cos * vn + sin * ve,
            v_mps=cos * ve - sin * vn,
            psi_rad=psi,
            r_radps=vessel.r_radps,
            sog_mps=math.hypot(vn, ve),
            cog_rad=math.atan2(ve, vn),
            drift_n_mps=drift[0],
            drift_e_mps=drift[1],
            current_n_mps=drift[0],
            current_e_mps=drift[1],
            position_age_s=0.0,
            heading_age_s=0.0,
            fix_type=FixType.RTK_FIXED,
        )


@dataclass(frozen=True, slots=True)
class Setup:
    """What a loop is made of. ``belief`` is the vessel that the controllers think they steer, None = the true one."""

    vessel: VesselConfig
    water: WaterConfig = field(default_factory=WaterConfig)
    steering: SteeringConfig = field(default_factory=SteeringConfig)
    guidance: GuidanceConfig = field(default_factory=GuidanceConfig)
    belief: VesselConfig | None = None
    seed: int = 1
    delay_s: float = 0.0
    """Extra delay of the actuation."""
    plant: Callable[[VesselConfig], SimVessel] = SimVessel
    """Makes the hull."""


class ControlLoop:
    """One run. Call ``sail`` for a manoeuvre, then ``tick`` until satisfied; or ``steer`` without guidance."""

    def __init__(self, setup: Setup, source: StateSource | None = None) -> None:
        belief = setup.belief or setup.vessel
        self.setup = setup
        self.vessel = setup.plant(setup.vessel)
        self.water = Water(setup.water, random.Random(f"water {setup.seed}"))
        self.source: StateSource = source or IdealState()
        self.controller = make_controller(setup.steering.profile, setup.steering, belief)
        self.guidance = Guidance(setup.guidance, belief)
        self.gate = Gate(GateConfig(), setup.vessel.rudder.max_rad, round(TICK_S * 1e6))
        steady_mps = steady_speed_mps(self.controller)
        if steady_mps is not None:
            self.guidance.limit(
                fast_mps=steady_mps,
                turn_radps=turn_rate_radps(self.controller),
                backs_and_fills=backs_and_fills(self.controller),
            )
        self.frame = LocalFrame(*ORIGIN_RAD)
        self.now_us = self._start_us = 0
        self.sent: ActuatorOutput | None = None
        self.desired = Desired(None, None)
        self.trace = ControlTrace()
        self.activity = 0.0
        """Sum over ticks and four channels of the absolute change of the normalised commands."""
        self.ticks = 0
        self._pending: list[ActuatorOutput] = []
        self.state = EstimatedState(0)

    @property
    def t_s(self) -> float:
        """Time since ``place``."""
        return (self.now_us - self._start_us) * 1e-6

    def place(self, north_m: float, east_m: float, psi_rad: float, surge_mps: float = 0.0) -> None:
        """Start here with the sensors settled: the hull comes along its heading at this speed; then the law is reset."""
        cos, sin = math.cos(psi_rad), math.sin(psi_rad)
        for tick in range(_WARM_UP_TICKS, -1, -1):
            back_m = surge_mps * tick * TICK_S
            self.vessel.place(
                north_m=north_m - back_m * cos, east_m=east_m - back_m * sin, psi_rad=psi_rad, surge_mps=surge_mps
            )
            self.now_us += round(TICK_S * 1e6)
            self.state = self.source.sense(self.now_us, self.vessel, surge_mps)
        self._start_us = self.now_us
        self.controller.reset(self.state)

    def goto(self, north_m: float, east_m: float, seq: int = 0, hold_s: float = 0.0) -> Goto:
        return Goto(seq, *self.frame.to_geodetic(north_m, east_m), hold_s=hold_s)

    def sail(
        self,
        maneuver: Goto | Loiter,
        previous: tuple[float, float] | None = None,
        following: Goto | Loiter | None = None,
    ) -> None:
        self.guidance.begin(self.now_us, self.state, maneuver, previous=previous, following=following)

    def tick(self, speed_mps: float) -> GuidanceOutput:
        """One control period under guidance."""
        output = self.guidance.step(self.now_us, TICK_S, self.state, speed_mps, self.sent)
        self.steer(output.desired)
        return output

    def steer(self, desired: Desired) -> None:
        """One control period: controller, actuators, water, hull, sensors."""
        self.desired = desired
        demand, self.trace = self.controller.step(self.now_us, TICK_S, self.state, desired, self.sent)
        self._carry_out(demand)

    def by_sticks(self, demand: ActuatorDemand) -> None:
        """One control period by hand. Aboard, too, the law keeps up with the sticks meanwhile, and tells the estimator what is current."""
        self.controller.reset(self.state, TICK_S, self.sent)
        self._carry_out(demand)

    def _carry_out(self, demand: ActuatorDemand) -> None:
        output = self.gate.decide(self.now_us, demand, Action.NONE, True, _READY)
        self._count(output)
        self.sent = output
        self._move(self._delayed(output))
        self.now_us += round(TICK_S * 1e6)
        water_mps, sway_mps = self.controller.water_speed_mps(), sway_through_water_mps(self.controller)
        self.state = self.source.sense(self.now_us, self.vessel, water_mps, sway_mps)

    def _delayed(self, output: ActuatorOutput) -> ActuatorOutput:
        self._pending.append(output)
        wait = round(self.setup.delay_s / TICK_S)
        return self._pending.pop(0) if len(self._pending) > wait else self._pending[0]

    def _count(self, output: ActuatorOutput) -> None:
        last = self.sent
        self.ticks += 1
        if last is None:
            return
        full = self.setup.vessel.rudder.max_rad
        self.activity += abs(output.thruster_port - last.thruster_port)
        self.activity += abs(output.thruster_starboard - last.thruster_starboard)
        self.activity += abs(output.rudder_port_rad - last.rudder_port_rad) / full
        self.activity += abs(output.rudder_starboard_rad - last.rudder_starboard_rad) / full

    @property
    def activity_per_s(self) -> float:
        """Mean absolute change per second and channel."""
        return self.activity / max(1, self.ticks) / TICK_S / 4.0

    def _move(self, output: ActuatorOutput) -> None:
        dt = TICK_S / _SUBSTEPS
        for _ in range(_SUBSTEPS):
            self.water.step(dt)
            self.vessel.step(
                dt,
                thruster_port=output.thruster_port,
                thruster_starboard=output.thruster_starboard,
                rudder_port_rad=output.rudder_port_rad,
                rudder_starboard_rad=output.rudder_starboard_rad,
                water=self.water,
            )

    def run(self, speed_mps: float, limit_s: float, until: Callable[[GuidanceOutput], bool]) -> GuidanceOutput:
        """Tick until ``until`` says so; AssertionError when it does not within ``limit_s``."""
        end_us = self.now_us + round(limit_s * 1e6)
        while self.now_us < end_us:
            output = self.tick(speed_mps)
            if until(output):
                return output
        raise AssertionError(f"not there after {limit_s:.0f} s")
