"""Readings that are not believed: the sounder's range said for no bottom."""

from __future__ import annotations

import pytest

from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.guard import DepthGuard
from companion.core.guard.depth.input import DepthInput, DepthInputConfig
from companion.core.hull.geometry import HullGeometry
from mavlink_bridge.language.messages import Distance, EstimatedState, GuardState

SPEED_MPS = 1.5
STEP_US = 100_000


class Line:
    """A boat under way on a straight line, and its input chain."""

    def __init__(self, *, step_us=STEP_US):
        self.chain = DepthInput(DepthInputConfig(sigma_m=0.0), HullGeometry())
        self.step_us, self.t_us, self.way_m = step_us, 0, 0.0

    def read(self, said, speed_mps=SPEED_MPS):
        """One reading; ``said`` of the way made. Return the altitude."""
        self.t_us += self.step_us
        self.way_m += speed_mps * self.step_us * 1e-6
        state = EstimatedState(self.t_us, sog_mps=abs(speed_mps), vx_mps=speed_mps, vy_mps=0.0)
        self.chain.measure(Distance(self.t_us, said(self.way_m), range_max_m=100.0), state)
        return self.chain.altitude_m(self.t_us)

    def sail(self, seconds, said, speed_mps=SPEED_MPS):
        """Return what was believed, without the unknown."""
        made = [self.read(said, speed_mps) for _ in range(round(seconds * 1e6 / self.step_us))]
        return [altitude_m for altitude_m in made if altitude_m is not None]


@pytest.mark.parametrize("range_m", [100.0, 99.6])
def test_the_range_itself_is_no_deep_water(range_m):
    line = Line()
    line.sail(3.0, lambda way_m: 9.5)
    line.sail(1.0, lambda way_m: range_m)
    assert not line.sail(60.0, lambda way_m: range_m), "however long it says so"
    assert not line.chain.out_of_reach
    assert line.chain.trouble == f"Sounder says its range, {range_m:.0f} m, after 9.5 m: no bottom heard"
    assert line.sail(1.0, lambda way_m: 9.0)[-1] == 9.0
    assert line.chain.trouble == ""


def test_the_range_is_believed_where_the_bottom_went_down_to_it():
    line = Line()
    assert line.sail(120.0, lambda way_m: min(50.0 + 0.4 * way_m, 100.0))[-1] == 100.0
    assert line.chain.trouble == ""


def test_the_guard_tells_once_what_is_wrong_and_that_it_is_over():
    guard = DepthGuard(DepthGuardConfig(), HullGeometry())
    texts, t_us = [], 0

    def read(seconds, value_m):
        nonlocal t_us
        for _ in range(round(seconds * 10)):
            t_us += STEP_US
            state = EstimatedState(t_us, sog_mps=SPEED_MPS)
            guard.measure(Distance(t_us, value_m, range_max_m=100.0), state)
            texts.extend(text for _, text in guard.step(t_us, state, True).texts)

    read(5.0, 9.5)
    read(0.3, 100.0)
    read(5.0, 9.5)
    assert not [text for text in texts if text.startswith("Sounder")], "a reading or two cost nothing"
    read(10.0, 100.0)
    assert guard.state is GuardState.UNKNOWN
    read(5.0, 9.5)
    assert [text for text in texts if text.startswith("Sounder")] == [
        "Sounder says its range, 100 m, after 9.5 m: no bottom heard",
        "Sounder believed again",
    ]
