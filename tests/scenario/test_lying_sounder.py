"""A sounder that lies up a slope: it repeats itself, says its range, or hears the second echo. The boat stops as without a sounder."""

from __future__ import annotations

import random

import pytest

from mavlink_bridge.language.messages import Action, GuardState, Mode
from tests.soaked import in_the_soak

KEEL_M = 0.35
LIMIT_M = 3.85
"""What the guard keeps on a slope with a sound sounder (test_depth_slopes)."""
CASES = [
    ("depth_says_range", True, "Sounder says its range, 100 m, after "),
    ("depth_echoes_below_m", 9.0, "Sounder jumped to "),
    ("depth_frozen", True, "Sounder repeats "),
]


def slope(gradient, depth_m=20.0, start_m=20.0):
    return (
        "world.bottom.mounds=[]",
        f"world.bottom.depth_m={depth_m}",
        "world.bottom.slope.bearing_deg=0",
        f"world.bottom.slope.start_m={start_m}",
        f"world.bottom.slope.gradient={gradient}",
    )


def lied_to(voyage, fault, value, gradient, speed_mps, *more, seed=1):
    """Sail up a slope with a sounder that begins to lie at 9 m; return the voyage and the least true altitude."""
    start_m = 20.0 if gradient > 0.1 else 10.0
    trip = voyage(*slope(gradient, 9.6 + 40.0 * gradient, start_m), *more, seed=seed)
    trip.sail(speed_mps, (400.0, 0.0))
    trip.until(lambda: trip.truth.depth_m - KEEL_M < 8.9, 120.0)
    setattr(trip.faults, fault, value)
    least_m = trip.truth.depth_m
    for _ in range(round(20.0 * min(150.0, 60.0 + 4.0 / gradient))):
        trip.step()
        least_m = min(least_m, trip.truth.depth_m - KEEL_M)
    return trip, least_m


@pytest.mark.parametrize(("gradient", "speed_mps"), [(0.3, 1.5), (0.08, 2.0), *in_the_soak((0.15, 1.5))])
@pytest.mark.parametrize(("fault", "value", "told"), CASES, ids=[case[0] for case in CASES])
def test_row_66_67_68_a_sounder_that_lies_over_a_closing_bottom_stops_the_boat_where_the_limit_would_be(
    voyage, measured, fault, value, told, gradient, speed_mps
):
    """Believed, the boat sailed on until she was aground, with the guard's OK."""
    trip, least_m = lied_to(voyage, fault, value, gradient, speed_mps)
    assert least_m >= LIMIT_M
    assert trip.snapshot.mode is Mode.HOLD
    assert trip.snapshot.action >= Action.HOLD
    assert sum(text.startswith(told) for text in trip.texts) == 1
    assert sum(text.startswith("Sounder lost while the bottom closes") for text in trip.texts) == 1, "told once"
    assert any("sounder lost over a closing bottom" in text for text in trip.texts)
    row = 66 + [case[0] for case in CASES].index(fault)
    measured(row, f"1:{1 / gradient:.0f} at {speed_mps} m/s: stopped with {least_m:.1f} m under the keel")


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 7))
@pytest.mark.parametrize("hz", [10.0, 2.0])
@pytest.mark.parametrize(("gradient", "speed_mps"), [(0.15, 1.5), (0.3, 1.5), (0.08, 2.0)])
@pytest.mark.parametrize(("fault", "value", "told"), CASES, ids=[case[0] for case in CASES])
def test_sounders_that_lie_for_many_seeds(voyage, fault, value, told, gradient, speed_mps, hz, seed):
    trip, least_m = lied_to(voyage, fault, value, gradient, speed_mps, f"world.sensors.depth_hz={hz}", seed=seed)
    assert least_m >= 3.5, "as with a sounder that falls silent: the slope is known as well as it was measured"
    assert any(text.startswith(told) for text in trip.texts)


def test_the_sounder_is_believed_when_it_speaks_again(voyage):
    trip = voyage(*slope(0.05, 14.0))
    trip.sail(1.5, (400.0, 0.0))
    trip.until(lambda: trip.truth.depth_m < 10.0, 90.0)
    trip.faults.depth_frozen = True
    trip.until(lambda: trip.snapshot.guard is GuardState.UNKNOWN, 10.0)
    trip.run(3.0)
    trip.faults.depth_frozen = False
    trip.until(lambda: trip.snapshot.guard is GuardState.OK, 6.0)
    trip.run(1.0)
    assert trip.snapshot.mode is Mode.AUTO
    assert "Sounder believed again" in trip.texts


def test_over_a_level_bottom_a_sounder_that_repeats_itself_is_told_and_nothing_else(voyage):
    trip = voyage("world.bottom.kind=flat", "world.bottom.depth_m=9.0")
    trip.sail(1.5, (400.0, 0.0), after_s=15.0)
    trip.faults.depth_frozen = True
    trip.run(30.0)
    assert sum(text.startswith("Sounder repeats ") and text.endswith("look at it") for text in trip.texts) == 1
    assert trip.snapshot.mode is Mode.AUTO
    assert trip.snapshot.action is Action.NONE
    assert trip.snapshot.guard is GuardState.OK


@pytest.mark.parametrize(("drop_m", "within_m"), [(12.5, 35.0), (30.0, 20.0)], ids=["twice", "far more"])
def test_a_true_edge_into_deep_water_is_believed_after_a_bounded_way(voyage, drop_m, within_m):
    """Up a slope, then over the edge of a level: at twice the depth it might be a second echo, for 25 m; deeper, for 10 m."""
    trip = voyage(*slope(0.05, 16.0, 0.0))
    trip.sail(1.5, (300.0, 0.0))
    trip.until(lambda: trip.truth.depth_m < 12.0, 120.0)
    edge_m, level_m = trip.truth.north_m, trip.truth.depth_m + drop_m
    while trip.snapshot.guard is not GuardState.OK or (trip.snapshot.state.alt_m or 0.0) < 18.0:
        trip.faults.depth_bias_m = level_m - trip.truth.depth_m
        trip.step()
        assert trip.truth.north_m - edge_m < within_m
    assert any(text.startswith("Sounder jumped to ") and "doubted" in text for text in trip.texts)
    assert "Sounder believed again" in trip.texts
    trip.run(1.0)
    assert trip.snapshot.mode is Mode.AUTO
    trip.run(10.0)
    assert "depth_lost" not in trip.snapshot.causes


def test_a_true_edge_with_a_corner_of_the_plan_behind_it_does_not_stop_the_boat(voyage):
    """The way was measured along the course at the edge only: after the corner it grew no more, and she stopped in 17 m."""
    trip = voyage("world.bottom.kind=flat", "world.bottom.depth_m=60.0")
    edge_m, rng = 100.0, random.Random(1)
    trip.world.surroundings.plant.sensors._echo = lambda truth: (
        14.0 - 0.05 * truth.north_m if truth.north_m < edge_m else 17.0 + rng.uniform(-0.03, 0.03)
    )
    trip.sail(1.5, (edge_m + 8.0, 0.0), (edge_m + 8.0, 400.0))
    trip.until(lambda: any("doubted" in text for text in trip.texts), 120.0)
    trip.until(lambda: "Sounder believed again" in trip.texts, 60.0)
    trip.run(30.0)
    assert trip.snapshot.mode is Mode.AUTO
    assert trip.snapshot.guard is GuardState.OK


def coarse(trip, *, level_m, gradient, sigma_m):
    """Up a slope to a level, as an honest sounder of 0.1 m digits reads them."""
    rng = random.Random(1)
    trip.world.surroundings.plant.sensors._echo = lambda truth: round(
        max(level_m, 12.0 - gradient * max(0.0, truth.north_m - 20.0)) + rng.gauss(0.0, sigma_m), 1
    )


@pytest.mark.parametrize(("gradient", "sigma_m"), [(0.05, 0.01), (0.1, 0.02)])
def test_an_honest_coarse_sounder_that_comes_up_a_slope_onto_a_dredged_level_does_not_stop_the_boat(
    voyage, gradient, sigma_m
):
    trip = voyage("world.bottom.kind=flat", "world.bottom.depth_m=40.0", "world.sensors.depth_hz=1")
    coarse(trip, level_m=6.0, gradient=gradient, sigma_m=sigma_m)
    trip.sail(1.5, (250.0, 0.0))
    trip.until(lambda: trip.truth.north_m > 240.0, 300.0)
    assert trip.snapshot.mode is Mode.AUTO
    assert trip.snapshot.guard is GuardState.OK
    assert [text for text in trip.texts if text.startswith("Sounder repeats 6.00 m")] == [
        "Sounder repeats 6.00 m while the boat moves: look at it"
    ], "told, since a sounder that is stuck would look the same"
