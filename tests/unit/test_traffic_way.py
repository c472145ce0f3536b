"""A vessel's straight way out of many reports: how well her velocity is known, an honest sigma, and that a turn begins a new way."""

from __future__ import annotations

import math
import random

import pytest

from companion.core.traffic.way import Way
from mavlink_bridge.language.traffic import Danger
from sitl.traffic.target import VesselText
from sitl.traffic.transmitter import AisText
from tests.traffic_rig import Sea

PLACE_M, EVERY_S = 6.0, 30.0


class Straight:
    """A vessel that goes straight on, and reports with a receiver's errors."""

    def __init__(self, rng: random.Random, speed_mps: float) -> None:
        self.rng, angle = rng, rng.uniform(-math.pi, math.pi)
        self.true = speed_mps * math.cos(angle), speed_mps * math.sin(angle)
        self.rate_mps = max(0.25, speed_mps * math.radians(2.5))
        self.told = self._velocity()
        self.off = self._noise(PLACE_M)
        self.way = Way(*self.told, PLACE_M, self.rate_mps)

    def _noise(self, sigma: float) -> tuple[float, float]:
        return self.rng.gauss(0.0, sigma), self.rng.gauss(0.0, sigma)

    def _velocity(self) -> tuple[float, float]:
        off = self._noise(self.rate_mps)
        return self.true[0] + off[0], self.true[1] + off[1]

    def report(self, turned: tuple[float, float] = (0.0, 0.0)) -> bool:
        """One more report; ``turned``: how far she is off her way, m."""
        off = self._noise(PLACE_M)
        moved = [
            rate * EVERY_S + new - old + more
            for rate, new, old, more in zip(self.true, off, self.off, turned, strict=True)
        ]
        self.off, self.told = off, self._velocity()
        joined = self.way.join((moved[0], moved[1]), self.told, EVERY_S, (PLACE_M, self.rate_mps))
        if not joined:
            self.way = Way(*self.told, PLACE_M, self.rate_mps)
        return joined

    def error_mps(self) -> float:
        return math.dist(self.true, (self.way.vx_mps, self.way.vy_mps))


@pytest.mark.parametrize("speed_mps", [2.0, 8.0, 17.0])
def test_places_far_apart_tell_the_velocity_and_the_sigma_is_honest(speed_mps: float) -> None:
    rng, better, inside, count = random.Random(3), 0, 0, 300
    for _ in range(count):
        vessel = Straight(rng, speed_mps)
        assert sum(vessel.report() for _ in range(10)) >= 8
        better += vessel.error_mps() < math.dist(vessel.true, vessel.told)
        inside += vessel.error_mps() <= 2.45 * vessel.way.rate_mps  # 95 % of a plane's normal errors
    assert vessel.way.rate_mps < 0.15
    assert better >= 0.85 * count
    assert inside >= 0.95 * count


def test_one_that_has_turned_goes_another_way() -> None:
    vessel = Straight(random.Random(1), 6.0)
    assert all(vessel.report() for _ in range(6))
    assert not vessel.report(turned=(60.0, 0.0))


def test_a_vessel_beside_us_that_may_come_nearer_is_a_risk() -> None:
    """Nearly our own way and speed, 18 m to her hull: whether she opens by 0.1 m/s no receiver can say."""
    beside = VesselText(
        ais="B", north_m=0.0, east_m=20.0, course_deg=2.0, speed_mps=1.55, interval_s=5.0, length_m=12.0
    )
    apart = VesselText(ais="B", north_m=0.0, east_m=20.0, course_deg=60.0, speed_mps=3.0, interval_s=5.0, length_m=12.0)
    exact = AisText(position_m=0.0, loss_share=0.0, course_deg=0.0, speed_mps=0.0)
    near, leaving = Sea([beside], ais=exact), Sea([apart], ais=exact)
    near.run(8.0)
    leaving.run(8.0)
    assert [vessel.danger for vessel in near.picture.vessels] == [Danger.RISK]
    assert [vessel.danger for vessel in leaving.picture.vessels] == [Danger.NONE]
