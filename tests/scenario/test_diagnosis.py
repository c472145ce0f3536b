"""What is wrong with thrusters or rudders is suspected by its right name within 15 s of its effect; rough water is nothing wrong."""

import itertools
import math
import random

import pytest

from companion.core.guard.diagnosis import Cause, Diagnosis, words
from companion.core.guard.propulsion import PropulsionWatch
from mavlink_bridge.language.figures import Circle, Hover
from mavlink_bridge.language.messages import EstimatedState, Loiter, Mode
from mavlink_bridge.language.requests import Arm, ManualInput
from sitl.plant import WaterConfig
from sitl.plant.library import load_vessel
from tools.benches.cells.control_cells import BREEZE, WATERS, Case
from tools.benches.cells.control_loop import TICK_S
from tools.benches.cells.fault_cells import MIRRORED, REVERSED, SWAPPED, stuck, thrusters
from tools.benches.cells.foreign_hulls import FOREIGN, any_hull, bare, launch, single_screw
from tools.benches.cells.sensed import SensedState, late_eyes
from tools.benches.cells.trial_cells import wrong
from tools.campaigns.health import HEALTH

HULLS = {
    "otter": load_vessel("otter"),
    "blueboat": load_vessel("blueboat"),
    "wamv": load_vessel("wamv"),
    "launch": launch(),
    "bare": bare("otter", 0.5),
    "single": single_screw(),
    "restless": bare("otter", 1.0),
}
GALE = WaterConfig(wind_mps=10.0, gust_share=0.25, wave_height_m=0.3, current_mps=0.3)
BLOW = WaterConfig(current_mps=0.5, wind_mps=8.0, gust_share=0.25, wave_height_m=0.3)
RING = Circle(radius_m=20.0)


def suspected_s(hull, water, figure, mps, seconds, fault=None, seed=1, fault_s=15.0):
    """Sail; return (seconds after the fault, the cause) of the first suspicion, None when there was none."""
    run = Case(HULLS[hull], water, seed=seed, source=SensedState).loop()
    run.place(20.0, 0.0, math.pi / 2.0, mps)
    diagnosis = Diagnosis(HULLS[hull])
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=figure))
    while run.t_s < seconds:
        if fault is not None and run.t_s > fault_s:
            fault(run.vessel)
            fault = None
        run.tick(mps)
        cause = diagnosis.step(TICK_S, run.state, run.sent)
        if cause is not None:
            return run.t_s - fault_s, cause
    return None


def judged(hull, water, seconds, each=lambda run: None, seed=1, figure=None, mps=1.5):
    """Sail north, or about a point; return what is suspected and what the watch that acts has found, as the vessel asks them."""
    vessel = any_hull(hull)
    run = Case(vessel, water, seed=seed, source=late_eyes if hull == "crooked" else SensedState).loop()
    run.place(0.0, 0.0, 0.0, mps)
    if figure is None:
        run.sail(run.goto(400.0, 0.0))
    else:
        run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 20.0), figure=figure))
    diagnosis, watch, suspected = Diagnosis(vessel), PropulsionWatch(vessel), []
    while run.t_s < seconds:
        each(run)
        run.tick(mps)
        cause = diagnosis.step(TICK_S, run.state, run.sent)
        suspected += [cause] if cause else []
        if any(watch.step(TICK_S, run.state, run.sent, diagnosis.opinion)) or watch.helm_mirrored:
            diagnosis.rest()
    return suspected, watch.flags


QUICK = [
    ("otter", stuck(15.0), Cause.RUDDERS_STILL),
    ("launch", stuck(0.0), Cause.RUDDERS_STILL),
    ("otter", MIRRORED, Cause.RUDDERS_REVERSED),
    ("wamv", thrusters(0.4, 0.4), Cause.SLIP),
    ("launch", thrusters(0.0, 1.0), Cause.PORT_WEAK),
    ("wamv", REVERSED, Cause.PORT_REVERSED),
    ("single", thrusters(0.0, 0.0), Cause.WEAK),
]
MORE = [
    ("otter", stuck(0.0), Cause.RUDDERS_STILL),
    ("launch", stuck(-15.0), Cause.RUDDERS_STILL),
    ("otter", thrusters(0.4, 0.4), Cause.SLIP),
    ("blueboat", thrusters(0.4, 0.4), Cause.SLIP),
    ("launch", thrusters(0.4, 0.4), Cause.SLIP),
    ("otter", thrusters(1.0, 0.0), Cause.STARBOARD_WEAK),
    ("wamv", thrusters(0.3, 1.0), Cause.PORT_WEAK),
    ("blueboat", thrusters(1.0, 0.3), Cause.STARBOARD_WEAK),
    ("wamv", SWAPPED, Cause.SWAPPED),
    ("blueboat", SWAPPED, Cause.SWAPPED),
    ("otter", REVERSED, Cause.PORT_REVERSED),
    ("launch", REVERSED, Cause.PORT_REVERSED),
]


@pytest.mark.parametrize(("hull", "fault", "cause"), QUICK, ids=lambda part: getattr(part, "name", None))
def test_the_right_cause_is_suspected_within_15_s(hull, fault, cause):
    found = suspected_s(hull, BLOW, RING, 1.5, 30.0, fault)
    assert found is not None
    assert found[1] is cause
    assert 0.0 < found[0] <= 15.0


def test_weed_that_leaves_two_fifths_is_told_where_nothing_else_fits():
    found = suspected_s("otter", WATERS["calm"], RING, 1.5, 30.0, thrusters(1.0, 0.4))
    assert found is not None
    assert found[1] is Cause.STARBOARD_WEAK


def test_a_sound_boat_whose_file_is_wrong_is_not_told_of_a_thruster():
    """By up to half in every figure: she makes a third less speed than it says. A port thruster was told of after half a minute."""
    belief = wrong(HULLS["otter"], 1)
    run = Case(HULLS["otter"], BREEZE, source=SensedState, belief=belief).loop()
    run.place(15.0, 0.0, math.pi / 2.0, 1.5)
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=Circle(radius_m=15.0)))
    diagnosis = Diagnosis(belief)
    while run.t_s < 45.0:
        run.tick(1.5)
        assert diagnosis.step(TICK_S, run.state, run.sent) is None


def test_a_hull_that_turns_away_by_itself_is_no_fault():
    """In a gale the way that she makes aside is known to some centimetres a second: by those her own moment is off."""
    assert suspected_s("restless", GALE, Circle(radius_m=25.0), 2.5, 110.0) is None


@pytest.mark.soak
@pytest.mark.parametrize("water", [WATERS["calm"], BLOW], ids=["calm", "blow"])
def test_the_right_cause_is_suspected_on_every_hull(water):
    right = []
    for (hull, fault, cause), seed in itertools.product(QUICK + MORE, range(1, 6)):
        # the weather is known half a minute after the start
        found = suspected_s(hull, water, RING, 1.5, 45.0, fault, seed, fault_s=30.0)
        right.append(found is not None and found[1] is cause)
    assert sum(right) >= 0.95 * len(right)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("hull", HULLS)
@pytest.mark.parametrize(
    ("figure", "mps"), [(Hover(), 1.0), (Circle(radius_m=10.0), 1.5), (Circle(radius_m=25.0), 2.5)]
)
def test_an_hour_of_rough_water_is_nothing_wrong(hull, figure, mps, seed):
    assert suspected_s(hull, GALE, figure, mps, 3600.0, seed=seed) is None


def from_30_s(fault):
    def break_down(run):
        if run.t_s > 30.0:
            fault(run.vessel)

    return break_down


def test_a_stuck_rudder_is_not_taken_for_a_thruster_that_pushes_the_wrong_way():
    suspected, flags = judged("launch", WATERS["calm"], 50.0, from_30_s(stuck(15.0)))
    assert suspected == [Cause.RUDDERS_STILL]
    assert not flags.thruster_reversed
    assert not flags.thruster_weak


def test_weed_is_found_with_a_compass_that_is_late():
    suspected, _ = judged("crooked", WATERS["calm"], 45.0, from_30_s(thrusters(0.4, 1.0)))
    assert suspected == [Cause.PORT_WEAK]


def test_unlike_thrusters_changed_over_are_told_in_calm_water():
    """What they turn her by is no more than a gale does, but there is no gale."""
    assert HEALTH.sail("lopsided", "calm", "ring", "swapped", 1)["is_right"]


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_eddies_are_no_fault(sense):
    def shear(run):
        across = sense if int(run.vessel.north_m // 25.0) % 2 else -sense
        run.water.configure(WaterConfig(current_mps=0.7, current_to_deg=90.0 * across, wind_mps=2.0))

    suspected, flags = judged("rudderless", WATERS["calm"], 90.0, shear)
    assert suspected == []
    assert not flags.thruster_weak


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 4))
@pytest.mark.parametrize("hull", ["otter", "blueboat", "wamv", *FOREIGN])
@pytest.mark.parametrize(("figure", "mps"), [(None, 2.0), (Circle(radius_m=10.0), 1.5), (Hover(), 1.0)])
def test_rough_water_is_nothing_wrong_on_hulls_that_nobody_modelled(hull, figure, mps, seed):
    suspected, flags = judged(hull, GALE, 190.0 if figure is None else 1800.0, seed=seed, figure=figure, mps=mps)
    assert suspected == []
    assert not flags.thruster_weak
    assert not flags.thruster_reversed


def test_each_cause_has_words_of_its_own():
    told = [words(cause) for cause in Cause]
    assert len(set(told)) == len(told)
    assert all(text.startswith("Suspected: ") for text in told)


@pytest.mark.parametrize(("after_s", "is_withdrawn"), [(20.0, True), (60.0, False)])
def test_what_was_suspected_by_a_heading_that_is_then_proven_wrong_is_withdrawn(after_s, is_withdrawn):
    """A compass that creeps shows as a thruster first: she was hauled out for weed that was not there."""
    run = Case(HULLS["blueboat"], WaterConfig(), seed=1, source=SensedState).loop()
    run.place(0.0, 0.0, 0.0, 1.5)
    run.sail(run.goto(400.0, 0.0))
    diagnosis, cause = Diagnosis(HULLS["blueboat"]), None
    while cause is None:
        assert run.t_s < 60.0
        if run.t_s > 15.0:
            run.vessel.thruster_health[0] = 0.2
        run.tick(1.5)
        cause = diagnosis.step(TICK_S, run.state, run.sent)
    assert diagnosis.heed(run.state.t_us, heading_wrong=False) == []
    found_us = run.state.t_us + round(after_s * 1e6)
    told = [text for _, text in diagnosis.heed(found_us, heading_wrong=True)]
    assert told == (
        ["No longer suspected: port thruster gives little (lost, weed); a wrong heading looks like it"]
        if is_withdrawn
        else []
    )
    assert (cause in diagnosis.told) != is_withdrawn
    assert diagnosis.heed(found_us, heading_wrong=True) == []


def test_a_boat_whose_heading_is_proven_wrong_takes_her_suspicion_back(voyage):
    trip = voyage("depth.enabled=false")
    trip.sail(1.5, (60.0, 0.0), (60.0, 60.0), (0.0, 60.0), after_s=20.0)
    stuck(15.0)(trip.world.surroundings.plant.vessel)
    trip.run(12.0)
    assert "Suspected: rudders stuck or free" in trip.texts
    for second in range(45):
        trip.faults.set("heading_bias_deg", min(100.0, 4.0 * second))
        trip.run(1.0)
    assert any("Heading not believed" in text for text in trip.texts)
    assert trip.texts.count("No longer suspected: rudders stuck or free; a wrong heading looks like it") == 1


def test_without_a_heading_nothing_is_suspected():
    diagnosis = Diagnosis(HULLS["otter"])
    assert all(diagnosis.step(TICK_S, EstimatedState(t_us), None) is None for t_us in range(100))


def test_the_operator_is_told_and_the_boat_sails_on(voyage):
    trip = voyage("depth.enabled=false")
    trip.sail(1.5, (200.0, 0.0), after_s=20.0)
    stuck(15.0)(trip.world.surroundings.plant.vessel)
    trip.run(15.0)
    assert trip.texts.count("Suspected: rudders stuck or free") == 1
    assert trip.snapshot.armed
    assert trip.snapshot.mode.name == "AUTO"


TICK_OF_TUG_S = 0.05


class Tug:
    """Pulls a boat by a rope of 5 m at her bow, eastward."""

    def __init__(self, trip, speed_mps):
        self.hull, self.speed_mps = trip.world.surroundings.plant.vessel, speed_mps
        self.north_m, self.east_m, self.for_s = self.hull.north_m, self.hull.east_m + 4.5, 0.0

    def pull(self):
        hull, dt_s = self.hull, TICK_OF_TUG_S
        self.for_s += dt_s
        tug_mps = self.speed_mps * min(self.for_s / 6.0, 1.0)
        self.east_m += tug_mps * dt_s
        ahead, aside = math.cos(hull.psi_rad), math.sin(hull.psi_rad)
        north, east = self.north_m - hull.north_m - ahead, self.east_m - hull.east_m - aside
        length_m = math.hypot(north, east)
        if length_m <= 5.0:
            return
        north, east = north / length_m, east / length_m
        apart_mps = (tug_mps - hull.ve_mps) * east - hull.vn_mps * north
        pull_mps2 = max(0.0, min(0.6 * (length_m - 5.0), 3.0) + 0.5 * apart_mps)
        hull.u_mps += dt_s * pull_mps2 * (north * ahead + east * aside)
        side_mps2 = pull_mps2 * (east * ahead - north * aside)
        hull.v_mps += dt_s * side_mps2
        hull.r_radps += dt_s * 1.2 * side_mps2


def sticks(seed):
    """Somebody who tries the thrusters now and then, tick by tick: ahead and yaw."""
    rng = random.Random(seed)
    while True:
        ahead = -1.0 if rng.random() < 0.4 else 1.0
        turns = rng.random() < 0.4
        surge = 0.0 if turns else ahead * rng.uniform(0.3, 1.0)
        yaw = rng.choice((-1.0, 1.0)) * rng.uniform(0.5, 1.0) if turns else rng.uniform(-1.0, 1.0)
        yield from itertools.repeat((surge, yaw), round(rng.uniform(1.0, 4.0) / TICK_OF_TUG_S))
        yield from itertools.repeat((0.0, 0.0), round(rng.uniform(1.0, 6.0) / TICK_OF_TUG_S))


@pytest.mark.parametrize("seed", [2, 4])
def test_a_boat_on_a_tow_rope_has_sound_thrusters(voyage, seed):
    """Pulled by more than a gale at 2.5 m/s, and turned by her helm, she fitted a thruster that pushes the wrong way best."""
    trip = voyage("vessel='blueboat'", "depth.enabled=false", seed=seed)
    trip.run(13.0)
    trip.ask(Arm(arm=True))
    trip.mode(Mode.MANUAL)
    tug, hands = Tug(trip, 2.5), sticks(seed)
    for tick in range(round(30.0 / TICK_OF_TUG_S)):
        trip.world.app.submit(ManualInput(*next(hands), 255), lambda reply: None)
        if tick * TICK_OF_TUG_S > 5.0:
            tug.pull()
        trip.step()
    assert trip.truth.east_m > 40.0
    told = [text for text in trip.texts if text.startswith("Suspected")]
    assert not [text for text in told if "a tow" not in text], "held, or towed, is true"
