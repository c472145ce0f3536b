"""The vessel in one place: runs its parts in one fixed order, once per tick.

estimate → mission → guidance → steering → depth guard → failsafe → gate. Each step takes the values of those before it and returns one
of its own (``ticked.py``). It knows nothing of links or MAVLink; what comes in is measurements and requests, what goes out is one
actuator output and one snapshot. An exception in a part is not caught here: the app answers it with neutral in the same tick.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, assert_never

from mavlink_bridge.language.messages import (
    Action,
    ActuatorDemand,
    ActuatorOutput,
    Desired,
    Distance,
    EstimatedState,
    FenceEnable,
    Mode,
    Noted,
    PlanState,
    SetHome,
    Severity,
)
from mavlink_bridge.language.requests import Reply, Request
from mavlink_bridge.language.snapshot import Snapshot

from ..guard import failsafe
from ..guard.depth.shoal import Going
from ..guard.diagnosis import Cause, words
from ..guard.gate import Evidence
from ..guard.outlook import outlook
from ..guide.leg import Leg
from ..hull import VesselConfig
from ..hull.geometry import SENT_LINK
from ..steer import manual_demand, sway_through_water_mps
from .config import TickInputs, VehicleConfig
from .controls import Controls, Decided
from .flags import flags_of
from .mission import Effect
from .navigator import Intent, Measured, Steer, Sticks
from .orders import Orders
from .parts import make_parts
from .plan_reach import plan_number
from .ticked import Demand, FailsafeVerdict, Guarded, Pursuit, Sensed, Ticked
from .view import View

_COURSE_MPS: Final = 0.5
"""Slower than this the course over ground is the receiver's noise, and a course to steer is steered as a heading."""
_ASTERN: Final = -1.0
"""The guard's braking: all that the thrusters have; the gate keeps it within the hull's limits."""
_LOW: Final = "the battery is low, and the next run asks for full thrust"
_REVERSED: Final = "pushes against what it is told (suspected): look at its wiring and its propeller"
_MIRRORED: Final = (
    "The helm turns the boat the wrong way (suspected): thrusters changed over, or a rudder servo mirrored"
)
_UNMEASURED: Final = "a thruster gives too little to be measured; if both are sound the file is far off, rudders that are not there for one"
_WEAK: Final = "gives much less than it is told to (suspected): weed, a lost propeller, or a stuck rudder"


class Vehicle:
    """The vessel's decisions. In each control period: ``bring`` what was measured, ``handle`` requests, then one ``tick``."""

    def __init__(self, config: VehicleConfig, vessel: VesselConfig, sources: Sequence[str] = ()) -> None:
        """``sources``: names of the sensor links, in the order of their numbers."""
        self.parts = make_parts(config, vessel, sources)
        self.controls = Controls(config, self.parts)
        self._orders = Orders(self.controls)
        self._view = View(self.controls)

    def bring(self, inputs: TickInputs) -> None:
        """What this control period brings: orders look at it, and the tick."""
        self.controls.inputs = inputs

    def handle(self, request: Request, now_us: int) -> Reply:
        """Carry out a request at a tick boundary and answer it."""
        return self._orders.handle(request, now_us)

    def tick(self, now_us: int) -> Snapshot:
        """Run one control period."""
        controls, before = self.controls, self.controls.last
        sensed = self._sense(now_us, before)
        intent = self._intend(sensed, before)
        course = self._steer_for(sensed, intent, before)
        demand = self._demand(sensed, course, before)
        guarded = self._guard(sensed, course, before)
        verdict = self._judge(sensed, course, guarded, before)
        demand = _braked(sensed, course, demand, guarded)
        output = self._decide(sensed, course, demand, verdict)
        controls.last = ticked = Ticked(
            number=before.number + 1,
            sensed=sensed,
            course=course,
            demand=demand,
            guarded=guarded,
            verdict=verdict,
            output=output,
        )
        reached = self._follow_up(ticked)
        return self._view.picture(ticked, reached, controls.voice.take())

    # ---- sensed

    def _sense(self, now_us: int, before: Ticked) -> Sensed:
        """Take in the measurements, and what follows at once from where the vessel is."""
        controls, parts, inputs = self.controls, self.parts, self.controls.inputs
        dt_s = (now_us - controls.sensed.now_us) * 1e-6 if before.number else 0.0
        controls.voice.now_us = now_us
        self._measure(inputs)
        self._tell_motion(now_us, dt_s, before)
        state = parts.estimator.predict(now_us, before.guarded.depth.altitude_m)
        utc_us = parts.estimator.utc_us(now_us)
        parts.mission.utc_s_of_day = None if utc_us is None else utc_us * 1e-6 % 86_400.0
        parts.guard.utc_s = 0 if utc_us is None else utc_us // 1_000_000
        board = parts.board.step(
            inputs.actuator, inputs.actuator_faults, ready=inputs.actuator_ready, armed=controls.armed
        )
        others = parts.traffic.step(now_us, state, utc_us, inputs.ais, line_alive=inputs.ais_alive)
        controls.voice.say_all(parts.traffic.drain_texts())
        controls.sensed = sensed = Sensed(now_us, dt_s, inputs, state, board=board, utc_us=utc_us, others=others)
        controls.look_for_home(now_us, utc_us)
        self._diagnose(sensed, before)
        self._watch_thrusters(sensed, before)
        controls.watch_compass(now_us)
        return controls.sensed

    def _measure(self, inputs: TickInputs) -> None:
        estimator, guard, state = self.parts.estimator, self.parts.guard, self.controls.state
        for item, source in inputs.measurements:
            if estimator.update(item, source) and isinstance(item, Distance):
                guard.measure(item, state, source)
        for reading in self.controls.take_soundings():
            if estimator.update(reading, SENT_LINK):
                guard.measure(reading, state, None)

    def _tell_motion(self, now_us: int, dt_s: float, before: Ticked) -> None:
        """Tell the estimator what the vessel should do by what was sent."""
        parts, state = self.parts, self.controls.state
        estimator, u_mps = parts.estimator, parts.controller.water_speed_mps()
        estimator.note_water_speed(u_mps, sway_through_water_mps(parts.controller))
        measured_radps = None if estimator.turns_unseen or state.psi_rad is None else state.r_radps or 0.0
        through_mps = (state.u_mps or 0.0) if u_mps is None else u_mps
        estimator.note_turn(now_us, dt_s, parts.turned.step(dt_s, before.output, through_mps, measured_radps))

    def _watch_thrusters(self, sensed: Sensed, before: Ticked) -> None:
        """Tell when one begins to give much less than it is told to, and when it is back."""
        watch, say = self.parts.propulsion, self.controls.voice.say
        if not self.controls.armed:
            if watch.clear():
                self.controls.use_thrusters(watch.shares)
            return
        mirrored, was_late = watch.helm_mirrored, watch.late.told_s > 0.0
        was, shares, said = watch.weak, watch.shares, self.parts.diagnosis
        watch.on_trial = self.parts.navigator.on_trial
        watch.has_turn_rate = self.parts.estimator.has_turn_rate(sensed.now_us)
        now = watch.step(sensed.dt_s, sensed.state, before.output, said.opinion, said.told, before_mps=said.before_mps)
        if watch.helm_mirrored and not mirrored:
            say(Severity.CRITICAL, _MIRRORED)
        if watch.late.told_s and not was_late:
            say(Severity.WARNING, watch.late.words)
        if watch.shares != shares:
            self.controls.use_thrusters(watch.shares)
        for side, was_weak, weak in zip(("Port", "Starboard"), was, now, strict=True):
            if weak and not was_weak:
                say(Severity.CRITICAL, f"{side} thruster {_REVERSED if watch.reversed else _WEAK}")
                self.parts.navigator.abandon_trial(_UNMEASURED)
            elif was_weak and not weak:
                say(Severity.NOTICE, f"{side} thruster gives what it is told again")

    def _diagnose(self, sensed: Sensed, before: Ticked) -> None:
        """Tell what may be wrong with thrusters and rudders; what is known already explains all the rest."""
        diagnosis, watch, estimator = self.parts.diagnosis, self.parts.propulsion, self.parts.estimator
        self.controls.voice.say_all(diagnosis.heed(sensed.now_us, heading_wrong=estimator.heading_proven_wrong))
        if not self.controls.armed:
            diagnosis.clear()
            return
        # a compass that repeats itself looks like rudders that do nothing, until it is named
        blind = estimator.turns_unseen and not (
            sensed.state.heading_from_course or estimator.has_turn_rate(sensed.now_us)
        )
        if any(watch.weak) or watch.helm_mirrored or watch.late.told_s or blind:
            diagnosis.rest()
            return
        cause = diagnosis.step(sensed.dt_s, sensed.state, before.output)
        if cause is not None and not (watch.late.explains and cause in (Cause.SWAPPED, Cause.RUDDERS_REVERSED)):
            self.controls.voice.say(Severity.WARNING, words(cause))

    # ---- course and demand

    def _intend(self, sensed: Sensed, before: Ticked) -> Intent:
        """What the mode in force wants done; None while disarmed or stopped."""
        controls, parts = self.controls, self.parts
        if parts.plan_reach.is_new(parts.mission.plan, plan_number(sensed.inputs.plan_ids[0]), sensed.state):
            controls.look_at_reach()
        may_move = controls.armed and before.verdict.result.action < Action.STOP
        return parts.navigator.intent(sensed.now_us, sensed.state) if may_move else None

    def _steer_for(self, sensed: Sensed, intent: Intent, before: Ticked) -> Pursuit:
        """Turn the intent into a heading and a speed; sticks and nothing have neither."""
        match intent:
            case None | Sticks() | Measured():
                return Pursuit(intent)
            case Steer():
                course = Pursuit(intent, self._heading(sensed, intent))
            case Leg():
                course = self._sail(sensed, intent, before)
            case _:
                assert_never(intent)
        return course.over(before.guarded.depth)

    def _heading(self, sensed: Sensed, intent: Steer) -> Desired:
        """A heading as it is; a course as the heading that makes it good, by what wind and current do now."""
        state, psi_rad = sensed.state, intent.psi_rad
        if intent.course:
            made_good = self.parts.guidance.follower.heading_for(state, psi_rad, intent.speed_mps)
            psi_rad = psi_rad + _leeway_rad(state) if made_good is None else made_good
        return Desired(psi_rad, intent.speed_mps)

    def _sail(self, sensed: Sensed, leg: Leg, before: Ticked) -> Pursuit:
        """Let guidance sail a leg; one that is new begins here, once the position is known."""
        guidance, state, speed_mps = self.parts.guidance, sensed.state, self.parts.navigator.speed_mps
        if leg.generation != before.course.generation:
            if not state.position_valid:
                return Pursuit(leg, Desired(None, None), generation=before.course.generation)
            guidance.begin(sensed.now_us, state, leg.maneuver, previous=leg.previous, following=leg.following)
        guided = guidance.step(sensed.now_us, sensed.dt_s, state, speed_mps, before.output)
        return Pursuit(leg, guided.desired, guided, leg.generation)

    def _demand(self, sensed: Sensed, course: Pursuit, before: Ticked) -> Demand:
        """Turn the course into a demand; None where there is none (and the gate makes neutral of it)."""
        controller, desired, intent = self.parts.controller, course.desired, course.intent
        if desired is None or (desired.psi_rad is None and desired.speed_mps is None):
            controller.reset(sensed.state, sensed.dt_s, before.output)
            if not isinstance(intent, Sticks | Measured):
                return Demand()
            steering, vessel = self.controls.config.steering, self.parts.vessel
            mixed = not (isinstance(intent, Measured) and intent.rudders_alone)
            return Demand(manual_demand(sensed.now_us, intent.surge, intent.yaw, steering, vessel, mixed=mixed))
        actuators, trace = controller.step(sensed.now_us, sensed.dt_s, sensed.state, desired, before.output)
        return Demand(actuators, trace)

    # ---- guarded, verdict, output

    def _guard(self, sensed: Sensed, course: Pursuit, before: Ticked) -> Guarded:
        """Let those look who may stop the vessel, and say what they have to say."""
        controls, parts, state = self.controls, self.parts, sensed.state
        depth = parts.guard.step(
            sensed.now_us,
            state,
            controls.armed and course.intent is not None and not isinstance(course.intent, Sticks),
            None if course.guided is None else parts.guidance.path_ahead,
            controls.stopping_distance_m,
            braking=controls.braking,
            going=Going(course.guided is not None and course.guided.holds, parts.navigator.turns_at_rest),
        )
        controls.voice.say_all(depth.texts)
        if depth.abort and parts.navigator.mode is not Mode.MANUAL:
            controls.break_off("depth guard")
        run_m = controls.stopping_distance_m(state.sog_mps or 0.0) if parts.fence.enabled else 0.0
        is_steered = controls.armed and before.verdict.result.action < Action.HOLD
        ahead_m = _straight_m(course) if is_steered else None
        fence = parts.fence.check(state, run_m, straight_m=ahead_m, by_hand=parts.navigator.mode is Mode.MANUAL)
        controls.voice.say_all(fence.texts)
        radius_m = controls.config.guidance.loiter_radius_m
        for told in (
            parts.plan_fence.step(sensed.now_us, parts.mission.plan, state, radius_m),
            parts.mission.havens.step(sensed.now_us, state),
        ):
            if told is not None:
                controls.voice.say(*told)
        monitors = parts.monitors.step(
            sensed.now_us,
            state,
            before.output,
            desired=course.desired,
            stopped=before.verdict.result.action >= Action.STOP,
            late_s=sensed.inputs.late_s,
            supply=sensed.board.supply,
            vessel_speed_fn=parts.statics.throttle_to_speed,
            leapt_m=parts.estimator.leapt_m,
        )
        return Guarded(depth, fence, monitors)

    def _judge(self, sensed: Sensed, course: Pursuit, guarded: Guarded, before: Ticked) -> FailsafeVerdict:
        """Let the failsafe judge, and change mode as it asks."""
        controls, config, now_us = self.controls, self.controls.config.failsafe, sensed.now_us
        memory = before.verdict.result.memory
        returns = memory.action is Action.RETURN or controls.returns_by_order
        standing = {*memory.entries, "fence_ahead"} if guarded.fence.flags.fence_ahead and returns else memory.entries
        flags = flags_of(controls, sensed, course, guarded, standing=standing)
        result = failsafe.step(memory, flags, now_us, config)
        verdict = FailsafeVerdict(
            result, outlook(result.memory, flags, now_us, config, result.action) if result.memory.entries else ()
        )
        controls.voice.say_all([*guarded.monitors.told_since(before.guarded.monitors), *result.texts])
        controls.decided = Decided()
        if guarded.monitors.battery_low:
            self.parts.navigator.abandon_trial(_LOW, at_next=True)
        if result.action > Action.WARN:
            self._react(verdict, before.verdict.result.action, by_hand=flags.helm.manual)
        return verdict

    def _react(self, verdict: FailsafeVerdict, before: Action, *, by_hand: bool) -> None:
        """Change mode as the failsafe asks. Manual is the operator's: thrust may be taken away, the mode not, but to bring her home.

        ``by_hand``: sticks steer, or may do so in a moment.
        """
        controls, action = self.controls, verdict.result.action
        if action >= Action.DISARM and controls.armed:
            controls.disarm(", ".join(verdict.authors))
        mode = self.parts.navigator.mode
        if by_hand or (mode is Mode.MANUAL and action is not Action.RETURN):
            return
        if action in (Action.HOLD, Action.STOP) and mode is not Mode.HOLD:
            controls.break_off(verdict.author)
        elif action is Action.RETURN and before is not Action.RETURN and mode is not Mode.RTL:
            # Once only: a vessel that has come home holds there.
            controls.break_off(verdict.author, Mode.RTL)

    def _decide(self, sensed: Sensed, course: Pursuit, demand: Demand, verdict: FailsafeVerdict) -> ActuatorOutput:
        """Ask the gate."""
        inputs, result, manual = sensed.inputs, verdict.result, isinstance(course.intent, Sticks)
        parts = self.parts
        if result.action >= Action.STOP:
            parts.navigator.forget_hold()
        evidence = Evidence(
            inputs.actuator_ready,
            inputs.actuator_reason,
            manual,
            inputs.actuator.emergency_stop,
            parts.statics.most_command(result.thrust_share),
        )
        return parts.gate.decide(sensed.now_us, demand.actuators, result.action, self.controls.armed, evidence)

    # ---- afterwards

    def _follow_up(self, ticked: Ticked) -> tuple[int, ...]:
        """Let the plan move on, and say what the parts have to say; return the items that were reached."""
        parts, sensed, guided, say_all = self.parts, ticked.sensed, ticked.course.guided, self.controls.voice.say_all
        self._watch_progress(ticked)  # before the plan moves on: what is left to go is this item's
        if guided is not None:
            parts.navigator.advance(sensed.now_us, sensed.state, guided)
        for part in (parts.estimator, parts.guidance, parts.navigator, parts.operators):
            say_all(part.drain_texts())
        reached, effects = parts.mission.drain()
        for effect in effects:
            self._take_effect(effect)
        say_all(parts.mission.drain_texts())
        return reached

    def _watch_progress(self, ticked: Ticked) -> None:
        """A plan that is being sailed should get somewhere."""
        parts, guided, mission = self.parts, ticked.course.guided, self.parts.mission
        in_auto = parts.navigator.mode is Mode.AUTO and mission.state is PlanState.ACTIVE
        if guided is None or not self.controls.armed or not in_auto:
            parts.progress.rest()
            return
        sensed = ticked.sensed
        self.controls.voice.say_all(parts.progress.step(sensed.now_us, mission.seq, guided, sensed.state))

    def _take_effect(self, effect: Effect) -> None:
        """What an item of the plan does beside sailing."""
        controls = self.controls
        match effect:
            case SetHome():
                controls.set_home(effect.lat_rad, effect.lon_rad)
            case FenceEnable():
                controls.enable_fence(effect.enable)
            case Noted():
                controls.voice.say(Severity.INFO, f"item {effect.seq} ({effect.name}) noted, nothing done")
            case _:
                assert_never(effect)


def _braked(sensed: Sensed, course: Pursuit, demand: Demand, guarded: Guarded) -> Demand:
    """The depth guard may take the way off with astern thrust; sticks stay the operator's."""
    if not guarded.depth.flags.depth_braking or isinstance(course.intent, Sticks):
        return demand
    return replace(demand, actuators=ActuatorDemand(sensed.now_us, _ASTERN, _ASTERN))


def _leeway_rad(state: EstimatedState) -> float:
    """How far the bow is off the course over ground: all that a law which knows no speed through the water can tell."""
    if state.cog_rad is None or state.psi_rad is None or (state.sog_mps or 0.0) <= _COURSE_MPS:
        return 0.0
    return state.psi_rad - state.cog_rad


def _straight_m(course: Pursuit) -> float | None:
    """How far the vessel is going to keep its course: to the next point of a leg; None on a figure."""
    if course.guided is None:
        return math.inf
    path = course.guided.path
    if path.orbit_radius_m is not None or path.eight is not None:
        return None
    return math.inf if path.distance_m is None else path.distance_m
