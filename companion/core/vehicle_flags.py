"""Fills the failsafe's flags from what the vessel knows at a tick: the one place where the two meet."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.imc import Mode

from .controls import Controls
from .failsafe import Flags
from .monitors import MonitorFlags

_BOARD_SILENT: Final = frozenset({"lost", "blocked", "silent", "baud", "failsafe"})
"""Faults of the actuator board after which nothing that is sent can be relied on."""


def gather(vehicle: Controls, now_us: int, seen: MonitorFlags, *, fence_ahead: bool) -> Flags:
    """Return this tick's flags."""
    state, inputs, guard = vehicle.state, vehicle.inputs, vehicle.guard_out
    faults = inputs.actuator_faults
    manual = vehicle.navigator.mode is Mode.MANUAL
    return Flags(
        armed=vehicle.armed,
        autonomous=not manual,
        manual=manual and vehicle.navigator.stick_age_s(now_us) is not None,
        operator_order=vehicle.ordered,
        operator_arm=vehicle.rearmed,
        terminate=vehicle.terminating,
        emergency_stop=vehicle.aborting or inputs.actuator.emergency_stop,
        gcs_required=vehicle.config.operator.gcs_required,
        gcs_age_s=inputs.gcs_age_s,
        radio_age_s=inputs.radio_age_s,
        manual_age_s=vehicle.navigator.stick_age_s(now_us) if manual else None,
        guided_age_s=vehicle.navigator.guided_age_s(now_us),
        position_lost=not state.position_valid,
        heading_lost=not state.heading_valid,
        position_frozen=vehicle.estimator.frozen,
        sources_disagree=vehicle.estimator.sources_disagree,
        actuator_lost=not _BOARD_SILENT.isdisjoint(faults),
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
        storage_fault=inputs.storage_fault,
        time_jump=seen.time_jump,
        tick_late=seen.tick_late,
        tick_very_late=seen.tick_very_late,
        overruns=seen.overruns,
        task_failing=inputs.task_failing,
    )
