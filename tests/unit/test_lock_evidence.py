"""What proves that the water is too shallow: noise alone does not, three sigma of less water do within a second."""

from __future__ import annotations

import math
import random

import pytest

from companion.core.guard.depth.evidence import LockEvidence
from companion.core.guard.depth.input import Altitude

LOCK_M, FAR_M, SIGMA_M = 3.9, 3.7, 0.05
TICK_US = 100_000


def fed(values, period_us=TICK_US):
    evidence = LockEvidence()
    for number, value_m in enumerate(values):
        evidence.note((Altitude(number * period_us, value_m),))
    return evidence


def proves(evidence, filtered_m=3.8):
    return evidence.proves(filtered_m, LOCK_M, FAR_M, SIGMA_M)


@pytest.mark.parametrize("sigma_m", [0.02, 0.05, 0.09])
def test_a_true_altitude_on_the_lock_is_not_locked_by_noise(sigma_m):
    rng = random.Random(7)
    evidence, locked = LockEvidence(), 0
    for number in range(6000):
        evidence.note((Altitude(number * TICK_US, LOCK_M + rng.gauss(0.0, sigma_m)),))
        locked += proves(evidence, LOCK_M)
    assert locked == 0, "ten minutes"


@pytest.mark.parametrize("sigma_m", [0.02, 0.05, 0.09])
@pytest.mark.parametrize("seed", range(10))
def test_three_sigma_below_the_lock_is_locked_within_a_second(sigma_m, seed):
    rng = random.Random(seed)
    evidence = LockEvidence()
    for number in range(40):
        evidence.note((Altitude(number * TICK_US, 3.98 + rng.gauss(0.0, sigma_m)),))
    for number in range(40, 50):
        true_m = LOCK_M - 3.0 * sigma_m
        evidence.note((Altitude(number * TICK_US, true_m + rng.gauss(0.0, sigma_m)),))
        if proves(evidence, true_m):
            return
    pytest.fail("not within a second")


def test_three_readings_far_below_lock_at_once_whatever_their_noise():
    rng = random.Random(1)
    noisy = [4.2 + rng.gauss(0.0, 0.5) for _ in range(30)]
    assert proves(fed([*noisy, 3.69, 3.69, 3.69]))
    assert not proves(fed([*[4.1] * 30, 3.69, 3.7, 3.69]))
    assert not proves(fed([3.6, 3.6]), 4.0), "two are no three"


def test_slope_and_heave_are_no_noise():
    rng = random.Random(3)

    def sounded(number):
        slope_m = 0.02 * 0.8 * 0.1 * number
        heave_m = 0.1 * math.sin(2.0 * math.pi * number * 0.1 / 3.0)
        return 6.0 - slope_m + heave_m + rng.gauss(0.0, 0.05)

    assert fed([sounded(number) for number in range(32)]).sigma_m(SIGMA_M) == pytest.approx(0.05, rel=0.4)
    assert fed([5.0 - 0.05 * number for number in range(32)]).sigma_m(SIGMA_M) == pytest.approx(0.0, abs=1e-9)


def test_the_noise_is_at_most_twice_the_sensor_file_s_and_that_when_little_is_known():
    wild = [4.0 + (0.5 if number % 2 else -0.5) for number in range(32)]
    assert fed(wild).sigma_m(SIGMA_M) == 2.0 * SIGMA_M
    assert fed(wild[:23]).sigma_m(SIGMA_M) == SIGMA_M
    assert fed(wild[:24]).sigma_m(SIGMA_M) == 2.0 * SIGMA_M


def test_a_slow_sounder_is_believed_by_its_median():
    slow = fed([3.95, 3.9, 3.88], period_us=1_000_000)
    assert proves(slow, 3.809)
    assert not proves(slow, 3.811)


def test_the_mean_is_of_eight_tenths_of_a_second():
    assert proves(fed([*[4.5] * 15, *[3.8] * 8]), 4.5)
    assert not proves(fed([*[4.5] * 15, *[3.8] * 7]), 4.5)


def test_a_confirmed_jump_starts_the_noise_anew():
    evidence = fed([4.0 + (0.5 if number % 2 else -0.5) for number in range(32)])
    evidence.note(tuple(Altitude((32 + k) * TICK_US, 3.6) for k in range(3)))
    assert evidence.sigma_m(SIGMA_M) == SIGMA_M
    assert proves(evidence)


# ---- and that it is good again

GOOD_M = 4.1


def good(evidence, filtered_m):
    return evidence.proves_good(filtered_m, GOOD_M, SIGMA_M)


def test_noise_half_a_margin_below_the_mark_does_not_make_good():
    """A median of 4.12 m ended a correction at a true 4.055 m, while the vessel still turned; then she was stopped once more."""
    rng = random.Random(12)
    evidence, lucky = LockEvidence(), 0
    for number in range(6000):
        evidence.note((Altitude(number * TICK_US, 4.05 + rng.gauss(0.0, SIGMA_M)),))
        lucky += number >= 16 and good(evidence, 4.12)
    assert lucky == 0, "ten minutes of lucky medians"


def test_well_above_the_mark_is_good_at_once_and_on_it_within_1_6_s():
    assert good(fed([3.95, 4.05, 4.2]), 4.2)
    assert not good(fed([*[4.05] * 20, 4.1]), 4.1 - 1e-6)
    assert good(fed([*[4.05] * 20, *[4.1] * 16]), 4.1)
    assert not good(fed([*[4.0, 4.1] * 10, *[4.1] * 14, 4.09]), 4.1)


def test_a_slow_sounder_is_good_by_its_median():
    assert good(fed([4.0, 4.1], period_us=2_000_000), 4.1)
