"""What a process keeps has an end: at rest no table grows but those with a bound, and the bounds are small."""

from __future__ import annotations

from collections import OrderedDict, deque

import pytest

import config as shipped
from companion.settings import load
from sitl.world import SimSettings, World
from tests.held import globals_of, walk
from tools.benches import memory

BOUNDED = {"Air", "KeptLedger", "Ledger", "DuplicateFilter", "WaterSpeedObserver", "CommandServer", "RadioModule"}
"""Their own tests hold the bounds: packets, an hour's transmissions, frames against duplicates, ..."""


def lengths(world):
    """Every container that the world or our modules hold, by its identity: itself, its length, and who leads to it."""
    kinds = (list, dict, set, deque, OrderedDict)
    roots = [held for name in ("companion", "mavlink_bridge", "sitl") for held in globals_of(name)]
    return {id(item): (item, len(item), by) for item, by in walk(world, *roots) if isinstance(item, kinds)}


def test_at_rest_with_three_stations_nothing_grows_that_has_no_bound(tmp_path):
    world = World(load(shipped.path("sim.toml"), ["operator.gcs_required=false"], SimSettings), 1, run_dir=tmp_path)
    memory.rest(world, 60, 3)
    before = {key: length for key, (_, length, _) in lengths(world).items()}
    assert len(before) > 500
    memory.rest(world, 60, 3)
    grown = [(item, by) for key, (item, length, by) in lengths(world).items() if length > before.get(key, length) + 20]
    mine = [(type(item).__name__, len(item), by) for item, by in grown if not BOUNDED & set(by)]
    assert mine == []


def test_a_simulation_remembers_half_an_hour_of_packets():
    world = World(load(shipped.path("sim.toml"), (), SimSettings), 1)
    assert world.surroundings.radio.air.log.maxlen == 2_000


@pytest.mark.soak
@pytest.mark.parametrize("stations", [0, 3])
def test_after_the_first_hour_memory_stands_still(tmp_path, stations):
    assert memory.growth_mb(tmp_path, 4.0, stations=stations) * 24.0 <= memory.DAY_BAR_MB * 2.0
