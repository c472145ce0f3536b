"""What a process keeps has an end: at rest no table grows but those with a bound, and the bounds are small."""

from __future__ import annotations

import gc
from collections import OrderedDict, deque

import pytest

import config as shipped
from companion.settings import load
from sitl.world import SimSettings, World
from tools.benches import memory

BOUNDED = {"Air", "KeptLedger", "Ledger", "DuplicateFilter", "WaterSpeedObserver", "CommandServer", "RadioModule"}
"""Their own tests hold the bounds: packets, an hour's transmissions, frames against duplicates, ..."""


def lengths():
    """Every container by its identity, with its length and owner-to-be-found."""
    gc.collect()
    kinds = (list, dict, set, deque, OrderedDict)
    return {id(item): (item, len(item)) for item in gc.get_objects() if isinstance(item, kinds)}


def owners(item, depth=2):
    """Names of the classes that hold a container."""
    names = set()
    for holder in gc.get_referrers(item):
        names.add(type(holder).__name__)
        if depth > 1 and isinstance(holder, dict):
            names |= owners(holder, depth - 1)
    return names


def test_at_rest_with_three_stations_nothing_grows_that_has_no_bound(tmp_path):
    world = World(load(shipped.path("sim.toml"), ["operator.gcs_required=false"], SimSettings), 1, run_dir=tmp_path)
    memory.rest(world, 60, 3)
    before = {key: length for key, (_, length) in lengths().items()}
    memory.rest(world, 60, 3)
    grown = [item for key, (item, length) in lengths().items() if length > before.get(key, length) + 20]
    mine = [item for item in grown if not owners(item) & BOUNDED and "frame" not in owners(item, 1)]
    assert [(type(item).__name__, len(item), sorted(owners(item))) for item in mine] == []


def test_a_simulation_remembers_half_an_hour_of_packets():
    world = World(load(shipped.path("sim.toml"), (), SimSettings), 1)
    assert world.surroundings.radio.air.log.maxlen == 2_000


@pytest.mark.soak
@pytest.mark.parametrize("stations", [0, 3])
def test_after_the_first_hour_memory_stands_still(tmp_path, stations):
    assert memory.growth_mb(tmp_path, 4.0, stations=stations) * 24.0 <= memory.DAY_BAR_MB * 2.0
