"""The vessel in one place: holds the parts and runs them in one fixed order, once per tick.

estimate → mission → guidance → steering → depth guard → failsafe → gate. It knows nothing of links or MAVLink; what comes
in is measurements and requests, what goes out is one actuator output and one snapshot. An exception in a part is
not caught here: the app answers it with neutral in the same tick.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from mavlink_bridge.imc import (
    Action,
    ActuatorDemand,
    ActuatorOutput,
    ActuatorStatus,
    AngularVelocity,
    Desired,
    Distance,
    EstimatedState,
    EulerAngles,
    FenceArea,
    FenceEnable,
    GpsFix,
    GuardState,
    LogText,
    Mode,
    Noted,
    PathControlState,
    PlanSpecification,
    SetHome,
    Severity,
    SupplyVoltage,
)
from mavlink_bridge.requests import DistanceInput, LoadPlan, Reply, Request
from mavlink_bridge.snapshot import ControlTrace, FenceStatus, Health, LinkHealth, Progress, Snapshot

from . import arming, failsafe
from .config import Config, param
from .depth_guard import DepthGuard, DepthGuardConfig, GuardOutput
from .estimate import Estimator, EstimatorConfig
from .failsafe import FailsafeConfig, FailsafeMemory, FailsafeResult, Flags
from .fence import Fence, FenceConfig
from .gate import Evidence, Gate, GateConfig
from .guidance import Guidance, GuidanceConfig, GuidanceOutput
from .mission import Leg, Mission, MissionConfig, Point
from .monitors import MonitorConfig, MonitorFlags, Monitors
from .navigator import Intent, ModeConfig, Navigator, Steer, Sticks
from .orders import Orders
from .steering import SteeringConfig, make_controller, manual_demand
from .vessel import VesselConfig, stopping_distance_m, throttle_to_speed, top_speed_mps

_NO_PATH: Final = PathControlState()
_BOARD_SILENT: Final = frozenset({"lost", "blocked", "silent", "baud", "failsafe"})
"""Faults of the actuator board after which nothing that is sent can be relied on."""

Measurement = GpsFix | EulerAngles | AngularVelocity | Distance


class OperatorConfig(Config):
    """What the vessel expects of ground stations."""

    gcs_required: bool = param(True, "GCS_REQUIRED", "Armed, a ground station must be heard")
    owner_timeout_s: float = param(
        3.0, "OWNER_TIMEOUT", "Sticks become free after this silence", unit="s", ge=0.5, le=60
    )


class VehicleConfig(Config):
    """Settings of all parts of the core."""

    operator: OperatorConfig = OperatorConfig()
    mission: MissionConfig = MissionConfig()
    modes: ModeConfig = ModeConfig()
    guidance: GuidanceConfig = GuidanceConfig()
    steering: SteeringConfig = SteeringConfig()
    estimate: EstimatorConfig = EstimatorConfig()
    depth: DepthGuardConfig = DepthGuardConfig()
    fence: FenceConfig = FenceConfig()
    failsafe: FailsafeConfig = FailsafeConfig()
    monitors: MonitorConfig = MonitorConfig()
    gate: GateConfig = GateConfig()


@dataclass(frozen=True, slots=True)
class TickInputs:
    """What the app brings to a tick, besides requests."""

    measurements: Sequence[Measurement] = ()
    actuator: ActuatorStatus = field(default_factory=lambda: ActuatorStatus(0))
    actuator_ready: bool = False
    actuator_reason: str = "no actuator board"
    actuator_faults: Sequence[str] = ()
    commanded_us: tuple[int, int, int, int] | None = None
    links: tuple[LinkHealth, ...] = ()
    gcs_age_s: float | None = None
    radio_age_s: float | None = None
    storage_fault: bool = False
    task_failing: bool = False
    late_s: float = 0.0
    load: float = 0.0
    plan_ids: tuple[int, int, int] = (0, 0, 0)


class Vehicle:
    """The vessel's decisions. One call of ``tick`` per control period; ``handle`` in between."""

    def __init__(self, config: VehicleConfig, vessel: VesselConfig) -> None:
        self.config = config
        self.vessel = vessel
        self.estimator = Estimator(config.estimate)
        self.mission = Mission(config.mission)
        self.navigator = Navigator(config.modes, self.mission)
        self.guidance = Guidance(config.guidance, vessel)
        self.controller = make_controller(config.steering.profile, config.steering, vessel)
        self.guard = DepthGuard(config.depth)
        self.fence = Fence(config.fence)
        self.monitors = Monitors(config.monitors)
        self.gate = Gate(config.gate)
        self.orders = Orders(self)
        self.armed = False
        self.state = EstimatedState(0)
        self._memory = FailsafeMemory()
        self._result = FailsafeResult(self._memory, Action.NONE)
        self._guard_out = GuardOutput(GuardState.UNKNOWN, None, None, None)
        self._fence_status = FenceStatus()
        self._generation: int | None = None
        self._desired: Desired | None = None
        self._trace = ControlTrace()
        self._guided: GuidanceOutput | None = None
        self._output = self.gate.neutral(0, "start")
        self._inputs = TickInputs()
        self._home_by_operator = False
        self._terminating = self._aborting = self._ordered = self._rearmed = False
        self._owner: tuple[int, int] | None = None
        self._tick = 0
        self._last_us: int | None = None
        self._text_number = 0
        self._texts: list[LogText] = []
        self._depth_inputs: list[Distance] = []
        self.say(Severity.INFO, self.guard.startup_warning(self._stopping))

    # ---- what requests do ---------------------------------------------------------------------------------------

    def handle(self, request: Request, now_us: int) -> Reply:
        """Carry out a request at a tick boundary and answer it."""
        return self.orders.handle(request, now_us)

    def configure(self, config: VehicleConfig) -> None:
        """Take new live settings; a change of gains does not bump the actuators."""
        old, self.config = self.config, config
        self.mission.configure(config.mission)
        self.navigator.configure(config.modes)
        if config.guidance != old.guidance:
            self.guidance.configure(config.guidance)
        if config.steering != old.steering:
            self.controller.configure(config.steering)
        if config.estimate != old.estimate:
            self.estimator.configure(config.estimate)
        if config.depth != old.depth:
            self.guard.configure(config.depth)
        if config.fence != old.fence:
            self.fence.configure(config.fence)
        if config.monitors != old.monitors:
            self.monitors.configure(config.monitors)
        if config.gate != old.gate:
            self.gate.configure(config.gate)

    def plan_refusal(self, body: LoadPlan) -> str:
        """Return why a plan that is sound on the wire is still refused by this vessel, or an empty string."""
        top_mps = top_speed_mps(self.vessel)
        for item in body.plan.maneuvers:
            speed = getattr(item, "speed_mps", None)
            if speed is not None and speed > top_mps:
                return f"item {item.seq}: {speed:.1f} m/s is more than the vessel's {top_mps:.1f} m/s"
        return ""

    def load_plan(self, plan: PlanSpecification) -> None:
        self.mission.load(plan)

    def load_fence(self, areas: Sequence[FenceArea]) -> None:
        self.fence.load(areas)

    def load_rally(self, points: tuple[Point, ...]) -> None:
        self.mission.rally = points

    def prearm_reasons(self, now_us: int, *, force: bool = False) -> tuple[str, ...]:
        """Return why the vessel must not be armed now; empty when it may."""
        inputs, causes = self._inputs, self._result.causes
        if self.gate.terminated or force:
            return ("terminated: restart first",) if self.gate.terminated else self._forced_reasons()
        return arming.reasons(
            mode=self.navigator.mode,
            state=self.state,
            actuator_ready=inputs.actuator_ready,
            actuator_reason=inputs.actuator_reason,
            emergency_stop=inputs.actuator.emergency_stop,
            holding_causes=failsafe.holding(self._memory, self.config.failsafe),
            guard=self.guard.state if self.config.depth.enabled else GuardState.UNKNOWN,
            guard_reason=self.guard.refusal(now_us),
            depth_required=self.config.depth.required,
            altitude_known=self._guard_out.altitude_m is not None,
            fence=self._fence_status,
            battery_low="battery_low" in causes,
            battery_lost="battery_lost" in causes,
            sources_disagree=self.estimator.sources_disagree,
            gcs_required=self.config.operator.gcs_required,
            gcs_heard=inputs.gcs_age_s is not None or inputs.radio_age_s is not None,
            plan_needed=True,
            plan_loaded=bool(self.mission.total),
        )

    def _forced_reasons(self) -> tuple[str, ...]:
        """A forced arm passes over all checks but the actuators' own."""
        return () if self._inputs.actuator_ready else (f"actuators not ready: {self._inputs.actuator_reason}",)

    def arm(self, now_us: int, sender: int) -> None:
        """Permit thrust. The caller has asked ``prearm_reasons``."""
        if not self.armed:
            self.say(Severity.NOTICE, "armed")
            self.controller.reset(self.state)
        self.armed = self._rearmed = True
        self._set_home_once()

    def disarm(self, why: str, *, abort: bool = False) -> None:
        """Neutral from this tick on. ``abort`` (IMC Abort) also pauses the plan; only an operator goes on."""
        if self.armed:
            self.say(Severity.CRITICAL if abort else Severity.NOTICE, f"disarmed: {why}")
        self.armed = False
        if abort:
            self._aborting = True
        if self.navigator.mode is not Mode.MANUAL:
            self.navigator.enter(Mode.HOLD, self.state)

    def terminate(self, why: str) -> None:
        self.say(Severity.EMERGENCY, why)
        self._terminating = True
        self.armed = False

    def motion_refusal(self, now_us: int) -> str:
        """Return why an order that sets the vessel moving is refused now, or an empty string."""
        if self.gate.terminated or self._terminating:
            return "terminated: restart to go on"
        return self.guard.activation(now_us) or ""

    def operator_acted(self, now_us: int) -> None:
        """An operator has given an order; latched failsafes look at it in the next tick."""
        self._ordered = True

    def target_refusal(self, lat_rad: float | None, lon_rad: float | None) -> str:
        """Return why a guided target is refused (outside the fence), or an empty string."""
        if lat_rad is None or lon_rad is None or not self.fence.enabled or self.estimator.origin is None:
            return ""
        inside_m = self.fence.distance_m(self.state, self.estimator.origin.to_local(lat_rad, lon_rad))
        return "" if inside_m is None or inside_m >= 0.0 else f"the target is {-inside_m:.0f} m outside the fence"

    def manual_owner(self, sender: int, now_us: int) -> int:
        """Return who has the sticks; the sender when they were free."""
        if self._owner is None or now_us - self._owner[1] > self.config.operator.owner_timeout_s * 1e6:
            self._owner = (sender, now_us)
        if self._owner[0] == sender:
            self._owner = (sender, now_us)
        return self._owner[0]

    def set_home(self, lat_rad: float | None, lon_rad: float | None) -> str:
        """Set home to a position or to here; return a refusal or an empty string."""
        if lat_rad is None or lon_rad is None:
            lat_rad, lon_rad = self.state.lat_rad, self.state.lon_rad
        if lat_rad is None or lon_rad is None:
            return "no position"
        self.mission.home = (lat_rad, lon_rad)
        self._home_by_operator = True
        return ""

    def enable_fence(self, enable: bool) -> str:
        self.fence.enable(enable)
        return ""

    def depth_input(self, body: DistanceInput, now_us: int) -> None:
        self._depth_inputs.append(Distance(now_us, body.value_m, signal_quality=body.signal_quality))

    @property
    def guard_state(self) -> GuardState:
        return self.guard.state

    def unlock_guard(self) -> None:
        self.guard.unlock_once()
        self.say(Severity.WARNING, "depth guard unlocked once by the operator")

    def say(self, severity: Severity, text: str) -> None:
        """Queue a text for every operator."""
        self._text_number += 1
        self._texts.append(LogText(self._text_number, self._last_us or 0, severity, text))

    # ---- the tick -----------------------------------------------------------------------------------------------

    def tick(self, now_us: int, inputs: TickInputs) -> Snapshot:
        """Run one control period."""
        dt_s = 0.0 if self._last_us is None else (now_us - self._last_us) * 1e-6
        self._inputs, self._last_us = inputs, now_us
        self._tick += 1
        self._measure(inputs.measurements, now_us)
        intent = self._intent(now_us)
        demand = self._steer(now_us, dt_s, intent)
        self._guard(now_us, intent)
        self._judge(now_us, intent)
        output = self._decide(now_us, demand, isinstance(intent, Sticks))
        self._follow_up(now_us)
        return self._snapshot(now_us, demand, output)

    def _measure(self, measurements: Sequence[Measurement], now_us: int) -> None:
        for item in (*measurements, *self._depth_inputs):
            self.estimator.update(item)
            if isinstance(item, Distance):
                self.guard.measure(item, self.state)
        self._depth_inputs.clear()
        self.estimator.note_water_speed(self.controller.water_speed_mps())
        self.state = self.estimator.predict(now_us, self._guard_out.altitude_m)
        utc_us = self.estimator.utc_us(now_us)
        self.mission.utc_s_of_day = None if utc_us is None else utc_us * 1e-6 % 86_400.0
        self._set_home_once()

    def _set_home_once(self) -> None:
        state = self.state
        if self.mission.home is None and state.lat_rad is not None and state.lon_rad is not None:
            self.mission.home = (state.lat_rad, state.lon_rad)

    def _intent(self, now_us: int) -> Intent:
        if not self.armed or self._result.action >= Action.STOP:
            return None
        return self.navigator.intent(now_us, self.state)

    def _steer(self, now_us: int, dt_s: float, intent: Intent) -> ActuatorDemand | None:
        """Turn the intent into a demand; None where there is none (and the gate makes neutral of it)."""
        self._guided, self._desired, self._trace = None, None, ControlTrace()
        if intent is None:
            self._generation = None
            self.controller.reset(self.state)
            return None
        if isinstance(intent, Sticks):
            self._generation = None
            self.controller.reset(self.state)
            return manual_demand(now_us, intent.surge, intent.yaw, self.config.steering, self.vessel)
        desired = self._course(intent) if isinstance(intent, Steer) else self._path(now_us, dt_s, intent)
        slow = self._guard_out.slow_to_mps
        if slow is not None and desired.speed_mps is not None:
            desired = Desired(
                desired.psi_rad, min(slow, desired.speed_mps), desired.r_radps, desired.through_water, desired.brake
            )
        self._desired = desired
        if desired.psi_rad is None and desired.speed_mps is None:
            self.controller.reset(self.state)
            return None
        demand, self._trace = self.controller.step(now_us, dt_s, self.state, desired, self._output)
        return demand

    def _course(self, intent: Steer) -> Desired:
        self._generation = None
        psi_rad = intent.psi_rad
        if intent.course and self.state.cog_rad is not None and self.state.psi_rad is not None:
            psi_rad += self.state.psi_rad - self.state.cog_rad if (self.state.sog_mps or 0.0) > 0.5 else 0.0
        return Desired(psi_rad, intent.speed_mps)

    def _path(self, now_us: int, dt_s: float, leg: Leg) -> Desired:
        if leg.generation != self._generation:
            if not self.state.position_valid:
                return Desired(None, None)
            self._generation = leg.generation
            self.guidance.begin(now_us, self.state, leg.maneuver, leg.previous, leg.following, self.navigator.speed_mps)
        self._guided = self.guidance.step(now_us, dt_s, self.state, self.navigator.speed_mps)
        return self._guided.desired

    def _guard(self, now_us: int, intent: Intent) -> None:
        loops_active = self.armed and intent is not None and not isinstance(intent, Sticks)
        self._guard_out = self.guard.step(now_us, self.state, loops_active, None, self._stopping)
        for severity, text in self._guard_out.texts:
            self.say(severity, text)
        if self._guard_out.abort and self.navigator.mode is not Mode.MANUAL:
            self.navigator.enter(Mode.HOLD, self.state)

    def _judge(self, now_us: int, intent: Intent) -> None:
        fence = self.fence.check(self.state, self._stopping(self.state.sog_mps or 0.0))
        self._fence_status = fence.status
        for severity, text in fence.texts:
            self.say(severity, text)
        monitored = self.monitors.step(
            now_us,
            self.state,
            self._output,
            self._desired,
            stopped=self._result.action >= Action.STOP,
            late_s=self._inputs.late_s,
            supply=self._supply(now_us),
            vessel_speed_fn=self._speed_at,
        )
        flags = self._flags(now_us, monitored, fence.stop)
        before = self._result.action
        self._result = failsafe.step(self._memory, flags, now_us, self.config.failsafe)
        self._memory = self._result.memory
        for severity, text in self._result.texts:
            self.say(severity, text)
        self._ordered = self._rearmed = self._aborting = False
        self._react(before)

    def _flags(self, now_us: int, seen: MonitorFlags, fence_ahead: bool) -> Flags:
        state, inputs, guard = self.state, self._inputs, self._guard_out
        faults = inputs.actuator_faults
        manual = self.navigator.mode is Mode.MANUAL
        return Flags(
            armed=self.armed,
            autonomous=not manual,
            manual=manual and self.navigator.stick_age_s(now_us) is not None,
            operator_order=self._ordered,
            operator_arm=self._rearmed,
            terminate=self._terminating,
            emergency_stop=self._aborting or inputs.actuator.emergency_stop,
            gcs_required=self.config.operator.gcs_required,
            gcs_age_s=inputs.gcs_age_s,
            radio_age_s=inputs.radio_age_s,
            manual_age_s=self.navigator.stick_age_s(now_us) if manual else None,
            guided_age_s=self.navigator.guided_age_s(now_us),
            position_lost=not state.position_valid,
            heading_lost=not state.heading_valid,
            position_frozen=self.estimator.frozen,
            sources_disagree=self.estimator.sources_disagree,
            actuator_lost=not _BOARD_SILENT.isdisjoint(faults),
            actuator_reset="reset" in faults,
            actuator_mismatch="mismatch" in faults,
            actuator_noise="noise" in faults,
            actuator_garbage="garbage" in faults,
            depth_shallow=guard.shallow,
            depth_locked=guard.locked,
            depth_ahead=guard.stop_ahead,
            depth_lost=guard.lost,
            depth_blind=guard.blind,
            fence_ahead=fence_ahead,
            fence_breach=self._fence_status.breached,
            plan_invalid=self._guided is not None and bool(self._guided.unable),
            battery_low=seen.battery_low,
            battery_critical=seen.battery_critical,
            battery_empty=seen.battery_empty,
            battery_lost=seen.battery_lost,
            stuck=seen.stuck,
            moving_in_neutral=seen.moving_in_neutral,
            drifting_while_stopped=seen.drifting_while_stopped,
            oscillating=seen.oscillating,
            storage_fault=inputs.storage_fault,
            time_jump=seen.time_jump,
            tick_late=seen.tick_late,
            tick_very_late=seen.tick_very_late,
            overruns=seen.overruns,
            task_failing=inputs.task_failing,
        )

    def _react(self, before: Action) -> None:
        """Change mode as the failsafe asks. Manual is the operator's: thrust may be taken away, the mode not."""
        action = self._result.action
        if action >= Action.DISARM and self.armed:
            self.disarm(", ".join(self._result.causes))
        if action <= before or self.navigator.mode is Mode.MANUAL:
            return
        if action is Action.RETURN and self.navigator.mode is not Mode.RTL:
            if self.navigator.enter(Mode.RTL, self.state):
                self.navigator.enter(Mode.HOLD, self.state)
        elif action in (Action.HOLD, Action.STOP) and self.navigator.mode is not Mode.HOLD:
            self.navigator.enter(Mode.HOLD, self.state)

    def _decide(self, now_us: int, demand: ActuatorDemand | None, manual: bool) -> ActuatorOutput:
        evidence = Evidence(
            actuator_ready=self._inputs.actuator_ready,
            reason=self._inputs.actuator_reason,
            manual=manual,
            emergency_stop=self._inputs.actuator.emergency_stop,
        )
        if self._result.action >= Action.STOP:
            self.navigator.forget_hold()
        limit = self._result.thrust_limit
        if demand is not None and limit < 1.0:
            demand = _limited(demand, limit)
        self._output = self.gate.decide(now_us, demand, self._result.action, self.armed, evidence)
        return self._output

    def _follow_up(self, now_us: int) -> None:
        """Let the plan move on, and collect what the parts have to say."""
        if self._guided is not None:
            report = self._guided
            self.navigator.advance(
                now_us, self.state, arrived=report.arrived, on_path=report.on_path, turns=report.turns
            )
        for source in (self.estimator, self.guidance, self.navigator):
            for severity, text in source.drain_texts():
                self.say(severity, text)

    def _effects(self) -> tuple[int, ...]:
        reached, effects, texts = self.mission.drain()
        for effect in effects:
            if isinstance(effect, SetHome):
                self.set_home(effect.lat_rad, effect.lon_rad)
            elif isinstance(effect, FenceEnable):
                self.enable_fence(effect.enable)
            elif isinstance(effect, Noted):
                self.say(Severity.INFO, f"item {effect.seq}: command {effect.command} noted, nothing done")
        for severity, text in texts:
            self.say(severity, text)
        return reached

    def _stopping(self, speed_mps: float) -> float:
        return stopping_distance_m(self.vessel, speed_mps)

    def _speed_at(self, throttle: float) -> float:
        return throttle_to_speed(self.vessel, throttle)

    def _supply(self, now_us: int) -> SupplyVoltage | None:
        status = self._inputs.actuator
        return None if status.voltage_v is None else SupplyVoltage(status.t_us, status.voltage_v)

    def _snapshot(self, now_us: int, demand: ActuatorDemand | None, output: ActuatorOutput) -> Snapshot:
        inputs = self._inputs
        reached = self._effects()
        texts, self._texts = tuple(self._texts), []
        reasons = () if self.armed else self.prearm_reasons(now_us)
        attitude = self.estimator.latest_attitude
        home = self.mission.home
        return Snapshot(
            t_us=now_us,
            tick=self._tick,
            state=self.state,
            mode=self.navigator.mode,
            armed=self.armed,
            output=output,
            demand=demand,
            desired=self._desired,
            path=self._guided.path if self._guided is not None else _NO_PATH,
            trace=self._trace,
            progress=Progress(
                state=self.mission.state,
                seq=self.mission.seq,
                total=self.mission.total,
                mission_id=inputs.plan_ids[0],
                fence_id=inputs.plan_ids[1],
                rally_id=inputs.plan_ids[2],
                reached=reached,
            ),
            fix=self.estimator.latest_fix,
            attitude=attitude,
            distance=self.estimator.latest_distance,
            altitude_raw_m=self._guard_out.altitude_raw_m,
            altitude_limit_m=self._guard_out.limit_m,
            guard=self._guard_out.state,
            action=self._result.action,
            causes=self._result.causes,
            health=Health(
                gps=self.state.position_valid,
                heading=self.state.heading_valid,
                attitude=self.state.phi_rad is not None,
                depth=None if not self.config.depth.enabled else self._guard_out.altitude_m is not None,
                actuators=inputs.actuator_ready,
                battery=None if inputs.actuator.voltage_v is None else "battery_low" not in self._result.causes,
                logging=not inputs.storage_fault,
                fence_ok=not self._fence_status.breached,
                fence_enabled=self.fence.enabled,
                prearm_ok=not reasons,
                prearm_reasons=reasons,
            ),
            fence=self._fence_status,
            supply=self._supply(now_us),
            actuator=inputs.actuator,
            commanded_us=inputs.commanded_us,
            home_lat_rad=None if home is None else home[0],
            home_lon_rad=None if home is None else home[1],
            utc_us=self.estimator.utc_us(now_us),
            texts=texts,
            links=inputs.links,
            throttle=0.5 * (output.thruster_port + output.thruster_starboard),
            terminated=self.gate.terminated,
            load=inputs.load,
        )


def _limited(demand: ActuatorDemand, limit: float) -> ActuatorDemand:
    return ActuatorDemand(
        demand.t_us,
        max(-limit, min(limit, demand.thruster_port)),
        max(-limit, min(limit, demand.thruster_starboard)),
        demand.rudder_port_rad,
        demand.rudder_starboard_rad,
    )
