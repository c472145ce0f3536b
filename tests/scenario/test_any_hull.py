"""Hulls that nobody tuned for, in a current of 0.5 m/s and 8 m/s of wind with gusts and waves: held by the law on the truth."""

import math
import statistics

import pytest

from companion.core.guide import GuidanceConfig
from companion.core.hull import VesselConfig
from companion.core.vehicle.config import VehicleConfig
from companion.core.vehicle.vehicle import Vehicle
from sitl.plant import WaterConfig
from sitl.plant.library import load_vessel
from tools.benches.cells import control_cells as cells
from tools.benches.cells.control_cells import WATERS, Case
from tools.benches.cells.foreign_hulls import any_hull, bare, barge, pontoon
from tools.benches.cells.sensed import SensedState

BLOW = WATERS["0.5 m/s + 8 m/s"]


@pytest.mark.parametrize("munk", [0.5, 1.0])
def test_a_truthful_file_does_not_make_a_rudderless_boat_wander(munk):
    found, _ = cells.legs(Case(bare("otter", munk), BLOW, source=SensedState), 1.5, 50.0)
    assert found.finished
    assert found.rms < 0.16
    assert found.most < 0.6


@pytest.mark.soak
@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("speed", [1.5, 2.5])
@pytest.mark.parametrize("munk", [0.5, 1.0])
@pytest.mark.parametrize("name", ["otter", "plant_b", "wamv"])
def test_rudderless_hulls_hold_legs_and_circles(name, munk, speed, seed):
    case = Case(bare(name, munk), BLOW, source=SensedState, seed=seed)
    legs, _ = cells.legs(case, speed)
    circle = cells.ring(case, 20.0, speed)
    assert legs.finished
    assert circle.finished
    assert legs.rms < (0.12 if speed == 1.5 else 0.3)
    assert circle.rms < 0.3


def test_a_boat_without_rudders_gives_up_way_to_turn_at_full_speed():
    """All thrust drives her there. A law that held the speed hardly turned her: up to 3 m off this circle, 0.5 m off the legs."""
    case = Case(bare("wamv", 0.5), BLOW, source=SensedState, seed=2)
    legs, _ = cells.legs(case, 2.5)
    assert legs.rms < 0.25
    assert cells.ring(case, 20.0, 2.5).rms < 0.3


@pytest.mark.parametrize(
    ("name", "current_mps", "to_deg", "most_m"),
    [
        ("launch", 0.5, 90.0, 2.2),
        pytest.param("otter", 1.2, 60.0, 4.0, marks=pytest.mark.soak),
        ("blueboat", 0.8, 110.0, 2.0),
        pytest.param("wamv", 1.2, 60.0, 4.0, marks=pytest.mark.soak),
    ],
)
def test_corners_are_kept_in_a_current(name, current_mps, to_deg, most_m):
    """Where the bow must swing by more than the path turns: 3.2, 12, 3.6 and 11 m beside the legs when it began at the corner."""
    water = WaterConfig(current_mps=current_mps, current_to_deg=to_deg)
    found = cells.big_square(Case(any_hull(name), water, source=SensedState), 1.5)
    assert found.whole.finished
    assert found.whole.most < most_m


def test_a_corner_is_kept_in_a_current_by_a_hull_that_turns_faster_than_her_file_says():
    """Timed by the file alone, the bow came round 4 m inside of each corner; the first, where no turn was seen yet, is left by 2.1 m."""
    truth = load_vessel("wamv")
    slow = truth.model_copy(
        update={"hull": truth.hull.model_copy(update={"nr": 2.0 * truth.hull.nr, "nrr": 2.0 * truth.hull.nrr})}
    )
    water = WaterConfig(current_mps=0.5, current_to_deg=60.0)
    found = cells.big_square(Case(truth, water, source=SensedState, belief=slow), 1.5)
    assert found.whole.finished
    assert found.whole.most < 2.5
    assert found.whole.rms < 0.3


def test_a_slow_hull_does_not_swing_about_its_legs():
    """A launch whose propellers take 0.8 s, in a blow: a look-ahead shorter than her answer let one run in five swing by 0.44 m RMS."""
    found = [cells.legs(Case(any_hull("launch"), BLOW, source=SensedState, seed=seed), 1.5)[0] for seed in (2, 3)]
    assert max(legs.rms for legs in found) < 0.2
    assert max(legs.activity for legs in found) < 0.33


def test_a_heavy_boat_does_not_swing_past_the_leg_that_she_joins():
    """Her turn towards the leg takes five seconds to become one along it; the arc had none to spare: 0.74 m RMS, in calm water."""
    found, _ = cells.legs(Case(pontoon(), source=SensedState), 1.5)
    assert found.rms < 0.4


def test_a_boat_that_her_rudder_turns_slowly_ends_her_turns_in_time():
    """Her reference turned as if it could stop at once, and swung past, and back: 3.7 m off her legs in calm water, 5.7 m off a circle."""
    case = Case(barge(), source=SensedState)
    legs, _ = cells.legs(case, 1.0)
    assert legs.rms < 0.3
    assert cells.ring(case, 20.0, 1.0, laps=1.0).rms < 0.15


@pytest.mark.parametrize(
    ("name", "rate_dps", "rms_m"),
    [("single", 8.0, 0.35), ("plant_b", 8.0, 0.06)],
)
def test_a_slow_rudder_servo_is_reckoned_with(name, rate_dps, rms_m):
    """A boat of one screw was 3.8 m beside her legs, helm from stop to stop, when the law knew the servo's lag alone."""
    quick = any_hull(name)
    slow = quick.model_copy(update={"rudder": quick.rudder.model_copy(update={"rate_dps": rate_dps})})
    found, _ = cells.legs(Case(slow, WATERS["0.3 m/s + 4 m/s"], source=SensedState), 1.5)
    assert found.finished
    assert found.rms < rms_m


def four_hundred_kilos() -> VesselConfig:
    """Heavy and of little power."""
    otter = load_vessel("otter")
    mass = {"mass_kg": 400.0, "m11_kg": 430.0, "m22_kg": 700.0, "m23_kgm": 0.0, "m33_kgm2": 380.0, "length_m": 3.0}
    damping = {"xu": 12.0, "xuu": 14.0, "nr": 300.0, "nrr": 2000.0, "yv": 500.0, "yvv": 700.0}
    thrust = {"ahead_n": 110.0, "astern_n": 65.0, "lateral_m": 0.4}
    return otter.model_copy(
        update={
            "hull": otter.hull.model_copy(update=mass | damping),
            "thruster": otter.thruster.model_copy(update=thrust),
            "rudder": otter.rudder.model_copy(update={"area_m2": 0.025, "x_m": -1.5}),
        }
    )


def test_the_noise_of_a_compass_does_not_work_the_propellers_of_a_heavy_slow_boat_from_stop_to_stop():
    """Thirty full swings a minute in still water, by a reference quicker than anything that turns her at so little speed."""
    loop = Case(four_hundred_kilos(), source=SensedState).loop()
    loop.place(0.0, 0.0, 0.0, 0.4)
    loop.sail(loop.goto(100.0, 0.0))
    side, swings = 0.0, 0
    while loop.t_s < 120.0:
        loop.tick(0.4)
        assert loop.sent is not None
        if abs(loop.sent.thruster_port) > 0.5:
            now = math.copysign(1.0, loop.sent.thruster_port)
            swings += now == -side
            side = now
    assert swings <= 30


def test_a_boat_that_loses_her_way_slowly_slows_early_for_a_corner():
    """Planned to lose 0.3 m/s in a second, she came to it twice as fast as her arc allows, and 4.7 m beyond her next leg."""
    assert cells.big_square(Case(pontoon(), source=SensedState), 1.5).whole.most < 3.0


def test_the_propeller_of_a_heavy_boat_is_not_worked_by_the_noise_of_her_speed():
    """A receiver's noise of 2 cm/s asked for a third of her thrust to and fro."""
    hull = barge()
    weak = hull.model_copy(update={"thruster": hull.thruster.model_copy(update={"ahead_n": 60.0, "astern_n": 40.0})})
    run = Case(weak, source=SensedState).loop()
    run.place(0.0, 0.0, 0.0, 0.6)
    run.sail(run.goto(100.0, 0.0))
    asked = []
    while run.t_s < 60.0:
        run.tick(0.6)
        asked.append(run.sent.thruster_port)
    assert statistics.pstdev(asked[400:]) < 0.1


@pytest.mark.parametrize("east_m", [2.5, -3.5])
def test_a_heavy_boat_ends_her_track_also_when_she_comes_to_it_from_the_side(east_m):
    """Half a second from its end no speed is planned any more: her way to join the track was divided by it, and her autopilot ended."""
    run = Case(pontoon(), source=SensedState).loop()
    run.place(75.0, east_m, 0.0, 1.5)
    run.sail(run.goto(80.0, 0.0), run.frame.to_geodetic(0.0, 0.0))
    while not run.tick(1.5).arrived and run.t_s < 60.0:
        pass
    assert run.t_s < 60.0


def test_the_lowered_top_speed_is_told_and_kept():
    """2.5 m/s ordered where the margins end at 1.8 m/s."""
    vessel = bare("otter", 1.0)
    run = Case(vessel, source=SensedState).loop()
    run.place(0.0, 0.0, 0.0)
    run.sail(run.goto(100.0, 0.0))
    fastest = 0.0
    while run.t_s < 40.0:
        run.tick(2.5)
        fastest = max(fastest, run.vessel.u_mps)
    assert 1.6 < fastest < 1.9


def test_the_lowered_top_speed_stands_in_the_operators_log():
    for munk, told in ((1.0, True), (0.0, False)):
        vehicle = Vehicle(VehicleConfig(), bare("otter", munk))
        assert (
            any(text.text.startswith("Top speed lowered from 3.1 to") for text in vehicle.controls.voice.take()) == told
        )


def test_a_hull_whose_propellers_and_rudders_are_odd_sails_as_straight_as_any_when_its_file_says_so():
    """Thrust with the 1.3rd power, starboard a fifth weaker, dead band 12 %, rudders 4 degrees off their middle."""
    otter = load_vessel("otter")
    thruster = {"exponent": 1.3, "starboard_share": 0.8, "dead_band": 0.12, "speed_loss": 0.05}
    odd = otter.model_copy(
        update={
            "thruster": otter.thruster.model_copy(update=thruster),
            "rudder": otter.rudder.model_copy(update={"offset_deg": 4.0}),
        }
    )
    found, _ = cells.legs(Case(odd, BLOW, source=SensedState), 1.5, 50.0)
    assert found.finished
    assert found.rms < 0.13
    assert found.most < 0.5


def test_a_slow_hull_does_not_stand_beside_her_leg_where_drift_is_not_reckoned_with():
    """She looks 10 m ahead, and the current sets her off by more than the integral's corridor: it never began, 2.3 m for good."""
    no_drift = GuidanceConfig.model_validate({"follow": {"use_drift": False}})
    across = WaterConfig(current_mps=0.4, current_to_deg=90.0)
    run = Case(barge(), across, guidance=no_drift).loop()
    run.place(0.0, 0.0, 0.0)
    run.sail(run.goto(2000.0, 0.0), previous=run.frame.to_geodetic(0.0, 0.0))
    while run.t_s < 140.0:
        run.tick(1.2)
    assert abs(run.vessel.east_m) < 0.2
