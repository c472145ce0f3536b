"""The sea trial as a state machine, in simulated water: announced, inside its circle, ended by whatever ends it."""

import math
import random
from dataclasses import replace

import pytest

from companion.core.guard.fence import FenceConfig
from companion.core.hull.statics import stopping_distance_m, throttle_to_speed
from companion.core.steer import SteeringConfig, manual_demand
from companion.core.trial import Trial, TrialArea, TrialConfig, TrialStanding, free_around
from companion.core.trial.helm_sense import HelmSense
from companion.core.trial.homing import Homing
from companion.core.trial.manoeuvres import Run, Turn, manoeuvres_of
from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.points import NorthEast
from sitl.plant import SimVessel, Water, WaterConfig
from sitl.plant.library import load_vessel
from tools.benches.cells.control_loop import TICK_S, IdealState
from tools.benches.cells.foreign_hulls import single_screw

OTTER = load_vessel("otter")
SEA = WaterConfig(current_mps=0.4, wind_mps=5.0, wave_height_m=0.15)

QUICK = TrialConfig(quick=True)


class Boat:
    """A hull under a trial, tick by tick."""

    def __init__(self, config=QUICK, water=SEA, seed=1, vessel=OTTER):
        self.hull, self.sea, self.eyes = SimVessel(vessel), Water(water, random.Random(seed)), IdealState()
        self.now_us, self.texts, self.sticks, self.config = 0, [], (0.0, 0.0), config
        self.trial = Trial(config, self.state())
        self.furthest_m, self.told = 0.0, TrialStanding.RUNNING

    def state(self) -> EstimatedState:
        return self.eyes.sense(self.now_us, self.hull, None)

    def tick(self, state=None):
        self.now_us += round(TICK_S * 1e6)
        state = state or self.state()
        out = self.trial.step(self.now_us, state, stopping_distance_m(OTTER, state.sog_mps or 0.0))
        self.texts += out.texts
        self.told, self.sticks, self.home = out.told, (out.surge, out.yaw), out.home
        demand = manual_demand(self.now_us, out.surge, out.yaw, SteeringConfig(), self.hull.config)
        for _ in range(2):
            self.sea.step(TICK_S / 2)
            self.hull.step(
                TICK_S / 2,
                demand.thruster_port,
                demand.thruster_starboard,
                demand.rudder_port_rad,
                demand.rudder_starboard_rad,
                self.sea,
            )
        self.furthest_m = max(self.furthest_m, math.hypot(self.hull.north_m, self.hull.east_m))

    def sail(self, seconds, until=lambda boat: False):
        for _ in range(round(seconds / TICK_S)):
            self.tick()
            if until(self) or self.told is not TrialStanding.RUNNING:
                return


def test_each_manoeuvre_is_announced_five_seconds_ahead_with_neutral_sticks():
    boat = Boat()
    boat.sail(60.0, until=lambda b: any("2/" in text for text in b.texts))
    assert "in 5 s: straight at 35 %, then all stop, coasting (half throttle until confirmed)" in boat.texts[-1]
    for _ in range(98):
        boat.tick()
        assert boat.sticks == (0.0, 0.0)
    boat.sail(1.0, until=lambda b: b.sticks[0] != 0.0)
    assert boat.sticks[0] == pytest.approx(0.5 * 0.35)


def test_a_person_who_confirms_gets_the_whole_throttle_from_the_next_manoeuvre_on():
    boat = Boat()
    boat.trial.confirm()
    boat.sail(60.0, until=lambda b: b.sticks[0] > 0.0)
    assert boat.sticks[0] == pytest.approx(0.35)
    assert "Trial: whole throttle allowed" in boat.texts


@pytest.mark.parametrize("seed", [1, 2])
def test_a_quick_trial_is_done_within_its_circle_in_current_wind_and_waves(seed):
    boat = Boat(TrialConfig(radius_m=80.0, quick=True), seed=seed)
    boat.trial.confirm()
    boat.sail(1200.0)
    assert boat.told is TrialStanding.DONE
    assert boat.furthest_m < 80.0
    assert boat.now_us < 720e6
    assert boat.texts[-1].startswith("Trial done")


def test_an_order_ends_it_at_once_and_for_good():
    boat = Boat()
    boat.trial.confirm()
    boat.sail(60.0, until=lambda b: b.sticks[0] > 0.0)
    boat.texts += boat.trial.end("ordered")
    for _ in range(200):
        boat.tick()
        assert boat.sticks == (0.0, 0.0)
        assert boat.told is TrialStanding.ENDED
    assert boat.texts[-1] == "Trial ended: ordered; 1 of 10 manoeuvres done"


def test_a_lost_position_is_waited_for_a_second_and_then_ends_it():
    boat = Boat()
    boat.sail(20.0)
    for k in range(30):
        boat.tick(EstimatedState(boat.now_us))
        assert boat.sticks == (0.0, 0.0)
        assert (boat.told is TrialStanding.ENDED) == (k >= 20)
    assert any("position or heading lost" in text for text in boat.texts)
    boat.sail(5.0)
    assert boat.told is TrialStanding.ENDED


def test_a_silent_compass_ends_it_though_a_course_stands_in_for_the_heading():
    boat = Boat()
    boat.sail(20.0)
    for k in range(60):
        boat.tick(replace(boat.state(), heading_age_s=k * TICK_S))
        if k * TICK_S > 1.25:
            assert boat.sticks == (0.0, 0.0)
            assert not boat.home
    assert any("position or heading lost" in text for text in boat.texts)
    boat.tick()
    assert boat.told is TrialStanding.ENDED
    assert boat.home


def test_a_compass_that_speaks_once_a_second_is_enough():
    boat = Boat()
    boat.sail(20.0)
    for k in range(100):
        boat.tick(replace(boat.state(), heading_age_s=k % 22 * TICK_S))
    assert boat.told is TrialStanding.RUNNING


def test_a_circle_too_small_for_a_manoeuvre_has_it_repeated_twice_and_left_out_but_is_never_left():
    boat = Boat(TrialConfig(radius_m=25.0, quick=True))
    boat.trial.confirm()
    boat.sail(1500.0)
    assert boat.furthest_m < 25.0
    assert sum("the edge of the area is near" in text for text in boat.texts) >= 3
    assert boat.trial.skipped


def test_near_the_edge_the_way_off_is_taken_off_before_the_law_turns_the_boat_round():
    boat = Boat(TrialConfig(radius_m=25.0, quick=True))
    boat.trial.confirm()
    boat.sail(1500.0, until=lambda boat: "the edge of the area is near" in "".join(boat.texts))
    assert not boat.home
    assert abs(boat.sticks[0]) == 1.0
    boat.sail(60.0, until=lambda boat: boat.home)
    assert boat.home


def test_the_edge_is_as_near_as_the_water_sets_a_boat_that_turns():
    """For as long as the fence reckons with, which is a setting; the trial had a figure of its own."""
    outward = {"x_m": 50.0, "y_m": 0.0, "vx_mps": 1.0, "vy_mps": 0.0, "sog_mps": 1.0, "drift_n_mps": 0.8}
    state, area = EstimatedState(0, **outward), TrialArea(NorthEast((0.0, 0.0)), (80.0,))
    near = [
        Homing(area, 0, turn_s).edge_near(state, NorthEast((50.0, 0.0)), 2.0) for turn_s in (FenceConfig().turn_s, 30.0)
    ]
    assert near == [False, True]
    assert TrialConfig().turn_s == FenceConfig().turn_s


def test_a_current_that_the_boat_cannot_stem_ends_it_before_the_edge_is_passed_under_power():
    boat = Boat(TrialConfig(radius_m=40.0, quick=True), WaterConfig(current_mps=2.5))
    boat.sail(600.0)
    assert boat.told is TrialStanding.ENDED
    assert boat.sticks == (0.0, 0.0)
    assert any("outside its area" in text or "not reached" in text for text in boat.texts)


def test_a_run_that_has_settled_ends_before_its_time():
    boat = Boat(TrialConfig(radius_m=300.0), WaterConfig())
    boat.trial.confirm()
    boat.trial.manoeuvres = ((Run(0.5, 60.0),),)
    boat.sail(20.0)
    before_mps = boat.hull.u_mps
    boat.sail(30.0)
    assert boat.told is TrialStanding.DONE
    assert boat.now_us < 35e6
    assert before_mps == pytest.approx(throttle_to_speed(OTTER, 0.5), rel=0.01)


def test_an_area_keeps_to_the_free_water_on_each_bearing():
    reach_m = free_around((10.0, 20.0), 80.0, lambda point: point[0] < 50.0)
    area = TrialArea((10.0, 20.0), reach_m)
    assert area.room_m((49.0, 20.0)) < 0.0 < area.room_m((40.0, 20.0))
    assert area.room_m((-60.0, 20.0)) == pytest.approx(10.0)
    for k in range(720):
        angle = math.tau * k / 720
        edge_m = area.reach_m((10.0 + math.cos(angle), 20.0 + math.sin(angle)))
        assert 10.0 + edge_m * math.cos(angle) < 50.0
    assert area.words == "36 to 80 m of free water on each side"


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(200))
def test_two_hundred_trials_with_faults_stay_inside(seed):
    """A sensor falls silent, an operator stops it, or nothing happens. A dead thruster needs the law: scenario/test_sea_trial.py."""
    dice = random.Random(seed)
    boat = Boat(TrialConfig(radius_m=dice.uniform(40.0, 100.0), quick=True), seed=seed)
    boat.trial.confirm()
    boat.sail(dice.uniform(10.0, 400.0))
    fault = dice.choice(("silent", "order", "none"))
    if fault == "silent":
        for _ in range(40):
            boat.tick(EstimatedState(boat.now_us))
    elif fault == "order":
        boat.trial.end("ordered")
    boat.sail(900.0)
    if fault == "silent" or fault == "order":
        assert boat.told is not TrialStanding.RUNNING
        assert boat.sticks == (0.0, 0.0)
    assert boat.furthest_m < boat.config.radius_m


def test_a_hull_that_does_not_turn_at_rest_is_spared_the_spins_with_words():
    """A lone screw would drift through each spin to the edge, three times over."""
    whole, spared = (manoeuvres_of(quick=False, turns_at_rest=turns) for turns in (True, False))
    spins = [one for group in whole for one in group if isinstance(one, Turn) and one.throttle == 0.0]
    assert [one for group in spared for one in group] == [one for group in whole for one in group if one not in spins]
    assert all(spared)
    boat = Boat(vessel=single_screw(), config=TrialConfig(quick=True))
    boat.trial = Trial(boat.config, boat.state(), turns_at_rest=False)
    boat.tick()
    assert boat.texts[0] == "Trial: spins are left out: this hull does not turn without way on"
    assert boat.trial.progress == (0, len(manoeuvres_of(quick=True)) - 1)


@pytest.mark.parametrize(("turns_away", "is_wrong"), [(False, True), (True, False)])
def test_a_hull_that_turns_away_by_herself_may_spin_half_a_turn_against_her_helm(turns_away, is_wrong):
    """Light twins without rudders were put to rest for it, sound."""
    sense = HelmSense(turns_away=turns_away)
    for tick in range(round(7.0 / TICK_S)):
        rate_radps = min(0.8, 0.2 * tick * TICK_S)
        sense.step(TICK_S, surge=0.5, helm=-0.5, r_radps=rate_radps, through_mps=0.8)
    assert sense.is_wrong is is_wrong


def test_what_is_turned_in_a_stream_from_ahead_counts_and_astern_does_not():
    ahead, astern = HelmSense(turns_away=False), HelmSense(turns_away=False)
    for _ in range(round(10.0 / TICK_S)):
        ahead.step(TICK_S, surge=0.5, helm=0.5, r_radps=-0.3, through_mps=0.4)
        astern.step(TICK_S, surge=0.5, helm=0.5, r_radps=-0.3, through_mps=-0.4)
    assert ahead.is_wrong
    assert not astern.is_wrong
