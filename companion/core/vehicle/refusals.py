"""Why the vessel says no: before arming, to a plan, to a target, to an order that would set it moving.

Each answer is one plain sentence, or nothing. These only look; they change nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from mavlink_bridge.language.geodesy import inverse
from mavlink_bridge.language.messages import Goto, GuardState, Loiter, Mode, PlanState
from mavlink_bridge.language.points import LatLon, NorthEast
from mavlink_bridge.language.requests import LoadPlan
from mavlink_bridge.language.trials import SeaTrial, TrialOrder

from ..guard import failsafe
from ..guard.depth.grid import PlanLeg
from ..guard.depth.plan_legs import plan_legs
from ..guard.failsafe_orders import Order
from ..hull.statics import throttle_to_speed, top_speed_mps
from ..trial import LEAST_RADIUS_M, MOST_RADIUS_M, TrialArea, free_around
from . import arming, insist
from .controls import Controls
from .plan_reach import shown, speed_refusal

LYING_M: Final = 20.0
"""A vessel at its berth swings on its lines, and a receiver without corrections wanders by some metres."""
LYING_MPS: Final = 0.5
"""Above the speed noise of such a receiver; any current that carries a vessel away brings it out of ``LYING_M`` soon."""


def prearm_reasons(controls: Controls, now_us: int, *, force: bool = False) -> tuple[str, ...]:
    """Return why the vessel must not be armed now; empty when it may. On a voyage only what the gate needs: it is no departure."""
    inputs, causes = controls.inputs, controls.last.verdict.result.causes
    if controls.parts.gate.terminated:
        return ("terminated: restart first",)
    if force or controls.voyage.has_begun(now_us):
        return _forced(controls)
    barred = () if controls.voyage.has_sailed else inputs.barred
    return barred + arming.reasons(
        mode=controls.parts.navigator.mode,
        state=controls.state,
        actuator_ready=inputs.actuator_ready,
        actuator_reason=inputs.actuator_reason,
        emergency_stop=inputs.actuator.emergency_stop,
        holding_causes=failsafe.holding(controls.last.verdict.result.memory, controls.config.failsafe),
        guard=controls.parts.guard.state if controls.config.depth.enabled else GuardState.UNKNOWN,
        guard_reason=controls.parts.guard.refusal(now_us),
        depth_required=controls.config.depth.required,
        altitude_known=controls.last.guarded.depth.altitude_m is not None,
        fence=controls.last.guarded.fence.status,
        battery_low="battery_low" in causes,
        battery_lost="battery_lost" in causes,
        sources_disagree=controls.parts.estimator.sources_disagree,
        compasses_apart=controls.parts.estimator.compasses_apart,
        gcs_required=controls.config.operator.gcs_required,
        gcs_heard=controls.parts.operators.hears(inputs.heard),
        plan_needed=True,
        plan_loaded=bool(controls.parts.mission.total),
        plan_refusal=start_refusal(controls, from_here=False) if controls.parts.navigator.mode is Mode.AUTO else "",
    )


def _forced(controls: Controls) -> tuple[str, ...]:
    """A forced arm passes over all checks but the actuators' own."""
    return () if controls.inputs.actuator_ready else (f"actuators not ready: {controls.inputs.actuator_reason}",)


def plan_refusal(controls: Controls, body: LoadPlan) -> str:
    """Return why a plan that is sound on the wire is still refused by this vessel, or an empty string."""
    too_fast = speed_refusal(body.plan.maneuvers, top_speed_mps(controls.parts.vessel))
    if too_fast:
        return too_fast
    legs = plan_legs(body.plan.maneuvers, controls.here, controls.config.guidance.loiter_radius_m)
    shallow = controls.parts.guard.check_plan(legs)
    return "" if shallow is None else f"item {shallow.seq}: {shallow.reason}; {insist.CHART}"


def start_refusal(controls: Controls, first: int | None = None, *, from_here: bool = True) -> str:
    """Return why the plan must not be sailed from item ``first`` (None: where it stands) on, or an empty string."""
    if first is None:
        first = 0 if controls.parts.mission.state is PlanState.COMPLETE else controls.parts.mission.seq
    controls.parts.plan_fence.renew(
        controls.parts.mission.plan, controls.state, controls.config.guidance.loiter_radius_m
    )
    fence = controls.parts.plan_fence.refusal(controls.state, first, from_here=from_here)
    refusal = f"{fence}; {insist.FENCE}" if fence and from_here else fence
    if refusal or not from_here:
        return refusal
    return blind_refusal(controls, _first_point(controls, first)) or controls.reach_refusal(first)


def _first_point(controls: Controls, first: int) -> LatLon | None:
    """Where a plan leads first from an item on; None = nowhere."""
    for item in controls.parts.mission.plan.maneuvers[first:]:
        if isinstance(item, Goto | Loiter):
            return LatLon((item.lat_rad, item.lon_rad))
    return None


def blind_refusal(controls: Controls, target: LatLon | None) -> str:
    """Return why a target is refused while the sounder is silent: the way there leads over the shoal that stopped the vessel."""
    origin = controls.parts.estimator.origin
    if target is None or origin is None:
        return ""
    why = controls.parts.guard.blind_refusal(controls.sensed.now_us, controls.state, origin.to_local(*target))
    return f"{why}; {insist.MANUAL}" if why else ""


def target_refusal(controls: Controls, lat_rad: float | None, lon_rad: float | None) -> str:
    """Return why a guided target is refused (outside the fence, charted too shallow), or an empty string."""
    if lat_rad is None or lon_rad is None:
        return ""
    shallow = controls.parts.guard.check_plan([PlanLeg(0, ((lat_rad, lon_rad),))])
    if shallow is not None and not _leads_home(controls, LatLon((lat_rad, lon_rad))):
        return f"the target: {shallow.reason}; {insist.CHART}"
    if blind := blind_refusal(controls, LatLon((lat_rad, lon_rad))):
        return blind
    if not controls.parts.fence.enabled or controls.parts.estimator.origin is None:
        return ""
    inside_m = controls.parts.fence.distance_m(
        controls.state, controls.parts.estimator.origin.to_local(lat_rad, lon_rad)
    )
    fits = inside_m is None or inside_m >= 0.0
    return "" if fits else f"the target is {-(inside_m or 0.0):.0f} m outside the fence; {insist.FENCE}"


def far_refusal(controls: Controls, lat_rad: float | None, lon_rad: float | None) -> str:
    """Return why an ordered target lies too far away, or an empty string: a slip on the map. One nearer home is a way back."""
    here, home, limit_m = controls.here, controls.parts.mission.home, controls.parts.mission.config.leg_distance_m
    if lat_rad is None or lon_rad is None or here is None:
        return ""
    target = LatLon((lat_rad, lon_rad))
    away_m = inverse(*here, *target)[0]
    if away_m <= limit_m or (home is not None and inverse(*home, *target)[0] < inverse(*home, *here)[0]):
        return ""
    return f"the target is {shown(away_m)} away, limit {shown(limit_m)}; {insist.FAR_TARGET}"


_ROUND: Final = 16
"""Points of a trial's circle that are looked at."""
_THROTTLE: Final = 0.5
"""Half of it is what a trial begins with; a circle in which the stop from there does not fit teaches nothing."""
_STOP_SHARE: Final = 0.4
"""Share of the way to the edge that this stop may take: a run before it, and the look ahead, need the rest."""


def trial_area(controls: Controls, body: SeaTrial) -> TrialArea | str:
    """Return the area of a sea trial that begins here, or why none may."""
    refusal = _unready(controls, body)
    if refusal:
        return refusal
    state = controls.state
    assert state.x_m is not None
    assert state.y_m is not None
    here, refused = NorthEast((state.x_m, state.y_m)), _looks_at(controls)
    if body.fitted:
        area = TrialArea(here, free_around(here, body.radius_m, lambda point: not refused(point)))
        if area.least_m < LEAST_RADIUS_M:
            why = f"only {math.floor(area.least_m)} m are free on one side of here"
            return f"{why}, a sea trial needs {LEAST_RADIUS_M:.0f}: begin in the middle of the free water"
    else:
        area = TrialArea(here, (body.radius_m,))
        refusal = _first_refusal(here, body.radius_m, refused)
        if refusal:
            return (
                f"the circle of {body.radius_m:.0f} m around here: {refusal}; a smaller one, or one fitted to the water"
            )
    return _no_way_to_stop(controls, area) or area


def _unready(controls: Controls, body: SeaTrial) -> str:
    if controls.parts.navigator.on_trial:
        return "a sea trial is under way: stop it first"
    if not controls.armed and body.order is TrialOrder.BEGIN:
        return "disarmed: a sea trial is valid for one arming"
    state = controls.state
    if controls.here is None or state.x_m is None or state.y_m is None or not state.heading_valid:
        return "no position or no heading"
    if not LEAST_RADIUS_M <= body.radius_m <= MOST_RADIUS_M:
        return f"a sea trial's circle of {body.radius_m:.0f} m is outside {LEAST_RADIUS_M:.0f}...{MOST_RADIUS_M:.0f} m"
    monitors = controls.last.guarded.monitors
    low = monitors.battery_low or monitors.battery_critical or monitors.battery_empty
    return "the battery is low: a sea trial asks for full thrust" if low else ""


def _looks_at(controls: Controls) -> Callable[[NorthEast], str]:
    """A look at one place in the plane: why the vessel would not go there."""
    origin = controls.parts.estimator.origin
    assert origin is not None
    return lambda point: target_refusal(controls, *origin.to_geodetic(*point))


def _first_refusal(here: NorthEast, radius_m: float, refused: Callable[[NorthEast], str]) -> str:
    for share in (0.5, 1.0):
        for k in range(_ROUND):
            angle, reach_m = math.tau * k / _ROUND, share * radius_m
            refusal = refused(NorthEast((here[0] + reach_m * math.cos(angle), here[1] + reach_m * math.sin(angle))))
            if refusal:
                return refusal
    return ""


def _no_way_to_stop(controls: Controls, area: TrialArea) -> str:
    """Why the vessel's way to stop does not fit into an area, or an empty string."""
    speed_mps = throttle_to_speed(controls.parts.vessel, _THROTTLE)
    stop_m = controls.stopping_distance_m(speed_mps)
    if stop_m <= _STOP_SHARE * area.least_m:
        return ""
    least_m = math.ceil(stop_m / _STOP_SHARE)
    return f"the way to stop from {speed_mps:.1f} m/s is {stop_m:.0f} m: it takes {least_m} m around here, not {area.least_m:.0f}"


def _leads_home(controls: Controls, target: LatLon) -> bool:
    """Whether a target is nearer home than the vessel, on a voyage."""
    home, here = controls.parts.mission.home, controls.here
    if home is None or here is None or controls.voyage.lasting is None:
        return False
    return inverse(*home, *target)[0] < inverse(*home, *here)[0]


def shutdown_refusal(controls: Controls, now_us: int, *, by_radio: bool) -> str:
    """Return why the vessel does not go dark for good, or an empty string: only where somebody stands beside it."""
    mend = "; a restart is obeyed"
    if by_radio:
        return f"a shutdown is not taken by radio: nobody could switch the vessel on again{mend}"
    here, began = controls.here, controls.started_at
    if here is None or began is None:
        return f"no position: a vessel that may be adrift does not go dark{mend}"
    away_m, speed_mps = inverse(*began, *here)[0], controls.state.sog_mps or 0.0
    if controls.voyage.has_begun(now_us):
        return f"on a voyage ({away_m:.0f} m from where it was started): a vessel afloat does not go dark{mend}"
    if away_m > LYING_M or speed_mps > LYING_MPS:
        return f"not where it was started ({away_m:.0f} m, {speed_mps:.1f} m/s): a vessel adrift does not go dark{mend}"
    return ""


def motion_refusal(controls: Controls, now_us: int, order: Order | None = None) -> str:
    """Return why an order that sets the vessel moving is refused now, or an empty string."""
    if controls.parts.gate.terminated or controls.terminating:
        return "terminated: restart to go on"
    way_back = (
        order is Order.RETURN
        and controls.voyage.has_begun(now_us)
        and controls.parts.guard.state is not GuardState.LOCKED
    )
    depth = "" if way_back else controls.parts.guard.activation(now_us)
    if depth:
        return f"{depth}; {insist.UNLOCK if controls.parts.guard.state is GuardState.LOCKED else insist.REQUIRED}"
    haven = controls.parts.mission.havens.nearest(controls.state) if order is Order.RETURN else None
    if haven is not None and (blind := blind_refusal(controls, haven.point)):
        return blind
    memory = controls.last.verdict.result.memory
    return failsafe.barring(memory, now_us, controls.config.failsafe, order, by_hand=insist.MANUAL)


def hold_refusal(controls: Controls, now_us: int) -> str:
    """Return why a Hold would hold nothing: the vessel is stopped for good. Sticks that still move her are stopped by it."""
    if controls.parts.navigator.mode is Mode.MANUAL or not controls.armed:
        return ""
    if controls.last.guarded.depth.flags.depth_locked:
        return f"{controls.parts.guard.refusal(now_us)}; {insist.UNLOCK}"
    why = failsafe.stopped_for_good(controls.last.verdict.result.memory, controls.config.failsafe)
    return f"{why}; {insist.MANUAL}" if why else ""
