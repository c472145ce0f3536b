"""Benchmarks of what recording costs a tick, and of reading a recording again."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import config as shipped
from companion.io.recording import Recorder
from companion.io.recording.truth import truth_row
from companion.settings import load
from mavlink_bridge.mavlink.wire import tlog
from sitl.world import SimSettings, World
from tools.figures import row

TICKS = 4000
RUNS = 3


def run() -> list[dict[str, Any]]:
    """Microseconds of processor time per tick; the best of several runs."""
    with tempfile.TemporaryDirectory() as folder:
        world = World(load(shipped.path("sim.toml"), (), SimSettings), 1)
        world.run(10.0)
        snapshot = world.snapshot
        assert snapshot is not None
        recorder = Recorder(Path(folder) / "run")
        inputs = recorder.inputs
        inputs.start({})
        frame, line = bytes((0xFD, 28)) + bytes(38), b"$GPGGA" + bytes(70)
        truth = (1.0, 41.18, -8.7, 12.3, 4.5, 88.0, 1.0, 0.1, 0.1, 1.1, 0.5, 0.5, 1.0, 1.0, 10.0, 9.5, b"Auto", 1, 2)

        def tick(number: int) -> None:
            inputs.begin("tick", number * 50_000, utc_us=number)
            inputs.wrote(1, 0, line, len(line), True)
            for link in (2, 3, 4):
                inputs.wrote(link, 0, frame, 40, False)
                recorder.frames(tlog.pack_output(number, link, frame))
            recorder.tick(snapshot)
            truth_row(truth)

        cost = _best(tick)
        recorder.close(0)
    return [row("recorder: cost of a tick, three endpoints and truth", cost, "us", 30.0)]


def _best(step: Callable[[int], None]) -> float:
    found = []
    for _ in range(RUNS):
        began = time.process_time()
        for number in range(TICKS):
            step(number)
        found.append((time.process_time() - began) / TICKS * 1e6)
    return min(found)


if __name__ == "__main__":
    print(json.dumps(run(), indent=1))
