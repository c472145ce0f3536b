"""The drift's slow mean: slow for gusts and turns, quick where the water itself has changed."""

import pytest

from companion.core.estimate.drift import DriftFilter


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
