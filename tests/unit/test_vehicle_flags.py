"""What the vehicle knows reaches the failsafe under its own name: the flags are handed over by place, so each is looked at."""

from __future__ import annotations

from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import pytest

from companion.core.guard.depth.guard import GuardOutput
from companion.core.guard.failsafe_flags import ALARMS, Flags
from companion.core.guard.failsafe_orders import Order
from companion.core.guard.monitors import MonitorFlags
from companion.core.vehicle.config import TickInputs
from companion.core.vehicle.flags import gather
from companion.core.vehicle.operators import Ages
from mavlink_bridge.language.messages import ActuatorStatus, EstimatedState, GuardState, Mode
from mavlink_bridge.language.snapshot import FenceStatus

GUARD = GuardOutput(GuardState.OK, 9.0, 9.0, 4.0)
STATE = EstimatedState(0, x_m=0.0, y_m=0.0, psi_rad=0.0)
CALM = Flags(autonomous=True)


class Helm:
    def __init__(self, mode: Mode = Mode.HOLD, stick_s: float | None = None, guided_s: float | None = None) -> None:
        self.mode = mode
        self._ages = stick_s, guided_s

    def stick_age_s(self, now_us: int) -> float | None:
        return self._ages[0]

    def guided_age_s(self, now_us: int) -> float | None:
        return self._ages[1]


def flags_of(*, seen: MonitorFlags | None = None, fence_ahead: bool = False, **parts: Any) -> Flags:
    """Return the flags of a vessel on which all is well but for ``parts``."""
    vessel: Any = SimpleNamespace(
        state=STATE,
        inputs=TickInputs(),
        guard_out=GUARD,
        navigator=Helm(),
        estimator=SimpleNamespace(frozen=False, sources_disagree=False),
        propulsion=SimpleNamespace(weak=(False, False)),
        fence_status=FenceStatus(),
        guided=None,
        returns_by_order=False,
        ordered=None,
        ages=Ages(),
        board_known=True,
        goes_on_with="",
        **dict.fromkeys(("armed", "rearmed", "terminating", "aborting", "gcs_required"), False),
    )
    vars(vessel).update(parts)
    return gather(vessel, 0, seen or MonitorFlags(), fence_ahead)


BY_CAUSE: dict[str, dict[str, Any]] = {
    "armed": {"armed": True},
    "operator_order": {"ordered": Order.AUTO},
    "return_ordered": {"returns_by_order": True, "navigator": Helm(Mode.RTL)},
    "resume": {"goes_on_with": "Auto"},
    "operator_arm": {"rearmed": True},
    "terminate": {"terminating": True},
    "emergency_stop": {"inputs": TickInputs(actuator=ActuatorStatus(0, emergency_stop=True))},
    "aborted": {"aborting": True},
    "gcs_required": {"gcs_required": True},
    "gcs_age_s": {"ages": Ages(gcs_s=1.5)},
    "radio_age_s": {"ages": Ages(radio_s=1.5)},
    "guided_age_s": {"navigator": Helm(Mode.GUIDED, guided_s=1.5)},
    "position_lost": {"state": replace(STATE, x_m=None, y_m=None)},
    "heading_lost": {"state": replace(STATE, psi_rad=None)},
    "position_frozen": {"estimator": SimpleNamespace(frozen=True, sources_disagree=False)},
    "sources_disagree": {"estimator": SimpleNamespace(frozen=False, sources_disagree=True)},
    "thruster_weak": {"propulsion": SimpleNamespace(weak=(False, True))},
    "actuator_lost": {"inputs": TickInputs(actuator_faults=["silent"])},
    "actuator_reset": {"inputs": TickInputs(actuator_faults=["reset"])},
    "actuator_mismatch": {"inputs": TickInputs(actuator_faults=["mismatch"])},
    "actuator_noise": {"inputs": TickInputs(actuator_faults=["noise"])},
    "actuator_garbage": {"inputs": TickInputs(actuator_faults=["garbage"])},
    "depth_shallow": {"guard_out": replace(GUARD, shallow=True)},
    "depth_locked": {"guard_out": replace(GUARD, locked=True)},
    "depth_ahead": {"guard_out": replace(GUARD, stop_ahead=True)},
    "depth_braking": {"guard_out": replace(GUARD, brake=True)},
    "depth_lost": {"guard_out": replace(GUARD, lost=True)},
    "depth_blind": {"guard_out": replace(GUARD, blind=True)},
    "fence_ahead": {"fence_ahead": True},
    "fence_breach": {"fence_status": FenceStatus(breached=True)},
    "plan_invalid": {"guided": SimpleNamespace(unable="the water is faster than the vessel")},
    "storage_fault": {"inputs": TickInputs(storage_fault=True)},
    "task_failing": {"inputs": TickInputs(task_failing=True)},
    **{item.name: {"seen": MonitorFlags(**{item.name: True})} for item in fields(MonitorFlags)},
}
"""Each flag, and the one thing that raises it."""


@pytest.mark.parametrize("name", BY_CAUSE)
def test_each_cause_raises_its_own_flag_and_no_other(name):
    value = {"resume": "Auto", "operator_order": Order.AUTO}.get(name, 1.5 if name.endswith("_s") else True)
    assert flags_of(**BY_CAUSE[name]) == replace(CALM, **{name: value})


def test_a_board_that_never_was_there_is_not_lost():
    assert flags_of(**BY_CAUSE["actuator_lost"], board_known=False) == CALM


def test_every_flag_has_been_looked_at():
    by_mode = {"autonomous", "manual", "manual_age_s"}
    assert {item.name for item in fields(Flags)} == BY_CAUSE.keys() | by_mode


def test_the_flags_of_a_mode():
    assert flags_of(navigator=Helm(Mode.AUTO, stick_s=0.2)) == CALM, "sticks count by hand only"
    assert flags_of(navigator=Helm(Mode.MANUAL)) == Flags()
    assert flags_of(navigator=Helm(Mode.MANUAL, stick_s=0.2)) == Flags(manual=True, manual_age_s=0.2)


def test_the_stop_input_of_the_board_is_an_emergency_stop():
    pressed = TickInputs(actuator=ActuatorStatus(0, emergency_stop=True))
    assert flags_of(inputs=pressed) == replace(CALM, emergency_stop=True)


@pytest.mark.parametrize("name", ALARMS)
def test_any_alarm_is_an_alarm(name):
    assert Flags(**{name: True}).any_alarm()
    assert not Flags().any_alarm()
