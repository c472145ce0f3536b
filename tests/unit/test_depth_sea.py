"""Waves under the depth guard: what their heave explains is no slope, and what it does not explain is one at once."""

from __future__ import annotations

import math
import random

import pytest

from companion.core.guard.depth.input import Altitude
from companion.core.guard.depth.lookahead import LONG_WINDOWS, ClosingRate
from companion.core.guard.depth.sea import Sea

SIGMA_M = 0.05
HZ = 10


class Water:
    """Readings of a sounder of 10 Hz, and what is made of them."""

    def __init__(self) -> None:
        self.rng, self.sea, self.now = random.Random(3), Sea(), 0
        self.short, self.long = ClosingRate(), ClosingRate(LONG_WINDOWS)
        self.steepest_mps = 0.0

    def read(self, seconds, depth, height_m, period_s=3.0):
        """Sound ``depth(s)`` for so long, with waves of so much from trough to crest; the greatest closing rate of it is kept."""
        self.steepest_mps = 0.0
        for _ in range(round(seconds * HZ)):
            now_s = self.now / HZ
            heave_m = 0.5 * height_m * math.sin(2.0 * math.pi * now_s / period_s)
            reading = Altitude(self.now * 1_000_000 // HZ, depth(now_s) + heave_m + self.rng.gauss(0.0, SIGMA_M))
            self.now += 1
            self.sea.add(reading, SIGMA_M)
            self.short.add(reading, SIGMA_M, self.sea)
            self.long.add(reading, SIGMA_M, self.sea)
            self.steepest_mps = max(self.steepest_mps, self.short.closing_mps)


@pytest.mark.parametrize(
    ("height_m", "period_s"),
    [(0.3, 3.0), (0.8, 3.0), (0.8, 2.0), (1.2, 5.0), (1.5, 7.0), (0.6, 9.0), (1.5, 12.0), (1.8, 15.0)],
)
def test_waves_over_a_level_bottom_close_nothing(height_m, period_s):
    water = Water()
    water.read(max(20.0, 3.0 * period_s), lambda s: 6.0, height_m, period_s)
    assert water.sea.is_seen
    water.read(120.0, lambda s: 6.0, height_m, period_s)
    assert water.steepest_mps <= 0.02


@pytest.mark.parametrize("depth", [lambda s: 6.0, lambda s: 20.0 - 0.1 * s, lambda s: 2.0 + 0.1 * s])
def test_noise_and_slopes_are_no_sea(depth):
    water = Water()
    for _ in range(600):
        water.read(0.2, depth, 0.0)
        assert not water.sea.is_seen
        assert water.sea.rate_mps(2.0) == 0.0


def test_a_slope_in_waves_is_known_by_the_long_lines_to_a_fifth():
    water = Water()
    water.read(30.0, lambda s: 20.0, 0.5)
    water.read(20.0, lambda s: 20.0 - 0.3 * (s - 30.0), 0.5)
    assert max(water.short.closing_mps, water.long.closing_mps) >= 0.24


def test_a_slope_in_a_swell_is_known_by_the_long_lines():
    water = Water()
    water.read(60.0, lambda s: 30.0, 1.2, 12.0)
    assert water.long.closing_mps == 0.0
    water.read(30.0, lambda s: 30.0 - 0.3 * (s - 60.0), 1.2, 12.0)
    assert max(water.short.closing_mps, water.long.closing_mps) >= 0.2


def test_a_swell_explains_no_more_than_its_face_is_steep():
    water = Water()
    water.read(60.0, lambda s: 30.0, 1.2, 12.0)
    face_mps = math.pi * 1.2 / 12.0
    assert face_mps <= water.sea.rate_mps(1.0) <= 1.5 * face_mps


@pytest.mark.parametrize("hz", [1.0, 2.0])
def test_a_slow_sounder_sees_waves_of_three_decimetres(hz):
    rng, sea, seen = random.Random(3), Sea(), []
    for i in range(round(300.0 * hz)):
        heave_m = 0.15 * math.sin(2.0 * math.pi * i / hz / 5.3)
        sea.add(Altitude(round(i / hz * 1e6), 6.0 + heave_m + rng.gauss(0.0, SIGMA_M)), SIGMA_M)
        seen.append(sea.is_seen)
    assert all(seen[len(seen) // 5 :])


def test_where_the_water_falls_out_of_the_waves_nothing_is_left_out():
    water = Water()
    water.read(30.0, lambda s: 10.0, 0.8)
    assert water.sea.rate_mps(1.0) > 0.5
    water.read(1.5, lambda s: 10.0 - 1.25 * (s - 30.0), 0.8)
    assert water.sea.rate_mps(1.0) == 0.0
    assert water.short.closing_mps > 0.5


def test_one_ridge_is_no_sea_nor_are_hills_higher_or_longer_than_waves():
    for height_m, period_s in ((0.8, 24.0), (2.6, 6.0)):
        water = Water()
        water.read(60.0, lambda s: 10.0, height_m, period_s)
        assert water.sea.rate_mps(1.0) == 0.0
        assert water.steepest_mps > 0.05
    water = Water()
    water.read(10.0, lambda s: 10.0 - max(0.0, 1.0 - 0.5 * abs(s - 5.0)), 0.0)
    assert not water.sea.is_seen


def test_waves_that_are_past_are_forgotten():
    water = Water()
    water.read(20.0, lambda s: 6.0, 0.8)
    assert water.sea.is_seen
    water.read(31.0, lambda s: 6.0, 0.0)
    assert not water.sea.is_seen
    water.read(20.0, lambda s: 6.0, 0.8)
    water.sea.forget()
    assert not water.sea.is_seen
    assert water.sea.rate_mps(1.0) == 0.0
