"""Pre-arm checks: every reason at once, in plain words; by hand an operator may do more."""

from __future__ import annotations

import pytest

from companion.core.vehicle.arming import reasons
from mavlink_bridge.language.messages import EstimatedState, GuardState, Mode
from mavlink_bridge.language.snapshot import FenceStatus

READY = {"mode": Mode.AUTO, "state": EstimatedState(0, x_m=0.0, y_m=0.0, psi_rad=0.0), "actuator_ready": True}


def ask(**changes) -> tuple[str, ...]:
    return reasons(**{**READY, **changes})


@pytest.mark.parametrize("mode", list(Mode))
def test_a_ready_vessel_may_be_armed_in_every_mode(mode):
    assert ask(mode=mode) == ()


ALWAYS = [
    ({"terminated": True}, "terminated: restart first"),
    ({"emergency_stop": True}, "emergency stop is active"),
    ({"actuator_ready": False}, "actuators not ready: no answer"),
    ({"actuator_ready": False, "actuator_reason": "port closed"}, "actuators not ready: port closed"),
    ({"sources_disagree": True}, "position sources disagree"),
    (
        {"compasses_apart": "b reads 180 deg more than a"},
        "compasses disagree: b reads 180 deg more than a; mend the wrong one, or forbid it (sentences)",
    ),
    ({"battery_low": True}, "battery low"),
    ({"battery_lost": True}, "battery sensor lost"),
    ({"gcs_required": True}, "no ground station heard"),
    ({"holding_causes": ("actuator_lost",)}, "failsafe: actuators lost"),
]
BY_ITSELF = [
    ({"state": EstimatedState(0, psi_rad=0.0)}, "no position"),
    ({"state": EstimatedState(0, x_m=0.0, y_m=0.0)}, "no heading"),
    (
        {"state": EstimatedState(0, x_m=0.0, y_m=0.0, psi_rad=1.0, heading_from_course=True)},
        "no compass: the course stands in for the heading",
    ),
    ({"guard": GuardState.LOCKED}, "depth guard locked"),
    ({"guard": GuardState.LOCKED, "guard_reason": "depth guard locked: 2 m"}, "depth guard locked: 2 m"),
    ({"depth_required": True}, "water depth unknown, and depth.required is set"),
    ({"fence": FenceStatus(breached=True)}, "outside the fence"),
    ({"plan_needed": True}, "no plan loaded"),
    ({"holding_causes": ("depth_locked",)}, "failsafe: too shallow: locked, no manoeuvre"),
]


@pytest.mark.parametrize(("changes", "text"), ALWAYS)
def test_reasons_in_every_mode(changes, text):
    for mode in Mode:
        (reason,) = ask(mode=mode, **changes)
        assert text in reason


@pytest.mark.parametrize(("changes", "text"), BY_ITSELF)
def test_reasons_only_where_the_vessel_steers_itself(changes, text):
    assert ask(**changes) == (text,)
    assert ask(**{**changes, "mode": Mode.MANUAL}) == ()


def test_what_is_allowed():
    assert ask(gcs_required=True, gcs_heard=True) == ()
    assert ask(depth_required=True, altitude_known=True) == ()
    assert ask(plan_needed=True, plan_loaded=True) == ()
    assert ask(mode=Mode.GUIDED, plan_needed=True) == ()
    assert ask(fence=FenceStatus()) == ()
    assert ask(guard=GuardState.CORRECTION) == ()


def test_all_reasons_come_at_once():
    found = ask(terminated=True, battery_low=True, state=EstimatedState(0), holding_causes=("time_jump",))
    assert found == (
        "terminated: restart first",
        "battery low",
        "no position",
        "no heading",
        "failsafe: the computer stood still",
    )
