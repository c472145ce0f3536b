"""The water under the vessel: means that are slow for gusts and turns, quick where the water itself has changed; and the current is not
what a wrong file makes of the hull."""

import math

import pytest

from companion.core.estimate.water import CurrentFilter, DriftFilter


def fed(mean, seconds, north, rate=0.0):
    for _ in range(round(seconds / 0.05)):
        mean.step(0.05, 12.0, north, 0.0, rate)
    return mean.north_mps


def test_an_eddy_line_is_taken_up_within_four_seconds():
    mean = DriftFilter()
    fed(mean, 60.0, 0.3)
    assert fed(mean, 4.0, -0.4) < -0.1


def test_gusts_leave_it_slow():
    mean = DriftFilter()
    fed(mean, 60.0, 0.3)
    assert fed(mean, 2.0, 0.5) == pytest.approx(0.3 + 0.2 * (1 - 2.718 ** (-2 / 12)), abs=0.01)


def test_the_slip_of_a_turn_is_no_change_of_the_water():
    turning, straight = DriftFilter(), DriftFilter()
    for mean in (turning, straight):
        fed(mean, 60.0, 0.3)
    assert fed(turning, 3.0, -0.1, rate=0.3) > 0.2
    assert fed(straight, 3.0, -0.1) < 0.15


def lying(drift, seconds, north, rate=0.0):
    """Feed a hull that lies still, bow to the north, in water that moves north."""
    for _ in range(round(seconds / 0.05)):
        drift.step(0.05, 12.0, ground_mps=(north, 0.0), bow=(1.0, 0.0), through_mps=(0.0, 0.0), r_radps=rate)
    return drift.mps[0]


def test_the_current_of_an_eddy_line_is_taken_up_within_four_seconds():
    drift = CurrentFilter()
    lying(drift, 60.0, 0.3)
    assert lying(drift, 4.0, -0.4) < -0.1


def test_gusts_leave_the_current_slow():
    drift = CurrentFilter()
    lying(drift, 60.0, 0.3)
    assert lying(drift, 2.0, 0.5) == pytest.approx(0.3 + 0.2 * (1 - 2.718 ** (-2 / 12)), abs=0.02)


def test_the_slip_of_a_turn_is_no_current():
    turning, straight = CurrentFilter(), CurrentFilter()
    for drift in (turning, straight):
        lying(drift, 60.0, 0.3)
    assert lying(turning, 3.0, -0.1, rate=0.3) > 0.2
    assert lying(straight, 3.0, -0.1) < 0.17


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
