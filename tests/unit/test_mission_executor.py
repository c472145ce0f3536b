"""The plan executor: order, jumps, speeds, durations, caps; plans replaced under way."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest
from hypothesis import given, settings, strategies as st

from companion.core.guide.leg import Leg
from companion.core.vehicle.mission import ANOTHER, BEGINS_ANEW, GOES_ON, Mission
from companion.core.vehicle.plan_reach import MissionConfig
from mavlink_bridge.language.figures import Circle, Hover
from mavlink_bridge.language.messages import (
    ChangeSpeed,
    Delay,
    EstimatedState,
    FenceEnable,
    Goto,
    Jump,
    Loiter,
    Maneuver,
    PlanSpecification,
    PlanState,
    ReturnHome,
    Severity,
)

LAT, LON = math.radians(41.0), math.radians(-8.0)
HERE = EstimatedState(0, lat_rad=LAT, lon_rad=LON, x_m=0.0, y_m=0.0, psi_rad=0.0)
METRE = 1.0 / 6.37e6


@dataclass
class Report:
    arrived: bool = False
    on_path: bool = False
    turns: float = 0.0


def point(seq: int, metres: float = 50.0, **more: float) -> Goto:
    return Goto(seq, LAT + metres * METRE, LON, **more)


def mission(*items: Maneuver) -> Mission:
    made = Mission(MissionConfig())
    made.load(PlanSpecification(items, plan_id=1))
    assert made.start() == ""
    return made


def leg_of(made: Mission, now_s: float) -> Leg | None:
    return made.active(round(now_s * 1e6), HERE)


def finish(made: Mission, now_s: float, report: Report | None = None) -> None:
    made.advance(round(now_s * 1e6), HERE, report or Report(arrived=True))


def test_items_follow_each_other_and_each_is_reported_once() -> None:
    made = mission(point(0), ChangeSpeed(1, 2.2), point(2, 90))
    first = leg_of(made, 0)
    assert first is not None
    assert (first.maneuver.seq, first.speed_mps, first.previous) == (0, 1.5, None)
    finish(made, 1)
    second = leg_of(made, 2)
    assert second is not None
    assert (second.maneuver.seq, second.speed_mps) == (2, 2.2)
    assert second.previous == (first.maneuver.lat_rad, first.maneuver.lon_rad)
    assert second.generation != first.generation
    finish(made, 3)
    assert leg_of(made, 4) is None
    assert made.state is PlanState.COMPLETE
    assert made.drain()[0] == (0, 1, 2)
    assert made.drain()[0] == ()


def test_a_point_is_held_for_its_time() -> None:
    made = mission(point(0, hold_s=10.0), point(1, 90))
    leg_of(made, 0)
    finish(made, 5)
    finish(made, 14.9)
    assert leg_of(made, 14.9).maneuver.seq == 0
    finish(made, 15.0)
    assert leg_of(made, 15.1).maneuver.seq == 1


def test_duration_counts_from_reaching_the_circle() -> None:
    made = mission(Loiter(0, LAT, LON, figure=Circle(radius_m=20.0), duration_s=60.0))
    leg_of(made, 0)
    finish(made, 30, Report())
    finish(made, 40, Report(on_path=True))
    finish(made, 99.9, Report(on_path=True))
    assert leg_of(made, 99.9) is not None
    finish(made, 100.0, Report(on_path=True))
    assert leg_of(made, 100.1) is None


def test_an_approach_that_never_gets_there_is_capped_and_told() -> None:
    made = mission(Loiter(0, LAT + 75 * METRE, LON, figure=Circle(radius_m=20.0), duration_s=60.0))
    leg_of(made, 0)
    nominal_s = 75 / 1.5
    finish(made, 4 * nominal_s + 119, Report())
    assert leg_of(made, 0) is not None
    finish(made, 4 * nominal_s + 121, Report())
    assert leg_of(made, 0) is None
    assert any("not reached" in text for _, text in made.drain_texts())


def test_what_was_given_up_is_told_as_skipped_and_not_reported_as_reached() -> None:
    """A station that counts what was reached would believe that the survey is whole, or the headland rounded."""
    for item in (point(0, 75), Loiter(0, LAT + 75 * METRE, LON, figure=Circle(radius_m=20.0), duration_s=60.0)):
        made = mission(item, point(1, 90))
        leg_of(made, 0)
        finish(made, 1000, Report())
        assert leg_of(made, 1000).maneuver.seq == 1
        assert made.drain()[0] == ()
        ((severity, text),) = made.drain_texts()
        assert severity is Severity.WARNING
        assert "skipped" in text
        assert "APPR_FACTOR" in text
        finish(made, 1001, Report(arrived=True))
        assert made.drain()[0] == (1,)


def test_turns_end_a_loiter_and_an_unlimited_one_never_ends() -> None:
    made = mission(Loiter(0, LAT, LON, figure=Circle(radius_m=20.0), turns=2.0))
    leg_of(made, 0)
    finish(made, 1, Report(on_path=True, turns=1.99))
    assert leg_of(made, 1) is not None
    finish(made, 2, Report(on_path=True, turns=2.0))
    assert leg_of(made, 2) is None
    endless = mission(Loiter(0, LAT, LON, figure=Circle(radius_m=20.0)))
    leg_of(endless, 0)
    finish(endless, 1e6, Report(on_path=True, turns=1e4))
    assert leg_of(endless, 1e6) is not None


def test_jumps_are_counted_and_then_passed() -> None:
    made = mission(point(0), point(1, 90), Jump(2, 0, 2), point(3, 200))
    sailed = []
    for second in range(10):
        leg = leg_of(made, second)
        if leg is None:
            break
        sailed.append(leg.maneuver.seq)
        finish(made, second + 0.5)
    assert sailed == [0, 1, 0, 1, 0, 1, 3]


@pytest.mark.parametrize("repeats", [-1, 200])
@pytest.mark.parametrize("apart_m", [None, 0.0, 1.0], ids=["one point", "two equal", "two near"])
def test_a_jump_back_to_the_same_place_stays_there_and_goes_round_once_a_second(
    apart_m: float | None, repeats: int
) -> None:
    """Gone round at each tick, a link's whole rate would be items that were reached."""
    points = (point(0),) if apart_m is None else (point(0), point(1, 50 + apart_m))
    made = mission(*points, Jump(len(points), 0, repeats))
    for tick in range(100 * 20):
        leg = leg_of(made, tick / 20)
        assert leg is not None
        finish(made, tick / 20)
    reached = made.drain()[0]
    assert 90 * len(points) < len(reached) < 102 * len(points)
    assert list(made.drain_texts()) == []


@pytest.mark.parametrize(
    "stays",
    [
        (Loiter(1, LAT + 50 * METRE, LON, figure=Hover(), duration_s=0.0), Jump(2, 0, -1)),
        (Loiter(1, LAT + 50 * METRE, LON, figure=Hover(), duration_s=0.0), Jump(2, 1, -1)),
        (Loiter(1, LAT + 50 * METRE, LON, figure=Circle(radius_m=20.0), turns=0.0), Jump(2, 1, -1)),
        (Delay(1, 0.0), Jump(2, 0, -1)),
        (Delay(1, 0.0), ChangeSpeed(2, 1.0), Jump(3, 1, -1)),
        (Delay(1, 0.0, until_utc_s_of_day=100.0), Jump(2, 1, -1)),
        (Jump(1, 2, -1), Delay(2, 0.0), Jump(3, 0, -1)),
    ],
)
def test_a_loop_that_sails_nowhere_takes_a_second_whatever_its_items_are(stays: tuple[Maneuver, ...]) -> None:
    """A loiter of no time and a jump back were items reached at each tick."""
    made = mission(point(0), *stays)
    made.utc_s_of_day = 120.0
    for tick in range(100 * 20):
        assert leg_of(made, tick / 20) is not None
        finish(made, tick / 20, Report(arrived=True, on_path=True))
    assert 45 < len(made.drain()[0]) < 101 * len(stays) + 5


def test_a_patrol_that_ends_where_it_begins_goes_on_without_a_stay() -> None:
    """She stopped at the first point for a second in each lap."""
    made = mission(point(0), point(1, 90), point(2, 50), Jump(3, 0, -1))
    sailed_s = {0: 0.0, 1: 30.0, 2: 30.0}
    now_s, held = 0.0, []
    for _ in range(30):
        leg = leg_of(made, now_s)
        assert isinstance(leg.maneuver, Goto)
        held.append(leg.maneuver.hold_s)
        now_s += sailed_s[leg.maneuver.seq] + 0.05
        finish(made, now_s)
    assert held == [0.0] * 30


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(-1, 3)), min_size=1, max_size=6))
@settings(max_examples=60, deadline=None)
def test_a_plan_of_jumps_alone_ends(jumps: list[tuple[int, int]]) -> None:
    items = tuple(Jump(seq, target % len(jumps), repeats) for seq, (target, repeats) in enumerate(jumps))
    assert leg_of(mission(*items), 0) is None


def test_a_delay_keeps_station_where_the_plan_stands() -> None:
    made = mission(point(0), Delay(1, 30.0), point(2, 90))
    leg_of(made, 0)
    finish(made, 1)
    waiting = leg_of(made, 2)
    assert isinstance(waiting.maneuver, Loiter)
    assert waiting.maneuver.figure == Hover()
    assert waiting.maneuver.lat_rad == point(0).lat_rad
    finish(made, 3, Report(on_path=True))
    finish(made, 33, Report(on_path=True))
    assert leg_of(made, 34).maneuver.seq == 2


def test_return_goes_to_the_nearest_rally_point_or_home_or_is_passed_with_a_word() -> None:
    far, near, home = (LAT + 900 * METRE, LON), (LAT + 100 * METRE, LON), (LAT - 10 * METRE, LON)
    made = mission(ReturnHome(0))
    assert leg_of(made, 0) is None
    assert any("no home" in text for _, text in made.drain_texts())
    for rally, known, target, words in (
        ((far, near), None, near, "item 0: return to rally point 2, 100 m"),
        ((far, near), home, home, "item 0: return to home, 10 m"),
        ((near,), far, near, "item 0: return to rally point 1, 100 m"),
        ((), home, home, "item 0: return to home, 10 m"),
    ):
        made = mission(ReturnHome(0))
        made.havens.rally, made.havens.home = rally, known
        assert leg_of(made, 0).maneuver.lat_rad == target[0]
        assert [text for _, text in made.drain_texts()] == [words]


def test_effects_are_handed_over_in_order() -> None:
    made = mission(FenceEnable(0, enable=False), point(1))
    leg_of(made, 0)
    _, effects = made.drain()
    assert effects == (FenceEnable(0, enable=False),)


def test_a_new_plan_goes_on_at_an_unchanged_item_and_else_starts_over() -> None:
    made = mission(point(0), point(1, 90), point(2, 120))
    leg_of(made, 0)
    finish(made, 1)
    under_way = leg_of(made, 2)
    made.load(PlanSpecification((point(0), point(1, 90), point(2, 300)), 2))
    onward = leg_of(made, 3)
    assert onward.maneuver == under_way.maneuver, "the same item"
    assert onward.previous == under_way.previous, "on the same line"
    assert onward.following == point(2, 300), "but toward what follows now"
    made.load(PlanSpecification((point(0), point(1, 90), point(2, 300)), 4))
    assert leg_of(made, 3) is onward
    made.load(PlanSpecification((point(0, 55), point(1, 90)), 3))
    assert leg_of(made, 3) is not None
    assert leg_of(made, 3).maneuver == point(1, 90), "what was passed does not matter to who sails to the same point"
    made.load(PlanSpecification((point(0, 60), point(1, 95)), 5))
    assert leg_of(made, 4).maneuver.seq == 0
    assert [text for _, text in made.drain_texts()] == [BEGINS_ANEW]
    made.load(PlanSpecification())
    assert leg_of(made, 5) is None
    assert made.state is PlanState.NO_MISSION


def test_a_new_plan_with_the_current_item_moved_goes_on_at_it_from_here() -> None:
    made = mission(ChangeSpeed(0, 2.2), point(1), point(2, 90), point(3, 120))
    leg_of(made, 0)
    finish(made, 1)
    before = leg_of(made, 2)
    assert made.load(PlanSpecification((ChangeSpeed(0, 2.2), point(1), point(2, 95), point(3, 120)), 2))
    moved = leg_of(made, 3)
    assert moved.maneuver == point(2, 95)
    assert (moved.previous, moved.speed_mps) == (None, 2.2), "from where the boat is, as fast as before"
    assert moved.generation != before.generation
    assert list(made.drain_texts()) == [(Severity.WARNING, GOES_ON)], "a radio carries warnings"
    assert not made.load(PlanSpecification((ChangeSpeed(0, 2.2), point(1)), 3)), "its place is beyond the plan's end"
    assert leg_of(made, 4).maneuver.seq == 1
    assert [text for _, text in made.drain_texts()] == [BEGINS_ANEW]


def test_a_paused_plan_keeps_its_place_when_it_is_uploaded_again() -> None:
    made = mission(point(0), point(1, 90), point(2, 120))
    leg_of(made, 0)
    finish(made, 1)
    made.pause()
    for item, changed in ((point(2, 120), False), (point(2, 300), False)):
        assert made.load(PlanSpecification((point(0), point(1, 90), item), 2))
        assert (made.state, made.seq, made.is_changed) == (PlanState.PAUSED, 1, changed)
    assert list(made.drain_texts()) == []
    assert made.load(PlanSpecification((point(0), point(1, 95), point(2, 300)), 3))
    assert (made.state, made.seq, made.is_changed) == (PlanState.PAUSED, 1, True)
    made.start()
    assert leg_of(made, 3).maneuver == point(1, 95)
    made.pause()
    assert not made.load(PlanSpecification((point(0, 51), point(1, 96)), 4))
    assert (made.state, made.seq, made.is_changed) == (PlanState.NOT_STARTED, 0, False)


def paused_at_the_second_item() -> Mission:
    made = mission(point(0), point(1, 90))
    leg_of(made, 0)
    finish(made, 1)
    made.pause()
    return made


def test_a_place_that_was_left_is_kept_for_the_same_plan_alone() -> None:
    same, other = PlanSpecification((point(0), point(1, 90)), 2), PlanSpecification((point(0), point(1, 95)), 3)
    for is_armed in (False, True):
        for plan, goes_on in ((same, True), (other, False)):
            made = paused_at_the_second_item()
            if is_armed:
                made.leave()
            assert made.load(plan, is_armed=is_armed) is goes_on
            assert made.seq == int(goes_on)
            assert list(made.drain_texts()) == ([] if goes_on else [(Severity.NOTICE, ANOTHER)])


def test_a_place_that_was_left_is_one_again_when_the_plan_goes_on() -> None:
    made = paused_at_the_second_item()
    made.leave()
    made.start()
    assert made.load(PlanSpecification((point(0), point(1, 95)), 3))
    assert made.seq == 1


def test_a_jump_counts_on_where_it_is_the_same_and_anew_where_it_is_not() -> None:
    made = mission(point(0), point(1, 90), Jump(2, 0, 2))
    for now_s in range(0, 6, 2):
        leg_of(made, now_s)
        finish(made, now_s + 1)
    assert leg_of(made, 6).maneuver.seq == 1, "in the second lap"
    made.load(PlanSpecification((point(0), point(1, 95), Jump(2, 0, 2)), 2))
    sailed = []
    for now_s in range(8, 20, 2):
        leg = leg_of(made, now_s)
        if leg is not None:
            sailed.append(leg.maneuver.seq)
            finish(made, now_s + 1)
    assert sailed == [1, 0, 1], "one lap is left"


def test_another_first_item_of_a_paused_plan_is_another_plan() -> None:
    made = mission(point(0), point(1, 90))
    leg_of(made, 0)
    made.pause()
    assert not made.load(PlanSpecification((point(0, 5_000), point(1, 90)), 2))
    assert made.state is PlanState.NOT_STARTED
    assert list(made.drain_texts()) == [], "it begins where it would have begun"


def test_pause_keeps_the_item_and_start_goes_on_with_it() -> None:
    made = mission(point(0), point(1, 90))
    leg_of(made, 0)
    finish(made, 1)
    made.pause()
    assert leg_of(made, 2) is None
    assert made.state is PlanState.PAUSED
    assert made.start() == ""
    assert leg_of(made, 3).maneuver.seq == 1


def test_wrong_numbers_are_refused_and_change_nothing() -> None:
    made = mission(point(0), point(1, 90))
    before = leg_of(made, 0)
    assert "outside" in made.set_current(2)
    assert "outside" in made.start(7)
    assert "outside" in made.start(1, 0)
    assert leg_of(made, 1) is before
    assert "no plan" in Mission(MissionConfig()).start()


def test_set_current_and_a_last_item() -> None:
    made = mission(point(0), point(1, 90), point(2, 120))
    assert made.set_current(1) == ""
    assert leg_of(made, 0).maneuver.seq == 1
    assert made.start(0, 0) == ""
    leg_of(made, 1)
    finish(made, 2)
    assert leg_of(made, 3) is None
    assert made.state is PlanState.COMPLETE


def test_without_a_position_nothing_begins() -> None:
    made = mission(point(0))
    assert made.active(0, EstimatedState(0)) is None
