"""No progress, and off the track: told once, in time, and not when nothing is to be gained."""

from __future__ import annotations

from companion.core.guide import GuidanceOutput
from companion.core.vehicle.progress_watch import ProgressWatch
from mavlink_bridge.language.messages import Desired, EstimatedState, PathControlState

S = 1_000_000


def run(
    seconds: float, distance_m=lambda t: None, cross_m=lambda t: 0.0, x_m=lambda t: 0.0, item=lambda t: 0, **guided
) -> list[tuple[float, str]]:
    watch, told = ProgressWatch(guided.pop("turning_us", 0)), []
    for tick in range(round(seconds * 2)):
        t_s = tick / 2
        path = PathControlState(cross_track_m=cross_m(t_s), distance_m=distance_m(t_s))
        state = EstimatedState(0, x_m=x_m(t_s), y_m=0.0)
        seen = GuidanceOutput(Desired(None, None), path, **guided)
        told += [(t_s, text) for _, text in watch.step(round(t_s * S), item(t_s), seen, state)]
    return told


def test_a_boat_that_comes_nearer_is_left_alone():
    assert run(300.0, lambda t: 100.0 - 0.06 * t) == []


def test_a_boat_that_stays_is_told_after_20_s_and_again_after_a_minute():
    told = run(130.0, lambda t: 80.0 if t > 30 else 110.0 - t)
    assert told == [
        (50.0, "no progress for 20 s at item 0, 80 m to go"),
        (110.0, "no progress for 20 s at item 0, 80 m to go"),
    ]


def test_a_boat_that_is_carried_away_makes_no_progress():
    assert run(25.0, lambda t: 50.0 + t)[0][0] == 20.0


def test_each_item_starts_anew():
    assert run(100.0, lambda t: 50.0, item=lambda t: int(t // 15)) == []


def test_on_a_circle_moving_is_progress_and_lying_still_is_none():
    assert run(100.0, lambda t: 0.0, x_m=lambda t: t, on_path=True) == []
    assert run(100.0, lambda t: 0.0, on_path=True)[0][0] == 20.0


def test_a_station_that_is_kept_is_no_stall_however_far_a_turn_sets_the_boat_aside():
    assert run(100.0, lambda t: 3.0, on_path=True, holds=True) == []
    assert run(100.0, lambda t: 3.0, arrived=True, holds=True) == [], "a waypoint's hold time runs from its passing on"


def test_a_boat_that_lies_about_a_point_which_it_has_not_been_at_is_told_after_a_minute():
    assert run(100.0, lambda t: 3.0, holds=True) == [(60.0, "no progress for 60 s at item 0, 3 m to go")]


def test_a_boat_that_turns_slowly_is_given_the_time_of_a_turn_and_no_more_than_a_minute():
    assert run(50.0, lambda t: 62.0, turning_us=42 * S)[0] == (42.0, "no progress for 42 s at item 0, 62 m to go")
    assert run(100.0, lambda t: 62.0, turning_us=15 * S)[0][0] == 20.0
    assert run(100.0, lambda t: 62.0, turning_us=400 * S)[0][0] == 60.0


def test_off_the_track_is_told_after_10_s_once():
    told = run(60.0, lambda t: 500.0 - t, lambda t: 20.0 if t > 5 else 2.0)
    assert told == [(15.5, "off the track by 20 m")]
    assert run(60.0, lambda t: 500.0 - t, lambda t: -30.0) == [], "it is on its way to the track"
    back = run(60.0, lambda t: 500.0 - t, lambda t: 20.0 if 5 < t < 20 or t > 30 else 2.0)
    assert [text for _, text in back] == ["off the track by 20 m"] * 2
