"""The gate's invariants (architecture-study §4.7) for inputs of any kind."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings, strategies as st

from companion.core.guard.gate import Evidence, Gate, GateConfig
from mavlink_bridge.language.messages import Action, ActuatorDemand, ActuatorOutput

NUMBER = st.floats(allow_nan=True, allow_infinity=True) | st.none() | st.just("ahead")
SANE = st.floats(-5.0, 5.0)
ACTION = st.sampled_from(list(Action))
CONFIG = st.builds(
    GateConfig,
    thruster_min=st.floats(-1.0, 0.0),
    thruster_max=st.floats(0.0, 1.0),
    thruster_rate=st.sampled_from([0.0, 0.1, 2.0, 50.0]),
    rudder_rate_degps=st.sampled_from([0.0, 30.0, 400.0]),
)
READY = Evidence(True, "")
PERIOD_US = 50_000


def demands(number: st.SearchStrategy[object], age_us: st.SearchStrategy[int]) -> st.SearchStrategy[object]:
    def build(age: int, values: list[object]) -> object:
        return age, values

    return st.builds(build, age_us, st.lists(number, min_size=4, max_size=4))


STEPS = st.lists(
    st.tuples(
        st.integers(-10_000_000, 10_000_000),
        st.none() | demands(NUMBER, st.integers(-300_000, 300_000)),
        ACTION | st.none() | st.just(99),
        st.booleans() | st.none(),
        st.none() | st.builds(Evidence, st.booleans(), st.text(max_size=5), st.booleans(), st.booleans(), NUMBER),
    ),
    max_size=12,
)


def channels(output: ActuatorOutput) -> tuple[float, float, float, float]:
    return output.thruster_port, output.thruster_starboard, output.rudder_port_rad, output.rudder_starboard_rad


@settings(max_examples=200, deadline=None)
@given(CONFIG, st.floats(0.0, 1.5), STEPS)
def test_invariants_1_to_4_whatever_comes(config, rudder, steps):
    gate, now = Gate(config, rudder, PERIOD_US), 0
    terminated = False
    low = (config.thruster_min, config.thruster_min, -rudder, -rudder)
    high = (config.thruster_max, config.thruster_max, rudder, rudder)
    for dt, made, action, armed, evidence in steps:
        now += dt
        demand = None if made is None else ActuatorDemand(now - made[0], *made[1])
        output = gate.decide(now, demand, action, armed, evidence)
        terminated = terminated or action == Action.TERMINATE
        # 1: an output every tick, stamped, with a cause
        assert isinstance(output, ActuatorOutput)
        assert (output.t_us, bool(output.cause)) == (now, True)
        # 4: finite and inside each channel's range
        for value, least, most in zip(channels(output), low, high, strict=True):
            assert math.isfinite(value)
            assert least <= value <= most
        # 2 and 3: anything short of full permission is neutral
        permitted = armed is True and action in (Action.NONE, Action.WARN, Action.HOLD, Action.RETURN)
        permitted = permitted and evidence is not None and evidence.actuator_ready and not evidence.emergency_stop
        fresh = made is not None and 0 <= made[0] <= 2 * PERIOD_US
        if not (permitted and fresh and not terminated):
            assert channels(output) == (0.0, 0.0, 0.0, 0.0)
            assert output.cause not in ("demand", "manual")


@settings(max_examples=150, deadline=None)
@given(
    CONFIG,
    st.lists(
        st.tuples(st.integers(-100_000, 400_000), st.lists(SANE, min_size=4, max_size=4), ACTION),
        min_size=1,
        max_size=20,
    ),
)
def test_invariant_5_away_from_neutral_is_limited_toward_it_is_not(config, steps):
    rudder = 0.5
    gate, now = Gate(config, rudder, PERIOD_US), 0
    last = (0.0, 0.0, 0.0, 0.0)
    last_us = None
    rudder_rate = math.radians(config.rudder_rate_degps)
    rates = (config.thruster_rate, config.thruster_rate, rudder_rate, rudder_rate)
    highs = (config.thruster_max, config.thruster_max, rudder, rudder)
    lows = (config.thruster_min, config.thruster_min, -rudder, -rudder)
    for dt, values, action in steps:
        now += dt
        output = gate.decide(now, ActuatorDemand(now, *values), action, True, READY)
        elapsed_s = 0.0 if last_us is None else min(max(now - last_us, 0), 2 * PERIOD_US) / 1e6
        for i, value in enumerate(channels(output)):
            wanted = min(max(values[i], lows[i]), highs[i])
            if output.cause != "demand":
                assert value == 0.0
                continue
            toward = last[i] * wanted > 0.0 and abs(wanted) <= abs(last[i])
            if rates[i] == 0.0 or toward or wanted == 0.0:
                assert value == wanted
            else:
                start = last[i] if last[i] * wanted > 0.0 else 0.0
                reach = abs(start) + rates[i] * elapsed_s
                assert abs(value) == pytest.approx(min(abs(wanted), reach), abs=1e-12)
                assert value * wanted >= 0.0
        last, last_us = channels(output), now


@given(st.floats(0.0, 1.0), SANE)
def test_an_output_limit_caps_both_thrusters(limit, wanted):
    output = Gate(GateConfig(), 0.5, PERIOD_US).decide(
        0, ActuatorDemand(0, wanted, wanted, 0.1, 0.1), Action.WARN, True, Evidence(True, "", most=limit)
    )
    assert abs(output.thruster_port) <= limit
    assert output.thruster_starboard == output.thruster_port
    assert output.rudder_port_rad == 0.1
