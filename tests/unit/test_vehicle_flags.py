"""What each part of the vessel knows reaches the failsafe under its own name, and under no other."""

from __future__ import annotations

from dataclasses import fields
from types import SimpleNamespace
from typing import Any

import pytest

from companion.core.estimate.flags import PlaceFlags
from companion.core.guard.board_watch import BoardFlags, BoardReport, BoardWatch
from companion.core.guard.depth.guard import DepthFlags, GuardOutput
from companion.core.guard.failsafe_config import FailsafeConfig
from companion.core.guard.failsafe_flags import ALARMS, HOME, Flags, ProcessFlags, changed, flags_of as flags_named
from companion.core.guard.failsafe_orders import Order
from companion.core.guard.fence import FenceFlags, FenceOutput
from companion.core.guard.monitors import MonitorFlags
from companion.core.guard.propulsion import ThrustFlags
from companion.core.guide import GuidanceOutput
from companion.core.traffic.flags import TrafficFlags
from companion.core.vehicle.config import TickInputs
from companion.core.vehicle.controls import Decided
from companion.core.vehicle.flags import flags_of
from companion.core.vehicle.operators import Ages
from companion.core.vehicle.ticked import Guarded, Pursuit, Sensed
from mavlink_bridge.language.messages import (
    ActuatorStatus,
    Desired,
    EstimatedState,
    GuardState,
    Mode,
    PathControlState,
)
from mavlink_bridge.language.snapshot import FenceStatus

CALM = flags_named(autonomous=True)
STUCK = GuidanceOutput(Desired(None, None), PathControlState(), unable="the water is faster than the vessel")


class Helm:
    def __init__(self, mode: Mode = Mode.HOLD, stick_s: float | None = None, guided_s: float | None = None) -> None:
        self.mode = mode
        self.awaited_us = -11_000_000
        self._ages = stick_s, guided_s

    def stick_wait_s(self, now_us: int) -> float | None:
        return self._ages[0]

    def guided_age_s(self, now_us: int) -> float | None:
        return self._ages[1]


def gathered(
    *,
    helm: Helm | None = None,
    ages: Ages | None = None,
    place: PlaceFlags | None = None,
    thrust: ThrustFlags | None = None,
    traffic: TrafficFlags | None = None,
    board: BoardFlags | None = None,
    process: ProcessFlags | None = None,
    depth: DepthFlags | None = None,
    fence: FenceFlags | None = None,
    seen: MonitorFlags | None = None,
    guided: GuidanceOutput | None = None,
    required: bool = False,
    standing: tuple[str, ...] = (),
    **controls: Any,
) -> Flags:
    """Return the flags of a vessel on which all is well but for what is given."""
    parts = SimpleNamespace(
        navigator=helm or Helm(),
        operators=SimpleNamespace(ages=lambda heard, now_us: ages or Ages()),
        estimator=SimpleNamespace(flags=lambda state: place or PlaceFlags()),
        propulsion=SimpleNamespace(flags=thrust or ThrustFlags()),
        traffic=SimpleNamespace(flags=traffic or TrafficFlags()),
    )
    usual: dict[str, Any] = {
        "armed": False,
        "terminating": False,
        "decided": Decided(),
        "returns_by_order": False,
        "goes_on_with": "",
    }
    config = SimpleNamespace(operator=SimpleNamespace(gcs_required=required), failsafe=FailsafeConfig())
    vessel: Any = SimpleNamespace(parts=parts, config=config, **(usual | controls))
    inputs = TickInputs(process=process or ProcessFlags())
    sensed = Sensed(0, 0.05, inputs, EstimatedState(0), board=BoardReport(board or BoardFlags()))
    water = GuardOutput(GuardState.OK, 9.0, 9.0, 4.0, flags=depth or DepthFlags())
    guarded = Guarded(water, FenceOutput(FenceStatus(), fence or FenceFlags()), seen or MonitorFlags())
    return flags_of(vessel, sensed, Pursuit(guided=guided), guarded, standing=standing)


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


GROUPS: dict[str, Any] = {
    "place": PlaceFlags,
    "thrust": ThrustFlags,
    "traffic": TrafficFlags,
    "board": BoardFlags,
    "process": ProcessFlags,
    "depth": DepthFlags,
    "fence": FenceFlags,
    "seen": MonitorFlags,
}

BY_CAUSE: dict[str, dict[str, Any]] = {
    "armed": {"armed": True},
    "operator_order": {"decided": Decided(order=Order.AUTO)},
    "operator_arm": {"decided": Decided(armed=True)},
    "aborted": {"decided": Decided(aborted=True)},
    "return_ordered": {"returns_by_order": True, "helm": Helm(Mode.RTL)},
    "resume": {"goes_on_with": "Auto"},
    "awaits_arming": {"standing": ("depth_locked",)},
    "terminate": {"terminating": True},
    "gcs_required": {"required": True},
    "gcs_age_s": {"ages": Ages(gcs_s=1.5)},
    "radio_age_s": {"ages": Ages(radio_s=1.5)},
    "guided_age_s": {"helm": Helm(Mode.GUIDED, guided_s=1.5)},
    "plan_invalid": {"guided": STUCK},
    **{item.name: {name: group(**{item.name: True})} for name, group in GROUPS.items() for item in fields(group)},
}
"""Each flag, and the one thing that raises it."""


@pytest.mark.parametrize("name", BY_CAUSE)
def test_each_cause_raises_its_own_flag_and_no_other(name):
    value = {"resume": "Auto", "operator_order": Order.AUTO}.get(name, 1.5 if name.endswith("_s") else True)
    assert gathered(**BY_CAUSE[name]) == changed(CALM, **{name: value})


@pytest.mark.parametrize(("name", "fault"), FAULTS.items())
def test_a_fault_of_the_board_raises_its_own_flag(name, fault):
    assert reported(fault) == BoardFlags(**{name: True})


def test_the_stop_input_of_the_board_is_an_emergency_stop():
    assert reported(emergency_stop=True) == BoardFlags(emergency_stop=True)


def test_a_board_that_never_was_there_is_not_lost():
    assert not reported("silent", known=False).actuator_lost
    assert BoardWatch().step(ActuatorStatus(0), ["silent"], ready=False, armed=True).flags.actuator_lost, (
        "armed it must be"
    )


def test_every_flag_has_been_looked_at():
    by_mode = {"autonomous", "manual", "manual_idle", "manual_age_s"}
    asked_at_the_fence = {"return_shut_off"}  # tests/scenario/test_fence_voyages.py
    assert HOME.keys() == BY_CAUSE.keys() | by_mode | asked_at_the_fence


def test_the_flags_of_a_mode():
    assert gathered(helm=Helm(Mode.AUTO, stick_s=0.2)) == CALM, "sticks count by hand only"
    assert gathered(helm=Helm(Mode.MANUAL)) == flags_named(manual_idle=True), "no stick ever moved: nobody steers"
    taken = Helm(Mode.MANUAL)
    taken.awaited_us = -9_000_000
    assert gathered(helm=taken) == flags_named(manual=True), "somebody reaches for the sticks"
    assert gathered(helm=Helm(Mode.MANUAL, stick_s=0.2)) == flags_named(manual=True, manual_age_s=0.2)
    assert gathered(helm=Helm(Mode.MANUAL, stick_s=0.5)) == flags_named(manual_age_s=0.5), "no stick is heard: no hand"


@pytest.mark.parametrize("name", ALARMS)
def test_any_alarm_is_an_alarm(name):
    assert flags_named(**{name: True}).any_alarm()
    assert not Flags().any_alarm()
