"""No progress, and off the track: told once, in time, and not when nothing is to be gained."""

from __future__ import annotations

from companion.core.vehicle.progress_watch import ProgressWatch
from mavlink_bridge.language.messages import EstimatedState, PathControlState

S = 1_000_000


def run(
    seconds: float, distance_m=lambda t: None, cross_m=lambda t: 0.0, x_m=lambda t: 0.0, item=lambda t: 0, **path
) -> list[tuple[float, str]]:
    watch, told = ProgressWatch(), []
    for tick in range(round(seconds * 2)):
        t_s = tick / 2
        seen = PathControlState(cross_track_m=cross_m(t_s), distance_m=distance_m(t_s), **path)
        state = EstimatedState(0, x_m=x_m(t_s), y_m=0.0)
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
    assert run(100.0, lambda t: 0.0, x_m=lambda t: t, on_path=True, orbit_radius_m=20.0) == []
    assert run(100.0, lambda t: 0.0, on_path=True, orbit_radius_m=20.0)[0][0] == 20.0


def test_a_station_that_is_kept_is_no_stall():
    assert run(100.0, lambda t: 0.3, on_path=True) == []


def test_off_the_track_is_told_after_10_s_once():
    told = run(60.0, lambda t: 500.0 - t, lambda t: 20.0 if t > 5 else 2.0)
    assert told == [(15.5, "off the track by 20 m")]
    assert run(60.0, lambda t: 500.0 - t, lambda t: -30.0) == [], "it is on its way to the track"
    back = run(60.0, lambda t: 500.0 - t, lambda t: 20.0 if 5 < t < 20 or t > 30 else 2.0)
    assert [text for _, text in back] == ["off the track by 20 m"] * 2
