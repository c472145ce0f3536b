"""A compass that was silent and comes back: believed where what stood in meanwhile bears it out, held as a jump where it does not."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.units import wrap_pi
from sitl.sensors import SimulatedSensors
from tests.soaked import in_the_soak
from tests.unit.test_course_stands_in import carried, then
from tools.benches.cells.sensor_rig import Motion, Pose, SensorRig, circle, straight

BACK = "Heading is back"


def was_silent(
    motion: Motion, silent_s: float, bias_deg: float, *, has_rate: bool = True, sensors: SimulatedSensors | None = None
) -> SensorRig:
    """A compass that is right for 20 s, then silent, then off by so much."""
    made = SensorRig(motion, sensors=sensors)
    made.suite.faults.rate_silent = not has_rate
    made.run(20.0)
    made.suite.faults.heading_silent = True
    made.run(silent_s)
    made.suite.faults.heading_silent = False
    made.suite.faults.heading_bias_deg = bias_deg
    made.texts.clear()
    return made


def off_deg(made: SensorRig) -> float:
    """How far off the heading is that is shown; 0 where none is."""
    if made.state.psi_rad is None:
        return 0.0
    return abs(math.degrees(wrap_pi(made.state.psi_rad - made.truth.psi_rad)))


def worst_deg(made: SensorRig, seconds: float) -> float:
    found: list[float] = []
    made.run(seconds, lambda here: found.append(off_deg(here)))
    return max(found)


def said(made: SensorRig, what: str) -> list[str]:
    return [text for _, _, text in made.texts if what in text]


def doubts(made: SensorRig) -> list[str]:
    return [*said(made, "Heading"), *said(made, "Compass")]


@pytest.mark.parametrize("has_rate", [True, False])
@pytest.mark.parametrize("silent_s", [0.6, 3.0, 60.0, *in_the_soak(1.0, 10.0)])
@pytest.mark.parametrize("bias_deg", [180.0, -90.0, *in_the_soak(120.0, -60.0)])
def test_under_way_one_that_comes_back_wrong_is_told_and_not_believed(
    bias_deg: float, silent_s: float, has_rate: bool
) -> None:
    """A GNSS compass that finds a wrong ambiguity was believed at once, without a word: she ran away at full thrust."""
    made = was_silent(straight(1.5, 0.4), silent_s, bias_deg, has_rate=has_rate)
    assert worst_deg(made, 90.0) < 15.0
    assert made.state.heading_from_course
    assert len(said(made, BACK)) == 1
    assert [severity for _, severity, text in made.texts if BACK in text] == [Severity.ERROR]


def test_a_slow_compass_that_comes_back_wrong_is_not_believed() -> None:
    made = was_silent(straight(1.5, 0.4), 3.0, 180.0, sensors=SimulatedSensors(heading_hz=1.0))
    assert worst_deg(made, 30.0) < 15.0
    assert said(made, BACK)


@pytest.mark.parametrize("has_rate", [True, False])
@pytest.mark.parametrize("silent_s", [0.6, 3.0, 10.0, 60.0])
@pytest.mark.parametrize("motion", [straight(1.5, 0.4), circle(20.0, 1.5), carried(1.5, -0.5 * math.pi)])
def test_under_way_one_that_comes_back_right_is_believed_at_once(
    motion: Motion, silent_s: float, has_rate: bool
) -> None:
    made = was_silent(motion, silent_s, 0.0, has_rate=has_rate)
    made.run(0.3)
    assert not made.state.heading_from_course
    assert off_deg(made) < 4.0
    assert doubts(made) == []


@pytest.mark.parametrize(("silent_s", "turned_deg"), [(0.6, 20.0), (3.0, 40.0), (10.0, 90.0), (120.0, 180.0)])
def test_at_rest_without_a_turn_rate_she_may_have_turned_meanwhile(silent_s: float, turned_deg: float) -> None:
    made = was_silent(straight(0.0, 0.4), silent_s, turned_deg, has_rate=False)
    made.run(0.3)
    assert made.state.heading_valid
    assert doubts(made) == []


@pytest.mark.parametrize("silent_s", [0.6, 3.0, 30.0])
def test_at_rest_a_turn_rate_tells_that_she_has_not_turned(silent_s: float) -> None:
    """It is held as any jump is, and accepted as one: where she lies nothing can contradict it."""
    made = was_silent(straight(0.0, 0.4), silent_s, 180.0)
    assert worst_deg(made, 9.0) < 15.0
    assert said(made, BACK)
    made.run(2.0)
    assert made.state.heading_valid
    assert said(made, "accepted") == ["Compass: new heading accepted after 10 s"]


def test_a_turn_that_the_rate_sensor_saw_is_expected() -> None:
    made = was_silent(circle(5.0, 0.5), 20.0, 0.0)
    made.run(0.3)
    assert made.state.heading_valid
    assert off_deg(made) < 4.0
    assert doubts(made) == []


def test_after_minutes_at_rest_nothing_is_expected() -> None:
    made = was_silent(straight(0.0, 0.4), 240.0, 180.0)
    made.run(0.3)
    assert made.state.heading_valid
    assert said(made, BACK) == []


def test_one_that_was_refused_is_believed_again_as_soon_as_it_is_right() -> None:
    made = was_silent(straight(1.5, 0.4), 3.0, 180.0)
    made.run(30.0)
    made.suite.faults.heading_bias_deg = 0.0
    made.run(0.3)
    assert not made.state.heading_from_course
    assert said(made, "plausible") == ["Compass: heading is plausible again"]


def test_a_moment_without_way_does_not_make_a_wrong_heading_right() -> None:
    """At the next corner, where for a moment no course contradicts it, it was accepted."""
    slow = then(straight(1.5, 0.4), 60.0, straight(0.5, 0.4))
    made = was_silent(then(slow, 70.0, straight(1.5, 0.4)), 3.0, 180.0)
    assert worst_deg(made, 80.0) < 15.0
    assert said(made, "accepted") == []


def test_at_rest_a_heading_that_was_contradicted_is_not_locked_out_for_ever() -> None:
    made = was_silent(then(straight(1.5, 0.4), 40.0, straight(0.0, 0.4)), 3.0, 180.0)
    made.run(74.0)
    assert not made.state.heading_valid
    made.run(10.0)
    assert made.state.heading_valid
    assert said(made, "accepted") == ["Compass: new heading accepted after 60 s"]


def test_one_that_was_contradicted_is_not_right_where_the_bow_swings_by_unseen() -> None:
    """Adrift without a turn rate sensor, what was expected stayed with nobody to tell of it, and the wrong compass came by: plausible."""

    def stops_and_swings(t_s: float) -> Pose:
        way_mps = 1.5 if t_s < 30.0 else 1.5 * math.exp(0.5 * (30.0 - t_s))
        psi_rad = wrap_pi(0.4 + math.tau * min(1.0, max(0.0, t_s - 45.0) / 24.0))
        gone_m = 1.5 * min(t_s, 30.0) + 2.0 * ((1.5 - way_mps) if t_s > 30.0 else 0.0)
        vn, ve = way_mps * math.cos(0.4), way_mps * math.sin(0.4)
        return Pose(gone_m * math.cos(0.4), gone_m * math.sin(0.4), psi_rad, vn, ve, u_mps=way_mps)

    made = was_silent(stops_and_swings, 3.0, 180.0, has_rate=False)
    made.run(60.0)
    assert made.state.psi_rad is None
    assert said(made, "plausible") == []
    made.run(25.0)
    assert said(made, "accepted") == ["Compass: new heading accepted after 60 s"]


def test_a_course_that_bears_a_heading_out_ends_the_doubt() -> None:
    """The boat is on another course by now than when it was contradicted."""
    turned = straight(1.5, 0.4 - 0.5 * math.pi)
    motion = then(straight(1.5, 0.4), 40.0, turned)
    made = was_silent(motion, 3.0, -90.0, has_rate=False)
    made.run(17.0)
    made.suite.faults.heading_bias_deg = 0.0
    made.run(12.0)
    assert not made.state.heading_from_course
    assert off_deg(made) < 4.0


def test_the_first_heading_of_all_is_believed() -> None:
    made = SensorRig(straight(1.5, 0.4))
    made.suite.faults.heading_silent = True
    made.run(20.0)
    made.suite.faults.heading_silent = False
    made.run(0.3)
    assert made.state.heading_valid
    assert off_deg(made) < 4.0


def spin(r_radps: float, until_s: float = 1e6, other_radps: float = 0.0) -> Motion:
    """On the spot; from a time on with another turn rate."""

    def pose(t_s: float) -> Pose:
        psi_rad = wrap_pi(r_radps * min(t_s, until_s) + other_radps * max(t_s - until_s, 0.0))
        return Pose(0.0, 0.0, psi_rad, 0.0, 0.0, r_radps if t_s < until_s else other_radps)

    return pose


@pytest.mark.parametrize(
    ("silent_s", "r_radps", "has_rate"), [(3.0, 1.0, False), (10.0, 1.0, False), (20.0, 1.4, True)]
)
def test_in_a_spin_one_that_comes_back_right_is_believed_at_once(
    silent_s: float, r_radps: float, has_rate: bool
) -> None:
    """Light hulls turn 60 degrees a second: she may have pointed anywhere, and for 10 s her compass was not believed."""
    made = was_silent(spin(r_radps), silent_s, 0.0, has_rate=has_rate)
    made.run(0.3)
    assert made.state.heading_valid
    assert doubts(made) == []


def test_a_turn_to_the_other_side_meanwhile_is_no_jump() -> None:
    """Helm to and fro: she was expected to have gone on to the first side."""
    made = was_silent(spin(0.6, 20.0, -0.6), 2.0, 0.0, has_rate=False)
    made.run(0.3)
    assert made.state.heading_valid
    assert doubts(made) == []


def test_a_turn_that_thrusters_were_asked_for_meanwhile_is_expected() -> None:
    made = SensorRig(spin(0.0, 20.0, 1.0))
    made.suite.faults.rate_silent = True
    made.run(20.0)
    made.suite.faults.heading_silent = True
    made.run(3.0, lambda here: here.estimator.note_turn(here.now_us, 0.05, 1.0))
    made.suite.faults.heading_silent = False
    made.texts.clear()
    made.run(0.3)
    assert made.state.heading_valid
    assert doubts(made) == []


def test_after_quick_turns_one_that_her_way_contradicts_is_not_believed() -> None:
    """She may have turned anywhere, but by now thrust takes her straight ahead."""
    made = was_silent(then(spin(1.0), 20.5, straight(1.5, 0.4)), 10.0, 180.0, has_rate=False)
    assert worst_deg(made, 60.0) < 15.0
    assert said(made, BACK)


@pytest.mark.parametrize("has_rate", [True, False])
@pytest.mark.parametrize("psi_rad", [-1.0, 3.0])
def test_a_current_that_sets_in_meanwhile_makes_no_compass_wrong(psi_rad: float, has_rate: bool) -> None:
    """Where she lies it passed for her course, and that for what her compass should say."""
    set_in = then(straight(0.0, psi_rad), 21.0, carried(0.0, psi_rad))
    made = was_silent(set_in, 10.0, 0.0, has_rate=has_rate)
    made.run(0.3)
    assert not made.state.heading_from_course
    assert off_deg(made) < 4.0
    made.run(30.0)
    assert doubts(made) == []


def test_what_thrust_made_before_a_silence_tells_nothing_of_the_heading_after_it() -> None:
    """A current that set in meanwhile was taken for what her thrust had made of it, off the heading."""
    set_in = then(straight(0.0, math.pi), 22.0, carried(1.0, math.pi, 1.5))
    made = was_silent(set_in, 10.0, 0.0)
    made.run(30.0)
    assert made.state.heading_valid
    assert doubts(made) == []
