"""The water under the vessel: means that are slow for gusts and turns, quick where the water itself has changed; and the current is not
what a wrong file makes of the hull."""

import math

import pytest

from companion.core.estimate.water import CurrentFilter, DriftFilter, WaterMeans
from mavlink_bridge.language.messages import EstimatedState


class Drift:
    """A hull that lies still, bow to the north, in water that moves north: as the drift sees it."""

    def __init__(self):
        self.mean = DriftFilter()

    def fed(self, seconds, north, rate=0.0):
        for _ in range(round(seconds / 0.05)):
            self.mean.step(0.05, 12.0, sample_mps=(north, 0.0), r_radps=rate, bow=(1.0, 0.0))
        return self.mean.mps[0]


class Current:
    """The same as the current sees it."""

    def __init__(self):
        self.mean = CurrentFilter()

    def fed(self, seconds, north, rate=0.0):
        for _ in range(round(seconds / 0.05)):
            self.mean.step(0.05, 12.0, ground_mps=(north, 0.0), bow=(1.0, 0.0), through_mps=(0.0, 0.0), r_radps=rate)
        return self.mean.mps[0]


@pytest.mark.parametrize("kind", [Drift, Current])
def test_an_eddy_line_is_taken_up_within_four_seconds(kind):
    water = kind()
    water.fed(60.0, 0.3)
    assert water.fed(4.0, -0.4) < -0.1


@pytest.mark.parametrize(("kind", "near"), [(Drift, 0.01), (Current, 0.02)])
def test_gusts_leave_it_slow(kind, near):
    water = kind()
    water.fed(60.0, 0.3)
    assert water.fed(2.0, 0.5) == pytest.approx(0.3 + 0.2 * (1 - 2.718 ** (-2 / 12)), abs=near)


@pytest.mark.parametrize(("kind", "most"), [(Drift, 0.15), (Current, 0.17)])
def test_the_slip_of_a_turn_is_no_change_of_the_water(kind, most):
    turning, straight = kind(), kind()
    for water in (turning, straight):
        water.fed(60.0, 0.3)
    assert turning.fed(3.0, -0.1, rate=0.3) > 0.2
    assert straight.fed(3.0, -0.1) < most


def test_a_hull_that_leaps_ahead_in_a_turn_is_no_change_of_the_water():
    """A file that is wrong about thrust and drag is so along the bow. Across it, the water itself has changed."""
    ahead, across = CurrentFilter(), CurrentFilter()
    for mean, made in ((ahead, (0.6, 0.0)), (across, (0.0, 0.6))):
        for k in range(round(3.0 / 0.05) + 200):
            ground, rate = ((0.0, 0.0), 0.0) if k < 200 else (made, 0.3)
            mean.step(0.05, 12.0, ground_mps=ground, bow=(1.0, 0.0), through_mps=(0.0, 0.0), r_radps=rate)
    assert ahead.mps[0] < 0.2
    assert across.mps[1] > 0.28


def sail(drift, course_deg, seconds, made, through, current):
    """Sail a heading: the file says ``through`` m/s, the hull makes ``made``, in a current (north, east)."""
    cos, sin = math.cos(math.radians(course_deg)), math.sin(math.radians(course_deg))
    ground = (made * cos + current[0], made * sin + current[1])
    for _ in range(round(seconds / 0.05)):
        drift.step(0.05, 12.0, ground_mps=ground, bow=(cos, sin), through_mps=(through, 0.0), r_radps=0.0)


@pytest.mark.parametrize("through", [1.0, 1.5, 2.2])
def test_a_file_wrong_by_half_is_told_from_the_current_at_the_first_corner(through):
    drift, current = CurrentFilter(), (0.1, 0.3)
    sail(drift, 0.0, 60.0, 1.5, through, current)
    sail(drift, 90.0, 10.0, 1.5, through, current)
    assert drift.share == pytest.approx(1.5 / through - 1.0, abs=0.07)
    assert math.hypot(drift.mps[0] - current[0], drift.mps[1] - current[1]) < 0.12
    # the next corner finds it as it was
    before = drift.mps
    sail(drift, 180.0, 10.0, 1.5, through, current)
    assert math.hypot(drift.mps[0] - before[0], drift.mps[1] - before[1]) < 0.12


def test_what_the_hull_makes_is_learnt_anew_when_it_has_changed():
    drift = CurrentFilter()
    for leg in range(20):
        sail(drift, 90.0 * leg, 60.0, 1.5, 1.5, (0.0, 0.2))
    assert drift.share == pytest.approx(0.0, abs=0.03)
    for leg in range(20):  # weed: a quarter of the speed is gone
        sail(drift, 90.0 * leg, 60.0, 1.1, 1.5, (0.0, 0.2))
    assert drift.share == pytest.approx(-0.27, abs=0.06)


def test_what_a_lost_propeller_taught_of_the_water_is_forgotten():
    """It makes half the way that the model has of it: until that is known the rest looks like a current against the boat."""
    water, bow = WaterMeans(), (1.0, 0.0)

    def fed(seconds, made, through):
        for _ in range(round(seconds / 0.05)):
            ground = (made + 0.2, 0.3)
            water.step(0.05, 12.0, ground_mps=ground, bow=bow, through_mps=(through, 0.0), r_radps=0.0)

    fed(60.0, 1.5, 1.5)
    fed(30.0, 0.7, 1.5)
    assert water.current_mps[0] < -0.4
    now = EstimatedState(0, vx_mps=0.9, vy_mps=0.3, psi_rad=0.0)
    known, through_mps = water.recall(now)
    assert through_mps == pytest.approx((0.7, 0.0), abs=0.01)
    assert (known.drift_n_mps, known.drift_e_mps) == water.drift_mps, "the tick that finds it goes on with that water"
    assert (*water.current_mps, *water.drift_mps) == pytest.approx((0.2, 0.3) * 2, abs=0.01)
    fed(10.0, 0.7, 0.7)
    assert water.current_mps == pytest.approx((0.2, 0.3), abs=0.01)


def test_nothing_is_recalled_of_water_that_was_never_met():
    state = EstimatedState(0, vx_mps=0.9, vy_mps=0.3, psi_rad=0.0)
    assert WaterMeans().recall(state) == (state, None)
