"""What the hull's motion tells of thrusters and rudders, part by part: the weather, the weighing, and what the watch makes of it."""

import math
import random
from dataclasses import replace

from companion.core.guard.diagnosis import Cause, Diagnosis, words
from companion.core.guard.diagnosis.residual import SAMPLE_S, Sample
from companion.core.guard.diagnosis.suspects import Acting, suspects
from companion.core.guard.diagnosis.weather import Bounds, Weather
from companion.core.guard.diagnosis.weighing import Weighing
from companion.core.guard.propulsion import PropulsionWatch
from companion.core.hull.actuator_model import ActuatorModel
from companion.core.hull.statics import Statics
from mavlink_bridge.language.messages import ActuatorOutput, EstimatedState
from sitl.plant import SimVessel, Water, WaterConfig
from sitl.plant.library import load_vessel
from tools.benches.cells.control_loop import TICK_S, IdealState
from tools.benches.cells.foreign_hulls import bare, lopsided, single_screw

OTTER = load_vessel("otter")
BOUNDS = Bounds(least=(1.0, 1.0), first=(100.0, 100.0), most=(500.0, 500.0), lever_m=0.4)
HEALTHY = Sample((0.0, 0.0), ((0.0, 0.0),), thrust_n=0.0, on_station=False)


def seen(weather, unexplained, count):
    for _ in range(count):
        weather.follow(SAMPLE_S, replace(HEALTHY, unexplained=unexplained()), suspicious=False)
    return weather


def test_quiet_water_is_known_for_it_within_twenty_seconds():
    weather = Weather(BOUNDS)
    assert not weather.settled
    seen(weather, lambda: (0.0, 0.0), 40)
    assert weather.settled
    assert weather.gale_share < 0.7
    assert weather.noise(HEALTHY).variance[1] < 50.0


def test_what_lasts_says_less_than_what_comes_and_goes():
    dice, gust = random.Random(1), [0.0]

    def slow():
        gust[0] += 0.08 * (dice.gauss(0.0, 60.0) - gust[0])
        return gust[0], gust[0]

    gusty = seen(Weather(BOUNDS), slow, 200).noise(HEALTHY).alike
    quick = seen(Weather(BOUNDS), lambda: (dice.gauss(0.0, 10.0),) * 2, 200).noise(HEALTHY).alike
    assert quick == (2.0, 2.0)
    assert min(gusty) > 3.0


def test_a_model_that_is_off_by_thrust_is_noise_in_proportion():
    weather = seen(Weather(BOUNDS), lambda: (0.0, 0.0), 100)
    hard = replace(HEALTHY, thrust_n=1000.0)
    assert weather.noise(hard).variance[0] > 3000.0 > weather.noise(HEALTHY).variance[0]


def weighed(cause, effect, samples, **more):
    (suspect,) = [each for each in suspects(OTTER) if each.cause is cause][:1]
    weighing = Weighing((suspect, replace(suspect, cause=Cause.SWAPPED)), BOUNDS)
    found = [
        weighing.step(SAMPLE_S, replace(HEALTHY, unexplained=unexplained, effects=(effect, (0.0, 0.0)), **more))
        for unexplained in samples
    ]
    return weighing, next((each for each in found if each is not None), None)


QUIET, LOST = [(0.0, 0.0)] * 60, [(-60.0, 25.0)] * 20


def test_nothing_is_thought_before_the_weather_is_known_and_nothing_of_a_healthy_boat():
    assert weighed(Cause.STARBOARD_WEAK, (-60.0, 25.0), QUIET[:10])[0].opinion is None
    assert weighed(Cause.STARBOARD_WEAK, (-60.0, 25.0), QUIET)[0].opinion == frozenset()


def test_what_explains_all_is_the_only_opinion_and_the_cause():
    weighing, cause = weighed(Cause.STARBOARD_WEAK, (-60.0, 25.0), QUIET + LOST)
    assert cause is Cause.STARBOARD_WEAK
    assert weighing.opinion == {Cause.STARBOARD_WEAK}


def test_an_eddy_ends_every_suspicion():
    weighing, _ = weighed(Cause.STARBOARD_WEAK, (-60.0, 25.0), QUIET + LOST)
    weighing.step(SAMPLE_S, replace(HEALTHY, effects=((-60.0, 25.0), (0.0, 0.0)), upset=True))
    assert not weighing.suspected
    assert weighing.opinion == frozenset()


def test_on_station_it_takes_more():
    def needed(**more):
        lost = [(-40.0, 16.0)]
        return next(k for k in range(60) if weighed(Cause.RUDDERS_STILL, lost[0], QUIET + k * lost, **more)[1])

    assert needed() < needed(on_station=True)


def told_after(cause, effect):
    """How many samples it takes until a fault of this effect is told."""
    return next(k for k in range(60) if weighed(cause, effect, QUIET + k * [effect])[1])


def test_only_what_may_be_a_propeller_that_stops_is_waited_for():
    """Rudders that stood were told of a second too late, when the odds had long been a million to one."""
    assert told_after(Cause.RUDDERS_STILL, (0.0, -60.0)) < told_after(Cause.PORT_WEAK, (-60.0, 25.0))


def test_what_is_not_told_apart_for_long_was_no_fault():
    suspect = suspects(OTTER)[0]
    weighing = Weighing((suspect, replace(suspect, cause=Cause.SWAPPED)), BOUNDS)
    alike = replace(HEALTHY, effects=((-60.0, 25.0), (-60.0, 25.0)))
    found = [weighing.step(SAMPLE_S, replace(alike, unexplained=unexplained)) for unexplained in QUIET + 8 * LOST]
    assert found == [None] * len(found)
    assert not weighing.suspected


def test_thrusters_on_one_line_are_not_judged():
    inline = OTTER.model_copy(update={"thruster": OTTER.thruster.model_copy(update={"lateral_m": 0.0})})
    diagnosis = Diagnosis(inline)
    assert diagnosis.step(TICK_S, SLOW, HALF) is None
    assert diagnosis.opinion is None


# ---- the watch that acts


HALF = ActuatorOutput(0, 0.7, 0.7, rudder_port_rad=0.3, rudder_starboard_rad=0.3, cause="")
SLOW = EstimatedState(0, psi_rad=0.0, u_mps=0.9, v_mps=0.0, r_radps=0.0)


def watched(opinion, seconds=20.0):
    """Half the speed, and straight with the rudders against the port side: a port thruster that gives nothing."""
    watch = PropulsionWatch(OTTER)
    watch.step(TICK_S, SLOW, replace(HALF, rudder_port_rad=0.0, rudder_starboard_rad=0.0), opinion)
    for _ in range(round(seconds / TICK_S)):
        watch.step(TICK_S, SLOW, HALF, opinion)
    return watch


def test_the_watch_finds_nothing_that_the_diagnosis_does_not_hold_for_possible():
    assert watched(None).weak == (True, False)
    assert watched(frozenset()).weak == (False, False)
    assert watched(frozenset({Cause.RUDDERS_STILL})).weak == (False, False)
    assert watched(frozenset({Cause.PORT_WEAK, Cause.SLIP})).weak == (True, False)


def test_the_diagnosis_decides_whether_it_pushes_little_or_the_wrong_way():
    assert watched(frozenset({Cause.PORT_REVERSED})).flags.thruster_reversed
    assert not watched(frozenset({Cause.PORT_WEAK})).flags.thruster_reversed
    both = watched(frozenset({Cause.PORT_WEAK, Cause.PORT_REVERSED}))
    assert both.flags.thruster_reversed == watched(None).flags.thruster_reversed


def test_one_that_is_weak_explains_all_the_rest():
    watch = watched(frozenset({Cause.PORT_WEAK}))
    for _ in range(round(20.0 / TICK_S)):  # the other way now, as if starboard gave nothing
        watch.step(TICK_S, SLOW, replace(HALF, rudder_port_rad=-0.3, rudder_starboard_rad=-0.3))
    assert watch.weak == (True, False)


LEGS = [0.0, 90.0, 180.0, 270.0, 0.0]
BARE = bare("otter", 0.5)


def worn_in(commands_of_leg, legs=LEGS, leg_s=40.0):
    """Straight legs at the speed that the thrust makes, whatever the thrusts turn her by: all else has got used to what is wrong."""
    watch, actuators, statics = PropulsionWatch(BARE), ActuatorModel(BARE), Statics(BARE)
    state = replace(SLOW, u_mps=1.0)
    for leg, heading_deg in enumerate(legs):
        port, starboard = commands_of_leg(leg)
        sent = replace(HALF, thruster_port=port, thruster_starboard=starboard)
        for _ in range(round(leg_s / TICK_S)):
            actuators.step(TICK_S, sent, state.u_mps)
            u_mps = statics.speed_for_thrust(actuators.port_n + actuators.starboard_n)
            state = replace(state, psi_rad=math.radians(heading_deg), u_mps=u_mps)
            watch.step(TICK_S, state, sent, frozenset())
    return watch


def test_a_propeller_that_fouls_slowly_is_found():
    """What it lost was taken for wind and current, and the boat left her track by 20 m without a word of the thruster."""
    assert worn_in(lambda leg: (0.9, 0.35)).weak == (True, False)
    assert worn_in(lambda leg: (0.35, 0.9)).weak == (False, True)


def test_wind_that_turns_the_hull_is_no_propeller_that_fouls():
    assert worn_in(lambda leg: (0.9, 0.35) if leg % 2 else (0.35, 0.9)).weak == (False, False)


def test_a_drag_to_one_side_is_no_propeller_that_fouls():
    """A sonar's pole, a rudder a few degrees off: a sound boat was told that a thruster gives much less, and slowed."""
    assert worn_in(lambda leg: (0.9, 0.6)).weak == (False, False)
    assert worn_in(lambda leg: (0.6, 0.9)).weak == (False, False)


def test_on_one_straight_leg_wind_and_a_slow_loss_look_the_same():
    assert worn_in(lambda leg: (0.9, 0.35), legs=[0.0] * 5).weak == (False, False)


# ---- boats of one thruster, and of two unlike ones


def sailed(vessel, fault, throttle=0.7, seconds=50.0, water=WaterConfig()):  # noqa: B008 - frozen
    """Throttle ahead and rudder to and fro; the fault after 30 s. Return what is suspected, with the seconds after it."""
    hull, eyes, diagnosis = SimVessel(vessel), IdealState(), Diagnosis(vessel)
    sea = Water(water, random.Random("one"))
    for tick in range(round(seconds / TICK_S)):
        t_s = tick * TICK_S
        if t_s >= 30.0:
            fault(hull)
        rudder = 0.2 if int(t_s / 4.0) % 2 else -0.2
        sent = ActuatorOutput(0, throttle, throttle, rudder_port_rad=rudder, rudder_starboard_rad=rudder, cause="")
        for _ in range(3):
            sea.step(TICK_S / 3)
            hull.step(TICK_S / 3, throttle, throttle, rudder_port_rad=rudder, rudder_starboard_rad=rudder, water=sea)
        cause = diagnosis.step(TICK_S, eyes.sense(round(t_s * 1e6), hull, hull.u_mps), sent)
        if cause is not None:
            return t_s - 30.0, cause
    return None


def dead(hull):
    hull.thruster_health[:] = [0.0, 0.0]


def stuck(hull):
    hull.rudder_stuck_rad[:] = [0.0, 0.0]


def test_a_boat_of_one_thruster_is_judged_too():
    assert sailed(single_screw(), lambda hull: None) is None
    for fault, cause in ((dead, Cause.WEAK), (stuck, Cause.RUDDERS_STILL)):
        found = sailed(single_screw(), fault)
        assert found is not None
        assert found[1] is cause
        assert 0.0 < found[0] <= 15.0


def test_two_thrusters_that_are_dead_are_told_as_both():
    """Told as one of them that pushes against what it is told: look at its wiring."""
    for vessel in (OTTER, BARE):
        found = sailed(vessel, dead)
        assert found is not None
        assert found[1] is Cause.SLIP
    assert words(Cause.SLIP).startswith("Suspected: both thrusters give little or nothing")


def test_a_single_thruster_that_turns_the_other_way_has_its_own_words():
    assert {each.cause for each in suspects(single_screw())} == {
        Cause.WEAK,
        Cause.REVERSED,
        Cause.RUDDERS_STILL,
        Cause.RUDDERS_REVERSED,
    }
    (reversed_,) = [each for each in suspects(single_screw()) if each.cause is Cause.REVERSED]
    port_n, starboard_n, _ = reversed_.instead(Acting(1.0, 0.0, 0.0, 90.0, 90.0, 0.0))
    assert port_n == starboard_n == -50.0
    assert words(Cause.REVERSED) == "Suspected: the thruster pushes the wrong way"


def test_unlike_thrusters_changed_over_give_what_the_other_is_asked_for_by_their_own_size():
    (swapped,) = [each for each in suspects(lopsided()) if each.cause is Cause.SWAPPED]
    assert swapped.instead(Acting(1.0, 0.0, 0.0, 50.0, 40.0, 0.1)) == (50.0, 40.0, 0.1)
    port_n, starboard_n, _ = swapped.instead(Acting(1.0, 0.0, 0.0, 40.0, 40.0, 0.0))
    assert (port_n, starboard_n) == (50.0, 32.0)
