"""What the heading loop reckons with where nothing but the compass tells how fast the boat turns."""

from __future__ import annotations

import pytest

from companion.core.steer.slow_compass import SlowCompass


@pytest.mark.parametrize(
    ("period_s", "has_rate", "is_steered", "late_s"),
    [
        (0.1, True, False, 0.0),
        (0.1, False, False, 0.25),
        (0.1, False, True, 0.0),
        (1.0, False, False, 0.75),
        (1.0, False, True, 0.75),
    ],
)
def test_a_turn_rate_that_is_made_of_headings_comes_late(
    period_s: float, has_rate: bool, is_steered: bool, late_s: float
) -> None:
    """Its filter's delay and noise were nobody's: a launch swung her thrusters from side to side in a light air, and was cut for it."""
    compass = SlowCompass()
    for tick in range(200):
        now_s = 0.05 * tick
        compass.step(tick * 50_000, 0.0 if has_rate else now_s % period_s, is_steered=is_steered)
    assert compass.late_s == late_s
