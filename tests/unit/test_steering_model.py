"""Profile ``model``: what it promises beyond the closed-loop figures."""

import math

import pytest

from companion.core.steer.law import ModelConfig, SteeringConfig, make_controller
from mavlink_bridge.language.messages import Desired, EstimatedState
from mavlink_bridge.language.units import wrap_pi
from sitl.plant.library import load_vessel, vessel_names
from tools.benches.cells.control_loop import ControlLoop, Setup

OTTER = load_vessel("otter")
DT = 0.05


def state(psi_deg=0.0, speed=1.5, rate=0.0):
    return EstimatedState(0, psi_rad=math.radians(psi_deg), u_mps=speed, sog_mps=speed, r_radps=rate)


def loop(vessel=OTTER, belief=None):
    run = ControlLoop(Setup(vessel, belief=belief))
    run.place(0.0, 0.0, 0.0, 1.5)
    return run


def test_a_change_of_gains_is_bumpless():
    run = loop()
    for _ in range(300):
        run.steer(Desired(0.1, 1.5))
    run.vessel.psi_rad += 0.05
    run.steer(Desired(0.1, 1.5))
    before = run.sent
    run.controller.configure(SteeringConfig(model=ModelConfig(heading_bandwidth=1.0)))
    run.steer(Desired(0.1, 1.5))
    assert run.sent.rudder_port_rad == pytest.approx(before.rudder_port_rad, abs=math.radians(6))
    assert run.sent.thruster_port == pytest.approx(before.thruster_port, abs=0.05)


def test_integrals_stand_still_while_the_gate_sends_something_else():
    """A failsafe holds neutral for ten seconds against a heading error: nothing has wound up after it."""
    controller = make_controller("model", SteeringConfig(), OTTER)
    controller.reset(state())
    run = loop()
    neutral = run.gate.neutral(0, "failsafe")
    for _ in range(200):
        _, trace = controller.step(0, DT, state(20.0), Desired(0.0, 2.5), neutral)
    assert trace.heading_i == pytest.approx(0.0, abs=1.0)
    assert trace.speed_i == pytest.approx(0.0, abs=3.0)


def test_a_big_turn_does_not_wind_up():
    run = loop()
    for _ in range(20 * 20):
        run.steer(Desired(math.radians(179.0), 1.5))
    overshoot = 0.0
    for _ in range(20 * 10):
        run.steer(Desired(math.radians(179.0), 1.5))
        error = math.remainder(run.vessel.psi_rad - math.radians(179.0), 2 * math.pi)
        overshoot = max(overshoot, abs(error))
    assert overshoot < math.radians(2.0)


@pytest.mark.parametrize("name", vessel_names())
def test_every_shipped_hull_turns_and_settles(name):
    run = loop(load_vessel(name))
    for _ in range(20 * 25):
        run.steer(Desired(math.radians(90.0), 1.5))
    assert math.degrees(run.vessel.psi_rad) == pytest.approx(90.0, abs=2.0)
    assert run.vessel.surge_over_ground_mps == pytest.approx(1.5, abs=0.1)


def test_one_thruster_and_a_rudder():
    thruster = OTTER.thruster.model_copy(update={"count": 1, "ahead_n": 239.0, "astern_n": 133.0})
    run = loop(OTTER.model_copy(update={"thruster": thruster}))
    for _ in range(20 * 25):
        run.steer(Desired(math.radians(90.0), 1.5))
        assert run.sent.thruster_port == pytest.approx(run.sent.thruster_starboard)
    assert math.degrees(run.vessel.psi_rad) == pytest.approx(90.0, abs=2.0)


@pytest.mark.parametrize("wrong", [0.7, 1.3])
def test_a_wrong_model_still_settles(wrong):
    run = loop(belief=OTTER.scaled(mass=wrong, drag=wrong))
    worst = 0.0
    for tick in range(20 * 25):
        run.steer(Desired(math.radians(90.0), 1.5))
        if tick > 20 * 8:
            worst = max(worst, abs(run.vessel.psi_rad - math.radians(90.0)))
    assert worst < math.radians(3.0)


def test_rudders_do_the_work_at_speed():
    """At 2.5 m/s a small turn is the rudders' business: the thrusters hardly differ."""
    run = ControlLoop(Setup(OTTER))
    run.place(0.0, 0.0, 0.0, 2.5)
    for _ in range(200):
        run.steer(Desired(0.0, 2.5))
    differential = rudder = 0.0
    for _ in range(40):
        run.steer(Desired(math.radians(15.0), 2.5))
        differential = max(differential, abs(run.sent.thruster_port - run.sent.thruster_starboard))
        rudder = max(rudder, abs(run.sent.rudder_port_rad))
    assert rudder > math.radians(8.0)
    assert differential < 0.05


def test_rudders_that_stall_before_their_stop_are_not_put_beyond():
    """Hard over they would turn a boat with one dead thruster less than at 20 degrees, and she could not be held."""
    stalling = OTTER.model_copy(update={"rudder": OTTER.rudder.model_copy(update={"stall_deg": 20.0})})
    run = loop(stalling)
    run.vessel.thruster_health[0] = 0.0
    run.controller.thrusters((0.0, 1.0))
    run.place(0.0, 0.0, 0.0, 1.4)
    for _ in range(600):
        run.steer(Desired(math.radians(20.0), 1.4))
        assert abs(run.sent.rudder_port_rad) <= math.radians(20.0) + 1e-9
    assert wrap_pi(run.vessel.psi_rad) == pytest.approx(math.radians(20.0), abs=math.radians(3.0))


@pytest.mark.parametrize("share", [0.3, 0.7])
def test_turning_on_the_spot_asks_no_more_than_the_weaker_side_can_give(share):
    """More would be thrust ahead that nobody asked for, on one side only."""
    catamaran = load_vessel("wamv")
    vessel = catamaran.model_copy(update={"thruster": catamaran.thruster.model_copy(update={"starboard_share": share})})
    ways = []
    for sense in (1.0, -1.0):
        run = ControlLoop(Setup(vessel))
        run.place(0.0, 0.0, 0.0)
        for _ in range(600):
            run.steer(Desired(sense * math.radians(150.0), 0.0, gentle=True, firmness=1.0))
        ways.append(math.hypot(run.vessel.north_m, run.vessel.east_m))
    assert max(ways) < 0.1, "she stays where she is, to either side"


def test_nothing_wanted_is_neutral():
    controller = make_controller("model", SteeringConfig(), OTTER)
    demand, _ = controller.step(0, DT, state(), Desired(None, None), None)
    assert (demand.thruster_port, demand.thruster_starboard, demand.rudder_port_rad) == (0.0, 0.0, 0.0)


def test_the_first_call_without_time_behind_it_is_finite():
    controller = make_controller("model", SteeringConfig(), OTTER)
    demand, _ = controller.step(0, 0.0, state(), Desired(1.0, 2.0), None)
    assert math.isfinite(demand.thruster_port)
    assert math.isfinite(demand.rudder_port_rad)


def test_rudder_alone_gets_a_kick_of_thrust_to_turn_from_rest():
    """Without way on and without differential there is no flow over the rudder: the propeller has to make it."""
    thruster = OTTER.thruster.model_copy(update={"count": 1, "ahead_n": 239.0, "astern_n": 133.0})
    run = ControlLoop(Setup(OTTER.model_copy(update={"thruster": thruster})))
    run.place(0.0, 0.0, 0.0)
    for _ in range(20 * 30):
        run.steer(Desired(math.radians(90.0), 0.0))
    assert math.degrees(run.vessel.psi_rad) == pytest.approx(90.0, abs=6.0)


def test_without_a_heading_that_is_wanted_no_heading_error_is_integrated():
    """The last one stood, and with a speed alone it went on into the integral: a turn that nobody asked for, when one was again."""
    run = loop()
    for _ in range(20):
        run.steer(Desired(0.09, 1.5))
    for _ in range(200):
        run.steer(Desired(None, 1.5))
    assert run.trace.heading_error_rad == 0.0
    assert abs(run.trace.heading_i) < 1.0
