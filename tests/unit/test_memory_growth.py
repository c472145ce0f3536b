"""What a process keeps has an end: at rest no table grows but those with a bound, and the bounds are small."""

from __future__ import annotations

from collections import OrderedDict, deque

import pytest

import config as shipped
from companion.settings import load
from sitl.world import SimSettings, World
<<<<<<< HEAD
from tools.benches import memory
=======
from tests.held import globals_of, walk
from tools import bench_memory
>>>>>>> a26ca5e (Tests: what a reader and a vessel hold is found by walking from them; equal disks are looked at once)

BOUNDED = {"Air", "KeptLedger", "Ledger", "DuplicateFilter", "WaterSpeedObserver", "CommandServer", "RadioModule"}
"""Their own tests hold the bounds: packets, an hour's transmissions, frames against duplicates, ..."""


def lengths(world):
    """Every container that the world or our modules hold, by its identity: itself, its length, and who leads to it."""
    kinds = (list, dict, set, deque, OrderedDict)
    roots = [held for name in ("companion", "mavlink_bridge", "sitl") for held in globals_of(name)]
    return {id(item): (item, len(item), by) for item, by in walk(world, *roots) if isinstance(item, kinds)}


def test_at_rest_with_three_stations_nothing_grows_that_has_no_bound(tmp_path):
    world = World(load(shipped.path("sim.toml"), ["operator.gcs_required=false"], SimSettings), 1, run_dir=tmp_path)
<<<<<<< HEAD
    memory.rest(world, 60, 3)
    before = {key: length for key, (_, length) in lengths().items()}
    memory.rest(world, 60, 3)
    grown = [item for key, (item, length) in lengths().items() if length > before.get(key, length) + 20]
    mine = [item for item in grown if not owners(item) & BOUNDED and "frame" not in owners(item, 1)]
    assert [(type(item).__name__, len(item), sorted(owners(item))) for item in mine] == []
=======
    bench_memory.rest(world, 60, 3)
    before = {key: length for key, (_, length, _) in lengths(world).items()}
    assert len(before) > 500
    bench_memory.rest(world, 60, 3)
    grown = [(item, by) for key, (item, length, by) in lengths(world).items() if length > before.get(key, length) + 20]
    mine = [(type(item).__name__, len(item), by) for item, by in grown if not BOUNDED & set(by)]
    assert mine == []
>>>>>>> a26ca5e (Tests: what a reader and a vessel hold is found by walking from them; equal disks are looked at once)


def test_a_simulation_remembers_half_an_hour_of_packets():
    world = World(load(shipped.path("sim.toml"), (), SimSettings), 1)
    assert world.surroundings.radio.air.log.maxlen == 2_000


@pytest.mark.soak
@pytest.mark.parametrize("stations", [0, 3])
def test_after_the_first_hour_memory_stands_still(tmp_path, stations):
    assert memory.growth_mb(tmp_path, 4.0, stations=stations) * 24.0 <= memory.DAY_BAR_MB * 2.0
