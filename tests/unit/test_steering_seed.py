"""Profile ``seed``: the seed's own examples and unit scenario."""

import math

import pytest

from companion.core.steer.law import SeedConfig, SteeringConfig, SteeringError, make_controller, manual_demand, mix
from companion.core.steer.loop_control import Loop
from companion.core.steer.pid import PidGains
from mavlink_bridge.language.messages import Desired, EstimatedState
from mavlink_bridge.language.units import KNOT_MPS
from sitl.plant.library import load_vessel
from tools.benches.cells.foreign_hulls import single_screw

GAINS = {"heading_gains": PidGains(kp=1.8, ki=0.005, kd=0.4), "speed_gains": PidGains(kp=0.6, ki=0.15)}
OTTER = load_vessel("otter")
DT = 0.1


def seed(vessel=OTTER, **changes):
    config = SteeringConfig(profile="seed", seed=SeedConfig(**(GAINS | changes)))
    return make_controller("seed", config, vessel)


def on_the_centre_line():
    return OTTER.model_copy(update={"thruster": OTTER.thruster.model_copy(update={"lateral_m": 0.0})})


def state(psi_deg=0.0, speed_mps=0.0):
    return EstimatedState(0, psi_rad=math.radians(psi_deg), u_mps=speed_mps, sog_mps=speed_mps, r_radps=0.0)


@pytest.mark.parametrize(
    ("common", "differential", "expected"),
    [(1, 0.2, (1.0, 0.6)), (0.5, 0.2, (0.7, 0.3)), (-1, 0.2, (-0.6, -1.0)), (1, -0.2, (0.6, 1.0)), (0, 1.2, (1, -1))],
)
def test_mix_keeps_the_difference(common, differential, expected):
    assert mix(common, differential, 1.0) == pytest.approx(expected)


def test_refuses_to_start_without_gains_and_names_both_keys():
    with pytest.raises(SteeringError, match=r"steering\.seed\.heading_gains and steering\.seed\.speed_gains"):
        make_controller("seed", SteeringConfig(profile="seed"), OTTER)


def test_an_unknown_profile_is_refused_with_the_choices():
    with pytest.raises(SteeringError, match="'seed', 'model' or 'module:Class'"):
        make_controller("fuzzy", SteeringConfig(), OTTER)


@pytest.mark.parametrize(("speed_kn", "share"), [(0.5, 0.2), (3.0, 0.8)])
def test_thruster_share_at_low_and_high_speed(speed_kn, share):
    """The seed's "go to": 20 % of the heading output goes to the thrusters at low speed, 80 % at high speed."""
    controller = seed(max_thruster_differential=1.0)
    here = state(0.0, speed_kn * KNOT_MPS)
    # within saturation: 0.1 rad of error, no history
    demand, trace = controller.step(0, DT, here, Desired(0.1, here.u_mps), None)
    output = trace.heading_p
    assert (demand.thruster_port - demand.thruster_starboard) / 2 == pytest.approx(share * output)
    assert demand.rudder_port_rad == pytest.approx((1 - share) * output * OTTER.rudder.max_rad)


def test_share_has_hysteresis():
    controller = seed()
    split = []
    for speed_kn in (1.05, 1.2, 0.95, 0.85, 1.05):
        demand, _ = controller.step(0, DT, state(0.0, speed_kn * KNOT_MPS), Desired(0.05, 0.0), None)
        split.append(demand.rudder_port_rad > 0.5 * 0.05 * 1.8 * OTTER.rudder.max_rad)
    assert split == [True, False, False, True, True]


def test_the_seeds_unit_scenario():
    """90° at 3 kn in ten linear steps, then -90° at 5 kn in ten steps, then hold: signs and priorities are right."""
    controller = seed()
    for turn, knots, start in ((90.0, 3.0, 0.0), (-90.0, 5.0, 90.0)):
        wanted = Desired(math.radians(turn), knots * KNOT_MPS)
        for k in range(10):
            psi = start + (turn - start) * k / 10
            demand, _ = controller.step(0, DT, state(psi, knots * KNOT_MPS * k / 10), wanted, None)
            to_starboard = turn > start
            if k < 8:
                assert (demand.thruster_port > demand.thruster_starboard) == to_starboard
                assert (demand.rudder_port_rad > 0) == to_starboard
            assert abs(demand.thruster_port - demand.thruster_starboard) <= 0.4 + 1e-9
            assert max(abs(demand.thruster_port), abs(demand.thruster_starboard)) <= 1.0
    held = [controller.step(0, DT, state(-90.0, 5 * KNOT_MPS), wanted, None)[0] for _ in range(20)]
    assert abs(held[-1].rudder_port_rad) < math.radians(2)
    assert held[-1].thruster_port == pytest.approx(held[-1].thruster_starboard, abs=0.05)


def test_rate_limit_holds_both_ways():
    controller = seed(max_thruster_rate=0.5)
    last = 0.0
    for wanted in [2.0] * 30 + [0.0] * 30:
        demand, _ = controller.step(0, DT, state(), Desired(None, wanted), None)
        assert abs(demand.thruster_port - last) <= 0.05 + 1e-9
        last = demand.thruster_port


def test_no_kick_on_a_reference_step_across_south():
    """The derivative is of the wrapped difference: a target crossing astern is no 2 pi jump."""
    controller = seed()
    controller.step(0, DT, state(0.0), Desired(math.radians(179), 0.0), None)
    _, trace = controller.step(0, DT, state(0.0), Desired(math.radians(-179), 0.0), None)
    assert abs(trace.heading_d) < 0.4 * math.radians(2.1) / DT


def test_a_pause_does_not_reach_the_integral():
    controller = seed()
    controller.step(0, DT, state(), Desired(0.5, 1.0), None)
    controller.step(0, 600.0, state(), Desired(0.5, 1.0), None)
    _, trace = controller.step(0, DT, state(), Desired(0.5, 1.0), None)
    assert abs(trace.speed_i) < 0.1


def test_the_speed_loop_begins_without_a_kick_and_forgets_what_it_was():
    """A loop that was off has no error to take a slope from; -2 m/s in a tick was full astern."""
    controller = seed(speed_gains=PidGains(kp=0.2, ki=0.05, kd=0.1))
    demand, trace = controller.step(0, DT, state(), Desired(0.0, 1.0), None)
    assert trace.speed_d == 0.0
    assert demand.thruster_port == pytest.approx(0.2, abs=0.02)
    for _ in range(100):
        controller.step(0, DT, state(), Desired(0.0, 1.0), None)
    controller.step(0, DT, state(), Desired(0.0, None), None)
    demand, trace = controller.step(0, DT, state(), Desired(0.0, 0.0), None)
    assert (trace.speed_i, trace.speed_d) == (0.0, 0.0)
    assert demand.thruster_port == pytest.approx(0.0, abs=0.01)


def test_changed_gains_take_effect_from_a_clean_memory():
    controller = seed()
    for _ in range(50):
        controller.step(0, DT, state(), Desired(0.0, 1.0), None)
    changed = SteeringConfig(profile="seed", seed=SeedConfig(**(GAINS | {"speed_gains": PidGains(kp=0.1, ki=0.1)})))
    controller.configure(changed)
    _, trace = controller.step(0, DT, state(), Desired(0.0, 1.0), None)
    assert trace.speed_i == 0.0
    assert trace.speed_p == pytest.approx(0.1)


def test_gains_of_one_loop_begin_both_anew_as_in_the_original():
    controller = seed(speed_gains=PidGains(kp=0.2, ki=0.05, kd=0.1))
    for _ in range(50):
        controller.step(0, DT, state(), Desired(0.1, 1.0), None)
    heading = {"heading_gains": PidGains(kp=1.0, ki=0.01), "speed_gains": PidGains(kp=0.2, ki=0.05, kd=0.1)}
    controller.configure(SteeringConfig(profile="seed", seed=SeedConfig(**heading)))
    _, trace = controller.step(0, DT, state(), Desired(0.1, 1.0), None)
    assert (trace.heading_i, trace.speed_i) == (0.0, 0.0)
    assert trace.speed_d == 0.0, "a first error has no slope"


def test_sticks_give_the_whole_yaw_and_never_overflow():
    demand = manual_demand(0, 1.0, 0.5, SteeringConfig(), OTTER)
    assert (demand.thruster_port, demand.thruster_starboard) == pytest.approx((1.0, 0.0))
    assert demand.rudder_starboard_rad == pytest.approx(0.5 * OTTER.rudder.max_rad)


@pytest.mark.parametrize("vessel", [single_screw(), on_the_centre_line()], ids=["one screw", "two on the centre line"])
def test_the_yaw_stick_never_moves_a_boat_whose_thrusters_do_not_turn_it(vessel):
    """To starboard it had sent one screw ahead, to port astern, and stopped it in a turn to port under way."""
    for surge in (0.0, 0.6, -0.3):
        for yaw in (-1.0, -0.5, 0.0, 0.5, 1.0):
            demand = manual_demand(0, surge, yaw, SteeringConfig(), vessel)
            assert (demand.thruster_port, demand.thruster_starboard) == (surge, surge)
            assert demand.rudder_port_rad == pytest.approx(yaw * vessel.rudder.max_rad)


def test_the_seeds_law_steers_one_screw_by_its_rudder_alone():
    controller = seed(single_screw())
    controller.loops.enable(Loop.BOTH, 1)
    turning, straight = (controller.step(0, DT, state(), Desired(psi, 1.0), None)[0] for psi in (0.5, 0.0))
    assert turning.thruster_port == pytest.approx(straight.thruster_port, abs=0.02)
    assert turning.rudder_port_rad > 0.0


def test_abort_is_neutral_at_once_and_stays_until_a_newer_scope_after_rearm():
    controller = seed()
    wanted = Desired(0.5, 1.0)
    controller.loops.enable(Loop.BOTH, 7)
    assert controller.step(0, DT, state(), wanted, None)[0].thruster_port != 0.0
    controller.loops.abort()
    demand, _ = controller.step(0, DT, state(), wanted, None)
    assert (demand.thruster_port, demand.thruster_starboard, demand.rudder_port_rad) == (0.0, 0.0, 0.0)
    assert not controller.loops.enable(Loop.BOTH, 8)
    controller.loops.rearm()
    assert not controller.loops.enable(Loop.BOTH, 7)
    assert controller.loops.enable(Loop.BOTH, 8)
    assert controller.step(0, DT, state(), wanted, None)[0].thruster_port != 0.0


def test_late_scopes_are_ignored():
    loops = seed().loops
    assert loops.enable(Loop.BOTH, 5)
    assert not loops.disable(Loop.BOTH, 4)
    assert loops.active is Loop.BOTH
    assert loops.disable(Loop.SPEED, 5)
    assert loops.active is Loop.HEADING


def test_heading_loop_alone_leaves_the_speed_alone():
    controller = seed()
    controller.loops.disable(Loop.SPEED, 1)
    demand, trace = controller.step(0, DT, state(), Desired(0.5, 2.0), None)
    assert demand.thruster_port == pytest.approx(-demand.thruster_starboard)
    assert trace.speed_error_mps is None
