"""The depth guard at its edges, through its own chain at ten soundings a second: what locks at once, what ends a correction."""

from __future__ import annotations

from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.guard import DepthFlags, DepthGuard
from companion.core.hull.geometry import HullGeometry
from mavlink_bridge.language.messages import Distance, GuardState

CONFIG = DepthGuardConfig(rate_look_ahead=False, map_look_ahead=False, unknown_policy="ignore")
"""The seed's 4.0, 0.1 and 0.1 m."""
PERIOD_US = 100_000


class Sounded:
    """A guard with a sounder under a keel of no depth, at rest in neutral."""

    def __init__(self) -> None:
        self.guard = DepthGuard(CONFIG, HullGeometry(beam_m=1.1))
        self.now_us = 0

    def hear(self, *altitudes_m: float) -> list[GuardState]:
        states = []
        for altitude_m in altitudes_m:
            self.now_us += PERIOD_US
            self.guard.measure(Distance(self.now_us, altitude_m), None, 0)
            states.append(self.guard.step(self.now_us, None, False).state)
        return states


def correcting() -> Sounded:
    boat = Sounded()
    boat.hear(*[4.3] * 20)
    assert boat.hear(*[3.93, 3.99] * 15)[-1] is GuardState.CORRECTION
    return boat


def test_three_soundings_three_margins_below_lock_before_a_mean_would():
    boat = correcting()
    assert boat.hear(3.65, 3.65, 3.65)[-1] is GuardState.LOCKED


def test_two_such_soundings_are_noise():
    boat = correcting()
    assert boat.hear(3.65, 3.65, 3.96, 3.96, 3.96)[-1] is GuardState.CORRECTION


def test_a_lucky_median_does_not_end_a_correction_and_good_water_does():
    boat = correcting()
    assert boat.hear(4.11, 4.11, 4.11, 3.96, 3.96) == [GuardState.CORRECTION] * 5
    assert boat.hear(*[4.11] * 20)[-1] is GuardState.OK


def test_nothing_is_flagged_until_something_is():
    assert not any(getattr(DepthFlags(), name) for name in DepthFlags.__slots__)
