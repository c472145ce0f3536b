"""Benchmarks of the sensor chain: sentences per second from bytes to estimate, and what a tick costs when flooded.

``run()`` returns rows {name, value, unit, bar, holds} for ``make bench``. Times are processor time of this thread, so that
a busy machine does not count; each figure is the best of several runs.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

from companion.core.estimate import Estimator, EstimatorConfig
from companion.core.nmea import NmeaConfig, NmeaReader
from sitl.sensors import SimulatedSensors
from tools.benches.cells.sensor_rig import SensorRig, circle, truth_at

TICK_US = 50_000
SECONDS = 20
RUNS = 5


def _chunks(*, flood: int = 1, config: SimulatedSensors | None = None) -> list[bytes]:
    """What the default sensors send per tick."""
    motion = circle(20.0, 1.5)
    suite = SensorRig(motion, sensors=config).suite
    suite.faults.flood = flood
    times = range(TICK_US, SECONDS * 1_000_000 + 1, TICK_US)
    return [b"".join(suite.step(now_us, truth_at(motion, now_us))) for now_us in times]


def _chain(chunks: list[bytes]) -> list[float]:
    """Feed the chain tick by tick; return each tick's processor time in seconds."""
    reader, estimator = NmeaReader(NmeaConfig()), Estimator(EstimatorConfig())
    spent: list[float] = []
    now_us = 0
    for chunk in chunks:
        now_us += TICK_US
        start = time.thread_time()
        for item in (*reader.receive(chunk, now_us), *reader.poll(now_us)):
            estimator.update(item)
        estimator.predict(now_us)
        spent.append(time.thread_time() - start)
    return spent


def _best(measure: Callable[[], float]) -> float:
    return min(measure() for _ in range(RUNS))


def run() -> list[dict[str, Any]]:
    """All figures."""
    plain, flooded = _chunks(), _chunks(flood=10)
    sentences = sum(chunk.count(b"$") for chunk in plain)
    whole_s = _best(lambda: sum(_chain(plain)))
    rate, tick_us = sentences / whole_s, whole_s / len(plain) * 1e6
    flood_us = _best(lambda: sorted(_chain(flooded))[int(0.99 * len(flooded))]) * 1e6
    return [
        _row("nmea bytes to estimate", rate, "sentences/s", 20_000.0, rate >= 20_000.0),
        _row("nmea and estimate per tick", tick_us, "us", None, None),
        _row("the same, tenfold flood, 99th percentile of ticks", flood_us, "us", 5_000.0, flood_us <= 5_000.0),
    ]


def _row(name: str, value: float, unit: str, bar: float | None, holds: bool | None) -> dict[str, Any]:
    return {"name": name, "value": round(value, 1), "unit": unit, "bar": bar, "holds": holds}


if __name__ == "__main__":
    print(json.dumps(run(), indent=1))
