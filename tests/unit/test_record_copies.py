"""A record counts once, however often and in whatever export it is given; two voyages alike count twice."""

import math
from dataclasses import replace

import numpy as np
import pytest

from companion.tuning.hull_arrays import STEP_S
from companion.tuning.records.copies import taken_once
from companion.tuning.voyages import Stretch


def sailed(source, seconds, seed, noise=0.01):
    """A zig-zag by one plan; the gyro's noise is the voyage's own."""
    t = STEP_S * np.arange(round(seconds / STEP_S))
    helm = np.sign(np.sin(0.15 * t))
    rate = 0.3 * helm + noise * np.random.default_rng(seed).normal(size=len(t))
    psi, pushed = 0.3 * np.cumsum(helm) * STEP_S, np.full(len(t), 0.5)
    return Stretch(source, 100.0, pushed + 0.2 * helm, pushed - 0.2 * helm, 0.0 * t, psi, 1.5 + 0.0 * t, 0.0 * t, rate)


def part(stretch, first_s, last_s, moved_s=0.0):
    """A while of it, read at other moments between the same rows where ``moved_s`` is no whole step."""
    t = STEP_S * np.arange(len(stretch.port))
    at = np.arange(first_s, last_s, STEP_S) + moved_s % STEP_S
    names = ("port", "starboard", "rudder_rad", "psi_rad", "surge", "sway", "rate")
    read = {name: np.interp(at, t, getattr(stretch, name)) for name in names}
    return replace(stretch, source="again", start_s=stretch.start_s + first_s + moved_s, **read)


def seconds(stretches):
    return math.fsum(stretch.seconds for stretch in stretches)


@pytest.mark.parametrize("moved_s", [-3.0, 0.01, 0.025, 3600.0, 1.7e9])
def test_another_export_whose_clock_is_set_otherwise_is_the_same_record(moved_s):
    """It counted twice, unsaid: intervals came out a third too narrow."""
    whole, told = sailed("first", 300.0, 1), []
    copy = part(whole, 0.0, 299.9, moved_s)
    (left,) = taken_once([whole, copy], told.append)
    assert left is whole
    assert told == ["again: the same record as first, taken once"]


@pytest.mark.parametrize("moved_s", [0.0, 0.025, 3600.0])
def test_of_two_that_overlap_the_while_that_both_hold_counts_once(moved_s):
    whole, told = sailed("first", 400.0, 1), []
    left = taken_once([part(whole, 0.0, 250.0), replace(part(whole, 160.0, 399.0, moved_s), source="b")], told.append)
    assert seconds(left) == pytest.approx(399.0, abs=0.6)
    assert told == ["b: 90 s of it are in again, taken once"]
    assert len(left[1].rate) == len(left[1].port)


@pytest.mark.parametrize("noise", [0.002, 0.01])
def test_two_voyages_by_one_plan_are_two(noise):
    two = [sailed("first", 300.0, 1, noise), sailed("second", 300.0, 2, noise)]
    assert taken_once(two, pytest.fail) == two


def test_two_that_lie_still_are_not_held_for_one():
    still = [
        replace(sailed(name, 120.0, 1, 0.0), rate=np.zeros(2400), start_s=at) for name, at in (("a", 0.0), ("b", 500.0))
    ]
    assert taken_once(still, pytest.fail) == still
