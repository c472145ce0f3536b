"""The seed's two integration scenarios of MinAltitude in the whole simulator, with its own 4.0 / 0.1 / 0.1.

A 2 % slope is sailed up until the guard stops the boat at 4.00 m. The operator who turns back comes into good water again; the
one who presses on is locked. The sounder has its usual noise, 0.05 m against a margin of 0.1 m.
"""

from __future__ import annotations

import pytest

from mavlink_bridge.language.messages import Action, GuardState
from mavlink_bridge.language.requests import StartPlan

KEEL_M = 0.35
SLOPE = (
    "world.bottom.mounds=[]",
    "world.bottom.slope.bearing_deg=0",
    "world.bottom.slope.start_m=10",
    "world.bottom.slope.gradient=0.02",
    "world.bottom.depth_m=5.0",
)
WAYS = [(0.4, 0.5), (0.6, 1.5), (0.8, 2.5), (0.6, 20.0)]
"""Speed, and how long the operator takes to order the way back."""


SEED = ("depth.rate_look_ahead=false", "depth.map_look_ahead=false")
"""The seed's guard looks straight down only."""


def stopped(voyage, seed, speed_mps, *more):
    trip = voyage(*SLOPE, *more, seed=seed)
    trip.sail(speed_mps, (150.0, 0.0))
    trip.until(lambda: trip.snapshot.action >= Action.HOLD or trip.snapshot.guard is GuardState.CORRECTION, 300.0)
    return trip


def turned_back(voyage, seed, *more):
    speed_mps, wait_s = WAYS[seed % len(WAYS)]
    trip = stopped(voyage, seed, speed_mps, *more)
    trip.run(wait_s)
    assert trip.plan(speed_mps, (-40.0, 0.0)).reason == ""
    assert trip.ask(StartPlan(0)).reason == ""
    states, least_m = set(), 9.0
    for _ in range(20 * 150):
        trip.step()
        states.add(trip.snapshot.guard)
        least_m = min(least_m, trip.truth.depth_m - KEEL_M)
        if trip.snapshot.guard is GuardState.OK and trip.truth.depth_m - KEEL_M > 4.2:
            break
    return trip, states, least_m


def pressed_on(voyage, seed):
    speed_mps = WAYS[seed % len(WAYS)][0]
    trip = stopped(voyage, seed, speed_mps)
    trip.run(1.0)
    for _ in range(6):
        if trip.snapshot.guard is GuardState.LOCKED:
            break
        if trip.ask(StartPlan(None)).reason == "":
            trip.run(10.0)
    return trip


@pytest.mark.parametrize(
    ("seed", "more"), [(6, SEED), (3, ())], ids=["where noise locked it", "where its own soundings barred the way"]
)
def test_who_turns_back_returns_to_normal(voyage, seed, more):
    trip, states, least_m = turned_back(voyage, seed, *more)
    assert GuardState.LOCKED not in states, least_m
    assert trip.snapshot.guard is GuardState.OK
    assert any("correction manoeuvre allowed" in text for text in trip.texts)


def test_who_presses_on_is_locked(voyage):
    trip = pressed_on(voyage, 1)
    assert trip.snapshot.guard is GuardState.LOCKED
    assert trip.neutral


@pytest.mark.soak
@pytest.mark.parametrize("more", [SEED, ()], ids=["straight down", "looking ahead"])
@pytest.mark.parametrize("seed", range(1, 21))
def test_both_with_every_seed(voyage, seed, more):
    trip, states, least_m = turned_back(voyage, seed, *more)
    assert least_m > 3.85
    assert GuardState.LOCKED not in states
    assert trip.snapshot.guard is GuardState.OK
    assert pressed_on(voyage, seed).snapshot.guard is GuardState.LOCKED
