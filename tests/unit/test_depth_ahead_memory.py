"""What the vessel has sounded before, seen by the look-ahead: how far, how wide, at which tide, and the way out again."""

from __future__ import annotations

from dataclasses import replace

import pytest

from companion.core.guard.depth.ahead import DepthAhead
from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.grid import Sounding, build, offset
from companion.core.guard.depth.input import DepthInput, DepthInputConfig
from companion.core.guard.depth.memory import DepthMemory, DepthMemoryConfig
from companion.core.hull.geometry import HullGeometry
from mavlink_bridge.language.messages import EstimatedState

HERE = (0.7188, -0.1519)
KEEL_M = 0.35
HULL = HullGeometry(keel_m=KEEL_M, beam_m=1.1)


def at(north_m=0.0, east_m=0.0, speed_mps=2.0, course_rad=0.0, **more):
    lat, lon = offset(*HERE, north_m, east_m)
    values = {"sog_mps": speed_mps, "cog_rad": course_rad, "psi_rad": course_rad, **more}
    return EstimatedState(0, lat_rad=lat, lon_rad=lon, x_m=north_m, y_m=east_m, **values)


def remembered(*shoals, cell_m=1.0):
    """Cells that were sounded ten times each: (north, east, depth below datum)."""
    memory = DepthMemory(DepthMemoryConfig(cell_m=cell_m), 0.05)
    for north_m, east_m, depth_m in shoals:
        for _ in range(10):
            memory.note(at(north_m, east_m), 0, depth_m, 0)
    memory.close_cell()
    return memory


def look(memory, state=None, altitude_m=9.0, path=None, grid=None, stopping=2.3, beam_m=1.0, **config):
    """One look with a stopping distance of 2.3 s: at 2 m/s it reaches 4.6 + 0.8 * 2 + 1 = 7.2 m, and a cell."""
    chain = DepthInputConfig()
    settings = DepthGuardConfig(**{"input": chain, **config})
    ahead = DepthAhead(settings, memory, replace(HULL, beam_m=beam_m))
    ahead.map = grid
    way = None if path is None else lambda reach_m: path
    return ahead.look(
        0, state or at(), altitude_m, DepthInput(settings.input, HULL), way, lambda speed: stopping * speed
    )


@pytest.mark.parametrize(("north_m", "stop"), [(3.5, True), (6.5, True), (8.0, True), (9.5, False), (30.0, False)])
def test_it_reaches_as_far_as_stopping_takes_and_a_cell(north_m, stop):
    assert look(remembered((north_m, 0.2, 2.0))).stop == stop


def test_reaction_and_latency_are_part_of_the_reach():
    """0.8 s at 2 m/s: cells 1.6 m farther than stopping alone would need."""
    assert look(remembered((8.6, 0.2, 2.0)), at(speed_mps=2.0), stopping=2.3).stop
    assert not look(remembered((8.6, 0.2, 2.0)), at(speed_mps=2.0), stopping=1.6).stop


def test_a_wide_vessel_on_a_coarse_grid_looks_no_wider_than_it_is():
    for east_m, stop in ((2.9, True), (8.5, False)):
        assert look(remembered((7.5, east_m, 2.0), cell_m=2.0), beam_m=3.0).stop == stop


def test_beside_a_shoal_only_its_own_place_bars_the_way():
    """Stopped before a rock: another order to go over it is stopped again, one to turn away from it is not."""
    rock = remembered((3.0, 0.3, 2.0), cell_m=2.0)
    assert look(rock, at(speed_mps=0.6), altitude_m=6.0).stop
    assert look(rock, at(speed_mps=1.0), path=[(0.0, 0.0), (9.0, 0.0)]).stop
    assert not look(rock, at(speed_mps=0.4, course_rad=1.57)).stop
    assert not look(rock, at(speed_mps=0.4), path=[(0.0, 0.0), (-9.0, 0.0)]).stop
    assert not look(rock, at(north_m=-9.0, speed_mps=1.0)).stop


def test_a_slower_vessel_looks_less_far_and_one_without_a_speed_looks_at_itself():
    memory = remembered((6.5, 0.2, 2.0))
    assert look(memory, at(speed_mps=2.0)).stop
    assert not look(memory, at(speed_mps=1.0)).stop
    assert not look(memory, at(sog_mps=None)).stop
    assert look(remembered((1.5, 0.2, 2.0)), at(sog_mps=None)).stop, "one metre and a cell in any case"
    assert not look(remembered((3.5, 0.2, 2.0)), at(sog_mps=None)).stop
    assert look(memory, at(speed_mps=1.0), reaction_s=4.0).stop


@pytest.mark.parametrize(
    ("beam_m", "east_m", "stop"), [(1.0, 0.9, True), (1.0, 3.3, False), (3.0, 2.9, True), (3.0, 5.6, False)]
)
def test_it_is_as_wide_as_the_vessel_on_either_side(beam_m, east_m, stop):
    for side in (1.0, -1.0):
        assert look(remembered((4.0, side * east_m, 2.0)), beam_m=beam_m).stop == stop


@pytest.mark.parametrize(("tide_m", "stop"), [(0.0, False), (-0.5, True), (0.5, False)])
def test_the_tide_of_the_day_counts(tide_m, stop):
    """4.65 m below datum are 4.3 m under the keel at no tide."""
    found = look(remembered((4.0, 0.2, 4.65)), tide_m=tide_m)
    assert found.stop == stop
    assert (found.why == "sounded before 3.8 m") == stop
    if stop:
        assert found.map_least_m == pytest.approx(3.8, abs=0.01)


def test_the_charts_uncertainty_is_not_taken_off_what_was_measured():
    assert not look(remembered((4.0, 0.2, 4.65)), map_sigma_m=1.0).stop


@pytest.mark.parametrize(
    ("here_m", "ahead_m", "altitude_m", "stop"),
    [
        (None, 3.9, 4.5, True),
        (None, 3.9, None, True),
        (3.6, 3.6, 4.5, False),
        (3.6, 3.52, 4.5, False),
        (3.6, 3.4, 4.5, True),
        (3.6, 3.4, 3.45, False),
        (None, 3.45, 3.5, False),
        (None, 3.35, 3.5, True),
        (None, 3.95, 4.02, True),
    ],
)
def test_amid_shoals_only_worse_water_stops_it(here_m, ahead_m, altitude_m, stop):
    """Altitudes; here by the memory, measured, or both."""
    shoals = [(4.5, 0.2, ahead_m + KEEL_M)]
    if here_m is not None:
        shoals.append((0.0, 0.0, here_m + KEEL_M))
    assert look(remembered(*shoals), altitude_m=altitude_m).stop == stop


def test_it_looks_along_the_path_and_straight_on_when_the_vessel_does_not_follow_it():
    east = [(0.0, 0.0), (2.0, 0.0), (2.0, 30.0)]
    turning, straight = at(r_radps=0.9), at()
    ahead, aside = remembered((6.5, 0.2, 2.0)), remembered((2.2, 4.5, 2.0))
    assert not look(ahead, turning, path=east).stop
    assert look(aside, turning, path=east).stop
    assert look(ahead, straight, path=east).stop, "it does not turn"
    assert look(aside, straight, path=east).stop
    assert look(ahead, turning).stop is False


def test_chart_and_memory_both_count_and_the_shallower_is_told():
    def charted(depth_m):
        return build([Sounding(*offset(*HERE, 4.0, 0.0), depth_m)], 1.0, 2.0)

    memory = remembered((4.0, 0.2, 3.35))
    found = look(memory, grid=charted(3.85))
    assert found.stop
    assert found.map_least_m == pytest.approx(3.0, abs=0.01)
    found = look(memory, grid=charted(2.85))
    assert found.map_least_m == pytest.approx(2.5, abs=0.01)
    assert look(memory, grid=charted(9.0)).stop, "a chart that knows of more water changes nothing"
    assert look(remembered((4.0, 0.2, 9.0)), grid=charted(3.85)).stop, "nor does a memory"
    assert not look(memory, grid=charted(9.0), map_look_ahead=False).stop


def test_without_a_position_it_says_nothing():
    state = EstimatedState(0, sog_mps=2.0, cog_rad=0.0, psi_rad=0.0)
    assert not look(remembered((4.0, 0.2, 2.0)), state).stop


class TestConfirming:
    """A stop by the closing rate is held back while waiting costs less than 15 mm of water."""

    def looks(self, rates_mps, dt_s=0.05):
        settings = DepthGuardConfig()
        ahead, now_us, found = DepthAhead(settings, None, HullGeometry(beam_m=1.1)), 10_000_000, []
        for rate_mps in rates_mps:
            now_us += round(dt_s * 1e6)
            source = DepthInput(settings.input, HullGeometry())
            source._middle_us = now_us
            ahead._closing._closing_mps = rate_mps
            found.append(
                ahead.look(now_us, at(speed_mps=1.0), 4.05 + 0.0 * rate_mps, source, None, lambda speed: 2.4).stop
            )
        return found

    def test_a_fast_one_at_once_and_a_slow_one_after_a_while(self):
        assert self.looks([0.5]) == [True]
        assert self.looks([0.15]) == [True]
        slow = self.looks([0.03] * 20)
        assert slow.index(True) in (6, 7, 8)
        assert all(slow[slow.index(True) :])

    def test_what_comes_and_goes_is_forgotten(self):
        assert not any(self.looks([0.03, 0.03, 0.0, 0.0, 0.0, 0.0] * 40))
        assert any(self.looks([0.03, 0.03, 0.03, 0.0] * 40)), "most of the time is a slope"

    def test_a_pause_between_two_looks_confirms_nothing(self):
        assert self.looks([0.03, 0.03], dt_s=5.0) == [False, False]
