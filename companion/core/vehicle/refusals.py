"""Why the vessel says no: before arming, to a plan, to a target, to an order that would set it moving.

Each answer is one plain sentence, or nothing. These only look; they change nothing.
"""

from __future__ import annotations

from mavlink_bridge.language.messages import GuardState, Mode, PlanState
from mavlink_bridge.language.requests import LoadPlan

from ..guard import failsafe
from ..guard.depth.grid import Leg
from ..guard.failsafe_orders import Order
from ..hull.vessel_file import top_speed_mps
from . import arming
from .controls import Controls
from .plan_depth import plan_legs


def prearm_reasons(vehicle: Controls, now_us: int, *, force: bool = False) -> tuple[str, ...]:
    """Return why the vessel must not be armed now; empty when it may."""
    inputs, causes = vehicle.inputs, vehicle.result.causes
    if vehicle.gate.terminated or force:
        return ("terminated: restart first",) if vehicle.gate.terminated else _forced(vehicle)
    barred = () if vehicle.has_sailed else inputs.barred
    return barred + arming.reasons(
        mode=vehicle.navigator.mode,
        state=vehicle.state,
        actuator_ready=inputs.actuator_ready,
        actuator_reason=inputs.actuator_reason,
        emergency_stop=inputs.actuator.emergency_stop,
        holding_causes=failsafe.holding(vehicle.memory, vehicle.config.failsafe),
        guard=vehicle.guard.state if vehicle.config.depth.enabled else GuardState.UNKNOWN,
        guard_reason=vehicle.guard.refusal(now_us),
        depth_required=vehicle.config.depth.required,
        altitude_known=vehicle.guard_out.altitude_m is not None,
        fence=vehicle.fence_status,
        battery_low="battery_low" in causes,
        battery_lost="battery_lost" in causes,
        sources_disagree=vehicle.estimator.sources_disagree,
        gcs_required=vehicle.config.operator.gcs_required,
        gcs_heard=vehicle.operators.hears(inputs.heard),
        plan_needed=True,
        plan_loaded=bool(vehicle.mission.total),
        plan_refusal=start_refusal(vehicle, from_here=False) if vehicle.navigator.mode is Mode.AUTO else "",
    )


def _forced(vehicle: Controls) -> tuple[str, ...]:
    """A forced arm passes over all checks but the actuators' own."""
    return () if vehicle.inputs.actuator_ready else (f"actuators not ready: {vehicle.inputs.actuator_reason}",)


def plan_refusal(vehicle: Controls, body: LoadPlan) -> str:
    """Return why a plan that is sound on the wire is still refused by this vessel, or an empty string."""
    top_mps = top_speed_mps(vehicle.vessel)
    for item in body.plan.maneuvers:
        speed = getattr(item, "speed_mps", None)
        if speed is not None and speed > top_mps:
            return f"item {item.seq}: {speed:.1f} m/s is more than the vessel's {top_mps:.1f} m/s"
    state = vehicle.state
    here = None if state.lat_rad is None or state.lon_rad is None else (state.lat_rad, state.lon_rad)
    legs = plan_legs(body.plan.maneuvers, here, vehicle.config.guidance.loiter_radius_m)
    shallow = vehicle.guard.check_plan(legs)
    return "" if shallow is None else f"item {shallow.seq}: {shallow.reason}"


def start_refusal(vehicle: Controls, first: int | None = None, *, from_here: bool = True) -> str:
    """Return why the plan must not be sailed from item ``first`` (None: where it stands) on, or an empty string."""
    if first is None:
        first = 0 if vehicle.mission.state is PlanState.COMPLETE else vehicle.mission.seq
    refusal = vehicle.plan_fence.refusal(vehicle.state, first, from_here=from_here)
    return refusal or (vehicle.reach_refusal(first) if from_here else "")


def target_refusal(vehicle: Controls, lat_rad: float | None, lon_rad: float | None) -> str:
    """Return why a guided target is refused (outside the fence, charted too shallow), or an empty string."""
    if lat_rad is None or lon_rad is None:
        return ""
    shallow = vehicle.guard.check_plan([Leg(0, ((lat_rad, lon_rad),))])
    if shallow is not None:
        return f"the target: {shallow.reason}"
    if not vehicle.fence.enabled or vehicle.estimator.origin is None:
        return ""
    inside_m = vehicle.fence.distance_m(vehicle.state, vehicle.estimator.origin.to_local(lat_rad, lon_rad))
    return "" if inside_m is None or inside_m >= 0.0 else f"the target is {-inside_m:.0f} m outside the fence"


def motion_refusal(vehicle: Controls, now_us: int, order: Order | None = None) -> str:
    """Return why an order that sets the vessel moving is refused now, or an empty string."""
    if vehicle.gate.terminated or vehicle.terminating:
        return "terminated: restart to go on"
    return vehicle.guard.activation(now_us) or failsafe.barring(vehicle.memory, now_us, vehicle.config.failsafe, order)
