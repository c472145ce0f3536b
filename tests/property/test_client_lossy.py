"""The station's side of MAVLink over a bad link: plans, parameters and orders arrive whole, and nothing is carried out twice."""

from __future__ import annotations

import importlib.util
import random
import sys
from pathlib import Path

import pytest

from mavlink_bridge.language import requests as ask
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import PlanItem, PlanKind, Reply, Result
from mavlink_bridge.mavlink.client import ClientConfig, JobOutcome, VehicleClient
from mavlink_bridge.mavlink.client.orders import arm, disarm, set_mode, start_mission
from mavlink_bridge.mavlink.client.parameters import fetch, put
from mavlink_bridge.mavlink.client.transfers import download, upload
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.mavlink.wire.signing import SigningState
from tests.fake_vessel import TICK_US, Bench

_spec = importlib.util.spec_from_file_location("lossy", Path(__file__).with_name("lossy.py"))
lossy = sys.modules["lossy"] = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(lossy)

CLEAR = lossy.Weather()
BAD = lossy.Weather(loss=0.3, copies=0.2, delay_us=(20_000, 200_000))


class Pair:
    """A client and a vessel's endpoint with weather in between."""

    def __init__(self, persona: str = "ardurover", weather=CLEAR, seed: int = 1, **options) -> None:
        self.bench = Bench(persona, **options)
        key = options["signing"].key if "signing" in options else None
        signing = SigningState(key, timestamp=1_000_000) if key else None
        self.client = VehicleClient(ClientConfig(), signing, link_id=7)
        rng = random.Random(seed)
        self.up, self.down = lossy.Air(weather, rng), lossy.Air(weather, rng)
        self.sent: list = []
        self.present = True
        self.run(2.5)

    def run(self, seconds: float, until=lambda: False) -> None:
        bench, count = self.bench, round(seconds * 1e6 / TICK_US)
        for number in range(count):
            bench.tick()
            now_us = bench.vessel.now_us
            # the bench's own station stands where the wire ends: what it got is what was sent
            for message in bench.gcs.inbox:
                self.down.put(bytes(message.get_msgbuf()), now_us)
            bench.gcs.clear()
            for raw in self.down.take(now_us):
                self.client.receive(raw, now_us)
            if self.present and number % 20 == 0:
                self.client.present()
            frames = Deframer().receive(self.client.take(now_us), now_us)
            self.sent += frames
            for frame in frames:
                self.up.put(frame.raw, now_us)
            for raw in self.up.take(now_us):
                bench.endpoint.receive(raw, now_us)
            bench.pump()
            if until():
                return

    def do(self, job, limit_s: float = 120.0) -> JobOutcome:
        done: list[JobOutcome] = []
        self.client.start(job, done.append, self.bench.vessel.now_us)
        self.run(limit_s, until=lambda: bool(done))
        assert done, "the job never ended"
        return done[0]

    def orders(self, kind: type) -> list:
        return [request.body for request in self.bench.vessel.handled if isinstance(request.body, kind)]

    @property
    def vehicle(self):
        assert self.client.vehicle is not None
        return self.client.vehicle

    @property
    def options(self) -> dict:
        return {"texts": self.client.texts_heard, "answer_s": 30.0}


def items(count: int) -> tuple[PlanItem, ...]:
    return tuple(
        PlanItem(16, 3, 0.0, 0.0, 0.0, float("nan"), 411_850_000 + 100 * number, -87_060_000, 0.0)
        for number in range(count)
    )


def shown(plan) -> list[tuple]:
    return [(item.command, item.frame, item.x, item.y, item.param1, item.param2) for item in plan]


@pytest.mark.parametrize("persona", ["ardurover", "generic"])
@pytest.mark.parametrize(("weather", "seed"), [(CLEAR, 1), (BAD, 2), (BAD, 3)])
def test_a_plan_comes_back_as_it_was_sent(persona, weather, seed) -> None:
    pair = Pair(persona, weather, seed)
    assert pair.do(upload(pair.vehicle, PlanKind.MISSION, items(12), **pair.options)).ok
    assert shown(pair.bench.vessel.plans.items(PlanKind.MISSION)) == shown(items(12))
    back: list[PlanItem] = []
    assert pair.do(download(pair.vehicle, PlanKind.MISSION, back)).ok
    assert shown(back) == shown(items(12))


@pytest.mark.parametrize("persona", ["ardurover", "generic"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_orders_arrive_and_none_is_obeyed_twice(persona, seed) -> None:
    pair = Pair(persona, BAD, seed)
    assert pair.do(upload(pair.vehicle, PlanKind.MISSION, items(3), **pair.options)).ok
    assert pair.do(arm(pair.vehicle, **pair.options)).ok
    assert pair.do(start_mission(pair.vehicle, **pair.options)).ok
    assert pair.bench.vessel.mode is Mode.AUTO
    assert pair.do(set_mode(pair.vehicle, Mode.HOLD, **pair.options)).ok
    assert pair.do(disarm(pair.vehicle, force=True, **pair.options)).ok
    assert not pair.bench.vessel.armed
    assert len(pair.orders(ask.LoadPlan)) == len(pair.orders(ask.StartPlan)) == 1
    assert [body.arm for body in pair.orders(ask.Arm)].count(True) == 1


def test_a_refusal_brings_the_vehicles_own_words() -> None:
    pair = Pair()
    pair.bench.vessel.refuse[ask.Arm] = Reply(Result.REJECTED_NOW, "no position")
    assert pair.do(arm(pair.vehicle, **pair.options)) == JobOutcome(False, "No position")
    bad = (PlanItem(22, 3, 0.0, 0.0, 0.0, 0.0, 411_850_000, -87_060_000, 0.0),)
    outcome = pair.do(upload(pair.vehicle, PlanKind.MISSION, bad, **pair.options))
    assert not outcome.ok
    assert "NAV_TAKEOFF" in outcome.reason


def test_silence_ends_an_order_too() -> None:
    pair = Pair()
    pair.bench.vessel.answers = False
    outcome = pair.do(set_mode(pair.vehicle, Mode.AUTO, texts=pair.client.texts_heard, answer_s=5.0))
    assert not outcome.ok


@pytest.mark.parametrize("weather", [CLEAR, BAD])
def test_parameters_are_read_whole_and_set(weather) -> None:
    pair = Pair("generic", weather, 5)
    values: dict[str, float] = {}
    assert pair.do(fetch(pair.vehicle, values), 300.0).ok
    theirs = {info.name: info.value for info in pair.bench.vessel.params.infos}
    assert {name: values[name] for name in theirs} == theirs
    assert pair.do(put(pair.vehicle, "TEST_007", 2.5, **pair.options)).ok
    assert pair.bench.vessel.params.get("TEST_007").value == 2.5
    refused = pair.do(put(pair.vehicle, "READ_ONLY", 1.0, **pair.options))
    assert not refused.ok
    assert "read-only" in refused.reason


def test_it_beats_as_often_as_its_user_and_no_longer() -> None:
    pair = Pair()
    pair.sent.clear()
    pair.run(10.0)
    assert sum(frame.message_id == 0 for frame in pair.sent) == 10
    pair.present = False
    pair.run(1.0)
    pair.sent.clear()
    pair.run(10.0)
    assert pair.sent == []


def test_an_unsigned_vehicle_is_not_believed_where_signatures_are_demanded() -> None:
    key = SigningState(bytes(range(32)))
    client = VehicleClient(ClientConfig(unsigned=False), key)
    bench = Bench()
    bench.run(3.0)
    for message in bench.gcs.inbox:
        client.receive(bytes(message.get_msgbuf()), bench.vessel.now_us)
    assert client.vehicle is None


def test_signed_orders_pass_where_unsigned_ones_do_not() -> None:
    pair = Pair("ardurover", signing=SigningState(bytes(range(32)), timestamp=1_000_000))
    assert pair.do(arm(pair.vehicle, **pair.options)).ok
    assert all(frame.signed for frame in pair.sent)
