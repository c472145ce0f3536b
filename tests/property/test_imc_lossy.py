"""Orders by IMC over a bad network: each is carried out once or refused, answered to its asker, whatever is lost, copied or restarted."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings, strategies as st

from companion.facade import SettingsParams
from companion.imc.desk import Desk, DeskConfig
from companion.settings import Settings
from mavlink_bridge import imc
from mavlink_bridge.imc.system import Asker, Udp
from mavlink_bridge.language import requests as ask
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.mavlink.client import VehicleClient
from tests.fake_vessel import TICK_US, Bench
from tests.imc_messages import messages
from tests.imc_rig import plan

HERE = {"lat_rad": 0.7188, "lon_rad": -0.1518}
SPEC = plan("p1", imc.Goto(**HERE, speed=1.0), imc.StationKeeping(**HERE, speed=1.0))
START = imc.PlanControl(op=imc.PlanControlOp.START, plan_id="p1", flags=1)
STOP = imc.PlanControl(op=imc.PlanControlOp.STOP)
FIRST_ID = 0x4001
SAVE = imc.PlanDB(op=imc.PlanDBOp.SET, plan_id="p1", arg=SPEC)


class Net:
    """Consoles, one desk, one vessel's endpoint. Packets between consoles and desk are lost, copied and held back."""

    def __init__(
        self, seed: int = 1, loss: float = 0.0, copies: float = 0.0, delay_us: int = 0, consoles: int = 1
    ) -> None:
        self.rng = random.Random(seed)
        self.loss, self.copies, self.delay_us = loss, copies, delay_us
        self.bench = Bench("generic")
        self.saved = ""
        self.begin()
        self.under_way: list[tuple[int, imc.Message, Asker]] = []
        self.inboxes: list[list[imc.Message]] = [[] for _ in range(consoles)]
        self.numbers = [0] * consoles
        self.run(3.0)

    def begin(self) -> None:
        def save(text: str) -> None:
            self.saved = text

        self.client = VehicleClient()
        self.desk = Desk(DeskConfig(), self.client, SettingsParams(Settings()), saved=self.saved, save=save)

    @property
    def now_us(self) -> int:
        return self.bench.vessel.now_us

    def asker(self, sent_s: float, who: int = 0) -> Asker:
        return Asker(FIRST_ID + who, 0xFF, f"ccu{who}", Udp(f"10.77.0.{1 + who}", 6001), sent_utc_s=sent_s)

    def send(self, message: imc.Message, who: int = 0) -> None:
        """Put a packet on the way, perhaps more than once, perhaps never."""
        asker = self.asker(self.now_us * 1e-6, who)
        for _ in range(2 if self.rng.random() < self.copies else 1):
            if self.rng.random() >= self.loss:
                self.under_way.append((self.now_us + self.rng.randint(0, self.delay_us), message, asker))

    def run(self, seconds: float) -> None:
        for count in range(round(seconds * 1e6 / TICK_US)):
            for who in range(len(self.numbers)) if count % 20 == 0 else ():
                self.send(imc.Heartbeat(), who)
            due = [each for each in self.under_way if each[0] <= self.now_us]
            self.under_way = [each for each in self.under_way if each[0] > self.now_us]
            for _, message, asker in due:
                self.desk.heard(asker, self.now_us)
                self.desk.receive(message, asker, self.now_us)
            self.bench.tick()
            for message in self.bench.gcs.inbox:
                self.client.receive(bytes(message.get_msgbuf()), self.now_us)
            self.bench.gcs.clear()
            for out in self.desk.take(self.now_us):
                if self.rng.random() >= self.loss and out.to is not None:
                    self.inboxes[out.to.imc_id - FIRST_ID].append(out.message)
            said = self.client.take(self.now_us)
            if said:
                self.bench.endpoint.receive(said, self.now_us)
                self.bench.pump()

    @property
    def answers(self) -> list[imc.Message]:
        return self.inboxes[0]

    def restart_console(self, who: int = 0) -> None:
        """It has forgotten what it asked, counts its requests from one again, and was away for a while."""
        self.numbers[who], self.inboxes[who] = 0, []
        self.run(11.0)

    def ask(self, message, who: int = 0, tries: int = 12):
        """A console that asks again each second until it is answered."""
        self.numbers[who] += 1
        request = type(message)(**{**message.__dict__, "request_id": self.numbers[who]})
        for _ in range(tries):
            self.send(request, who)
            self.run(0.7)
            found = [each for each in self.inboxes[who] if getattr(each, "request_id", None) == self.numbers[who]]
            if found:
                return found[0]
        return None

    def count(self, kind: type) -> int:
        return sum(isinstance(each.body, kind) for each in self.bench.vessel.handled)


@pytest.mark.parametrize("seed", range(6))
def test_over_a_network_that_loses_every_third_packet_no_order_is_obeyed_twice(seed: int) -> None:
    net = Net(seed, loss=0.3, copies=0.3, delay_us=400_000)
    for message in (SAVE, START):
        answer = net.ask(message)
        assert answer is not None
        assert answer.type == imc.ReplyType.SUCCESS
    assert net.bench.vessel.mode is Mode.AUTO
    assert net.ask(STOP).type == imc.ReplyType.SUCCESS
    net.run(3.0)
    assert net.bench.vessel.mode is Mode.HOLD, "no copy of the START came after the STOP"
    assert net.count(ask.LoadPlan) == net.count(ask.StartPlan) == 1


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(1, 30))])
def test_three_consoles_on_such_a_network_and_restarts_of_either_side_and_each_order_counts_once(seed: int) -> None:
    net = Net(seed, loss=0.3, copies=0.3, delay_us=400_000, consoles=3)
    assert net.ask(SAVE).type == imc.ReplyType.SUCCESS
    assert net.ask(START).type == imc.ReplyType.SUCCESS
    net.begin()
    net.run(2.0)
    assert net.ask(imc.PlanDB(op=imc.PlanDBOp.GET, plan_id="p1"), 1).arg == SPEC, "kept over the bridge's restart"
    refused = net.ask(START, 1)
    assert refused.type == imc.ReplyType.FAILURE
    assert "(0x4001) commands" in refused.info
    assert net.count(ask.StartPlan) == 1
    assert net.ask(STOP, 2).type == imc.ReplyType.SUCCESS, "everybody stops"
    net.run(3.0)
    assert net.bench.vessel.mode is Mode.HOLD
    net.restart_console()
    assert net.ask(START).type == imc.ReplyType.SUCCESS, "the first number of a console that began anew is a new order"
    assert net.bench.vessel.mode is Mode.AUTO
    assert net.count(ask.StartPlan) == 2
    starts = [[each for each in inbox if isinstance(each, imc.PlanControl)] for inbox in net.inboxes]
    assert {each.type for each in starts[1]} == {imc.ReplyType.FAILURE}
    assert {each.op for each in starts[2]} == {imc.PlanControlOp.STOP}, "answers go to who asked"


@pytest.mark.parametrize("after_s", [0.05, 0.1, 0.2, 0.5, 1.0])
def test_a_bridge_that_dies_over_a_start_does_not_start_twice(after_s: float) -> None:
    net = Net()
    assert net.ask(SAVE).type == imc.ReplyType.SUCCESS
    net.numbers[0] += 1
    request = type(START)(**{**START.__dict__, "request_id": net.numbers[0]})
    net.send(request)
    net.run(after_s)
    net.begin()
    net.run(1.5)
    for _ in range(3):
        net.send(request)
        net.run(1.0)
    assert net.count(ask.StartPlan) <= 1
    assert [each.request_id for each in net.answers].count(net.numbers[0]) >= 1, "and it is told so"
    assert net.ask(STOP).type in (imc.ReplyType.SUCCESS, imc.ReplyType.FAILURE)
    net.run(12.0)
    assert net.ask(START).type == imc.ReplyType.SUCCESS, "pressed anew it starts"


@settings(max_examples=40, deadline=None)
@given(st.lists(st.sampled_from(imc.messages.ALL).flatmap(messages), min_size=1, max_size=12), st.booleans())
def test_whatever_a_console_says_the_desk_goes_on(said, broken) -> None:
    net = Net()
    for message in said:
        net.desk.receive(message, net.asker(net.now_us * 1e-6), net.now_us)
        net.run(0.1)
    if broken:
        net.begin()
    net.desk.receive(imc.Abort(), net.asker(net.now_us * 1e-6), net.now_us)
    net.run(3.0)
    assert not net.bench.vessel.armed
    assert net.ask(imc.PlanDB(op=imc.PlanDBOp.GET_STATE)).type == imc.ReplyType.SUCCESS
