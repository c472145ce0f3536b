"""Two voyages with a restart between them: what the first one has sounded stops the second one in better water."""

from __future__ import annotations

import functools
import math

import pytest

from companion.commands.store import write_store
from companion.io.keeping.content import StoredRow, rows_of
from companion.io.keeping.depth_store import soundings_of
from companion.io.keeping.store import MemoryStore, Store
from mavlink_bridge.language.messages import GuardState, Mode
from mavlink_bridge.language.requests import ManualInput
from tests.soaked import in_the_soak

KEEL_M = 0.35
BANK = ("world.bottom.mounds=[]", "world.bottom.slope.bearing_deg=0", "world.bottom.slope.start_m=20")
STEEP, GENTLE = "world.bottom.slope.gradient=0.5", "world.bottom.slope.gradient=0.2"
GUARD_ONLY = ("depth.rate_look_ahead=false", "depth.map_look_ahead=false")


def sail(voyage, store, *overrides, speed_mps=1.5, seed=1):
    """Sail north at the bank until stopped; return the voyage, and the least true altitude on the way."""
    trip = voyage(*overrides, seed=seed, store=store)
    trip.sail(speed_mps, (200.0, 0.0))
    least = math.inf
    for _ in range(20 * 160):
        trip.step()
        least = min(least, trip.truth.depth_m - KEEL_M)
        if trip.snapshot.mode is Mode.HOLD and trip.truth.u_mps < 0.05:
            break
    trip.world.shutdown(trip.world.now_us)
    return trip, least


@functools.cache
def sounded(voyage, gradient, speed_mps):
    """What the first voyage at a bank leaves, with the guard alone: the store's content, how it ended, its least altitude."""
    store = MemoryStore()
    trip, least = sail(voyage, store, *BANK, gradient, *GUARD_ONLY, speed_mps=speed_mps)
    return store.snapshot(), trip, least


def from_disk(store, path):
    """What a restart finds: the content by way of a file. (In lock-step time a disk is too slow to be waited for.)"""
    assert write_store(
        path, [StoredRow(section, key, body) for (section, key), body in rows_of(store.snapshot()).items()]
    )
    on_disk = Store(path)
    on_disk.close()
    return MemoryStore(on_disk.snapshot())


@pytest.mark.parametrize(
    ("gradient", "speed_mps"), [(STEEP, 2.5), (GENTLE, 1.5), *in_the_soak((STEEP, 1.5), (GENTLE, 2.5))]
)
def test_the_second_voyage_stops_before_the_shoal_that_the_first_one_found(voyage, tmp_path, gradient, speed_mps):
    """Must hold: >= 4.0 m true altitude on the second voyage; the first, with the guard alone, got into less."""
    content, first, reached = sounded(voyage, gradient, speed_mps)
    assert reached < 3.9
    assert first.snapshot.guard in (GuardState.CORRECTION, GuardState.LOCKED)
    store = from_disk(MemoryStore(content), tmp_path / "companion.db")
    second, least = sail(voyage, store, *BANK, gradient, "depth.rate_look_ahead=false", speed_mps=speed_mps, seed=2)
    assert any("Depth memory: " in text for text in second.texts)
    assert any("Shallow water ahead (sounded before" in text for text in second.texts)
    assert least >= 4.0
    assert second.snapshot.guard is GuardState.OK
    third, again = sail(voyage, MemoryStore(), *BANK, gradient, "depth.rate_look_ahead=false", speed_mps=speed_mps)
    assert again < 3.9, "without the store it is as the first time"
    assert not any("Depth memory" in text for text in third.texts)


def test_a_higher_tide_lets_it_on_and_a_lower_one_stops_it_earlier(voyage):
    """What is remembered is below chart datum: the tide of the day is added, as with a chart."""
    reached = {}
    content, _, _ = sounded(voyage, GENTLE, 2.5)
    for tide_m in (0.0, 0.5, -0.5):
        store = MemoryStore(content)
        trip, _ = sail(voyage, store, *BANK, GENTLE, "depth.rate_look_ahead=false", f"depth.tide_m={tide_m}", seed=2)
        reached[tide_m] = trip.truth.north_m
    assert reached[-0.5] < reached[0.0] - 1.5
    assert reached[0.5] > reached[0.0] + 1.5


def test_it_sails_laps_near_the_limit_without_being_stopped_by_its_own_soundings(voyage):
    trip = voyage("world.bottom.kind=flat", "world.bottom.depth_m=4.5", "guidance.loiter_radius_m=10")
    trip.sail(
        1.5, (30.0, 0.0), (30.0, 30.0), (0.0, 30.0), (0.0, 0.0), (30.0, 0.0), (30.0, 30.0), (0.0, 30.0), (0.0, 0.0)
    )
    trip.run(150.0)
    assert trip.snapshot.mode is Mode.AUTO
    assert not any("Shallow" in text for text in trip.texts)


def test_the_operator_backs_off_a_remembered_shoal_and_sails_home_and_may_switch_the_memory_off(voyage):
    """Stopped 5 m before the shoal there is no room to turn ahead; astern by hand there is."""
    store = MemoryStore(sounded(voyage, GENTLE, 1.5)[0])
    trip = voyage(*BANK, GENTLE, seed=2, store=store)
    trip.sail(1.5, (200.0, 0.0))
    trip.until(lambda: trip.snapshot.mode is Mode.HOLD, 120.0)
    trip.run(10.0)
    stopped_m = trip.truth.north_m
    assert trip.mode(Mode.AUTO).reason == ""
    trip.run(20.0)
    assert trip.truth.depth_m - KEEL_M >= 4.0, "the same order again is stopped again"
    assert trip.snapshot.mode is Mode.HOLD
    assert trip.mode(Mode.MANUAL).reason == ""
    for _ in range(20 * 12):
        trip.world.app.submit(ManualInput(-0.6, 0.0, 255))
        trip.step()
    trip.plan(1.5, (0.0, 0.0))
    assert trip.mode(Mode.AUTO).reason == ""
    trip.run(30.0)
    assert trip.truth.north_m < stopped_m - 20.0
    assert trip.snapshot.mode is Mode.AUTO
    trip, least = sail(voyage, store, *BANK, GENTLE, "depth.rate_look_ahead=false", "depth.memory.enabled=false")
    assert least < 3.9


def test_the_store_holds_true_depths_where_they_were_sounded(voyage):
    content, trip, _ = sounded(voyage, GENTLE, 1.5)
    frame = trip.world.surroundings.plant.frame
    bottom = trip.world.surroundings.plant.bottom
    found = list(soundings_of(content))
    assert len(found) > 20
    for each in found:
        north, east = frame.to_local(math.radians(each.lat_deg), math.radians(each.lon_deg))
        assert abs(east) < 4.0
        assert each.depth_m == pytest.approx(bottom.depth_at(north, east), abs=0.5)
        assert each.least_m <= each.depth_m + 0.2
        assert each.utc_s > 1_600_000_000
