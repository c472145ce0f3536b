"""A false echo of some seconds: stopped at once, and after one order to forget here the boat sails on, home too."""

from __future__ import annotations

import math

import pytest

from companion.io.keeping.store import MemoryStore
from mavlink_bridge.language.messages import Action, Mode
from mavlink_bridge.language.requests import Arm, ForgetDepth, Result, SetHomePosition, StartPlan

DEEP = ("world.bottom.kind=flat", "world.bottom.depth_m=20.35")


def fooled(voyage, seconds, bias_m, wait_s, *more, seed=1, store=None):
    """Under way at 1.5 m/s, then a sounder that errs, a stop, and some waiting until somebody looks."""
    trip = voyage(*DEEP, *more, seed=seed, store=store)
    assert trip.ask(SetHomePosition(None, None)).reason == ""
    trip.sail(1.5, (400.0, 0.0), after_s=30.0)
    assert trip.truth.u_mps > 1.2
    trip.faults.depth_bias_m = bias_m
    trip.run(seconds)
    trip.faults.depth_bias_m = 0.0
    trip.until(lambda: trip.snapshot.action >= Action.HOLD, 5.0)
    trip.run(wait_s)
    return trip


def sails(trip, mode):
    """Whether one order gets the boat 25 m on its way."""
    north_m, east_m = trip.truth.north_m, trip.truth.east_m
    trip.ask(Arm(arm=False))
    assert trip.ask(Arm(arm=True)).reason == ""
    order = StartPlan(None) if mode is Mode.AUTO else None
    reply = trip.ask(order) if order else trip.mode(mode)
    assert reply.reason == ""
    for _ in range(90):
        trip.run(1.0)
        if math.hypot(trip.truth.north_m - north_m, trip.truth.east_m - east_m) > 25.0:
            return True
    return False


@pytest.mark.parametrize(("seconds", "bias_m", "mode"), [(3.0, -18.5, Mode.RTL), (1.0, -17.0, Mode.AUTO)])
def test_after_one_order_to_forget_the_boat_sails_again(voyage, seconds, bias_m, mode):
    trip = fooled(voyage, seconds, bias_m, 20.0)
    reply = trip.ask(ForgetDepth())
    assert reply.result is Result.ACCEPTED
    assert any("Forgot" in text and "shallowest" in text and "charts stay" in text for text in trip.texts)
    assert sails(trip, mode)
    assert not [text for text in trip.texts if "sounded before" in text]


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 11))
@pytest.mark.parametrize("mode", [Mode.RTL, Mode.AUTO])
@pytest.mark.parametrize("seconds", [1.0, 2.0, 3.0])
def test_every_boat_with_a_false_echo_sails_again_after_one_order(voyage, seconds, mode, seed):
    drift = ("world.water.current_mps=0.2", f"world.water.current_to_deg={36 * seed}")
    trip = fooled(voyage, seconds, -16.5 - 0.2 * seed, 4.0 * seed, *drift, seed=seed)
    assert trip.ask(ForgetDepth()).result is Result.ACCEPTED
    assert sails(trip, mode)


def test_what_was_forgotten_is_forgotten_in_the_store_too(voyage):
    store = MemoryStore()
    trip = fooled(voyage, 3.0, -18.5, 20.0, store=store)
    memory = trip.world.app.vehicle.parts.guard.memory
    before = sum(cell.least_m < 4.0 for *_, cell in memory.known())
    assert before
    trip.ask(ForgetDepth())
    trip.run(0.2)
    kept = store.snapshot().depth
    trip = voyage(*DEEP, store=store)
    again = trip.world.app.vehicle.parts.guard.memory
    assert len(again) == len(kept) > 0
    assert not [cell for *_, cell in again.known() if cell.least_m < 4.0]


def test_an_order_to_forget_has_its_limits(voyage):
    trip = voyage(*DEEP)
    assert "20 m at most" in trip.ask(ForgetDepth(radius_m=21.0)).reason
    assert trip.ask(ForgetDepth()).reason == ""
    assert trip.ask(ForgetDepth(0.5, 0.5)).reason == ""
    trip.run(0.1)
    assert "No depths remembered within 20 m" in trip.texts
