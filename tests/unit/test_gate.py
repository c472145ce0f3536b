"""The gate lets a demand pass only with every permission, and is neutral otherwise."""

from __future__ import annotations

import math

import pytest

from companion.core.guard.gate import Evidence, Gate, GateConfig
from mavlink_bridge.language.messages import Action, ActuatorDemand, ActuatorOutput

READY = Evidence(actuator_ready=True, reason="")
TICK_US = 50_000
RUDDER_MAX_RAD = math.radians(30.0)


def ahead(t_us: int, thrust: float = 0.5, rudder_rad: float = 0.1) -> ActuatorDemand:
    return ActuatorDemand(t_us, thrust, thrust, rudder_rad, rudder_rad)


def values(output: ActuatorOutput) -> tuple[float, float, float, float]:
    return output.thruster_port, output.thruster_starboard, output.rudder_port_rad, output.rudder_starboard_rad


NEUTRAL = (0.0, 0.0, 0.0, 0.0)


def test_a_permitted_demand_passes_unchanged():
    output = Gate(GateConfig(), RUDDER_MAX_RAD, TICK_US).decide(0, ahead(0), Action.NONE, True, READY)
    assert values(output) == (0.5, 0.5, 0.1, 0.1)
    assert (output.cause, output.t_us) == ("demand", 0)


def test_manual_is_recorded_in_the_cause():
    output = Gate(GateConfig(), RUDDER_MAX_RAD, TICK_US).decide(
        0, ahead(0), Action.WARN, True, Evidence(True, "", manual=True)
    )
    assert output.cause == "manual"


@pytest.mark.parametrize(
    ("demand", "action", "armed", "evidence", "cause"),
    [
        (ahead(0), Action.NONE, False, READY, "disarmed"),
        (ahead(0), Action.NONE, 1, READY, "disarmed"),
        (ahead(0), Action.STOP, True, READY, "failsafe STOP"),
        (ahead(0), Action.DISARM, True, READY, "failsafe DISARM"),
        (ahead(0), Action.TERMINATE, True, READY, "terminated"),
        (ahead(0), None, True, READY, "unknown action"),
        (ahead(0), Action.NONE, True, Evidence(), "no evidence"),
        (ahead(0), Action.NONE, True, Evidence(False, ""), "actuators not ready"),
        (ahead(0), Action.NONE, True, Evidence(True, "", emergency_stop=True), "emergency stop"),
        (None, Action.NONE, True, READY, "no demand"),
        (ahead(-100_001), Action.NONE, True, READY, "stale demand"),
        (ahead(1), Action.NONE, True, READY, "stale demand"),
        (ahead(0, math.nan), Action.NONE, True, READY, "demand is not a number"),
        (ahead(0, 0.5, math.inf), Action.NONE, True, READY, "demand is not a number"),
        (ActuatorDemand(0, None, 0.0, 0.0, 0.0), Action.NONE, True, READY, "fault: TypeError"),
        (ahead(0), Action.NONE, True, None, "fault: AttributeError"),
    ],
)
def test_whatever_is_missing_gives_neutral_with_its_cause(demand, action, armed, evidence, cause):
    output = Gate(GateConfig(), RUDDER_MAX_RAD, TICK_US).decide(0, demand, action, armed, evidence)
    assert values(output) == NEUTRAL
    assert output.cause == cause


def test_a_demand_of_exactly_two_periods_still_counts():
    output = Gate(GateConfig(), RUDDER_MAX_RAD, TICK_US).decide(100_000, ahead(0), Action.NONE, True, READY)
    assert output.thruster_port == 0.5


@pytest.mark.parametrize("action", [Action.NONE, Action.WARN, Action.HOLD, Action.RETURN])
def test_actions_that_sail_let_the_demand_pass(action):
    assert Gate(GateConfig(), RUDDER_MAX_RAD, TICK_US).decide(0, ahead(0), action, True, READY).thruster_port == 0.5


def test_termination_outlasts_everything_but_a_restart():
    gate = Gate(GateConfig(), RUDDER_MAX_RAD, TICK_US)
    assert not gate.terminated
    gate.decide(0, ahead(0), Action.TERMINATE, True, READY)
    output = gate.decide(TICK_US, ahead(TICK_US), Action.NONE, True, READY)
    assert gate.terminated
    assert (values(output), output.cause) == (NEUTRAL, "terminated")


def test_values_stay_inside_each_channel():
    gate = Gate(GateConfig(thruster_min=-0.3, thruster_max=0.6), math.radians(20.0), TICK_US)
    limit = math.radians(20.0)
    assert values(gate.decide(0, ahead(0, 9.0, 9.0), Action.NONE, True, READY)) == (0.6, 0.6, limit, limit)
    assert values(gate.decide(1, ahead(1, -9.0, -9.0), Action.NONE, True, READY)) == (-0.3, -0.3, -limit, -limit)


def test_row_20_full_ahead_to_full_astern_is_slewed():
    """Fault row 20: away from neutral at the configured rate, toward neutral at once, also after a failsafe."""
    gate = Gate(GateConfig(thruster_rate=2.0, rudder_rate_degps=60.0), RUDDER_MAX_RAD, TICK_US)
    gate.neutral(0, "start")
    now, thrust = 0, []
    for wanted in [1.0] * 12 + [-1.0] * 12:
        now += TICK_US
        thrust.append(gate.decide(now, ahead(now, wanted), Action.NONE, True, READY).thruster_port)
    assert thrust[:10] == pytest.approx([0.1 * i for i in range(1, 11)])
    assert thrust[11:14] == pytest.approx([1.0, -0.1, -0.2])
    now += TICK_US
    assert gate.decide(now, ahead(now, -1.0), Action.STOP, True, READY).thruster_port == 0.0
    now += TICK_US
    assert gate.decide(now, ahead(now, -1.0), Action.NONE, True, READY).thruster_port == pytest.approx(-0.1)


def test_a_demand_for_neutral_is_a_demand_where_changes_are_slewed_too():
    gate = Gate(GateConfig(thruster_rate=2.0), RUDDER_MAX_RAD, TICK_US)
    gate.neutral(0, "start")
    assert gate.decide(TICK_US, ahead(TICK_US, 0.0, 0.0), Action.NONE, True, READY).cause == "demand"


def test_the_rudder_rate_is_in_degrees_per_second():
    gate = Gate(GateConfig(rudder_rate_degps=60.0), RUDDER_MAX_RAD, TICK_US)
    gate.neutral(0, "start")
    output = gate.decide(TICK_US, ahead(TICK_US, 0.0, 1.0), Action.NONE, True, READY)
    assert math.degrees(output.rudder_port_rad) == pytest.approx(3.0)
    assert math.degrees(output.rudder_starboard_rad) == pytest.approx(3.0)


def test_a_pause_or_a_backward_clock_buys_no_step():
    gate = Gate(GateConfig(thruster_rate=1.0), RUDDER_MAX_RAD, TICK_US)
    assert gate.decide(0, ahead(0, 1.0), Action.NONE, True, READY).thruster_port == 0.0
    late = 60_000_000
    assert gate.decide(late, ahead(late, 1.0), Action.NONE, True, READY).thruster_port == pytest.approx(0.1)
    before = late - 1_000_000
    assert gate.decide(before, ahead(before, 1.0), Action.NONE, True, READY).thruster_port == pytest.approx(0.1)


def test_tighter_limits_act_on_the_next_output():
    gate = Gate(GateConfig(), RUDDER_MAX_RAD, TICK_US)
    gate.decide(0, ahead(0, 1.0), Action.NONE, True, READY)
    gate.configure(GateConfig(thruster_max=0.2))
    assert gate.decide(1, ahead(1, 1.0), Action.NONE, True, READY).thruster_port == 0.2


def test_the_oscillation_limit_scales_the_thrusters_only():
    gate = Gate(GateConfig(), RUDDER_MAX_RAD, TICK_US)
    evidence = Evidence(True, "", most=0.3)
    assert values(gate.decide(0, ahead(0, 1.0, 0.2), Action.WARN, True, evidence)) == (0.3, 0.3, 0.2, 0.2)
    assert values(gate.decide(1, ahead(1, -1.0, 0.2), Action.WARN, True, evidence)) == (-0.3, -0.3, 0.2, 0.2)


def test_one_bad_channel_is_enough():
    for channel in range(4):
        numbers = [0.1, 0.2, 0.3, 0.4]
        numbers[channel] = math.nan
        output = Gate(GateConfig(), RUDDER_MAX_RAD, TICK_US).decide(
            0, ActuatorDemand(0, *numbers), Action.NONE, True, READY
        )
        assert (values(output), output.cause) == (NEUTRAL, "demand is not a number")


@pytest.mark.parametrize("wanted", [(0.4, -0.3, 0.2, -0.25), (-0.4, 0.3, -0.2, 0.25)])
def test_each_channel_has_its_own_place_start_and_rate(wanted):
    gate = Gate(GateConfig(thruster_rate=1.0, rudder_rate_degps=math.degrees(1.0)), RUDDER_MAX_RAD, TICK_US)
    seen = [
        values(gate.decide(now, ActuatorDemand(now, *wanted), Action.NONE, True, READY))
        for now in range(0, 12 * TICK_US, TICK_US)
    ]
    assert seen[0] == NEUTRAL, "the first output starts from neutral with no time gone"
    for tick, output in enumerate(seen):
        for value, target in zip(output, wanted, strict=True):
            assert value == pytest.approx(math.copysign(min(abs(target), 0.05 * tick), target))
    now = 12 * TICK_US
    assert values(gate.decide(now, ActuatorDemand(now), Action.NONE, True, READY)) == NEUTRAL, "to neutral at once"


@pytest.mark.parametrize("limit", [0.0, -1.0, math.nan])
def test_an_output_limit_of_nothing_stops_the_thrusters(limit):
    output = Gate(GateConfig(), RUDDER_MAX_RAD, TICK_US).decide(
        0, ahead(0), Action.NONE, True, Evidence(True, "", most=limit)
    )
    assert values(output) == (0.0, 0.0, 0.1, 0.1)


@pytest.mark.parametrize(("period_us", "age_us", "passes"), [(50_000, 150_000, False), (100_000, 150_000, True)])
def test_a_demand_is_stale_after_two_of_the_vessel_s_own_periods(period_us, age_us, passes):
    output = Gate(GateConfig(), RUDDER_MAX_RAD, period_us).decide(age_us, ahead(0), Action.NONE, True, READY)
    assert (output.cause == "demand") is passes


def test_the_settings_have_these_defaults_and_ranges():
    schema = GateConfig.model_json_schema()["properties"]
    shape = {name: (field["default"], field["minimum"], field["maximum"]) for name, field in schema.items()}
    assert shape == {
        "thruster_min": (-1.0, -1, 0),
        "thruster_max": (1.0, 0, 1),
        "thruster_rate": (0.0, 0, 100),
        "rudder_rate_degps": (0.0, 0, 3600),
    }
