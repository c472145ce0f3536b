"""Readings that are not believed: the sounder's range said for no bottom, and jumps to much deeper water that may be second echoes."""

from __future__ import annotations

import math
import random

import pytest

from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.guard import DepthGuard
from companion.core.guard.depth.input import DepthInput, DepthInputConfig
from companion.core.hull.geometry import HullGeometry
from mavlink_bridge.language.messages import Distance, EstimatedState, GuardState

SPEED_MPS = 1.5
STEP_US = 100_000


class Bottom:
    """What is known beside the readings: no position is needed."""

    def __init__(self, slope=0.0, known_m=None):
        self.rise, self.known_m = slope, known_m

    def slope(self, t_us):
        return self.rise

    def known_altitude_m(self, state):
        return self.known_m


class Line:
    """A boat under way on a straight line, and its input chain."""

    def __init__(self, bottom=None, *, step_us=STEP_US):
        self.chain = DepthInput(DepthInputConfig(sigma_m=0.0), HullGeometry())
        self.chain.bottom = bottom or Bottom()
        self.step_us, self.t_us, self.way_m = step_us, 0, 0.0

    def read(self, said, speed_mps=SPEED_MPS, across_mps=0.0):
        """One reading; ``said`` of the way made along the line. Return the altitude."""
        self.t_us += self.step_us
        self.way_m += speed_mps * self.step_us * 1e-6
        sog_mps = math.hypot(speed_mps, across_mps)
        state = EstimatedState(self.t_us, sog_mps=sog_mps, vx_mps=speed_mps, vy_mps=across_mps)
        self.chain.measure(Distance(self.t_us, said(self.way_m), range_max_m=100.0), state)
        return self.chain.altitude_m(self.t_us)

    def sail(self, seconds, said, speed_mps=SPEED_MPS, across_mps=0.0):
        """Return what was believed, without the unknown."""
        made = [self.read(said, speed_mps, across_mps) for _ in range(round(seconds * 1e6 / self.step_us))]
        return [altitude_m for altitude_m in made if altitude_m is not None]


def up(slope, from_m=10.0, times=1.0):
    return lambda way_m: times * (from_m - slope * way_m)


@pytest.mark.parametrize("range_m", [100.0, 99.6])
def test_the_range_itself_is_no_deep_water(range_m):
    line = Line()
    line.sail(3.0, lambda way_m: 9.5)
    line.sail(1.0, lambda way_m: range_m)
    assert not line.sail(60.0, lambda way_m: range_m), "however long it says so"
    assert line.chain.is_disputed
    assert not line.chain.out_of_reach
    assert line.chain.trouble == f"Sounder says its range, {range_m:.0f} m, after 9.5 m: no bottom heard"
    assert line.sail(1.0, lambda way_m: 9.0)[-1] == 9.0
    assert line.chain.trouble == ""


def test_the_range_is_believed_where_the_bottom_went_down_to_it():
    line = Line()
    assert line.sail(120.0, lambda way_m: min(50.0 + 0.4 * way_m, 100.0))[-1] == 100.0
    assert line.chain.trouble == ""


@pytest.mark.parametrize(("range_m", "step_us"), [(100.0, 100_000), (99.6, 100_000), (100.0, 1_000_000)])
def test_beyond_the_reach_of_the_sounder_its_range_is_no_repetition(range_m, step_us):
    """It was told to be looked at, after any gentle slope into deep water."""
    line, rng = Line(step_us=step_us), random.Random(1)
    line.sail(60.0, lambda way_m: round(85.0 + 0.08 * way_m + rng.gauss(0.0, 0.1), 2))
    for _ in range(round(300e6 / step_us)):
        line.read(lambda way_m: min(round(85.0 + 0.08 * way_m + rng.gauss(0.0, 0.1), 2), range_m))
        assert line.chain.trouble == ""
    line.sail(60.0, lambda _: round(90.0 + rng.gauss(0.0, 0.1), 2))
    assert line.chain.trouble == ""
    line.sail(60.0, lambda _: 90.0)
    assert line.chain.trouble.endswith("look at it"), "a depth that is repeated afterwards is found as ever"


@pytest.mark.parametrize("times", [2.0, 3.0])
@pytest.mark.parametrize("step_us", [100_000, 1_000_000])
def test_a_second_echo_of_a_closing_bottom_is_doubted_for_as_long_as_it_closes(times, step_us):
    line = Line(Bottom(0.05), step_us=step_us)
    line.sail(10.0, up(0.05))
    line.sail(3.0, up(0.05, times=times))
    assert not line.sail(60.0, up(0.05, times=times))
    assert "doubted" in line.chain.trouble
    true_m = 10.0 - 0.05 * line.way_m
    assert line.sail(6.0, up(0.05))[-1] == pytest.approx(true_m, abs=0.5), "the bottom itself again"
    assert not line.chain.is_disputed


def test_an_echo_that_is_heard_on_the_way_back_is_doubted_too():
    line = Line(Bottom(0.1))
    line.sail(10.0, up(0.1))
    line.sail(3.0, up(0.1, times=2.0))
    assert not line.sail(10.0, up(0.1, times=2.0), -SPEED_MPS)


@pytest.mark.parametrize(("deep_m", "way_m"), [(17.0, 25.0), (40.0, 10.0)])
def test_deep_water_that_does_not_close_is_believed_after_a_bounded_way(deep_m, way_m):
    line = Line(Bottom(0.05))
    line.sail(10.0, up(0.05))
    began_m = line.way_m
    while line.read(lambda _: deep_m) != deep_m:
        assert line.way_m - began_m < way_m + 5.0
    assert line.way_m - began_m > way_m
    assert line.chain.trouble == ""


@pytest.mark.parametrize("across_mps", [SPEED_MPS, -SPEED_MPS])
@pytest.mark.parametrize(("deep_m", "way_m"), [(17.0, 38.0), (40.0, 15.0)])
@pytest.mark.parametrize("turn_m", [2.0, 8.0])
def test_deep_water_behind_an_edge_is_believed_where_the_boat_turns_along_it(deep_m, way_m, turn_m, across_mps):
    line, rng = Line(Bottom(0.05)), random.Random(2)
    line.sail(10.0, up(0.05))
    line.sail(turn_m / SPEED_MPS, lambda _: deep_m + rng.gauss(0.0, 0.02))
    assert line.chain.is_disputed
    believed = line.sail(way_m / SPEED_MPS, lambda _: deep_m + rng.gauss(0.0, 0.02), 0.0, across_mps)
    assert believed[-1] == pytest.approx(deep_m, abs=0.1)
    assert line.chain.trouble == ""


def test_an_echo_that_closed_is_doubted_for_a_way_after_the_boat_turned_along_the_slope():
    line = Line(Bottom(0.05))
    line.sail(10.0, up(0.05))
    line.sail(10.0, up(0.05, times=2.0))
    assert not line.sail(18.0, up(0.05, times=2.0), 0.0, SPEED_MPS)


@pytest.mark.parametrize("speed_mps", [0.0, 0.05])
def test_a_boat_that_lies_behind_an_edge_is_not_left_in_doubt_for_ever(speed_mps):
    line = Line(Bottom(0.05))
    line.sail(10.0, up(0.05))
    line.sail(4.0, lambda _: 17.0)
    assert not line.sail(240.0, lambda _: 17.0, 0.0, speed_mps)
    assert line.sail(120.0, lambda _: 17.0, 0.0, speed_mps)[-1] == 17.0


def test_a_single_false_echo_does_not_end_a_doubt():
    line = Line(Bottom(0.05))
    line.sail(10.0, up(0.05))
    line.sail(3.0, up(0.05, times=2.0))
    line.read(up(0.05, times=1.0))
    line.read(up(0.05, times=1.0))
    assert not line.sail(20.0, up(0.05, times=2.0))


def test_over_a_bottom_that_was_not_closing_a_jump_is_believed_as_ever():
    line = Line()
    line.sail(10.0, lambda _: 8.0)
    line.sail(0.3, lambda _: 16.0)
    assert line.sail(1.0, lambda _: 16.0)[-1] == 16.0


def test_where_chart_or_memory_know_the_depth_a_jump_to_twice_of_it_is_doubted():
    line = Line(Bottom(known_m=8.2))
    line.sail(10.0, lambda _: 8.0)
    line.sail(1.0, lambda _: 16.0)
    assert not line.sail(10.0, lambda _: 16.0)
    assert "known here" in line.chain.trouble
    assert line.sail(10.0, lambda _: 16.0)[-1] == 16.0, "a chart may be wrong: after 25 m"
    shallow = Line(Bottom(known_m=3.0))
    shallow.sail(10.0, lambda _: 8.0)
    assert shallow.sail(1.0, lambda _: 16.0)[-1] == 16.0, "a chart that was wrong before vouches for nothing"


def test_the_bottom_that_a_false_echo_hid_is_not_doubted():
    line = Line(Bottom(0.1))
    line.sail(5.0, lambda _: 20.0)
    line.sail(2.0, lambda _: 2.0)
    assert line.sail(1.0, lambda _: 20.0)[-1] == 20.0


def test_after_a_silence_a_second_echo_is_doubted():
    line = Line(Bottom(0.05))
    line.sail(10.0, up(0.05))
    line.sail(7.0, lambda _: None)
    assert not line.sail(10.0, up(0.05, times=2.0))


def test_a_sounder_that_repeats_itself_where_the_chart_knows_less_water_is_not_believed():
    line = Line(Bottom(known_m=12.0))
    rng = random.Random(1)
    line.sail(20.0, lambda _: round(12.0 + rng.gauss(0.0, 0.05), 2))
    assert line.sail(10.0, lambda _: 12.05)[-1] == 12.05
    assert line.chain.trouble.endswith("look at it")
    line.chain.bottom = Bottom(known_m=5.0)
    assert not line.sail(5.0, lambda _: 12.05)
    assert line.chain.trouble.endswith("not believed until it changes")


def test_the_guard_tells_once_what_is_wrong_and_that_it_is_over():
    guard = DepthGuard(DepthGuardConfig(), HullGeometry())
    texts, t_us = [], 0

    def read(seconds, value_m):
        nonlocal t_us
        for _ in range(round(seconds * 10)):
            t_us += STEP_US
            state = EstimatedState(t_us, sog_mps=SPEED_MPS)
            guard.measure(Distance(t_us, value_m, range_max_m=100.0), state)
            texts.extend(text for _, text in guard.step(t_us, state, True).texts)

    read(5.0, 9.5)
    read(0.3, 100.0)
    read(5.0, 9.5)
    assert not [text for text in texts if text.startswith("Sounder")], "a reading or two cost nothing"
    read(10.0, 100.0)
    assert guard.state is GuardState.UNKNOWN
    read(5.0, 9.5)
    assert [text for text in texts if text.startswith("Sounder")] == [
        "Sounder says its range, 100 m, after 9.5 m: no bottom heard",
        "Sounder believed again",
    ]
