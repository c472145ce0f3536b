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
        vehicle.armed,
        not by_hand,
        stick_age_s is not None,
        vehicle.ordered,
        vehicle.rearmed,
        vehicle.terminating,
        vehicle.aborting or inputs.actuator.emergency_stop,
        vehicle.gcs_required,
        inputs.gcs_age_s,
        inputs.radio_age_s,
        stick_age_s,
        navigator.guided_age_s(now_us),
        state.x_m is None or state.y_m is None,
        state.psi_rad is None,
        estimator.frozen,
        estimator.sources_disagree,
        bool(faults) and not _BOARD_SILENT.isdisjoint(faults),
        "reset" in faults,
        "mismatch" in faults,
        "noise" in faults,
        "garbage" in faults,
        guard.shallow,
        guard.locked,
        guard.stop_ahead,
        guard.brake,
        guard.lost,
        guard.blind,
        fence_ahead,
        vehicle.fence_status.breached,
        vehicle.guided is not None and bool(vehicle.guided.unable),
        seen.battery_low,
        seen.battery_critical,
        seen.battery_empty,
        seen.battery_lost,
        seen.stuck,
        seen.moving_in_neutral,
        seen.drifting_while_stopped,
        seen.oscillating,
        inputs.storage_fault,
        seen.time_jump,
        seen.tick_late,
        seen.tick_very_late,
        seen.overruns,
        inputs.task_failing,
        vehicle.returns_by_order and navigator.mode is _RETURN,
        "" if vehicle.interrupted is None else vehicle.interrupted.value,
    )
