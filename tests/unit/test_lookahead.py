"""The closing rate, the speed that still stops, the way ahead and what a map says along it."""

from __future__ import annotations

import itertools
import math
import random

import pytest

from companion.core.guard.depth.input import Altitude
from companion.core.guard.depth.lookahead import ClosingRate, sample, slow_speed_mps, strays, way_ahead
from companion.core.guide.paths import Chain, Line, fillet
from companion.core.hull.statics import stopping_distance_m
from companion.core.hull.stopping import Braking
from mavlink_bridge.language.figures import Circle, Racetrack
from mavlink_bridge.language.messages import EstimatedState
from sitl.plant.library import load_vessel


def rate(slope_mps: float, seconds: float, sigma_m: float = 0.0, seed: int = 1) -> float:
    rng, closing = random.Random(seed), ClosingRate()
    for i in range(round(seconds * 10) + 1):
        closing.add(Altitude(i * 100_000, 10.0 + slope_mps * i * 0.1 + rng.gauss(0.0, sigma_m)), sigma_m)
    return closing.closing_mps


def test_without_noise_the_rate_is_exact_and_only_downward_counts():
    assert rate(-0.5, 6.0) == pytest.approx(0.5, abs=1e-6)
    assert rate(0.5, 6.0) == 0.0
    assert rate(0.0, 6.0) == 0.0
    assert rate(-0.5, 0.2) == 0.0, "three readings prove nothing"
    assert rate(-0.5, 0.3) == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_with_noise_the_rate_is_at_most_the_true_one_and_not_much_less(seed):
    assert 0.15 < rate(-0.25, 6.0, 0.05, seed) <= 0.25 + 0.02
    assert rate(0.0, 6.0, 0.05, seed) == 0.0


def test_a_sudden_wall_shows_within_a_second_and_a_half():
    closing = ClosingRate()
    for i in range(60):
        closing.add(Altitude(i * 100_000, 10.0 - max(0.0, (i - 40) * 0.1)), 0.05)
        if i == 55:
            break
    assert closing.closing_mps > 0.6


def test_forgetting_starts_again():
    closing = ClosingRate()
    for i in range(60):
        closing.add(Altitude(i * 100_000, 10.0 - 0.05 * i), 0.0)
    assert closing.closing_mps > 0.4
    closing.forget()
    assert closing.closing_mps == 0.0
    closing.add(Altitude(6_000_000, 2.0), 0.0)
    assert closing.closing_mps == 0.0


def test_days_of_readings_leave_no_rounding():
    closing, start = ClosingRate(), 10**13
    for i in range(5000):
        closing.add(Altitude(start + i * 100_000, 10.0 + 3.0 * math.sin(i / 7.0)), 0.0)
    for i in range(5000, 5060):
        closing.add(Altitude(start + i * 100_000, 10.0 - 0.02 * (i - 5000)), 0.0)
    assert closing.closing_mps == pytest.approx(0.2, abs=1e-6)


def heard(times_s, depth, seed=1, sigma_m=0.05):
    """The rate after each reading of a sounder that is heard at these times over ``depth(s)``."""
    rng, closing, rates = random.Random(seed), ClosingRate(), []
    for time_s in times_s:
        closing.add(Altitude(round(time_s * 1e6), depth(time_s) + rng.gauss(0.0, sigma_m)), sigma_m)
        rates.append(closing.closing_mps)
    return rates


@pytest.mark.parametrize("period_s", [1.4, 2.0, 3.3, 5.0])
def test_a_slow_sounder_proves_a_rate_with_its_fourth_reading(period_s):
    rates = heard([period_s * i for i in range(40)], lambda s: 99.0 - 0.4 * s)
    assert rates[2] == 0.0
    assert all(0.27 < rate <= 0.42 for rate in rates[3:])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("period_s", "lost"), [(1.0, 0.2), (1.0, 0.4), (2.0, 0.2)])
def test_lost_readings_do_not_lose_the_slope(period_s, lost, seed):
    rng = random.Random(seed)
    times_s = [period_s * i for i in range(300) if rng.random() >= lost]
    rates = heard(times_s, lambda s: 150.0 - 0.4 * s, seed)
    assert sum(rate > 0.2 for rate in rates[3:]) >= 0.95 * (len(rates) - 3)


@pytest.mark.parametrize("period_s", [1.4, 2.0, 3.3])
def test_over_a_level_bottom_a_slow_sounder_proves_nothing(period_s):
    rates = heard([period_s * i for i in range(3000)], lambda s: 6.0)
    assert max(rates) <= 0.02
    once = heard([period_s * i for i in range(40)], lambda s: 3.0 if abs(s - 20.0 * period_s) < 0.1 else 6.0)
    assert max(once) <= 0.02, "one false echo draws no line"


def test_after_a_silence_two_places_are_no_line():
    times_s = [0.1 * i for i in range(50)] + [10.0]
    assert heard(times_s, lambda s: 6.0 if s < 9.0 else 3.0)[-1] == 0.0


def test_a_rate_stands_for_three_periods_where_readings_are_lost():
    times_s = [2.0 * i for i in range(10)] + [23.0, 38.0]
    *_, before, soon, late = heard(times_s, lambda s: 99.0 - 0.4 * s)
    assert before > 0.3
    assert soon > 0.3
    assert late == 0.0


def test_readings_at_one_time_do_not_divide_by_zero():
    closing = ClosingRate()
    for _ in range(6):
        closing.add(Altitude(5, 3.0), 0.0)
    assert closing.closing_mps == 0.0


def test_the_slow_speed_fits_the_room():
    def run(speed):
        return 2.0 * speed

    assert slow_speed_mps(10.0, 0.5, run, 0.5, 2.0) is None
    slow = slow_speed_mps(1.0, 0.5, run, 0.5, 2.0)
    assert 0.5 * (run(slow) + 0.5 * slow) <= 1.0
    assert slow == pytest.approx(0.8, abs=0.001)
    assert slow_speed_mps(0.0, 0.5, run, 0.5, 2.0) == 0.0


def at(**values) -> EstimatedState:
    return EstimatedState(0, **{"x_m": 0.0, "y_m": 0.0, "sog_mps": 2.0, "cog_rad": 0.0, "psi_rad": 0.0, **values})


def test_straight_on_without_a_path():
    points = way_ahead(at(cog_rad=math.pi / 2.0), None, 10.0, 1.0)
    assert points[0] == (0.0, 0.0)
    assert points[-1] == pytest.approx((0.0, 10.0))
    steps = [math.dist(a, b) for a, b in itertools.pairwise(points)]
    assert max(steps) <= 1.0 + 1e-9


def test_a_turn_is_followed_for_a_second_and_then_the_path():
    points = way_ahead(at(r_radps=math.pi / 2.0), [(0.0, 50.0)], 8.0, 0.5)
    assert points[4] == pytest.approx((1.27, 1.27), abs=0.05), "a quarter turn at 2 m/s"
    assert points[-1][1] == pytest.approx(7.3, abs=0.1)
    assert abs(points[-1][0]) < 1.3


def test_what_the_arc_has_passed_of_the_path_is_not_gone_back_to():
    points = way_ahead(at(), [(0.0, 0.0), (1.5, 0.0), (1.5, 3.0), (9.0, 3.0)], 8.0, 0.5)
    assert points[4] == pytest.approx((2.0, 0.0)), "a second at 2 m/s"
    assert points[6] == pytest.approx((1.5, 0.5)), "joined where the vessel is on the path by then"
    length_m = sum(math.dist(a, b) for a, b in itertools.pairwise(points))
    assert length_m == pytest.approx(8.0, abs=0.51)
    assert points[-1][0] > 3.5


def test_the_path_bends_at_its_points_and_ends_with_the_reach():
    points = way_ahead(at(sog_mps=0.0), [(5.0, 0.0), (5.0, 5.0)], 7.0, 1.0)
    assert (5.0, 0.0) in [tuple(round(v, 9) for v in p) for p in points]
    assert points[-1] == pytest.approx((5.0, 2.0))
    assert way_ahead(at(sog_mps=0.0), [(5.0, 0.0)], 20.0, 1.0)[-1] == pytest.approx((5.0, 0.0))
    assert way_ahead(at(sog_mps=0.0), [(5.0, 0.0), (9.0, 9.0)], 4.0, 1.0)[-1] == pytest.approx((4.0, 0.0))


def test_without_position_or_course_there_is_no_way():
    assert way_ahead(at(x_m=None), None, 10.0, 1.0) == []
    assert way_ahead(at(cog_rad=None, psi_rad=None), None, 10.0, 1.0) == [(0.0, 0.0)]
    assert way_ahead(at(sog_mps=0.1, cog_rad=2.0), None, 3.0, 1.0)[-1] == pytest.approx((3.0, 0.0)), "slow: the bow"


def test_the_map_is_looked_at_ahead_and_to_both_sides():
    points = way_ahead(at(), None, 10.0, 1.0)

    def wall(north, east):
        return 2.0 if east > 0.9 and north > 5.0 else 9.0

    seen = sample(wall, points, 1.0)
    assert (seen.here_m, seen.least_m, seen.unknown) == (9.0, 2.0, False)
    assert seen.where == pytest.approx((6.0, 0.0))
    assert sample(wall, points, 0.5).least_m == 9.0
    assert sample(lambda n, e: 2.0 if e < -0.9 else 9.0, points, 1.0).least_m == 2.0
    edge = sample(lambda n, e: None if n > 4.0 else 9.0, points, 1.0)
    assert (edge.least_m, edge.unknown) == (9.0, True)
    nothing = sample(wall, [], 1.0)
    assert (nothing.least_m, nothing.here_m) == (None, None)


def test_braking_is_shorter_than_coasting():
    """vessel-control §4.5: full astern 0.8 m at 1.5 and 1.5 m at 2.5 m/s; what the propellers take to turn round is on top."""
    vessel = load_vessel("otter")
    braking = Braking(vessel)
    assert braking.way_m(0.0) == 0.0
    for speed, measured in ((1.5, 0.8), (2.5, 1.5)):
        assert measured - 0.1 < braking.way_m(speed) < measured + 0.6
        assert braking.way_m(speed) < stopping_distance_m(vessel, speed)


@pytest.mark.parametrize(
    ("state", "path", "astray"),
    [
        ({}, [(0.0, 0.0), (10.0, 0.0)], False),
        ({}, [(0.0, 0.0), (0.0, 10.0)], True),
        ({"r_radps": 0.5}, [(1.0, 0.0), (3.0, 3.0)], False),
        ({"cog_rad": math.pi - 0.1}, [(-10.0, 1.0)], False),
        ({"cog_rad": math.pi}, [(10.0, 0.0)], True),
        ({"sog_mps": 0.4}, [(0.0, 10.0)], False),
        ({}, [(0.0, 2.0)], False),
        ({"sog_mps": None}, [(0.0, 10.0)], False),
        ({"cog_rad": None}, [(0.0, 10.0)], False),
        ({"x_m": None}, [(0.0, 10.0)], False),
    ],
    ids=[
        "on it",
        "not turning with it",
        "turning with it",
        "across the cut",
        "away from it",
        "hardly under way",
        "at its end",
        "no speed",
        "no course",
        "no position",
    ],
)
def test_a_vessel_that_does_not_follow_its_path_is_astray(state, path, astray):
    assert strays(at(**state), path) is astray


def walk(track, north, east, reach_m):
    track.locate(north, east)
    points = track.way(reach_m)
    return points, sum(math.dist(a, b) for a, b in itertools.pairwise(points))


def test_the_way_along_a_track_is_on_it_as_long_as_asked_and_ends_with_it():
    corner = fillet((0.0, 0.0), (20.0, 0.0), (20.0, 20.0), 1.0, 3.0, 10.0)
    legs = Chain(
        (Line((0.0, 0.0), corner.point(0.0)), corner, Line(corner.point(corner.length_m), (20.0, 20.0))), closed=False
    )
    points, length_m = walk(legs, 10.0, 0.0, 18.0)
    assert points[0] == pytest.approx((10.0, 0.0))
    assert length_m == pytest.approx(18.0, abs=0.2)
    assert all(
        abs(n - 20.0) < 1e-6 or abs(e) < 1e-6 or math.dist((n, e), corner.centre) - corner.radius_m < 1e-6
        for n, e in points
    )
    points, _ = walk(legs, 10.0, 3.0, 5.0)
    assert points[0] == pytest.approx((13.0, 0.0)), "a vessel aside joins at 45 degrees"
    points, _ = walk(legs, 20.0, 18.0, 50.0)
    assert points[-1] == pytest.approx((20.0, 20.0))


@pytest.mark.parametrize(
    "shape",
    [
        Circle().segments((0.0, 0.0), 10.0, 1),
        Racetrack(length_m=20.0, bearing_rad=0.3).segments((0.0, 0.0), 5.0, -1),
    ],
    ids=["circle", "racetrack"],
)
def test_the_way_round_a_closed_track_goes_on_and_on(shape):
    track = Chain(shape, closed=True)
    start = shape[0].point(0.0)
    points, length_m = walk(track, *start, 1.5 * track.lap_m)
    assert length_m == pytest.approx(1.5 * track.lap_m, rel=0.02)
    assert max(math.dist(a, b) for a, b in itertools.pairwise(points)) <= 20.001
    assert min(math.dist(start, point) for point in points[len(points) // 3 :]) < 2.1
