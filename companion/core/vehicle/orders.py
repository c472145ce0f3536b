"""What each request of a ground station does to the vessel, and what it is refused for.

One method for each kind of request, found by its type. A refusal says why in one sentence and changes nothing. An order that
sets the vessel moving lifts a latched stop, but never a locked guard or a termination.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Any, Final, assert_never, get_args

from mavlink_bridge.language.messages import GuardState, Mode, PlanState, Severity
from mavlink_bridge.language.requests import (
    ACCEPTED,
    FORGET_MAX_M,
    Arm,
    DistanceInput,
    EnableFence,
    EraseLogs,
    ForgetDepth,
    GuidedHeading,
    GuidedTarget,
    LoadPlan,
    ManualInput,
    Orbit,
    PausePlan,
    Reboot,
    Reply,
    Reposition,
    Request,
    RequestBody,
    Result,
    RtcmData,
    RunPrearmChecks,
    SetCurrent,
    SetHomePosition,
    SetMode,
    SetParameter,
    SetSpeed,
    StartPlan,
    TakeCommand,
    Terminate,
    UnlockGuard,
)
from mavlink_bridge.language.stations import Station
from mavlink_bridge.language.trials import SeaTrial, TrialOrder
from mavlink_bridge.language.units import clamp

from ..guard.failsafe import deaf_sticks, stopped_by
from ..guard.failsafe_orders import BY_MODE, Order
from ..hull.statics import throttle_to_speed, top_speed_mps
from . import insist
from .arming import LEFT_IN, KeptOrder, LeftOrder, order_words
from .controls import Controls
from .flags import by_shoal
from .refusals import (
    far_refusal,
    hold_refusal,
    motion_refusal,
    prearm_reasons,
    start_refusal,
    target_refusal,
    trial_area,
)


def _reply(refusal: str, result: Result = Result.REJECTED_NOW) -> Reply:
    return Reply(result, refusal) if refusal else ACCEPTED


def _speed_refusal(controls: Controls, speed_mps: float | None) -> str:
    limit_mps = top_speed_mps(controls.parts.vessel)
    fits = speed_mps is None or 0.0 < speed_mps <= limit_mps
    return "" if fits else f"speed {speed_mps:.2f} m/s is outside 0...{limit_mps:.2f}"


def _ordered_refusal(controls: Controls, body: Reposition | Orbit) -> str:
    refusal = target_refusal(controls, body.lat_rad, body.lon_rad) or far_refusal(controls, body.lat_rad, body.lon_rad)
    return refusal or _speed_refusal(controls, body.speed_mps or None)


def _forget_depth(controls: Controls, body: ForgetDepth) -> str:
    """Forget own soundings around a place and tell which; return a refusal or an empty string."""
    lat_rad, lon_rad = body.lat_rad, body.lon_rad
    if lat_rad is None or lon_rad is None:
        lat_rad, lon_rad = controls.state.lat_rad, controls.state.lon_rad
    if lat_rad is None or lon_rad is None:
        return "no position"
    if not 0.0 < body.radius_m <= FORGET_MAX_M:
        return f"depths are forgotten within {FORGET_MAX_M:g} m at most"
    if controls.parts.guard.memory is None:
        return "there is no depth memory (depth.memory.enabled)"
    cells, least_m = controls.parts.guard.forget(lat_rad, lon_rad, body.radius_m)
    where = f"within {body.radius_m:g} m"
    if least_m is None:
        controls.voice.say(Severity.NOTICE, f"No depths remembered {where}")
    else:
        controls.voice.say(
            Severity.WARNING, f"Forgot {cells} sounded cells {where}, shallowest {least_m:.2f} m; charts stay"
        )
    return ""


class Orders:
    """Carries out requests on one controls."""

    def __init__(self, controls: Controls) -> None:
        self._controls, self._left, self._kept = controls, LeftOrder(), KeptOrder()

    def handle(self, request: Request, now_us: int) -> Reply:
        """Carry out a request; UNSUPPORTED for a kind that the vessel itself does not answer."""
        if isinstance(request.body, TakeCommand):
            return self._controls.parts.operators.asked(request.body, request.station, now_us)
        controls, station = self._controls, request.station
        body = request.body if by_shoal(controls) else self._kept.meant(request.body, controls.interrupted)
        method = _METHODS.get(type(body))
        if method is None:
            return Reply(Result.UNSUPPORTED, f"{type(body).__name__} is not supported")
        by_hand, order = controls.parts.navigator.mode is Mode.MANUAL, order_of(body)
        refusal = controls.parts.operators.objection(body, station, now_us, manual=by_hand)
        if not refusal and body.nature.moves:
            refusal = motion_refusal(controls, now_us, order)
        if not refusal and order is Order.HOLD and isinstance(body, SetMode | PausePlan):
            refusal = hold_refusal(controls, now_us)
        if refusal:
            return Reply(Result.REJECTED_NOW, refusal)
        if order is not None:
            controls.parts.mission.havens.begin_anew()
        stood = controls.parts.navigator.standing
        reply = method(self, body, station, now_us)
        if reply.result is not Result.ACCEPTED:
            return reply
        if order is not None or isinstance(body, GuidedHeading | GuidedTarget):
            self._kept.given(body, controls.parts.navigator, stood)
        if body is not request.body and (words := order_words(controls.parts.navigator, controls.state)):
            controls.voice.say(Severity.NOTICE, f"Going on: {words}")
        controls.parts.operators.obeyed(body, station, now_us, manual=by_hand)
        controls.parts.operators.has_set(body, station, armed=controls.armed)
        if body.nature.moves:
            self._left.given(station)
        return reply if order is None else self._acted(order, station, reply)

    def _acted(self, order: Order, station: Station | None, reply: Reply) -> Reply:
        """The failsafes hear of an order; a bystander's Hold leaves a boat that one has stopped as she lies, and says so."""
        controls = self._controls
        aside = order is Order.HOLD and station is not None and station.bystander
        controls.operator_acted(Order.BYSTANDER_HOLD if aside else order)
        lies = stopped_by(controls.last.verdict.result.memory, controls.config.failsafe) if aside else ""
        if lies and controls.armed:
            return replace(reply, reason=f"she lies stopped: {lies}; Hold by a station would hold her")
        return reply

    def arm(self, body: Arm, station: Station | None, now_us: int) -> Reply:
        controls = self._controls
        if not body.arm:
            why = "operator abort" if body.force else "by the operator"
            if controls.interrupted is None:
                self._kept.drop()  # what a failsafe broke off goes on after the disarming that it may ask for
            controls.disarm(why, abort=body.force, by_operator=True)
            return ACCEPTED
        reasons = prearm_reasons(controls, now_us, force=body.force)
        if reasons:
            mend = "" if body.force or prearm_reasons(controls, now_us, force=True) else f"; {insist.FORCE}"
            why = "; ".join(reasons)
            return Reply(Result.REJECTED_NOW, why if "by force" in why else why + mend)
        if not controls.armed:
            controls.parts.mission.havens.begin_anew()
            controls.voice.say_all(self._left.at_arming(controls.parts, controls.state, station))
        controls.arm(now_us)
        return ACCEPTED

    def set_mode(self, body: SetMode, station: Station | None, now_us: int) -> Reply:
        if body.mode is Mode.MANUAL:
            self._controls.take_sticks(station, now_us)
            self._tell_deaf_sticks()
        return self._enter(body.mode)

    def _tell_deaf_sticks(self) -> None:
        """Manual is never refused, so who takes it is told where a failsafe lets no sticks through."""
        controls = self._controls
        until = deaf_sticks(controls.last.verdict.result.memory, controls.config.failsafe)
        if controls.armed and until:
            controls.voice.say(Severity.WARNING, f"Manual: sticks move nothing {until}")

    def _enter(self, mode: Mode) -> Reply:
        """Change mode; a plan that would leave the fence is not sailed, and what is done already goes on."""
        controls, navigator = self._controls, self._controls.parts.navigator
        is_done = mode is navigator.mode and mode in LEFT_IN and navigator.standing is not None
        if is_done and controls.armed and navigator.trial is None:
            return ACCEPTED
        refusal = start_refusal(controls) if mode is Mode.AUTO else ""
        begins = mode is Mode.AUTO and controls.parts.mission.state not in (PlanState.PAUSED, PlanState.ACTIVE)
        refusal = refusal or controls.parts.navigator.enter(mode, controls.state)
        if begins and not refusal:
            controls.parts.plan_reach.begin(controls.parts.mission.plan, controls.state)
        return _reply(refusal)

    def start_plan(self, body: StartPlan, station: Station | None, now_us: int) -> Reply:
        controls = self._controls
        if not controls.armed:
            return Reply(Result.REJECTED_NOW, "not armed")
        first = body.first if body.first else (0 if controls.parts.navigator.mode is not Mode.AUTO else None)
        refusal = start_refusal(controls, first)
        if not refusal and controls.parts.navigator.mode is not Mode.AUTO:
            refusal = controls.parts.navigator.enter(Mode.AUTO, controls.state)
        refusal = refusal or controls.parts.mission.start(first, body.last)
        if first is not None and not refusal:
            controls.parts.plan_reach.begin(controls.parts.mission.plan, controls.state)
        return _reply(refusal)

    def pause(self, body: PausePlan, station: Station | None, now_us: int) -> Reply:
        return self._enter(Mode.HOLD if body.pause else Mode.AUTO)

    def set_current(self, body: SetCurrent, station: Station | None, now_us: int) -> Reply:
        controls = self._controls
        if controls.parts.navigator.mode is Mode.AUTO and controls.parts.mission.state is PlanState.ACTIVE:
            far = controls.reach_refusal(body.seq, under_way=True)
            if far:
                return Reply(Result.REJECTED_NOW, far)
        return _reply(controls.parts.mission.set_current(body.seq, reset=body.reset), Result.DENIED)

    def reposition(self, body: Reposition, station: Station | None, now_us: int) -> Reply:
        controls = self._controls
        if not body.change_mode and controls.parts.navigator.mode is not Mode.GUIDED:
            return Reply(Result.REJECTED_NOW, "not in Guided mode, and the command does not ask to change it")
        refusal = _ordered_refusal(controls, body)
        return (
            _reply(refusal, Result.DENIED)
            if refusal
            else _reply(controls.parts.navigator.reposition(body, controls.state))
        )

    def orbit(self, body: Orbit, station: Station | None, now_us: int) -> Reply:
        controls = self._controls
        refusal = _ordered_refusal(controls, body)
        return (
            _reply(refusal, Result.DENIED) if refusal else _reply(controls.parts.navigator.orbit(body, controls.state))
        )

    def sea_trial(self, body: SeaTrial, station: Station | None, now_us: int) -> Reply:
        navigator = self._controls.parts.navigator
        match body.order:
            case TrialOrder.BEGIN:
                area = trial_area(self._controls, body)
                turn_s = self._controls.config.fence.turn_s
                begun = (
                    area if isinstance(area, str) else navigator.begin_trial(body, self._controls.state, area, turn_s)
                )
                return _reply(begun)
            case TrialOrder.LOOK:
                return self._look_at_trial(body)
            case TrialOrder.CONFIRM:
                return _reply(navigator.confirm_trial())
            case TrialOrder.TELL:
                return _reply(navigator.tell_trial())
            case TrialOrder.END:
                return _reply(navigator.stop_trial())
            case _ as never:
                assert_never(never)

    def _look_at_trial(self, body: SeaTrial) -> Reply:
        """Say whether a sea trial may begin here, as an order to begin would find it."""
        area = trial_area(self._controls, body)
        if isinstance(area, str):
            return Reply(Result.REJECTED_NOW, area)
        self._controls.voice.say(Severity.NOTICE, f"A sea trial may begin here: {area.words}")
        return ACCEPTED

    def set_speed(self, body: SetSpeed, station: Station | None, now_us: int) -> Reply:
        speed = body.speed_mps
        if speed is None and body.throttle is not None:
            speed = throttle_to_speed(self._controls.parts.vessel, body.throttle)
        refusal = _speed_refusal(self._controls, speed)
        if refusal:
            return Reply(Result.DENIED, refusal)
        self._controls.parts.navigator.set_speed(speed)
        self._kept.take_speed(speed)
        return ACCEPTED

    def guided_heading(self, body: GuidedHeading, station: Station | None, now_us: int) -> Reply:
        controls = self._controls
        speed = body.speed_mps
        if speed is None and body.throttle is not None:
            speed = throttle_to_speed(controls.parts.vessel, body.throttle)
        if speed is None:
            speed = controls.parts.navigator.speed_mps
        top_mps = top_speed_mps(controls.parts.vessel)
        if body.stream:
            speed = clamp(speed, -top_mps, top_mps)
        refusal = _speed_refusal(controls, abs(speed) or None)
        if refusal:
            return Reply(Result.DENIED, refusal)
        return _reply(controls.parts.navigator.steer(body, speed, controls.state, now_us))

    def guided_target(self, body: GuidedTarget, station: Station | None, now_us: int) -> Reply:
        controls = self._controls
        refusal = target_refusal(controls, body.lat_rad, body.lon_rad)
        return (
            _reply(refusal, Result.DENIED)
            if refusal
            else _reply(controls.parts.navigator.target(body, controls.state, now_us))
        )

    def manual(self, body: ManualInput, station: Station | None, now_us: int) -> Reply:
        owner = self._controls.manual_owner(station, now_us)
        if owner is not None and owner != station:
            who = str(owner) if station is None else owner.beside(station)
            return Reply(Result.DENIED, f"{who} has the sticks")
        self._controls.parts.navigator.sticks(body, now_us)
        return ACCEPTED

    def set_home(self, body: SetHomePosition, station: Station | None, now_us: int) -> Reply:
        return _reply(self._controls.set_home(body.lat_rad, body.lon_rad))

    def terminate(self, body: Terminate, station: Station | None, now_us: int) -> Reply:
        self._controls.terminate("terminated by the operator")
        return ACCEPTED

    def fence(self, body: EnableFence, station: Station | None, now_us: int) -> Reply:
        return _reply(self._controls.enable_fence(body.enable))

    def distance(self, body: DistanceInput, station: Station | None, now_us: int) -> Reply:
        self._controls.depth_input(body, now_us)
        return ACCEPTED

    def prearm(self, body: RunPrearmChecks, station: Station | None, now_us: int) -> Reply:
        if self._controls.armed:
            return Reply(Result.REJECTED_NOW, "armed already: these are the checks before arming")
        for reason in prearm_reasons(self._controls, now_us):
            self._controls.voice.say(Severity.WARNING, f"PreArm: {reason}")
        return ACCEPTED

    def unlock(self, body: UnlockGuard, station: Station | None, now_us: int) -> Reply:
        if self._controls.guard_state is not GuardState.LOCKED:
            return Reply(Result.DENIED, "the depth guard is not locked")
        self._controls.unlock_guard()
        return ACCEPTED

    def forget_depth(self, body: ForgetDepth, station: Station | None, now_us: int) -> Reply:
        return _reply(_forget_depth(self._controls, body))


def order_of(body: RequestBody) -> Order | None:
    """What a person has decided with this request; None = nothing that a failsafe looks at."""
    if not body.nature.decides:
        return None
    match body:
        case SetMode():
            return BY_MODE[body.mode]
        case PausePlan():
            return Order.HOLD if body.pause else Order.AUTO
        case StartPlan():
            return Order.AUTO
        case _:
            return Order.HOLD if body.nature.stops else Order.GUIDED


_METHODS: Final[dict[type, Callable[[Orders, Any, Station | None, int], Reply]]] = {
    Arm: Orders.arm,
    SetMode: Orders.set_mode,
    StartPlan: Orders.start_plan,
    PausePlan: Orders.pause,
    SetCurrent: Orders.set_current,
    Reposition: Orders.reposition,
    Orbit: Orders.orbit,
    SetSpeed: Orders.set_speed,
    GuidedHeading: Orders.guided_heading,
    GuidedTarget: Orders.guided_target,
    ManualInput: Orders.manual,
    SetHomePosition: Orders.set_home,
    Terminate: Orders.terminate,
    EnableFence: Orders.fence,
    DistanceInput: Orders.distance,
    RunPrearmChecks: Orders.prearm,
    UnlockGuard: Orders.unlock,
    ForgetDepth: Orders.forget_depth,
    SeaTrial: Orders.sea_trial,
}

BY_THE_PROCESS: Final = frozenset({LoadPlan, SetParameter, Reboot, EraseLogs, RtcmData, TakeCommand})
"""Requests that the process around the vessel carries out: they need its store, its logs, its links or its stations."""


def without_order(bodies: Collection[type]) -> list[str]:
    """Names of requests that nobody would carry out."""
    return sorted(body.__name__ for body in bodies if body not in _METHODS and body not in BY_THE_PROCESS)


if without_order(get_args(RequestBody)):
    raise ImportError(f"no order carries out {', '.join(without_order(get_args(RequestBody)))}")
