"""A heading that comes late is told with a figure that says something, and with what mends it."""

from __future__ import annotations

import math

import pytest

from companion.core.guard.diagnosis.late_heading import LateHeading

DT_S = 0.05
SWING_S = 6.0


def helm_nm(t_s: float) -> float:
    return 40.0 * math.sin(2.0 * math.pi * t_s / SWING_S)


def told_of(delay_s: float, damped_s: float = 0.0, set_s: float = 0.0) -> LateHeading:
    """After a minute of swings that are seen so late, and smoothed by so much."""
    late, seen_nm = LateHeading(5.0, set_s), 0.0
    for tick in range(round(60.0 / DT_S)):
        t_s = tick * DT_S
        delayed_nm = helm_nm(t_s - delay_s)
        seen_nm += (DT_S / damped_s if damped_s > 0.0 else 1.0) * (delayed_nm - seen_nm)
        late.step(DT_S, helm_nm(t_s), seen_nm - helm_nm(t_s))
    return late


@pytest.mark.parametrize(("delay_s", "damped_s"), [(0.0, 1.0), (0.6, 0.4)])
def test_a_little_lateness_is_told_with_its_figure_and_both_remedies(delay_s: float, damped_s: float) -> None:
    """It said "lags by about 0 s", and nothing of a delay."""
    late = told_of(delay_s, damped_s)
    assert late.told_s > 0.0
    assert late.words == ("Heading lags by about 0.5 s: switch the compass's damping off, or set its heading_latency_s")


def test_a_heading_that_is_not_late_or_whose_lateness_is_set_is_not_told() -> None:
    """One of 0.8 s that was set so was told as late by half a second."""
    assert told_of(0.0).told_s == 0.0
    assert told_of(1.0, set_s=1.0).told_s == 0.0
    assert told_of(0.0, damped_s=2.0, set_s=0.5).told_s > 0.5
