"""A sounder that falls silent over a closing bottom: slow at once, stopped where the limit would be, then the operator's."""

from __future__ import annotations

import pytest

from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.guard import DepthGuard
from companion.core.guard.depth.input import DepthInputConfig
from companion.core.guard.depth.lost import LostBottom
from companion.core.hull.geometry import HullGeometry
from mavlink_bridge.language.messages import Distance, EstimatedState

INPUT = DepthInputConfig()


class Approach:
    """Sailing at a speed up a slope, 10 readings a second, until they stop."""

    def __init__(self, altitude_m, slope, speed_mps=2.0, **config):
        self.guard = DepthGuard(DepthGuardConfig(input=INPUT, **config), HullGeometry())
        self.altitude_m, self.slope, self.speed_mps = altitude_m, slope, speed_mps
        self.now_us, self.texts, self.out = 0, [], None

    def run(self, seconds, *, silent=False):
        for _ in range(round(seconds * 20)):
            self.now_us += 50_000
            self.altitude_m -= self.slope * self.speed_mps * 0.05
            state = EstimatedState(self.now_us, x_m=0.0, y_m=0.0, sog_mps=self.speed_mps)
            if not silent and self.now_us % 100_000 == 0:
                self.guard.measure(Distance(self.now_us, self.altitude_m), state)
            self.out = self.guard.step(self.now_us, state, True, None, lambda speed: 2.3 * speed)
            self.texts += [text for _, text in self.out.texts]
        return self.out

    def until(self, what, limit_s=60.0):
        """Go on in silence until something holds; return the seconds."""
        began_us = self.now_us
        while not what(self.out):
            self.run(0.05, silent=True)
            assert self.now_us - began_us < limit_s * 1e6
        return (self.now_us - began_us) * 1e-6


@pytest.mark.parametrize("slope", [0.02, 0.05, 0.1])
@pytest.mark.parametrize("policy", ["warn", "slow", "stop"])
def test_lost_at_five_metres_closing_it_goes_slow_within_a_second(slope, policy):
    approach = Approach(5.0 + slope * 2.0 * 12.0, slope, unknown_policy=policy)
    approach.run(12.0)
    took_s = approach.until(lambda out: out.slow_to_mps is not None and out.slow_to_mps <= 0.5)
    assert took_s <= 1.0
    assert not approach.out.flags.depth_ahead
    assert "Sounder lost while the bottom closes: going slow" in approach.texts or slope == 0.1
    approach.run(0.5, silent=True)
    assert approach.texts.count("Sounder lost while the bottom closes: going slow") <= 1


@pytest.mark.parametrize(("speed_mps", "slope"), [(2.0, 0.05), (1.5, 0.1), (0.5, 0.1)])
def test_it_stops_while_there_is_water_if_the_slope_goes_on(speed_mps, slope):
    approach = Approach(5.5 + slope * speed_mps * 12.0, slope, speed_mps)
    approach.run(12.0)
    approach.until(lambda out: out.flags.depth_ahead)
    assert approach.altitude_m - slope * (2.3 + 0.3) * speed_mps > 4.0
    assert approach.altitude_m < 4.0 + slope * speed_mps * (2.3 + 0.6) + 0.35, "not much earlier than it must"
    assert any(text.startswith("Shallow water ahead (sounder lost over a closing bottom)") for text in approach.texts)


def test_a_level_bottom_and_one_that_is_far_below_are_only_told_of():
    level = Approach(6.0, 0.0)
    level.run(5.0)
    far = Approach(12.0, 0.03)
    far.run(12.0)
    for approach in (level, far):
        approach.run(10.0, silent=True)
        assert approach.out.flags.depth_lost
        assert approach.out.slow_to_mps is None
        assert not approach.out.flags.depth_ahead


@pytest.mark.parametrize(
    "config", [{"unknown_policy": "ignore"}, {"rate_look_ahead": False}], ids=["seed", "no look-ahead"]
)
def test_parity_does_nothing(config):
    approach = Approach(5.5, 0.05, **config)
    approach.run(10.0)
    approach.run(20.0, silent=True)
    assert approach.out.slow_to_mps is None
    assert not approach.out.flags.depth_ahead


def test_lying_still_ends_it_and_an_echo_does_too():
    approach = Approach(5.9, 0.05)
    approach.run(5.0)
    approach.until(lambda out: out.flags.depth_ahead)
    approach.speed_mps = 0.3
    assert not approach.run(0.1, silent=True).flags.depth_ahead
    approach.speed_mps = 2.0
    assert not approach.run(1.0, silent=True).flags.depth_ahead, "an operator went on"
    again = Approach(6.5, 0.05)
    again.run(8.0)
    again.run(1.5, silent=True)
    assert again.out.slow_to_mps == 0.5
    again.slope = 0.0
    again.run(6.0)
    assert again.out.slow_to_mps is None


def test_the_reckoning_is_by_way_and_not_by_time():
    lost = LostBottom()
    assert lost.reckon(0, 1.0) is None, "nothing seen"
    lost.seen(0, 6.0, 0.2, 2.0)
    assert lost.reckon(1_000_000, 2.0) == (pytest.approx(5.8), pytest.approx(0.2))
    assert lost.reckon(3_000_000, 0.5) == (pytest.approx(5.7), pytest.approx(0.05))
    assert lost.reckon(4_000_000, 0.3) is None
    assert lost.reckon(5_000_000, 2.0) is None
    lost.seen(5_000_000, 6.0, 0.2, 0.3)
    assert lost.reckon(6_000_000, 2.0) is None, "at rest it is the heave that closes"
    lost.seen(7_000_000, 6.0, 0.2, 0.4)
    lost.seen(7_000_000, 6.0, 0.0, 0.4)
    assert lost.reckon(8_000_000, 2.0) is None
