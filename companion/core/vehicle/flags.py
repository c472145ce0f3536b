"""Fills the failsafe's flags from what the vessel knows at a tick: the one place where the two meet."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import Mode

from ..guard.failsafe import Flags
from ..guard.monitors import MonitorFlags
from .controls import Controls

_BOARD_SILENT: Final = frozenset({"lost", "blocked", "silent", "mute", "baud", "failsafe"})
"""Faults of the actuator board after which nothing that is sent can be relied on."""
_MANUAL: Final = Mode.MANUAL
_RETURN: Final = Mode.RTL


def gather(vehicle: Controls, now_us: int, seen: MonitorFlags, fence_ahead: bool) -> Flags:
    """Return this tick's flags, in their order: naming each would cost more than all the rest of the gathering."""
    state, inputs, guard, navigator = vehicle.state, vehicle.inputs, vehicle.guard_out, vehicle.navigator
    estimator, faults = vehicle.estimator, vehicle.inputs.actuator_faults
    by_hand = navigator.mode is _MANUAL
    stick_age_s = navigator.stick_age_s(now_us) if by_hand else None
    return Flags(
        armed=vehicle.armed,
        autonomous=not by_hand,
        manual=stick_age_s is not None,
        operator_order=vehicle.ordered,
        operator_arm=vehicle.rearmed,
        terminate=vehicle.terminating,
        emergency_stop=inputs.actuator.emergency_stop,
        aborted=vehicle.aborting,
        gcs_required=vehicle.gcs_required,
        gcs_age_s=vehicle.ages.gcs_s,
        radio_age_s=vehicle.ages.radio_s,
        manual_age_s=stick_age_s,
        guided_age_s=navigator.guided_age_s(now_us),
        position_lost=state.x_m is None or state.y_m is None,
        heading_lost=state.psi_rad is None,
        position_frozen=estimator.frozen,
        sources_disagree=estimator.sources_disagree,
        actuator_lost=bool(faults) and vehicle.board_known and not _BOARD_SILENT.isdisjoint(faults),
        actuator_reset="reset" in faults,
        actuator_mismatch="mismatch" in faults,
        actuator_noise="noise" in faults,
        actuator_garbage="garbage" in faults,
        depth_shallow=guard.shallow,
        depth_locked=guard.locked,
        depth_ahead=guard.stop_ahead,
        depth_braking=guard.brake,
        depth_lost=guard.lost,
        depth_blind=guard.blind,
        fence_ahead=fence_ahead,
        fence_breach=vehicle.fence_status.breached,
        plan_invalid=vehicle.guided is not None and bool(vehicle.guided.unable),
        battery_low=seen.battery_low,
        battery_critical=seen.battery_critical,
        battery_empty=seen.battery_empty,
        battery_lost=seen.battery_lost,
        stuck=seen.stuck,
        moving_in_neutral=seen.moving_in_neutral,
        drifting_while_stopped=seen.drifting_while_stopped,
        oscillating=seen.oscillating,
        thruster_weak=any(vehicle.propulsion.weak),
        storage_fault=inputs.storage_fault,
        time_jump=seen.time_jump,
        tick_late=seen.tick_late,
        tick_very_late=seen.tick_very_late,
        overruns=seen.overruns,
        task_failing=inputs.task_failing,
        return_ordered=vehicle.returns_by_order and navigator.mode is _RETURN,
        resume=vehicle.goes_on_with,
    )
