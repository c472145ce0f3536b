"""What the vehicle knows reaches the failsafe under its own name: the flags are handed over by place, so each is looked at."""

from __future__ import annotations

from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import pytest

from companion.core.guard.board_watch import BoardFlags, BoardReport, BoardWatch
from companion.core.guard.depth.guard import DepthFlags, GuardOutput
from companion.core.guard.failsafe_flags import ALARMS, HOME, Flags, ProcessFlags, changed, flags_of as flags_named
from companion.core.guard.failsafe_orders import Order
from companion.core.guard.fence import FenceFlags
from companion.core.guard.monitors import MonitorFlags
from companion.core.vehicle.config import TickInputs
from companion.core.vehicle.flags import gather
from companion.core.vehicle.operators import Ages
from mavlink_bridge.language.messages import ActuatorStatus, EstimatedState, GuardState, Mode

GUARD = GuardOutput(GuardState.OK, 9.0, 9.0, 4.0)
STATE = EstimatedState(0, x_m=0.0, y_m=0.0, psi_rad=0.0)
CALM = flags_named(autonomous=True)


class Helm:
    def __init__(self, mode: Mode = Mode.HOLD, stick_s: float | None = None, guided_s: float | None = None) -> None:
        self.mode = mode
        self._ages = stick_s, guided_s

    def stick_age_s(self, now_us: int) -> float | None:
        return self._ages[0]

    def guided_age_s(self, now_us: int) -> float | None:
        return self._ages[1]


def flags_of(*, seen: MonitorFlags | None = None, fence: FenceFlags | None = None, **parts: Any) -> Flags:
    """Return the flags of a vessel on which all is well but for ``parts``."""
    vessel: Any = SimpleNamespace(
        state=STATE,
        inputs=TickInputs(),
        guard_out=GUARD,
        navigator=Helm(),
        estimator=SimpleNamespace(frozen=False, sources_disagree=False),
        propulsion=SimpleNamespace(weak=(False, False)),
        guided=None,
        returns_by_order=False,
        ordered=None,
        ages=Ages(),
        board=BoardReport(),
        goes_on_with="",
        **dict.fromkeys(("armed", "rearmed", "terminating", "aborting", "gcs_required"), False),
    )
    vars(vessel).update(parts)
    return gather(vessel, 0, seen or MonitorFlags(), fence or FenceFlags())


FAULTS = {
    "actuator_lost": "silent",
    "actuator_reset": "reset",
    "actuator_mismatch": "mismatch",
    "actuator_noise": "noise",
    "actuator_garbage": "garbage",
}


def reported(*faults: str, known: bool = True, emergency_stop: bool = False) -> BoardFlags:
    status = ActuatorStatus(0, emergency_stop=emergency_stop)
    return BoardWatch().step(status, faults, ready=known, armed=False).flags


BY_CAUSE: dict[str, dict[str, Any]] = {
    "armed": {"armed": True},
    "operator_order": {"ordered": Order.AUTO},
    "return_ordered": {"returns_by_order": True, "navigator": Helm(Mode.RTL)},
    "resume": {"goes_on_with": "Auto"},
    "operator_arm": {"rearmed": True},
    "terminate": {"terminating": True},
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
    **{item.name: {"guard_out": replace(GUARD, flags=DepthFlags(**{item.name: True}))} for item in fields(DepthFlags)},
    **{name: {"board": BoardReport(reported(fault))} for name, fault in FAULTS.items()},
    "emergency_stop": {"board": BoardReport(reported(emergency_stop=True))},
    **{item.name: {"fence": FenceFlags(**{item.name: True})} for item in fields(FenceFlags)},
    "plan_invalid": {"guided": SimpleNamespace(unable="the water is faster than the vessel")},
    "storage_fault": {"inputs": TickInputs(process=ProcessFlags(storage_fault=True))},
    "task_failing": {"inputs": TickInputs(process=ProcessFlags(task_failing=True))},
    **{item.name: {"seen": MonitorFlags(**{item.name: True})} for item in fields(MonitorFlags)},
}
"""Each flag, and the one thing that raises it."""


@pytest.mark.parametrize("name", BY_CAUSE)
def test_each_cause_raises_its_own_flag_and_no_other(name):
    value = {"resume": "Auto", "operator_order": Order.AUTO}.get(name, 1.5 if name.endswith("_s") else True)
    assert flags_of(**BY_CAUSE[name]) == changed(CALM, **{name: value})


def test_a_board_that_never_was_there_is_not_lost():
    assert not reported("silent", known=False).actuator_lost
    assert BoardWatch().step(ActuatorStatus(0), ["silent"], ready=False, armed=True).flags.actuator_lost, (
        "armed it must be"
    )


def test_every_flag_has_been_looked_at():
    by_mode = {"autonomous", "manual", "manual_age_s"}
    assert HOME.keys() == BY_CAUSE.keys() | by_mode


def test_the_flags_of_a_mode():
    assert flags_of(navigator=Helm(Mode.AUTO, stick_s=0.2)) == CALM, "sticks count by hand only"
    assert flags_of(navigator=Helm(Mode.MANUAL)) == Flags()
    assert flags_of(navigator=Helm(Mode.MANUAL, stick_s=0.2)) == flags_named(manual=True, manual_age_s=0.2)


@pytest.mark.parametrize("name", ALARMS)
def test_any_alarm_is_an_alarm(name):
    assert flags_named(**{name: True}).any_alarm()
    assert not Flags().any_alarm()
