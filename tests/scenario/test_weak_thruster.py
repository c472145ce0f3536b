"""A propeller that is lost or full of weed is told in words within 15 s of thrust, and the boat sails on with what is left;
clean rough water is no weed."""

import itertools
import math
import statistics
from dataclasses import replace

import pytest

from companion.core.guard.diagnosis import Diagnosis
from companion.core.guard.propulsion import PropulsionWatch
from companion.core.hull.left import WHOLE
from mavlink_bridge.language.figures import Circle, Hover
from mavlink_bridge.language.messages import ActuatorOutput, EstimatedState, Loiter
from sitl.plant import WaterConfig
from sitl.plant.library import load_vessel
from sitl.sensors import SimulatedSensors
from tools.benches.cells.control_cells import WATERS, Case
from tools.benches.cells.control_loop import TICK_S
from tools.benches.cells.fault_cells import REVERSED, STARBOARD_REVERSED, SWAPPED
from tools.benches.cells.foreign_hulls import bare, launch
from tools.benches.cells.sensed import SensedState
from tools.benches.cells.trial_cells import wrong

HULLS = {
    "otter": load_vessel("otter"),
    "blueboat": load_vessel("blueboat"),
    "bare": bare("otter", 0.5),
    "launch": launch(),
}
GALE = WaterConfig(wind_mps=10.0, gust_share=0.25, wave_height_m=0.3, current_mps=0.3)
BLOW = WATERS["0.5 m/s + 8 m/s"]


def ask(watch, diagnosis, run):
    """The watch, wired to the diagnosis as in the vessel."""
    opinion, told, before_mps = diagnosis.opinion, diagnosis.told, diagnosis.before_mps
    return watch.step(TICK_S, run.state, run.sent, opinion, told, before_mps=before_mps)


def told_after_s(hull, water, figure, mps, seconds, fault=None, seed=1, fault_s=30.0):
    """(seconds after the fault, what was found); None when nothing was. Watch and diagnosis are wired as in the vessel."""
    run = Case(HULLS[hull], water, seed=seed, source=SensedState).loop()
    run.place(15.0, 0.0, math.pi / 2.0, 0.0)
    watch, diagnosis = PropulsionWatch(HULLS[hull]), Diagnosis(HULLS[hull])
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=figure))
    while run.t_s < seconds:
        if fault is not None and run.t_s > fault_s:
            run.vessel.thruster_health[fault[0]] = fault[1]
        run.tick(mps)
        diagnosis.step(TICK_S, run.state, run.sent)
        weak = ask(watch, diagnosis, run)
        if any(weak):
            return run.t_s - fault_s, weak
    return None


@pytest.mark.parametrize("fault", [(0, 0.0), (1, 0.3)], ids=["port dead", "weed to starboard"])
@pytest.mark.parametrize("water", [WATERS["calm"], BLOW], ids=["calm", "blow"])
def test_it_is_found_under_way_on_its_side(water, fault):
    found = told_after_s("otter", water, Circle(radius_m=20.0), 1.5, 50.0, fault)
    assert found is not None
    seconds, weak = found
    assert 0.0 < seconds <= 15.0
    assert weak == (fault[0] == 0, fault[0] == 1)


def slippery():
    """A light hull without rudders or skeg, whose own way aside turns it as hard as one propeller does."""
    vessel = bare("otter", 0.735)
    damping = {"xu": 3.9, "xuu": 34.0, "yv": 96.0, "yvv": 281.0, "nr": 3.1, "nrr": 103.0, "nur": 25.5}
    hull = {"m11_kg": 90.0, "m22_kg": 226.0, "m23_kgm": 0.0, "m33_kgm2": 73.0} | damping
    thruster = {"lateral_m": 0.42, "ahead_n": 110.0, "astern_n": 60.0, "lag_s": 0.19}
    parts = {"hull": vessel.hull.model_copy(update=hull), "thruster": vessel.thruster.model_copy(update=thruster)}
    return vessel.model_copy(update=parts)


def test_a_lost_propeller_is_not_explained_by_the_water_that_it_made():
    """Its thrust passed for way through a current of 1.8 m/s, and what that way turns the hull by for the missing turn: never acted on."""
    hull = slippery()
    run = Case(hull, WATERS["calm"], source=SensedState).loop()
    run.place(0.0, 0.0, 0.0, 0.9)
    run.sail(run.goto(400.0, 0.0))
    watch, diagnosis = PropulsionWatch(hull), Diagnosis(hull)
    while run.t_s < 30.0 and not watch.flags.thruster_alone:
        run.vessel.thruster_health[0] = float(run.t_s < 15.0)
        run.tick(0.9)
        diagnosis.step(TICK_S, run.state, run.sent)
        ask(watch, diagnosis, run)
    assert watch.weak == (True, False)
    assert watch.flags.thruster_alone


def sail_on(hull, begin, seconds, side=0, share=0.0, seed=1, fault_s=15.0):
    """Yield (seconds, north, east) of a boat in the blow that loses a thruster and sails on by the vessel's own rules."""
    run = Case(HULLS[hull], BLOW, seed=seed, source=SensedState).loop()
    run.place(0.0, 0.0, 0.0, 1.5)
    watch, diagnosis = PropulsionWatch(HULLS[hull]), Diagnosis(HULLS[hull])
    begin(run)
    while run.t_s < seconds:
        if run.t_s > fault_s:
            run.vessel.thruster_health[side] = share
        run.tick(1.5)
        if any(watch.weak) or watch.helm_mirrored:
            diagnosis.rest()
        else:
            diagnosis.step(TICK_S, run.state, run.sent)
        before = watch.shares
        ask(watch, diagnosis, run)
        if watch.shares != before:
            is_other_boat = (before == WHOLE) != (watch.shares == WHOLE)
            through_mps = run.source.estimator.recall_water(run.state)[1] if is_other_boat else None
            run.controller.thrusters(watch.shares, through_mps)
            run.guidance.thrusters(watch.shares)
            run.guidance.limit(
                fast_mps=run.controller.steady_mps, turn_radps=run.controller.turn_radps, backs_and_fills=False
            )
        yield run.t_s, run.vessel.north_m, run.vessel.east_m


def worst_of_a_leg(hull, **fault):
    sailed = sail_on(hull, lambda run: run.sail(run.goto(400.0, 0.0)), 90.0, **fault)
    return math.sqrt(statistics.fmean(east_m**2 for t_s, _, east_m in sailed if t_s > 50.0))


def worst_of_a_stay(hull, seconds, **fault):
    def stay(run):
        run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=Hover()))

    return max(math.hypot(north_m, east_m) for _, north_m, east_m in sail_on(hull, stay, seconds, **fault))


def test_one_thruster_and_rudders_sail_a_leg_straight():
    assert worst_of_a_leg("otter") <= 1.0


def test_the_thrust_that_was_not_there_is_no_current_afterwards():
    """For ten seconds a launch drove astern with the thruster that was left: the "current" of that carried her 12 m off her leg."""
    assert worst_of_a_leg("launch", side=1, seed=3) <= 0.5


def test_a_thruster_that_the_diagnosis_is_sure_of_is_lost():
    """Told after 6 s, and steered with for 35 more: at each turn to and fro it was asked for too little to be judged by that alone."""
    assert worst_of_a_leg("launch", side=0, seed=2) <= 0.3


def test_one_thruster_and_rudders_stay_near_a_point():
    assert worst_of_a_stay("otter", 110.0) <= 40.0


def test_a_hull_that_one_thruster_cannot_steer_circles_nothing():
    """In the tick of her stop she told "circling the point at 36 m": without rudders she drifts."""
    run = Case(HULLS["blueboat"], BLOW, source=SensedState).loop()
    run.place(0.0, 0.0, 0.0, 0.0)
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=Hover()))
    while run.t_s < 30.0:
        run.tick(1.0)
    run.guidance.thrusters((1.0, 0.0))
    run.tick(1.0)
    assert run.guidance.drain_texts() == ()


def test_a_turn_against_thruster_and_wind_is_made_the_other_way_round():
    """The short way round her circle the boat came to lie on one heading, full rudder against it, and sailed 140 m away."""
    assert worst_of_a_stay("otter", 250.0, side=0, seed=3) <= 40.0


def test_a_thruster_that_dies_on_station_is_found_before_the_boat_is_gone():
    assert worst_of_a_stay("otter", 200.0, side=1, seed=9) <= 40.0


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize(("side", "share"), [(0, 0.0), (1, 0.0), (0, 0.3), (1, 0.3)])
@pytest.mark.parametrize("hull", ["otter", "launch"])
def test_what_is_left_does_it_on_either_side(hull, side, share, seed):
    assert worst_of_a_leg(hull, side=side, share=share, seed=seed) <= 1.0
    assert worst_of_a_stay(hull, 400.0, side=side, share=share, seed=seed) <= 40.0


@pytest.mark.parametrize("water", [WATERS["calm"], BLOW], ids=["calm", "blow"])
@pytest.mark.parametrize(
    ("hull", "fault", "which"),
    [
        ("otter", REVERSED, "port"),
        ("blueboat", STARBOARD_REVERSED, "starboard"),
        ("blueboat", SWAPPED, "helm"),
    ],
)
def test_what_works_the_wrong_way_is_found_within_15_s(hull, fault, which, water):
    run = Case(HULLS[hull], water, source=SensedState).loop()
    run.place(20.0, 0.0, math.pi / 2.0, 1.5)
    watch = PropulsionWatch(HULLS[hull])
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=Circle(radius_m=20.0)))
    fault(run.vessel)
    while not watch.flags.thruster_reversed and run.t_s < 15.0:
        run.tick(1.5)
        watch.step(TICK_S, run.state, run.sent)
    assert watch.flags.thruster_reversed
    assert watch.helm_mirrored is (which == "helm")
    assert watch.weak == (which == "port", which == "starboard")


class DampedCompass(SensedState):
    """A compass that smooths its heading, and no turn rate sensor beside it."""

    def __init__(self, seed, tau_s):
        super().__init__(seed, SimulatedSensors(depth_hz=0.0, rate_hz=0.0))
        self._tau_s, self._shown_rad = tau_s, None

    def _truth(self, now_us, vessel):
        truth = super()._truth(now_us, vessel)
        off_rad = 0.0 if self._shown_rad is None else math.remainder(truth.psi_rad - self._shown_rad, math.tau)
        self._shown_rad = truth.psi_rad - off_rad * math.exp(-TICK_S / self._tau_s)
        return replace(truth, psi_rad=self._shown_rad)


def watched_round_a_square(hull, water, source, seconds=80.0, fault=None):
    """The watch at its end, or when it has found something that works the wrong way."""
    run = Case(HULLS[hull], water, source=source).loop()
    run.place(0.0, 0.0, 0.0)
    watch, diagnosis = PropulsionWatch(HULLS[hull]), Diagnosis(HULLS[hull])
    if fault is not None:
        fault(run.vessel)
    for corner in itertools.cycle(((40.0, 0.0), (40.0, 40.0), (0.0, 40.0), (0.0, 0.0))):
        run.sail(run.goto(*corner))
        while math.dist(corner, (run.vessel.north_m, run.vessel.east_m)) > 4.0:
            if run.t_s >= seconds or watch.flags.thruster_reversed:
                return watch
            run.tick(1.2)
            diagnosis.step(TICK_S, run.state, run.sent)
            ask(watch, diagnosis, run)
    raise AssertionError


@pytest.mark.parametrize("water", [WATERS["calm"], BLOW], ids=["calm", "blow"])
@pytest.mark.parametrize("tau_s", [1.5, 2.0, 4.0])
def test_a_damped_compass_is_no_helm_that_works_the_wrong_way(tau_s, water):
    """A sound boat was stopped after 16 to 39 s for leads that were not changed over."""
    watch = watched_round_a_square("otter", water, lambda seed: DampedCompass(seed, tau_s))
    assert not watch.flags.thruster_reversed
    assert watch.late.told_s == pytest.approx(tau_s, abs=0.6)


@pytest.mark.parametrize("hull", ["otter", "blueboat"])
def test_a_compass_that_does_not_smooth_does_not_lag(hull):
    watch = watched_round_a_square(hull, BLOW, SensedState)
    assert watch.late.told_s == 0.0


def test_leads_that_are_changed_over_are_no_damped_compass():
    watch = watched_round_a_square("blueboat", BLOW, SensedState, fault=SWAPPED)
    assert watch.helm_mirrored
    assert watch.late.told_s == 0.0


def test_a_thruster_that_rests_has_not_given():
    watch, state = PropulsionWatch(HULLS["otter"]), EstimatedState(0, psi_rad=0.0, u_mps=0.9, v_mps=0.0, r_radps=0.0)
    half = ActuatorOutput(0, 0.7, 0.7, rudder_port_rad=0.0, rudder_starboard_rad=0.0, cause="")
    watch.step(TICK_S, state, half)
    for _ in range(round(20.0 / TICK_S)):  # 0.8 of 2.1 m/s, and straight with the rudders against the missing side
        watch.step(TICK_S, state, replace(half, rudder_port_rad=0.3, rudder_starboard_rad=0.3))
    assert watch.weak == (True, False)
    for _ in range(round(120.0 / TICK_S)):
        watch.step(TICK_S, replace(state, u_mps=0.0), replace(half, thruster_port=0.0, thruster_starboard=0.0))
    assert watch.weak == (True, False)
    for _ in range(round(60.0 / TICK_S)):  # as fast as both thrusters make it, and straight with the rudders amidships
        watch.step(TICK_S, replace(state, u_mps=1.86), half)
    assert watch.weak == (False, False)


@pytest.mark.parametrize(("helm_rad", "is_found"), [(0.0, True), (0.25, False)], ids=["calm", "gale"])
def test_what_the_water_has_done_before_is_no_weed(helm_rad, is_found):
    watch, state = PropulsionWatch(HULLS["otter"]), EstimatedState(0, psi_rad=0.0, u_mps=0.9, v_mps=0.0, r_radps=0.0)
    slow = ActuatorOutput(0, 0.3, 0.3, rudder_port_rad=0.0, rudder_starboard_rad=0.0, cause="")
    for tick in range(round(60.0 / TICK_S)):  # rudders to and fro for 10 s each hold the bow against what turns it
        angle = math.copysign(helm_rad, tick // 200 % 2 - 0.5)
        watch.step(TICK_S, state, replace(slow, rudder_port_rad=angle, rudder_starboard_rad=angle))
    more = replace(slow, thruster_port=0.62, thruster_starboard=0.62, rudder_port_rad=0.15, rudder_starboard_rad=0.15)
    for _ in range(round(15.0 / TICK_S)):  # 13 Nm of a side's 18 are missing
        watch.step(TICK_S, state, more)
    assert watch.weak == (is_found, False)


def test_rough_water_is_no_weed():
    assert told_after_s("otter", GALE, Hover(), 1.0, 120.0) is None
    assert told_after_s("otter", GALE, Circle(radius_m=10.0), 1.5, 90.0) is None


def test_a_file_that_is_known_to_be_wrong_makes_no_weed_of_a_corner():
    """All its figures are wrong by up to half: in the third corner, against the wind, a thruster was taken for lost."""
    belief = wrong(HULLS["launch"], 2)
    run = Case(HULLS["launch"], BLOW, seed=2, belief=belief, source=SensedState).loop()
    run.place(20.0, 0.0, math.pi / 2.0, 1.5)
    watch, diagnosis = PropulsionWatch(belief), Diagnosis(belief)
    for corner in ((150.0, 0.0), (150.0, 150.0), (0.0, 150.0)):
        run.sail(run.goto(*corner))
        while math.dist(corner, (run.vessel.north_m, run.vessel.east_m)) > 4.0 and run.t_s < 225.0:
            run.tick(1.5)
            diagnosis.step(TICK_S, run.state, run.sent)
            ask(watch, diagnosis, run)
            assert watch.weak == (False, False)
    assert run.t_s > 200.0


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("hull", HULLS)
@pytest.mark.parametrize(
    ("figure", "mps"), [(Hover(), 1.0), (Circle(radius_m=10.0), 1.5), (Circle(radius_m=25.0), 2.5)]
)
def test_an_hour_of_rough_water_on_every_hull_is_no_weed(hull, figure, mps, seed):
    assert told_after_s(hull, GALE, figure, mps, 3600.0, seed=seed) is None


def test_the_operator_is_told_which_side_and_the_boat_sails_on(voyage):
    trip = voyage("depth.enabled=false")
    trip.sail(1.5, (200.0, 0.0), after_s=20.0)
    trip.world.surroundings.plant.vessel.thruster_health[0] = 0.0
    trip.run(15.0)
    assert any(text.startswith("Port thruster gives much less than it is told to") for text in trip.texts)
    assert "thruster_weak" in trip.snapshot.causes
    assert trip.snapshot.armed
    assert trip.snapshot.mode.name == "AUTO"


def test_thrusters_changed_over_stop_the_boat_with_words(voyage):
    trip = voyage("depth.enabled=false", "vessel='blueboat'")
    SWAPPED(trip.world.surroundings.plant.vessel)
    trip.sail(1.5, (0.0, 200.0), after_s=15.0)
    assert trip.neutral
    assert trip.snapshot.armed
    assert any(text.startswith("The helm turns the boat the wrong way") for text in trip.texts)


def test_a_hull_that_one_thruster_cannot_steer_stops_and_says_why(voyage):
    trip = voyage("depth.enabled=false", "vessel='blueboat'", "failsafe.thruster_action='warn'")
    trip.sail(1.5, (200.0, 0.0), after_s=20.0)
    trip.world.surroundings.plant.vessel.thruster_health[1] = 0.0
    trip.run(16.0)
    assert trip.snapshot.output.thruster_port == trip.snapshot.output.thruster_starboard == 0.0
    assert "This hull cannot be steered by one thruster: STOP" in trip.texts


def test_the_thrust_that_was_not_there_is_not_told_as_water_that_is_too_fast(voyage):
    """In the tick in which it was found, in still water: "the water is faster than the vessel: stopped"."""
    trip = voyage("depth.enabled=false")
    trip.sail(1.5, (400.0, 0.0), after_s=20.0)
    trip.world.surroundings.plant.vessel.thruster_health[1] = -0.6
    trip.run(25.0)
    assert "thruster_weak" in trip.snapshot.causes
    assert not any("water is faster" in text for text in trip.texts)
