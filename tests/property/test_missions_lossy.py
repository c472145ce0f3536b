"""Transfers over a bad link complete or fail cleanly: the vessel has the whole old plan or the whole new one, never a mixture."""

from __future__ import annotations

import importlib.util
import math
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from mavlink_bridge.language.requests import ACCEPTED, PlanItem, PlanKind
from mavlink_bridge.mavlink.missions.plan_rules import MissionResult, plan_id
from mavlink_bridge.mavlink.missions.service import MissionServer
from mavlink_bridge.mavlink.missions.wire import item_from_message, item_to_message, with_home
from mavlink_bridge.mavlink.wire.codec import dialect

_spec = importlib.util.spec_from_file_location("lossy", Path(__file__).with_name("lossy.py"))
lossy = sys.modules["lossy"] = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(lossy)

BAD = lossy.Weather(loss=0.3, copies=0.2, delay_us=(20_000, 200_000))
SLOW = lossy.Weather(loss=0.3, copies=0.1, delay_us=(100_000, 2_000_000))


def plan(count, first=0):
    return tuple(
        PlanItem(16, 3, 0.0, 0.0, 0.0, math.nan, 411_850_000 + first + n, -87_062_154, 50.0) for n in range(count)
    )


class Vessel:
    """The server and the vessel behind it, which stores 50 ms later."""

    def __init__(self, items=(), home_item=False):
        self.plans = {PlanKind.MISSION: items, PlanKind.FENCE: (), PlanKind.RALLY: ()}
        self.home = (0.7, -0.15)
        self.server = MissionServer(self, home_item=home_item)
        self.waiting, self.stored = [], []

    def items(self, kind):
        return self.plans[kind]

    def plan_id(self, kind):
        return plan_id(self.plans[kind])

    @property
    def busy(self):
        return self.server.busy

    def step(self, messages, now_us):
        out = [answer for message in messages for answer in self.server.handle(message, now_us)]
        out += self.server.poll(now_us)
        self.waiting += [(now_us + 50_000, handle, load) for handle, load in self.server.loads()]
        for due_us, handle, load in self.waiting[:]:
            if due_us <= now_us:
                self.waiting.remove((due_us, handle, load))
                self.plans[load.kind] = load.items
                self.stored.append(plan_id(load.items))
                out += self.server.finish(handle, ACCEPTED, plan_id(load.items), now_us)
        return out


class Uploader:
    """Sends COUNT until something comes, answers requests; repeats its last message after ``wait_s``, ``tries`` times."""

    ids = (255, 190)

    def __init__(self, items, wait_s, tries):
        self.items, self.wait_us, self.tries = items, int(wait_s * 1e6), tries
        self.last = dialect.MAVLink_mission_count_message(1, 1, len(items), 0)
        self.sent_us, self.left, self.result, self.done = None, tries, None, False

    def step(self, messages, now_us):
        out = []
        for message in messages:
            if message.get_type() == "MISSION_REQUEST_INT" and not self.done and message.seq < len(self.items):
                self.last = item_to_message(self.items[message.seq], message.seq, 1, 1, PlanKind.MISSION)
                out.append(self.last)
                self.left, self.sent_us = self.tries, now_us
            elif message.get_type() == "MISSION_ACK" and not self.done:
                self.result, self.done = message.type, True
        if not self.done and (self.sent_us is None or now_us - self.sent_us >= self.wait_us):
            if self.left == 0:
                self.done = True
                return []
            self.left -= 1
            self.sent_us = now_us
            out.append(self.last)
        return out


class Downloader:
    """Asks for the list, then each item, repeating after 0.5 s."""

    ids = (245, 190)

    def __init__(self, tries=30):
        self.tries, self.left, self.sent_us = tries, tries, None
        self.count, self.got, self.done = None, {}, False

    def step(self, messages, now_us):
        for message in messages:
            if message.get_type() == "MISSION_COUNT" and self.count is None:
                self.count, self.left, self.sent_us = message.count, self.tries, None
            elif message.get_type() == "MISSION_ITEM_INT" and message.seq == len(self.got):
                self.got[message.seq] = item_from_message(message)
                self.left, self.sent_us = self.tries, None
        if self.done:
            return []
        if self.count is not None and len(self.got) == self.count:
            self.done = True
            return [dialect.MAVLink_mission_ack_message(1, 1, 0, 0)]
        if self.sent_us is not None and now_us - self.sent_us < 500_000:
            return []
        if self.left == 0:
            self.done = True
            return []
        self.left, self.sent_us = self.left - 1, now_us
        if self.count is None:
            return [dialect.MAVLink_mission_request_list_message(1, 1, 0)]
        return [dialect.MAVLink_mission_request_int_message(1, 1, len(self.got), 0)]


OLD = plan(7, 10_000)


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 10**6),
    st.integers(1, 25),
    st.booleans(),
    st.sampled_from([(0.5, 5), (1.5, 5), (1.5, 40)]),
    st.sampled_from([BAD, SLOW]),
)
def test_row_43_an_upload_over_a_bad_link_gives_the_whole_new_plan_or_keeps_the_old(
    seed, count, home_item, patience, weather
):
    new = plan(count)
    vessel = Vessel(OLD, home_item)
    station = Uploader(with_home(new, (0.7, -0.15)) if home_item else new, *patience)
    lossy.run(station, vessel, weather, seed)
    in_force = plan_id(vessel.items(PlanKind.MISSION))
    assert in_force in (plan_id(OLD), plan_id(new))
    assert set(vessel.stored) <= {plan_id(new)}
    if station.result == MissionResult.ACCEPTED:
        assert in_force == plan_id(new)
    if not vessel.stored:
        assert in_force == plan_id(OLD)
    assert not vessel.busy


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 25), st.sampled_from([BAD, SLOW]))
def test_a_download_over_a_bad_link_is_whole_when_it_ends(seed, count, weather):
    vessel, station = Vessel(plan(count)), Downloader()
    lossy.run(station, vessel, weather, seed)
    assert plan_id(list(station.got.values())) == plan_id(plan(count))


@pytest.mark.parametrize("seed", range(10))
def test_row_43_a_patient_station_gets_its_plan_through_at_30_percent_loss(seed):
    vessel, station = Vessel(OLD), Uploader(plan(25), 1.5, 20)
    lossy.run(station, vessel, BAD, seed)
    assert station.result == MissionResult.ACCEPTED


def test_829_items_get_through_at_30_percent_loss_and_200_ms_delay():
    weather = lossy.Weather(loss=0.3, copies=0.0, delay_us=(200_000, 200_000))
    vessel, station = Vessel(OLD), Uploader(plan(829), 1.5, 40)
    seconds = lossy.run(station, vessel, weather, seed=5, step_us=20_000)
    assert station.result == MissionResult.ACCEPTED
    assert plan_id(vessel.items(PlanKind.MISSION)) == plan_id(plan(829))
    assert seconds < 400.0


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6))
def test_a_late_copy_of_a_clear_does_not_clear_a_newer_plan(seed):
    class ClearThenUpload(Uploader):
        cleared = False

        def step(self, messages, now_us):
            if not self.cleared:
                self.cleared = True
                return [dialect.MAVLink_mission_clear_all_message(1, 1, 0)]
            if now_us < 1_000_000:
                return []
            return super().step([m for m in messages if m.get_type() != "MISSION_ACK" or now_us > 2_500_000], now_us)

    copying = lossy.Weather(copies=1.0, delay_us=(1_000, 900_000))
    vessel, station = Vessel(OLD), ClearThenUpload(plan(5), 1.5, 10)
    lossy.run(station, vessel, copying, seed)
    assert plan_id(vessel.items(PlanKind.MISSION)) == plan_id(plan(5))
