"""Benchmarks of watching other vessels: processor time that a tick pays for 200 of them and for none, and encounters judged in an hour.

The 200 sail in a harbour's mile around the boat and send what a receiver's line can carry, 47 sentences a second; reader, watch and three
ordinary links' tellers work as in the vessel's tick. Times are the process's own.
"""

from __future__ import annotations

import json
import math
import random
import sys
import time
from collections.abc import Callable
from typing import Any, Final

from companion.core.nmea import NmeaConfig, NmeaReader
from companion.core.traffic import Traffic, TrafficConfig
from companion.io.interpreter import cores
from mavlink_bridge.language.messages import Action, ActuatorOutput, EstimatedState, Mode
from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.language.traffic import TrafficPicture
from mavlink_bridge.mavlink.persona import EndpointConfig
from mavlink_bridge.mavlink.telemetry.outbox import Outbox
from mavlink_bridge.mavlink.telemetry.traffic import TrafficTeller
from mavlink_bridge.mavlink.wire.codec import Codec
from sitl.traffic import encoder
from tools.benches.vessel import COMPANION, PYPY, said, share_of
from tools.figures import row

VESSELS: Final = 200
SENTENCES_PER_S: Final = 47
"""What 38400 baud holds."""
TICK_US: Final = 50_000
SECONDS: Final = 60
LINKS: Final = 3
HERE: Final = (math.radians(41.185), math.radians(-8.706))
UTC_US: Final = 1_700_000_000_000_000
BUDGET_MS: Final = 5.0
IDLE_US: Final = 10.0
"""Of 50 000: a boat without a receiver pays for nothing."""
ENCOUNTERS: Final = 200
PYPY_ENCOUNTERS: Final = 600
"""PyPy needs some seconds to compile what it sees."""
LONG: Final = 10_000
LIMIT_H: Final = 5.0


class Harbour:
    """Vessels on straight courses, and one report after the other."""

    def __init__(self) -> None:
        rng = random.Random(5)
        self._at = [(rng.uniform(-1800, 1800), rng.uniform(-1800, 1800)) for _ in range(VESSELS)]
        self._way = [(rng.uniform(0.0, 8.0), rng.uniform(-math.pi, math.pi)) for _ in range(VESSELS)]
        self._sent = 0

    def until(self, now_us: int) -> bytes:
        """The sentences up to now."""
        found = []
        while self._sent < now_us * SENTENCES_PER_S // 1_000_000:
            found.append(self._report(self._sent % VESSELS, now_us))
            self._sent += 1
        return b"".join(found)

    def _report(self, number: int, now_us: int) -> bytes:
        (north, east), (speed, course) = self._at[number], self._way[number]
        way_m = speed * now_us * 1e-6
        north, east = north + way_m * math.cos(course), east + way_m * math.sin(course)
        lat_rad, lon_rad = HERE[0] + north / 6.37e6, HERE[1] + east / 6.37e6 / math.cos(HERE[0])
        report = encoder.StationReport(244_000_001 + number, lat_rad, lon_rad, now_us // 1_000_000 % 60)
        report.sog_mps, report.cog_rad = speed, course
        return encoder.sentences(report.class_a(), 0)


def snapshot_of(now_us: int, state: EstimatedState, picture: TrafficPicture) -> Snapshot:
    """What the tellers look at."""
    output: Any = ActuatorOutput
    return Snapshot(now_us, 0, state, mode=Mode.HOLD, armed=False, output=output, action=Action.NONE, traffic=picture)


class Tick:
    """What one tick of the vessel does with other vessels."""

    def __init__(self) -> None:
        self.reader, self.traffic = NmeaReader(NmeaConfig()), Traffic(TrafficConfig())
        self.links: list[tuple[TrafficTeller, Outbox]] = []
        for number in range(LINKS):
            config = EndpointConfig(name=f"gcs{number}", profile="lan")
            outbox = Outbox(config.limits, Codec(1, 1).seal_all, 12)
            self.links.append((TrafficTeller(config, outbox), outbox))

    def step(self, now_us: int, data: bytes) -> TrafficPicture:
        if data:
            self.reader.receive(data, now_us)
        state = EstimatedState(now_us, *HERE, x_m=0.0, y_m=0.0, vx_mps=1.5, vy_mps=0.0, psi_rad=0.0, sog_mps=1.5)
        picture = self.traffic.step(now_us, state, UTC_US + now_us, self.reader.take_ais())
        self.traffic.drain_texts()
        snapshot = snapshot_of(now_us, state, picture)
        for teller, outbox in self.links:
            teller.tick(now_us, snapshot)
            outbox.take(now_us, 1200)
        return picture


def ticks_ms(bytes_of: Callable[[int], bytes], tick: Tick) -> list[float]:
    """Processor time of each tick, once all are known."""
    found = []
    for number in range(1, SECONDS * 1_000_000 // TICK_US):
        now_us = number * TICK_US
        data = bytes_of(now_us)
        began = time.process_time_ns()
        tick.step(now_us, data)
        if now_us > 10_000_000:
            found.append((time.process_time_ns() - began) * 1e-6)
    return found


def tick_figures() -> list[dict[str, Any]]:
    """200 vessels, and none."""
    crowd, nobody = Tick(), Tick()
    busy, idle = ticks_ms(Harbour().until, crowd), ticks_ms(lambda now_us: b"", nobody)
    known = len(crowd.traffic.picture.vessels)
    base = ticks_ms(lambda now_us: b"", Bare())
    return [
        row(f"traffic: vessels known of {VESSELS}", float(known), "", float(VESSELS), at_least=True),
        row(f"traffic: tick, {VESSELS} vessels, {LINKS} links, median", share_of(busy, 0.5), "ms"),
        row(f"traffic: tick, {VESSELS} vessels, {LINKS} links, 99 %", share_of(busy, 0.99), "ms", BUDGET_MS),
        row(f"traffic: tick, {VESSELS} vessels, {LINKS} links, worst", max(busy), "ms"),
        row("traffic: tick, nobody, median", 1e3 * (share_of(idle, 0.5) - share_of(base, 0.5)), "us", IDLE_US),
    ]


class Bare(Tick):
    """The same tick without anything for other vessels: what the measuring itself costs."""

    def step(self, now_us: int, data: bytes) -> TrafficPicture:
        state = EstimatedState(now_us, *HERE, x_m=0.0, y_m=0.0, vx_mps=1.5, vy_mps=0.0, psi_rad=0.0, sog_mps=1.5)
        snapshot_of(now_us, state, self.traffic.picture)
        for _, outbox in self.links:
            outbox.take(now_us, 1200)
        return self.traffic.picture


def encounter_figures() -> list[dict[str, Any]]:
    """How long 10 000 random encounters take on this computer's cores, by some hundred of them."""
    rows: list[dict[str, Any]] = []
    for name, program, count in (("CPython", COMPANION, ENCOUNTERS), ("PyPy", PYPY, PYPY_ENCOUNTERS)):
        if not program.exists():
            print("    no PyPy here (make pypy): its figures are left out", file=sys.stderr)
            continue
        began = time.monotonic()
        said(program, *f"sim --encounters random --count {count} --seed 1 --json".split())
        seconds = time.monotonic() - began
        rows.append(row(f"encounters judged, {name}: a minute, {cores()} cores", 60.0 * count / seconds, ""))
        hours = seconds / count * LONG / 3600.0
        rows.append(row(f"encounters judged, {name}: {LONG} of them", hours, "h", LIMIT_H))
    return rows


def run() -> list[dict[str, Any]]:
    """All figures."""
    return [*tick_figures(), *encounter_figures()]


if __name__ == "__main__":
    print(json.dumps(run(), indent=1))
