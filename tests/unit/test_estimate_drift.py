"""The drift: slow for gusts and turns, quick where the water itself has changed, and not what a wrong file makes of the hull."""

import math

import pytest

from companion.core.estimate.drift import DriftFilter


def fed(drift, seconds, north, rate=0.0):
    """Feed a hull that lies still, bow to the north, in water that moves north."""
    for _ in range(round(seconds / 0.05)):
        drift.step(0.05, 12.0, ground=(north, 0.0), bow=(1.0, 0.0), through=(0.0, 0.0), r_radps=rate)
    return drift.north_mps


def test_an_eddy_line_is_taken_up_within_four_seconds():
    drift = DriftFilter()
    fed(drift, 60.0, 0.3)
    assert fed(drift, 4.0, -0.4) < -0.1


def test_gusts_leave_it_slow():
    drift = DriftFilter()
    fed(drift, 60.0, 0.3)
    assert fed(drift, 2.0, 0.5) == pytest.approx(0.3 + 0.2 * (1 - 2.718 ** (-2 / 12)), abs=0.02)


def test_the_slip_of_a_turn_is_no_change_of_the_water():
    turning, straight = DriftFilter(), DriftFilter()
    for drift in (turning, straight):
        fed(drift, 60.0, 0.3)
    assert fed(turning, 3.0, -0.1, rate=0.3) > 0.2
    assert fed(straight, 3.0, -0.1) < 0.17


def sail(drift, course_deg, seconds, made, through, current):
    """Sail a heading: the file says ``through`` m/s, the hull makes ``made``, in a current (north, east)."""
    cos, sin = math.cos(math.radians(course_deg)), math.sin(math.radians(course_deg))
    ground = (made * cos + current[0], made * sin + current[1])
    for _ in range(round(seconds / 0.05)):
        drift.step(0.05, 12.0, ground=ground, bow=(cos, sin), through=(through, 0.0), r_radps=0.0)


@pytest.mark.parametrize("through", [1.0, 1.5, 2.2])
def test_a_file_wrong_by_half_is_told_from_the_current_at_the_first_corner(through):
    drift, current = DriftFilter(), (0.1, 0.3)
    sail(drift, 0.0, 60.0, 1.5, through, current)
    sail(drift, 90.0, 10.0, 1.5, through, current)
    assert drift.share == pytest.approx(1.5 / through - 1.0, abs=0.07)
    assert math.hypot(drift.north_mps - current[0], drift.east_mps - current[1]) < 0.12
    # the next corner finds it as it was
    before = drift.north_mps, drift.east_mps
    sail(drift, 180.0, 10.0, 1.5, through, current)
    assert math.hypot(drift.north_mps - before[0], drift.east_mps - before[1]) < 0.12


def test_what_the_hull_makes_is_learnt_anew_when_it_has_changed():
    drift = DriftFilter()
    for leg in range(20):
        sail(drift, 90.0 * leg, 60.0, 1.5, 1.5, (0.0, 0.2))
    assert drift.share == pytest.approx(0.0, abs=0.03)
    for leg in range(20):  # weed: a quarter of the speed is gone
        sail(drift, 90.0 * leg, 60.0, 1.1, 1.5, (0.0, 0.2))
    assert drift.share == pytest.approx(-0.27, abs=0.06)
