"""A client with QGroundControl's sequence, timers and retries against the endpoint (checks 6, 7, 12 to 26 as QGC does them)."""

import math
import random

import pytest

from mavlink_bridge.language.requests import PlanKind
from tests.fake_vessel import TICK_US, Bench, FakeParams, FakeVessel, many_params
from tests.qgc_client import QgcClient

NAN = math.nan


class Air:
    """Carries bytes between an endpoint and clients, with loss, delay and copies, in virtual time."""

    def __init__(self, bench, clients, *, loss=0.0, delay_us=1_000, copies=0.0, seed=1):
        self.bench, self.clients = bench, clients
        self.dice = random.Random(seed)
        self.loss, self.delay_us, self.copies = loss, delay_us, copies
        self.flying = []
        self.now_us = bench.vessel.now_us

    def _launch(self, sink, data):
        if self.dice.random() < self.loss:
            return
        for _ in range(1 + (self.dice.random() < self.copies)):
            jitter = self.dice.randrange(1 + self.delay_us // 2)
            self.flying.append((self.now_us + self.delay_us + jitter, sink, data))

    def step(self, step_us=2_000):
        self.now_us += step_us
        arrived = sorted((item for item in self.flying if item[0] <= self.now_us), key=lambda item: item[0])
        self.flying = [item for item in self.flying if item[0] > self.now_us]
        for _, sink, data in arrived:
            sink(data, self.now_us)
        for client in self.clients:
            data = client.take(self.now_us)
            if data:
                self._launch(self.bench.endpoint.receive, data)
        if self.now_us // TICK_US != (self.now_us - step_us) // TICK_US:
            self.bench.vessel.now_us = self.now_us - TICK_US
            self.bench.stations = []
            for request in self.bench.endpoint.requests():
                reply = self.bench.vessel.handle(request)
                if request.reply:
                    self.bench.endpoint.reply(request.id, reply, self.now_us)
            self.bench.vessel.now_us = self.now_us
            self.bench.endpoint.tick(self.now_us, self.bench.vessel.snapshot())
        while data := self.bench.endpoint.take(self.now_us, 1200):
            for client in self.clients:
                self._launch(client.receive, data)

    def run_until_idle(self, limit_s):
        end_us = self.now_us + round(limit_s * 1e6)
        while self.now_us < end_us and not all(client.idle for client in self.clients):
            self.step()
        assert all(client.idle for client in self.clients), [client.report for client in self.clients]


def waypoints(count, persona):
    items = [(3, 16, 0.0, 0.0, 0.0, NAN, 411_850_000 + 10 * n, -87_060_000, 50.0) for n in range(count)]
    home = [(0, 16, 0.0, 0.0, 0.0, 0.0, 411_840_000, -87_060_000, 0.0)]
    return home + items if persona == "ardurover" else items


@pytest.mark.parametrize("count", [100, 1000])
def test_check_06_connects_in_time_without_one_complaint(persona, count):
    bench = Bench(persona, vessel=FakeVessel(params=FakeParams(many_params(count))))
    client = QgcClient()
    Air(bench, [client]).run_until_idle(20)
    report = client.report
    assert report.failures == []
    assert report.resends == 0
    assert report.finished_s < (2.0 if count == 100 else 5.0)
    assert len(report.params) >= count
    assert len(report.modes) == 7
    assert report.metadata
    assert report.plans[1] == report.plans[2] == []
    assert report.plans[0] == []


def test_check_07_two_of_them_at_once(persona):
    bench = Bench(persona)
    clients = [QgcClient(), QgcClient(254)]
    Air(bench, clients).run_until_idle(20)
    for client in clients:
        assert client.report.failures == []
        assert client.report.finished_s < 2.0
        assert len(client.report.params) >= 100


@pytest.mark.parametrize("seed", range(6))
def test_check_14_connects_through_30_percent_loss(persona, seed):
    """Three tries of 1.2 s may all be lost; what matters is that every state ends and the parameters and plans come."""
    bench = Bench(persona)
    client = QgcClient()
    Air(bench, [client], loss=0.3, delay_us=50_000, copies=0.1, seed=seed).run_until_idle(300)
    assert client.report.finished_s is not None
    assert len(client.report.params) >= 100 or any("param" in line or "file" in line for line in client.report.failures)


@pytest.mark.parametrize("count", [1, 100])
def test_check_13_a_plan_goes_up_and_comes_back(persona, count):
    bench = Bench(persona)
    client = QgcClient()
    air = Air(bench, [client])
    air.run_until_idle(20)
    began_us = air.now_us
    client.start(client.upload(0, waypoints(count, persona)))
    air.run_until_idle(20)
    assert client.result == 0
    assert (air.now_us - began_us) * 1e-6 < 0.1 + 0.008 * count
    assert len(bench.vessel.plans.items(PlanKind.MISSION)) == count
    client.start(client.download(0))
    air.run_until_idle(20)
    sent = waypoints(count, persona)
    assert [(m.frame, m.command, m.x, m.y) for m in client.result][1:] == [(i[0], i[1], i[6], i[7]) for i in sent][1:]


@pytest.mark.parametrize("kind", [1, 2])
def test_check_12_an_empty_fence_or_rally_is_acknowledged_at_once(persona, kind):
    bench = Bench(persona)
    client = QgcClient()
    air = Air(bench, [client])
    air.run_until_idle(20)
    client.start(client.upload(kind, []))
    air.run_until_idle(2)
    assert client.result == 0


def test_check_40_commands_as_it_sends_them(persona):
    bench = Bench(persona)
    client = QgcClient()
    air = Air(bench, [client])
    air.run_until_idle(20)
    for command, params, expected in (
        (400, (1,), 0),
        (176, (1, 4, 0), 0),
        (400, (0, 21196), 0),
        (31999, (), 3),
        (16, (), 3),
    ):
        client.start(client.command(command, *params))
        air.run_until_idle(5)
        assert client.result == expected
    assert client.report.failures == []


def test_check_37_parameters_as_it_sets_them(persona):
    bench = Bench(persona)
    client = QgcClient()
    air = Air(bench, [client])
    air.run_until_idle(20)
    for name, value, expected in (
        ("TEST_001", 0.1, True),
        ("TEST_001", 1e30, 2),
        ("READ_ONLY", 1.0, 5),
        ("NO_SUCH", 1.0, 1),
    ):
        client.start(client.set_param(name, value))
        air.run_until_idle(5)
        assert client.result is expected or client.result == expected
    assert bench.vessel.params.get("TEST_001").value == pytest.approx(0.1)


@pytest.mark.parametrize("seed", range(8))
def test_check_41_bad_links_never_execute_twice(persona, seed):
    """30 % loss both ways, copies, reordering and two seconds of delay."""
    bench = Bench(persona)
    client = QgcClient()
    air = Air(bench, [client])
    air.run_until_idle(20)
    air.loss, air.copies, air.delay_us, air.dice = 0.3, 0.3, 2_000_000 if seed % 2 else 300_000, random.Random(seed)
    client.start(client.upload(0, waypoints(5, persona)))
    air.run_until_idle(120)
    stored = len(bench.vessel.plans.items(PlanKind.MISSION))
    assert stored in (0, 5)
    assert client.result in (0, None) or stored == 0
    bench.vessel.handled.clear()
    client.start(client.command(193, 0))
    air.run_until_idle(60)
    assert len([r for r in bench.vessel.handled if type(r.body).__name__ == "PausePlan"]) <= 1
