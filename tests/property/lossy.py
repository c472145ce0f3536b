"""A seeded radio between a ground station and the vessel: loses, copies, delays and reorders frames in virtual time."""

from __future__ import annotations

import heapq
import random
from dataclasses import dataclass

from mavlink_bridge.mavlink.wire.codec import Codec, decode
from mavlink_bridge.mavlink.wire.framing import Deframer, DuplicateFilter


@dataclass(frozen=True)
class Weather:
    """What happens to each frame, either way. Delays in us, drawn evenly, so that frames overtake each other."""

    loss: float = 0.0
    copies: float = 0.0
    delay_us: tuple[int, int] = (1_000, 1_000)


class Air:
    """One direction."""

    def __init__(self, weather: Weather, rng: random.Random):
        self.weather, self.rng = weather, rng
        self.queue, self.count = [], 0

    def put(self, raw, now_us):
        if self.rng.random() < self.weather.loss:
            return
        for _ in range(2 if self.rng.random() < self.weather.copies else 1):
            self.count += 1
            heapq.heappush(self.queue, (now_us + self.rng.randint(*self.weather.delay_us), self.count, raw))

    def take(self, now_us):
        out = []
        while self.queue and self.queue[0][0] <= now_us:
            out.append(heapq.heappop(self.queue)[2])
        return out


class Port:
    """Frames in and out of one end, copies filtered as an endpoint does."""

    def __init__(self, system, component):
        self.codec, self.deframer, self.filter = (
            Codec(system, component),
            Deframer(datagrams=True),
            DuplicateFilter(5_000_000),
        )

    def read(self, raws, now_us):
        frames = [frame for raw in raws for frame in self.deframer.receive(raw, now_us)]
        return [decode(frame) for frame in frames if self.filter.is_new(frame, now_us)]


def run(station, vessel, weather, seed, limit_s=600.0, step_us=10_000):
    """Let both talk until the station is done and the air is empty. ``station`` and ``vessel`` have step(messages, now_us)."""
    rng = random.Random(seed)
    up, down = Air(weather, rng), Air(weather, rng)
    station_port, vessel_port = Port(*station.ids), Port(1, 1)
    now_us, quiet_us = 0, 0
    while now_us < limit_s * 1e6:
        for message in station.step(station_port.read(down.take(now_us), now_us), now_us):
            up.put(station_port.codec.encode(message), now_us)
        for message in vessel.step(vessel_port.read(up.take(now_us), now_us), now_us):
            down.put(vessel_port.codec.encode(message), now_us)
        if station.done and not vessel.busy and not up.queue and not down.queue:
            quiet_us += step_us
            if quiet_us > 100_000:
                break
        now_us += step_us
    return now_us / 1e6
