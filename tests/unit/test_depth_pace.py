"""A slow sounder is told of once, because it sees a slope late; one that loses some readings is not slow."""

from __future__ import annotations

import random

import pytest

from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.guard import DepthGuard
from companion.core.hull.geometry import HullGeometry
from mavlink_bridge.language.messages import Distance, EstimatedState


def told(period_s, seconds=240.0, lost=0.0, **settings):
    """What is told of the sounder's pace in so long, lying over ten metres of water."""
    rng, texts = random.Random(2), list[str]()
    guard = DepthGuard(DepthGuardConfig(**settings), HullGeometry(0.35, 0.2, 1.08))
    due_s = 0.0
    for i in range(round(seconds * 10.0)):
        now_us = i * 100_000
        if i * 0.1 >= due_s:
            due_s += period_s
            if rng.random() >= lost:
                guard.measure(Distance(now_us, 10.0 + rng.gauss(0.0, 0.05)), EstimatedState(now_us, sog_mps=0.0))
        out = guard.step(now_us, EstimatedState(now_us, sog_mps=0.0), False)
        texts += [text for _, text in out.texts if "a reading each" in text]
    return texts


@pytest.mark.parametrize("period_s", [2.0, 3.0])
def test_a_slow_sounder_is_told_once(period_s):
    assert told(period_s) == [f"Depth sounder: a reading each {period_s:.1f} s: slopes are seen late"]


@pytest.mark.parametrize(("period_s", "lost"), [(0.1, 0.0), (1.0, 0.0), (1.0, 0.1), (0.5, 0.4)])
def test_one_that_is_fast_enough_is_not(period_s, lost):
    assert told(period_s, lost=lost) == []


def test_silences_are_no_pace():
    assert told(8.0) == []


def test_nothing_is_told_where_the_rate_is_not_used():
    assert told(2.0, rate_look_ahead=False) == []
