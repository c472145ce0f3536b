"""Pre-arm checks: every reason why the vessel may not be armed now, in plain words, all at once. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from mavlink_bridge.language.messages import EstimatedState, GuardState, Mode
from mavlink_bridge.language.snapshot import FenceStatus

from ..guard.failsafe_row import Takeover
from ..guard.failsafe_table import BY_NAME

_STEERS_ITSELF = (Mode.HOLD, Mode.AUTO, Mode.RTL, Mode.GUIDED, Mode.CIRCLE, Mode.LOITER)
_FORBID = "mend the wrong one, or forbid it (sentences)"


def reasons(
    *,
    mode: Mode,
    state: EstimatedState,
    actuator_ready: bool,
    actuator_reason: str = "",
    terminated: bool = False,
    emergency_stop: bool = False,
    holding_causes: Sequence[str] = (),
    guard: GuardState = GuardState.UNKNOWN,
    guard_reason: str | None = None,
    depth_required: bool = False,
    altitude_known: bool = False,
    fence: FenceStatus | None = None,
    battery_low: bool = False,
    battery_lost: bool = False,
    sources_disagree: bool = False,
    compasses_apart: str = "",
    gcs_required: bool = False,
    gcs_heard: bool = False,
    plan_needed: bool = False,
    plan_loaded: bool = False,
    plan_refusal: str = "",
) -> tuple[str, ...]:
    """Return all reasons against arming; empty = may arm.

    ``holding_causes``: failsafe conditions of STOP or worse whose cause still stands, so that arming cannot clear them.
    ``guard_reason``: what ``DepthGuard.refusal`` answered. By hand an operator may sail out of a breach, off a shoal and
    without position, so these count only for modes that steer themselves. What bars a departure only, a store for one,
    is added by ``refusals.prearm_reasons``.
    """
    found = [
        (terminated, "terminated: restart first"),
        (emergency_stop, "emergency stop is active"),
        (not actuator_ready, f"actuators not ready: {actuator_reason or 'no answer'}"),
        (sources_disagree, "position sources disagree"),
        (bool(compasses_apart), f"compasses disagree: {compasses_apart}; {_FORBID}"),
        (battery_low, "battery low"),
        (battery_lost, "battery sensor lost"),
        (gcs_required and not gcs_heard, "no ground station heard"),
    ]
    if mode in _STEERS_ITSELF:
        found.append((not state.position_valid, "no position"))
        found.append((not state.heading_valid, "no heading"))
        # of a boat that a stream carries, and whose compass was never heard, the stream's course would pass for the bow's
        found.append((state.heading_from_course, "no compass: the course stands in for the heading"))
        found.append((guard_reason is not None, guard_reason or ""))
        found.append((guard is GuardState.LOCKED and guard_reason is None, "depth guard locked"))
        found.append((depth_required and not altitude_known, "water depth unknown, and depth.required is set"))
        found.append((fence is not None and fence.breached, "outside the fence"))
        found.append((mode is Mode.AUTO and plan_needed and not plan_loaded, "no plan loaded"))
        found.append((mode is Mode.AUTO and bool(plan_refusal), f"plan: {plan_refusal}"))
    else:
        holding_causes = [cause for cause in holding_causes if BY_NAME[cause].takeover is Takeover.NEVER]
    standing = [f"failsafe: {BY_NAME[cause].text}" for cause in holding_causes]
    return tuple([text for holds, text in found if holds] + standing)
