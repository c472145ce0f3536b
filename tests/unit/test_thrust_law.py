"""Propellers that are not the square of their command: the simulated hull, the statics and the law's inverse tell one story."""

import math
from itertools import pairwise

import pytest
from pydantic import ValidationError

from companion.core.hull.actuator_model import ActuatorModel
from companion.core.hull.statics import stopping_distance_m, throttle_to_speed, top_speed_mps
from companion.core.hull.stopping import Braking
from companion.core.hull.thrust import ThrustLaw
from companion.core.hull.vessel_file import ThrusterConfig, VesselConfig
from mavlink_bridge.language.messages import ActuatorOutput
from sitl.plant.hull import SimVessel
from sitl.plant.library import load_vessel
from tools.benches.cells.depth_runs import under_way

OTTER = load_vessel("otter")
CURVE = ((-1.0, -1.0), (-0.3, -0.1), (0.0, 0.0), (0.2, 0.1), (0.6, 0.7), (1.0, 1.0))


def hull(**keys) -> VesselConfig:
    return OTTER.model_copy(update={"thruster": OTTER.thruster.model_copy(update=keys)})


HULLS = {
    "exponents": hull(exponent=1.19, exponent_astern=1.5),
    "table": hull(curve=CURVE),
    "speed": hull(speed_loss=0.12),
    "sides": hull(starboard_share=0.8, exponent=1.5, speed_loss=0.05),
    "single": hull(count=1, lateral_m=0.0, exponent=1.3),
}


@pytest.mark.parametrize("name", HULLS)
@pytest.mark.parametrize("surge", [0.0, 1.5, -0.6])
def test_the_command_for_a_thrust_gives_that_thrust(name, surge):
    law = ThrustLaw(HULLS[name])
    for side in (0, 1):
        for command in (-0.9, -0.4, 0.35, 0.6, 0.95):
            force = law.thrust_n(side, law.revs(command), surge)
            if abs(force) > 0.02 * law.ahead_n:
                assert law.command(side, force, surge) == pytest.approx(command, abs=1e-9)


@pytest.mark.parametrize("name", HULLS)
def test_commands_grow_with_the_thrust_and_pass_through_zero(name):
    law = ThrustLaw(HULLS[name])
    commands = [law.command(1, 0.002 * k * law.ahead_n, 0.3) for k in range(-300, 500)]
    assert all(a <= b for a, b in pairwise(commands))
    assert law.command(1, 0.0, 0.3) == 0.0
    assert law.command(0, 1e6, 1.0) == 1.0
    assert law.command(0, -1e6, 1.0) == -1.0


@pytest.mark.parametrize("name", HULLS)
@pytest.mark.parametrize("share", [0.1, 0.3, 0.8])
def test_a_share_of_the_thrust_that_is_left_is_thrust_and_not_command(name, share):
    law = ThrustLaw(HULLS[name])
    most = law.most_command(share)
    given = [law.thrust_n(side, law.revs(sign * most), 0.0) for side in (0, 1) for sign in (1, -1)]
    full = [law.thrust_n(side, law.revs(sign), 0.0) for side in (0, 1) for sign in (1, -1)]
    shares = [some / whole for some, whole in zip(given, full, strict=True)]
    assert max(shares) == pytest.approx(share)
    assert (law.most_command(0.0), law.most_command(1.0), law.most_command(math.nan)) == (0.0, 1.0, 0.0)


@pytest.mark.parametrize("name", [name for name in HULLS if name != "sides"])
@pytest.mark.parametrize("command", [0.2, 0.5, 1.0])
def test_the_simulated_boat_settles_at_the_speed_that_the_file_says(name, command):
    boat = SimVessel(HULLS[name])
    for _ in range(1500):
        boat.step(0.02, command, command, 0.0, 0.0)
    assert boat.u_mps == pytest.approx(throttle_to_speed(HULLS[name], command), rel=0.01)


def test_a_share_of_one_and_an_exponent_of_two_are_todays_boat():
    plain, same = SimVessel(OTTER), SimVessel(hull(curve=((-1.0, -1.0), (0.0, 0.0), (1.0, 1.0))))
    assert ThrustLaw(OTTER).plain
    assert not ThrustLaw(same.config).plain
    for _ in range(100):
        plain.step(0.02, 1.0, 0.0, 0.1, 0.1)
        same.step(0.02, 1.0, 0.0, 0.1, 0.1)
    # the table settles at the same thrust; only the square between differs
    assert same.thrust_n == pytest.approx(plain.thrust_n)


@pytest.mark.parametrize("name", HULLS)
@pytest.mark.parametrize("least", [-1.0, -0.3])
def test_thrust_astern_stops_the_boat_within_the_stopping_distance(name, least):
    vessel = HULLS[name]
    speed, braking = 0.9 * top_speed_mps(vessel), Braking(vessel, least=least)
    boat = under_way(vessel, speed)
    while boat.u_mps > braking.until_mps:
        boat.step(0.01, least, least, 0.0, 0.0)
    while boat.u_mps > 0.001:
        boat.step(0.01, 0.0, 0.0, 0.0, 0.0)
    assert 0.7 * braking.way_m(speed) < boat.north_m < braking.way_m(speed)


def test_the_guards_reckon_with_the_upper_bound():
    careful = OTTER.model_copy(update={"stopping_factor": 1.3})
    assert stopping_distance_m(careful, 2.0) == pytest.approx(1.3 * stopping_distance_m(OTTER, 2.0))
    assert Braking(careful).way_m(2.0) == pytest.approx(1.3 * Braking(OTTER).way_m(2.0))


def test_a_rudder_that_stands_off_its_middle_turns_the_boat_and_the_file_says_which_way():
    rudder = OTTER.rudder.model_copy(update={"offset_deg": 4.0})
    boat = SimVessel(OTTER.model_copy(update={"rudder": rudder}))
    boat.place(surge_mps=1.5)
    for _ in range(300):
        boat.step(0.02, 0.56, 0.56, 0.0, 0.0)
    assert math.degrees(boat.r_radps) > 1.0


@pytest.mark.parametrize(
    "curve",
    [((-1, -1), (1, 1)), ((-1, -1), (0, 0), (0.5, 0.9), (0.6, 0.2), (1, 1)), ((-1, -1), (0, 0), (1, 0.9))],
)
def test_a_table_that_does_not_rise_through_zero_is_refused(curve):
    with pytest.raises(ValidationError, match="must rise"):
        ThrusterConfig(ahead_n=1, astern_n=1, curve=curve)


def test_a_rudder_that_stands_off_stops_at_its_stop_for_the_observer_as_for_the_hull():
    """Hard over with an offset of 5 degrees it was reckoned at 35, of a servo that goes to 30."""
    offset = OTTER.model_copy(update={"rudder": OTTER.rudder.model_copy(update={"offset_deg": 5.0})})
    model, full = ActuatorModel(offset), offset.rudder.max_rad
    for _ in range(100):
        model.step(0.05, ActuatorOutput(0, 0.0, 0.0, full, full, "demand"))
    assert model.rudder_rad == pytest.approx(full)
