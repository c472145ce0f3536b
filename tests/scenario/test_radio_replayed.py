"""Recorded radio traffic against the whole vessel: bytes at its modem, judged at the pulses of its actuators.

What a listener recorded of one start is given to later starts with every state of memory, to another boat, from the other
end, in pieces, and in a live session. ``tests/unit/test_radio_trust.py`` tries the same on the two ends alone.
"""

from __future__ import annotations

import itertools
import math
import random

import pytest

from companion.io.keeping.content import StoreContent
from companion.io.keeping.store import MemoryStore
from companion.radio import MEMORY_KEY
from tests.ashore import Ashore

NEUTRAL_US = 1500.0
ARM, GO_TO, SET_MODE = 400, 192, 176
HOLD, GUIDED, RTL, AUTO = 4.0, 15.0, 11.0, 10.0
TARGET = 41.1870, -8.7060


def neutral(shore):
    return all(abs(pulse - NEUTRAL_US) < 10.0 for pulse in shore.world.surroundings.plant.board.pulses_us)


def go(shore):
    shore.order(ARM, 1.0)
    shore.order(GO_TO, -1.0, 1.0, 0.0, math.nan, *TARGET)


class Day:
    """One start of boat and gateway with every kind of order in it: what went over the air, and the boat's store."""

    def __init__(self, folder):
        store = MemoryStore()
        shore = Ashore(folder, seed=11, store=store)
        self.first = shore.world.app.facade.identity.start_nonce
        shore.run(20.0)
        go(shore)
        assert shore.until(lambda: not neutral(shore), 10.0), "the orders of this day move the boat"
        self.half_way = store.snapshot()
        shore.order(SET_MODE, 1.0, HOLD)
        shore.order(SET_MODE, 1.0, RTL)
        shore.order(ARM, 0.0)
        go(shore)
        shore.run(5.0)
        store.close()
        self.log = list(shore.world.surroundings.radio.air.log)
        self.kept = store.snapshot()

    def memories(self):
        """The boat's store at a later start."""
        half = self.kept.values[MEMORY_KEY][: len(self.kept.values[MEMORY_KEY]) // 2]
        return {
            "kept": self.kept,
            "lost": StoreContent(),
            "half": StoreContent(values={**self.kept.values, MEMORY_KEY: half}, meta=self.kept.meta),
            "restored old": self.half_way,
        }

    def traffic(self, how):
        """(When after the start, bytes) for the boat's modem."""
        orders = [(item.end_us, item.data) for item in self.log if item.origin == "shore"]
        said = [(item.end_us, item.data) for item in self.log if item.origin == "vessel"]
        if how == "at the time of day at which it was sent":
            return orders
        if how == "what the boat itself said":
            return said
        chance = random.Random(how)
        frames = [data for _, data in orders]
        if how == "spliced":
            pairs = itertools.pairwise([*frames, *(data for _, data in said)])
            frames = [one[:cut] + two[cut:] for one, two in pairs for cut in (2, 3, max(len(one) - 5, 2))]
        chance.shuffle(frames)
        return [(2_000_000 + 150_000 * number, data) for number, data in enumerate(frames)]


WAYS = ("at the time of day at which it was sent", "shuffled", "spliced", "what the boat itself said")


@pytest.fixture(scope="module")
def day(tmp_path_factory):
    return Day(tmp_path_factory.mktemp("day"))


def attacked(shore, traffic, extra_s=5.0):
    """Give the bytes to the boat's modem at their times; return for how many ticks it was armed or its pins not neutral."""
    modem, motions = shore.world.surroundings.radio.air.modules[0], 0
    waiting = sorted(traffic)
    end_us = waiting[-1][0] + round(extra_s * 1e6)
    while shore.world.now_us < end_us:
        while waiting and waiting[0][0] <= shore.world.now_us:
            modem.to_host(waiting.pop(0)[1], shore.world.now_us)
        shore.step()
        motions += shore.world.snapshot.armed or not neutral(shore)
    return motions


def quick(*values):
    """The first in every run, all in ``make soak``."""
    return [values[0], *(pytest.param(value, marks=pytest.mark.soak) for value in values[1:])]


@pytest.mark.parametrize("how", quick(*WAYS))
@pytest.mark.parametrize("memory", quick("lost", "kept", "half", "restored old"))
def test_no_traffic_of_an_earlier_start_moves_the_boat_whatever_it_remembers(day, tmp_path, memory, how):
    later = Ashore(tmp_path, seed=12, store=MemoryStore(day.memories()[memory]), listens=False)
    assert attacked(later, day.traffic(how)) == 0


@pytest.mark.soak
@pytest.mark.parametrize("how", WAYS)
def test_no_other_boat_with_the_same_key_obeys(day, tmp_path, how):
    other = Ashore(tmp_path, "system.system_id=2", seed=11, store=MemoryStore(), listens=False)
    assert attacked(other, day.traffic(how)) == 0


def test_a_start_with_another_memory_or_seed_has_another_nonce_and_the_same_one_the_same(day, tmp_path):
    stores = [MemoryStore(), MemoryStore(day.kept), MemoryStore(day.half_way)]
    nonces = [Ashore(tmp_path, seed=11, store=store).world.app.facade.identity.start_nonce for store in stores]
    assert nonces[0] == day.first, "a simulation repeats itself"
    assert len({*nonces, Ashore(tmp_path, seed=12, store=MemoryStore()).world.app.facade.identity.start_nonce}) == 4


@pytest.mark.parametrize("seed", quick(1, 2, 3, 4, 5))
def test_in_a_live_session_every_stop_is_obeyed_while_old_traffic_hails(day, tmp_path, seed):
    """The listener plays to both ends without a pause; the operator's orders move the boat, nobody else's, and he stops it."""
    shore = Ashore(tmp_path, seed=20 + seed, store=MemoryStore(day.kept))
    chance = random.Random(seed)
    shore.run(20.0)
    modems = shore.world.surroundings.radio.air.modules

    def hail():
        for modem in modems:
            if chance.random() < 0.1:
                modem.to_host(chance.choice(day.log).data, shore.world.now_us)
        return False

    go(shore)
    assert shore.until(lambda: hail() or not neutral(shore), 20.0)
    for order, done in (
        ((SET_MODE, 1.0, HOLD), lambda: shore.world.snapshot.mode.value == "Hold"),
        ((ARM, 0.0), lambda: not shore.world.snapshot.armed and neutral(shore)),
    ):
        shore.until(hail, 5.0 + chance.uniform(0.0, 5.0))
        shore.give(*order)
        assert shore.until(lambda done=done: hail() or done(), 5.0), order
    assert not shore.until(lambda: hail() or shore.world.snapshot.armed or not neutral(shore), 30.0)


@pytest.mark.parametrize("order", quick((ARM, 1.0), (GO_TO, -1.0, 1.0, 0.0, math.nan, *TARGET)))
def test_an_order_held_back_beyond_its_failure_moves_nothing(tmp_path, order):
    shore = Ashore(tmp_path, seed=31)
    shore.run(20.0)
    air = shore.world.surroundings.radio.air
    if order[0] == GO_TO:
        shore.order(ARM, 1.0)
        shore.order(SET_MODE, 1.0, HOLD)
    mode, armed = shore.world.snapshot.mode, shore.world.snapshot.armed
    air.jammed, since_us = True, shore.world.now_us
    shore.operator.clear()
    shore.give(*order)
    shore.until(lambda: any(m.result not in (0, 5) for m in shore.operator.all("COMMAND_ACK")), 60.0)
    assert shore.operator.all("COMMAND_ACK")[-1].result == 4, "told that it failed"
    shore.run(2.0)
    held = [item.data for item in air.log if item.origin == "shore" and item.start_us >= since_us]
    assert held
    now_us = shore.world.now_us
    attacked(shore, [(now_us + 200_000 * number, data) for number, data in enumerate(held)])
    assert (shore.world.snapshot.mode, shore.world.snapshot.armed) == (mode, armed)
