"""Parameters over a bad link, by a station that is patient: the list is whole and exact, a value set is the value in force."""

from __future__ import annotations

import importlib.util
import random
import struct
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from mavlink_bridge.language import requests as ask
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import TICK_US, Bench, Station

_spec = importlib.util.spec_from_file_location("lossy", Path(__file__).with_name("lossy.py"))
lossy = sys.modules["lossy"] = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(lossy)

BAD = lossy.Weather(loss=0.3, copies=0.2, delay_us=(20_000, 200_000))
SLOW = lossy.Weather(loss=0.3, copies=0.1, delay_us=(100_000, 2_000_000))


class Patient:
    """Asks for the list, then for what is missing by index; sets values until each comes back."""

    patience_us = 2_500_000

    def __init__(self, wishes: dict[str, float]) -> None:
        self.end = Station()
        self.wishes = dict(wishes)
        self.values: dict[str, float] = {}
        self.indices: dict[int, str] = {}
        self.count: int | None = None
        self.heard_us, self.sends, self.begun = 0, 0, False

    @property
    def listed(self) -> bool:
        return self.count is not None and len(self.indices) == self.count

    @property
    def done(self) -> bool:
        return self.listed and not self.wishes

    def step(self, raws: list[bytes], now_us: int) -> list[bytes]:
        for raw in raws:
            self.end.receive(raw, now_us)
        for message in self.end.inbox:
            if message.get_type() == "PARAM_VALUE":
                self.heard_us = now_us
                self.count = message.param_count
                self.values[message.param_id] = message.param_value
                if message.param_index < message.param_count:
                    self.indices[message.param_index] = message.param_id
                if self.wishes.get(message.param_id) == message.param_value:
                    del self.wishes[message.param_id]
        self.end.clear()
        if self.begun and now_us - self.heard_us < self.patience_us:
            return []
        self.heard_us, self.begun = now_us, True
        return [self.end.codec.encode(message) for message in self.ask()]

    def ask(self) -> list[object]:
        if self.count is None:
            return [dialect.MAVLink_param_request_list_message(1, 1)]
        missing = [index for index in range(self.count) if index not in self.indices]
        if missing:
            return [dialect.MAVLink_param_request_read_message(1, 1, b"", index) for index in missing[:10]]
        self.sends += len(self.wishes)
        return [dialect.MAVLink_param_set_message(1, 1, name.encode(), v, 9) for name, v in self.wishes.items()]


def carry(bench: Bench, station: Patient, weather: object, seed: int, limit_s: float) -> None:
    rng = random.Random(seed)
    up, down = lossy.Air(weather, rng), lossy.Air(weather, rng)
    bench.stations = []
    vessel, endpoint = bench.vessel, bench.endpoint
    now_us = vessel.now_us
    end_us = now_us + limit_s * 1e6
    while not station.done and now_us < end_us:
        for raw in station.step(down.take(now_us), now_us):
            up.put(raw, now_us)
        now_us += TICK_US
        for raw in up.take(now_us):
            endpoint.receive(raw, now_us)
        vessel.now_us = now_us
        for request in endpoint.requests():
            reply = vessel.handle(request)
            endpoint.reply(request.id, reply, now_us)
        endpoint.tick(now_us, vessel.snapshot())
        while data := endpoint.take(now_us, 300):
            for frame in Station().deframer.receive(data, now_us):
                down.put(frame.raw, now_us)


@pytest.mark.parametrize("persona", ["ardurover", "generic"])
@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10**6), weather=st.sampled_from([BAD, SLOW]))
def test_the_list_is_whole_and_what_was_set_is_in_force(persona, seed, weather):
    bench = Bench(persona)
    wishes = {"TEST_003": 0.25, "TEST_050": -1e-7, "TEST_098": 12345.5}
    station = Patient({name: real32(value) for name, value in wishes.items()})
    carry(bench, station, weather, seed, 900.0)
    assert station.done
    table = bench.vessel.params
    for name, value in wishes.items():
        assert table.get(name).value == real32(value)
    for name, value in station.values.items():
        info = table.get(name)
        if info is not None:
            assert value == real32(info.value), "what the station holds is what the vessel has"
    executed = [r.body for r in bench.vessel.handled if isinstance(r.body, ask.SetParameter)]
    assert {body.name for body in executed} == set(wishes)
    assert len(executed) <= 2 * station.sends, "copies on the air and nothing else"


def real32(value: float) -> float:
    """As a REAL32 carries it."""
    (found,) = struct.unpack("<f", struct.pack("<f", value))
    return found
