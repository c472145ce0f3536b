"""A run that is stopped by what an earlier one had sounded replays bit for bit: the memory at the start is a recorded input."""

from __future__ import annotations

import math

import config as shipped
from companion.io.keeping.store import MemoryStore
from companion.io.recording.inputs import InputReader
from companion.replay import replay
from companion.settings.schema import load
from mavlink_bridge.language.requests import Arm, GuidedHeading
from sitl.world.settings import SimSettings
from sitl.world.world import World

BANK = (
    "operator.gcs_required=false",
    "world.bottom.mounds=[]",
    "world.bottom.slope.bearing_deg=0",
    "world.bottom.slope.start_m=5",
    "world.bottom.slope.gradient=0.5",
    "depth.rate_look_ahead=false",
    "depth.memory.save_s=5",
)


def sail(store, run_dir=None, seed=1, seconds=45.0):
    """North at the bank; return the texts and how far it came."""
    world = World(load(shipped.path("sim.toml"), BANK, SimSettings), seed, run_dir=run_dir, store=store)
    texts, north_m = [], -math.inf
    for number in range(round(20 * seconds)):
        if number == 100:
            world.app.submit(Arm(True))
            world.app.submit(GuidedHeading(0.0, 1.5))
        north_m = max(north_m, world.step().north_m)
        texts += [item.text for item in world.snapshot.texts]
    world.shutdown(world.now_us)
    return texts, north_m


def test_the_second_voyage_replays_with_the_memory_that_it_began_with(tmp_path):
    store = MemoryStore()
    _, first_m = sail(store)
    kept = store.snapshot()
    texts, second_m = sail(store, tmp_path / "run", seed=2)
    assert any("Shallow water ahead (sounded before" in text for text in texts)
    assert second_m < first_m - 1.0
    reader = InputReader(tmp_path / "run" / "inputs.bin")
    assert reader.store["depth"] == dict(kept.depth)
    reader.close()
    outcome = replay(tmp_path / "run")
    assert outcome.identical, outcome.differences[:3]
    assert outcome.rows_compared > 800
    assert outcome.writes_compared > 800
    without = replay(tmp_path / "run", changes=["depth.memory.enabled=false"])
    assert not without.identical, "the memory is what stopped it"
    assert len(store.snapshot().depth) >= len(kept.depth), "and the second voyage added to it"
