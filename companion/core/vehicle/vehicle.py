"""The vessel in one place: holds the parts and runs them in one fixed order, once per tick.

estimate → mission → guidance → steering → depth guard → failsafe → gate. It knows nothing of links or MAVLink; what comes
in is measurements and requests, what goes out is one actuator output and one snapshot. An exception in a part is
not caught here: the app answers it with neutral in the same tick.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.messages import (
    Action,
    ActuatorDemand,
    ActuatorOutput,
    Desired,
    Distance,
    FenceEnable,
    LogText,
    Mode,
    Noted,
    PlanState,
    SetHome,
    Severity,
)
from mavlink_bridge.language.requests import Reply, Request
from mavlink_bridge.language.snapshot import ControlTrace, Snapshot

from ..guard import failsafe
from ..guard.gate import Evidence
from ..guard.outlook import outlook
from ..hull import VesselConfig
from ..steer import manual_demand
from .config import Measurement, TickInputs, VehicleConfig
from .controls import Controls
from .flags import gather
from .mission import Leg
from .navigator import Intent, Steer, Sticks
from .orders import Orders
from .plan_reach import plan_number
from .progress_watch import ProgressWatch
from .view import View

_STOP: Final = Action.STOP
_WARN: Final = Action.WARN
_MANUAL: Final = Mode.MANUAL
_AUTO: Final = Mode.AUTO
_NO_TRACE: Final = ControlTrace()
_GROUND_LINK: Final = 99
"""What a station sends as a depth comes after every sensor of the vessel's own."""


class Vehicle(Controls):
    """The vessel's decisions. One call of ``tick`` per control period; ``handle`` in between."""

    def __init__(self, config: VehicleConfig, vessel: VesselConfig, sources: Sequence[str] = ()) -> None:
        """``sources``: names of the sensor links, in the order of their numbers."""
        super().__init__(config, vessel, sources)
        self.orders = Orders(self)
        self._view = View(self)
        self._progress = ProgressWatch()

    def handle(self, request: Request, now_us: int) -> Reply:
        """Carry out a request at a tick boundary and answer it."""
        return self.orders.handle(request, now_us)

    def tick(self, now_us: int, inputs: TickInputs) -> Snapshot:
        """Run one control period."""
        dt_s = 0.0 if self._last_us is None else (now_us - self._last_us) * 1e-6
        self.inputs, self._last_us = inputs, now_us
        self.ticks += 1
        self._measure(inputs.measurements, now_us)
        self.board = self.board_watch.step(
            inputs.actuator, inputs.actuator_faults, ready=inputs.actuator_ready, armed=self.armed
        )
        self._watch_thrusters(dt_s)
        if self.plan_reach.is_new(self.mission.plan, plan_number(inputs.plan_ids[0]), self.state):
            self.look_at_reach()
        intent = self.navigator.intent(now_us, self.state) if self.armed and self.result.action < _STOP else None
        manual = isinstance(intent, Sticks)
        demand = self._steer(now_us, dt_s, intent)
        self._guard(now_us, steers_itself=self.armed and intent is not None and not manual)
        self._judge(now_us)
        if self.guard_out.flags.depth_braking and not manual:
            demand = ActuatorDemand(now_us, -1.0, -1.0)
        output = self._decide(now_us, demand, manual)
        self._follow_up(now_us)
        reached = self._effects()
        texts: tuple[LogText, ...] = ()
        if self._texts:
            texts, self._texts = tuple(self._texts), []
        return self._view.picture(now_us, demand, output, reached, texts)

    def _watch_thrusters(self, dt_s: float) -> None:
        """Tell when one begins to give much less than it is told to, and when it is back."""
        watch = self.propulsion
        if not self.armed:
            watch.clear()
            return
        before, now = watch.weak, watch.step(dt_s, self.state, self._output)
        if now == before:
            return
        for side, was, weak in zip(("Port", "Starboard"), before, now, strict=True):
            if weak and not was:
                self.say(
                    Severity.CRITICAL,
                    f"{side} thruster gives much less than it is told to (suspected): weed, a lost propeller, or a stuck rudder",
                )
            elif was and not weak:
                self.say(Severity.NOTICE, f"{side} thruster gives what it is told again")

    def _measure(self, measurements: Sequence[tuple[Measurement, int]], now_us: int) -> None:
        estimator, guard = self.estimator, self.guard
        for item, source in measurements:
            if estimator.update(item, source) and isinstance(item, Distance):
                guard.measure(item, self.state, source)
        if self._depth_inputs:
            for reading in self._depth_inputs:
                if estimator.update(reading, _GROUND_LINK):
                    guard.measure(reading, self.state, None)
            self._depth_inputs.clear()
        estimator.note_water_speed(self.controller.water_speed_mps())
        self.state = estimator.predict(now_us, self.guard_out.altitude_m)
        self.utc_us = utc_us = estimator.utc_us(now_us)
        self.mission.utc_s_of_day = None if utc_us is None else utc_us * 1e-6 % 86_400.0
        guard.utc_s = 0 if utc_us is None else utc_us // 1_000_000
        if self.started_at is None:
            self.look_where_started()
        if self.mission.home is None:
            self._set_home_here()

    def _steer(self, now_us: int, dt_s: float, intent: Intent) -> ActuatorDemand | None:
        """Turn the intent into a demand; None where there is none (and the gate makes neutral of it)."""
        self.guided, self.desired, self.trace = None, None, _NO_TRACE
        if intent is None:
            self._generation = None
            self.controller.reset(self.state, dt_s, self._output)
            return None
        if isinstance(intent, Sticks):
            self._generation = None
            self.controller.reset(self.state, dt_s, self._output)
            return manual_demand(now_us, intent.surge, intent.yaw, self.config.steering, self.vessel)
        desired = self._course(intent) if isinstance(intent, Steer) else self._path(now_us, dt_s, intent)
        slow = self.guard_out.slow_to_mps
        if slow is not None and desired.speed_mps is not None:
            desired = replace(desired, speed_mps=min(slow, desired.speed_mps))
        self.desired = desired
        if desired.psi_rad is None and desired.speed_mps is None:
            self.controller.reset(self.state, dt_s, self._output)
            return None
        demand, self.trace = self.controller.step(now_us, dt_s, self.state, desired, self._output)
        return demand

    def _course(self, intent: Steer) -> Desired:
        self._generation = None
        psi_rad = intent.psi_rad
        if intent.course and self.state.cog_rad is not None and self.state.psi_rad is not None:
            psi_rad += self.state.psi_rad - self.state.cog_rad if (self.state.sog_mps or 0.0) > 0.5 else 0.0
        return Desired(psi_rad, intent.speed_mps)

    def _path(self, now_us: int, dt_s: float, leg: Leg) -> Desired:
        state, speed_mps = self.state, self.navigator.speed_mps
        if leg.generation != self._generation:
            if not state.position_valid:
                return Desired(None, None)
            self._generation = leg.generation
            self.guidance.begin(
                now_us, state, leg.maneuver, previous=leg.previous, following=leg.following, speed_mps=speed_mps
            )
        self.guided = guided = self.guidance.step(now_us, dt_s, state, speed_mps, self._output)
        return guided.desired

    def _guard(self, now_us: int, *, steers_itself: bool) -> None:
        path_ahead = None if self.guided is None else self.guidance.path_ahead
        self.guard_out = guard = self.guard.step(now_us, self.state, steers_itself, path_ahead, self._stopping)
        if guard.texts:
            self._say_all(guard.texts)
        if guard.abort and self.navigator.mode is not _MANUAL:
            self.break_off()

    def _judge(self, now_us: int) -> None:
        state, before = self.state, self.result.action
        run_m = self._stopping(state.sog_mps or 0.0) if self.fence.enabled else 0.0
        fence = self.fence.check(state, run_m)
        self.fence_status = fence.status
        if fence.texts:
            self._say_all(fence.texts)
        told = self.plan_fence.step(now_us, self.mission.plan, state, self._loiter_radius_m)
        if told is not None:
            self.say(*told)
        monitored = self.monitors.step(
            now_us,
            state,
            self._output,
            desired=self.desired,
            stopped=before >= _STOP,
            late_s=self.inputs.late_s,
            supply=self.board.supply,
            vessel_speed_fn=self.statics.throttle_to_speed,
        )
        self.ages = self.operators.ages(self.inputs.heard, now_us)
        flags = gather(self, now_us, monitored, fence.flags)
        self.result = result = failsafe.step(self.memory, flags, now_us, self._failsafe)
        self.memory = result.memory
        self.outlook = outlook(result.memory, flags, now_us, self._failsafe) if result.memory.entries else ()
        if result.texts:
            self._say_all(result.texts)
        self.ordered, self.rearmed, self.aborting = None, False, False
        if result.action > _WARN:
            self._react(before)

    def _react(self, before: Action) -> None:
        """Change mode as the failsafe asks. Manual is the operator's: thrust may be taken away, the mode not."""
        action = self.result.action
        if action >= Action.DISARM and self.armed:
            self.disarm(", ".join(each.cause for each in self.outlook))
        mode = self.navigator.mode
        if mode is Mode.MANUAL:
            return
        if action in (Action.HOLD, Action.STOP) and mode is not Mode.HOLD:
            self.break_off()
        elif action is Action.RETURN and before is not Action.RETURN and mode is not Mode.RTL:
            # Once only: a vessel that has come home holds there.
            self.break_off(Mode.RTL)

    def _decide(self, now_us: int, demand: ActuatorDemand | None, manual: bool) -> ActuatorOutput:
        inputs, result = self.inputs, self.result
        ready, reason = inputs.actuator_ready, inputs.actuator_reason
        evidence = Evidence(ready, reason, manual, inputs.actuator.emergency_stop, result.thrust_limit)
        if result.action >= _STOP:
            self.navigator.forget_hold()
        self._output = output = self.gate.decide(now_us, demand, result.action, self.armed, evidence)
        return output

    def _follow_up(self, now_us: int) -> None:
        """Let the plan move on, and collect what the parts have to say."""
        if self.guided is not None:
            self.navigator.advance(now_us, self.state, self.guided)
        self._watch_progress(now_us)
        for part in (self.estimator, self.guidance, self.navigator, self.operators):
            texts = part.drain_texts()
            if texts:
                self._say_all(texts)

    def _watch_progress(self, now_us: int) -> None:
        """A plan that is being sailed should get somewhere."""
        guided, mission = self.guided, self.mission
        if (
            guided is None
            or not self.armed
            or self.navigator.mode is not _AUTO
            or mission.state is not PlanState.ACTIVE
        ):
            self._progress.rest()
            return
        texts = self._progress.step(now_us, mission.seq, guided.path, self.state)
        if texts:
            self._say_all(texts)

    def _say_all(self, texts: Sequence[tuple[Severity, str]]) -> None:
        for severity, text in texts:
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
        if texts:
            self._say_all(texts)
        return reached
