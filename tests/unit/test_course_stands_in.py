"""The compass is lost: when the course stands in for the heading, and what it says of heading and turn rate (fault matrix row 30)."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from companion.core.hull.geometry import HullGeometry
from mavlink_bridge.language.units import wrap_pi
from tools.benches.cells.sensor_rig import Motion, Pose, SensorRig, circle, straight

_STREAM_MPS = 1.2


def carried(through_mps: float, psi_rad: float, stream_mps: float = _STREAM_MPS) -> Motion:
    """Ahead through the water at a speed, in a stream that sets east."""
    north_mps, east_mps = through_mps * math.cos(psi_rad), through_mps * math.sin(psi_rad) + stream_mps

    def pose(t_s: float) -> Pose:
        return Pose(north_mps * t_s, east_mps * t_s, psi_rad, north_mps, east_mps, u_mps=through_mps)

    return pose


def then(first: Motion, until_s: float, second: Motion) -> Motion:
    """One motion, and another one from a time on, from where the first one ends."""
    end = first(until_s)

    def pose(t_s: float) -> Pose:
        if t_s < until_s:
            return first(t_s)
        went = second(t_s - until_s)
        return replace(went, north_m=end.north_m + went.north_m, east_m=end.east_m + went.east_m)

    return pose


def without_compass(motion: Motion, before_s: float, *, bias_deg: float = 0.0) -> SensorRig:
    """Sailed for so long with a compass that may be wrong; then it is lost altogether.

    One that is wrong has taught no drift: with it the motion would agree.
    """
    made = SensorRig(motion)
    made.knows_water_speed = not bias_deg
    made.suite.faults.rate_silent = True
    made.suite.faults.heading_bias_deg = bias_deg
    made.run(before_s)
    made.suite.faults.heading_silent = True
    made.run(0.7)
    return made


def off_deg(made: SensorRig) -> float:
    assert made.state.psi_rad is not None
    return abs(math.degrees(wrap_pi(made.state.psi_rad - made.truth.psi_rad)))


def test_who_lies_still_in_a_stream_has_no_course_through_the_water() -> None:
    """Ground speed alone was asked: the noise of a vector of zero length passed for a heading of 5 degrees."""
    made = without_compass(carried(0.0, 0.0), 60.0)
    shown: list[bool] = []
    made.run(20.0, lambda here: shown.append(here.state.heading_valid))
    assert made.state.sog_mps == pytest.approx(_STREAM_MPS, abs=0.2)
    assert not any(shown)


def test_who_stems_a_stream_has_a_course_through_the_water() -> None:
    """Over ground she makes a crawl of 0.3 m/s."""
    made = without_compass(carried(1.5, -0.5 * math.pi), 60.0)
    worst: list[float] = []
    made.run(20.0, lambda here: worst.append(off_deg(here)))
    assert made.state.heading_from_course
    assert max(worst) < 10.0


@pytest.mark.parametrize("bias_deg", [100.0, 170.0, -120.0])
def test_a_compass_that_was_wrong_says_nothing_of_the_turn(bias_deg: float) -> None:
    """The heading was set anew by the course, and the turn rate took the whole difference for a turn: 148 degrees a second."""
    made = without_compass(straight(1.5, 0.4), 10.0, bias_deg=bias_deg)
    rates: list[float] = []
    made.run(5.0, lambda here: rates.append(abs(math.degrees(here.state.r_radps))))
    assert max(rates) < 15.0
    assert off_deg(made) < 10.0


@pytest.mark.parametrize("turned_deg", [60.0, 80.0, 170.0])
def test_a_heading_of_long_ago_says_nothing_of_the_turn(turned_deg: float) -> None:
    lain, sailed = straight(0.0, 0.0), straight(1.5, math.radians(turned_deg))
    made = without_compass(then(then(straight(1.5, 0.0), 10.0, lain), 30.0, sailed), 10.0)
    made.run(19.0)
    assert not made.state.heading_valid
    rates: list[float] = []
    worst: list[float] = []

    def look(here: SensorRig) -> None:
        if here.state.r_radps is not None:
            rates.append(abs(math.degrees(here.state.r_radps)))
            worst.append(off_deg(here))

    made.run(8.0, look)
    assert made.state.heading_from_course
    assert max(rates) < 20.0
    assert max(worst) < 20.0


def test_the_turn_rate_is_never_more_than_the_vessel_can() -> None:
    made = without_compass(straight(1.5, 0.4), 10.0, bias_deg=80.0)
    rates: list[float] = []
    made.run(5.0, lambda here: rates.append(abs(math.degrees(here.state.r_radps))))
    assert max(rates) <= made.estimator.config.heading_rate_max_dps + 1e-6


def turning(forward_m: float, *, rate_silent: bool) -> list[float]:
    """How far the heading is off, degrees, on a circle of 10 m at 1.5 m/s, with an antenna so far before the centre."""
    made = SensorRig(circle(10.0, 1.5), hull=HullGeometry(antenna=(forward_m, 0.0, 0.0)))
    made.run(20.0)
    made.suite.faults.rate_silent = rate_silent
    made.suite.faults.heading_silent = True
    made.run(3.0)
    found: list[float] = []
    made.run(60.0, lambda here: found.append(off_deg(here)))
    assert made.state.heading_from_course
    return sorted(found)


@pytest.mark.parametrize("forward_m", [-2.0, -1.0, 1.0, 2.0])
def test_the_course_of_an_antenna_is_taken_to_the_centre(forward_m: float) -> None:
    """The antenna swings out in a turn: 11 degrees for 2 m."""
    found = turning(forward_m, rate_silent=False)
    assert found[len(found) // 2] < 2.0
    assert found[-1] < 5.0


@pytest.mark.parametrize(("forward_m", "most_deg"), [(2.0, 13.0), (1.0, 7.0), (-1.0, 7.0), (-2.0, 10.0)])
def test_without_a_turn_rate_sensor_the_antenna_does_not_feed_itself(forward_m: float, most_deg: float) -> None:
    """A turn rate found from the course, taken off that course behind the centre, grows until the heading is lost."""
    found = turning(forward_m, rate_silent=True)
    assert found[len(found) // 2] < most_deg
    assert found[-1] < 2.0 * most_deg


def test_a_file_that_is_wrong_by_half_does_not_turn_the_course() -> None:
    """What she makes more than her file says is no stream: taken for one, it stood where the compass was lost, and she sailed on round."""
    motion = circle(20.0, 1.5)
    made = SensorRig(lambda t_s: replace(motion(t_s), u_mps=1.0))
    made.run(120.0)
    made.suite.faults.heading_silent = True
    made.run(3.0)
    found: list[float] = []
    made.run(80.0, lambda here: found.append(off_deg(here)))
    assert made.state.heading_from_course
    assert max(found) < 10.0


def test_a_stream_that_carries_her_astern_does_not_contradict_the_compass() -> None:
    """The course over ground was asked: a heading that had jumped was refused for as long as the stream ran."""
    made = SensorRig(carried(0.3, -0.5 * math.pi, 1.6))
    made.run(60.0)
    made.suite.faults.heading_bias_deg = 45.0
    made.run(14.0)
    assert made.state.heading_valid
    assert any("accepted" in text for _, _, text in made.texts)


def test_who_stems_a_stream_is_not_turned_about_by_a_flipped_compass() -> None:
    """Over ground she lies still: that contradicted no heading, and the flip was accepted after 10 s."""
    made = SensorRig(carried(1.5, -0.5 * math.pi, 1.5))
    made.run(60.0)
    made.suite.faults.heading_bias_deg = 180.0
    made.run(30.0)
    assert off_deg(made) < 10.0
    assert made.state.heading_from_course


def test_the_course_of_a_boat_that_goes_astern_is_that_of_her_stern() -> None:
    """It stood in for the heading half round, and a compass that was right was held to contradict the motion."""
    made = without_compass(lambda t_s: Pose(-1.5 * t_s, 0.0, 0.0, -1.5, 0.0, u_mps=-1.5), 30.0)
    worst: list[float] = []
    made.run(20.0, lambda here: worst.append(off_deg(here)))
    assert made.state.heading_from_course
    assert max(worst) < 10.0
    made.suite.faults.heading_silent = False
    made.run(0.3)
    assert not made.state.heading_from_course
    assert off_deg(made) < 4.0
