"""The depth memory under any voyage: bounded, equal across restarts, shallow rather than deep, and never worse than without."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings, strategies as st

from companion.core.board.wire import Version
from companion.core.guard.depth.ahead import DepthAhead
from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.grid import Sounding, build, offset
from companion.core.guard.depth.input import DepthInput
from companion.core.guard.depth.memory import DepthMemory, DepthMemoryConfig
from companion.core.guard.depth.tiles import TILE_BYTES, Cell, Geometry, tile_of
from companion.core.hull.geometry import HullGeometry
from companion.depth_keeper import DepthKeeper
from companion.io.keeping.store import MemoryStore
from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.requests import ACCEPTED, Reply, Result

HERE = (0.7188, -0.1519)
CONFIG = DepthMemoryConfig()
SMALL = DepthMemoryConfig(tiles_max=16)
soundings = st.lists(
    st.tuples(st.floats(-60.0, 60.0), st.floats(-60.0, 60.0), st.floats(-2.0, 90.0)), min_size=1, max_size=60
)


def at(north_m: float, east_m: float = 0.0, **more) -> EstimatedState:
    lat, lon = offset(*HERE, north_m, east_m)
    return EstimatedState(0, lat_rad=lat, lon_rad=lon, x_m=north_m, y_m=east_m, **more)


def filled(rows, memory=None) -> DepthMemory:
    memory = DepthMemory(CONFIG, 0.05) if memory is None else memory
    for north_m, east_m, depth_m in rows:
        memory.note(at(north_m, east_m), 0, depth_m, 1_800_000_000)
    memory.close_cell()
    return memory


def reborn(memory: DepthMemory) -> DepthMemory:
    changed, _ = memory.take_changes(10_000)
    again = DepthMemory(CONFIG, 0.05)
    assert all(again.restore(key, tile) for key, tile in changed)
    again.restored()
    return again


@given(soundings, soundings)
@settings(max_examples=40)
def test_a_restart_between_two_voyages_changes_nothing(first, second):
    whole = filled(second, filled(first))
    before = filled(first)
    again = filled(second, reborn(before))
    assert list(again.known()) == list(whole.known())


@given(
    soundings,
    st.lists(st.tuples(st.floats(-150.0, 150.0), st.floats(-150.0, 150.0)), max_size=25),
    st.floats(1.0, 40.0),
)
@settings(max_examples=60)
def test_no_shoal_within_reach_is_overlooked_wherever_the_vessel_comes_from(rows, track, reach_m):
    """Against asking every cell: the short cuts that make it cheap leave nothing out, and new soundings count at once."""
    memory = filled(rows[: len(rows) // 2])
    for number, (north_m, east_m) in enumerate([*track, (0.0, 0.0), (rows[0][0], rows[0][1])]):
        if number == len(track) // 2:
            filled(rows[len(rows) // 2 :], memory)
        state, near = at(north_m, east_m), []
        for lat, lon, cell in memory.known():
            sigma_m = max(0.05, 0.005 * abs(cell.mean_m))
            shallow = cell.robust_m(sigma_m) + 2.0 * sigma_m / math.sqrt(cell.soundings) < 4.0 - 1e-3
            away_m = math.hypot((lat - state.lat_rad) * 6378137.0, (lon - state.lon_rad) * 6378137.0 * math.cos(lat))
            near += [(lat, lon, cell.robust_m(sigma_m))] if shallow and away_m < reach_m - 3.0 else []
        found = memory.shoals_near(state, reach_m, 4.0)
        assert found or not near
        for lat, lon, depth_m in near:
            assert memory.shoal_at(lat, lon, 1) <= depth_m + 1e-6


@given(soundings)
@settings(max_examples=40)
def test_every_sounding_is_counted_and_the_robust_depth_is_on_the_shallow_side(rows):
    found = list(filled(rows).known())
    assert sum(cell.soundings for *_, cell in found) == len(rows)
    assert min(cell.least_m for *_, cell in found) <= min(depth for *_, depth in rows) + 1e-6
    for *_, cell in found:
        assert cell.least_m - 0.001 <= cell.robust_m(0.05) + 1e-4
        assert cell.robust_m(0.05) <= cell.mean_m + 1e-4


@given(soundings, st.integers(16, 20))
@settings(max_examples=30)
def test_the_memory_is_bounded_and_forgets_what_is_longest_ago(rows, most):
    memory = DepthMemory(DepthMemoryConfig(cell_m=0.5, tiles_max=most), 0.05)
    filled(rows, memory)
    assert len(memory) <= most
    _, gone = memory.take_changes(10_000)
    last = memory.geometry.cell_of(*(offset(*HERE, *rows[-1][:2])))
    assert (last[0] >> 4, last[1] >> 4) not in gone


@given(soundings, soundings, st.integers(1, 4))
@settings(max_examples=40)
def test_tiles_that_lie_packed_are_the_same_as_those_that_do_not(first, second, room):
    """A memory that takes back more than it has room for, against one with room for all of it."""
    changed, _ = filled(first, DepthMemory(DepthMemoryConfig(cell_m=0.5), 0.05)).take_changes(10_000)
    found = []
    for most in (room, 10_000):
        memory = DepthMemory(DepthMemoryConfig.model_construct(cell_m=0.5, tiles_max=most), 0.05)
        assert all(memory.restore(key, tile) for key, tile in changed)
        memory.restored()
        there = {key for key, _ in changed}
        again = [row for row in second if tile_of(memory.geometry.cell_of(*offset(*HERE, *row[:2]))) in there]
        near = [memory.shoals_near(at(north_m, east_m), 20.0, 9.0) for north_m, east_m, _ in second]
        filled(again, memory)
        near += [memory.shoals_near(at(north_m, east_m), 20.0, 9.0) for north_m, east_m, _ in second]
        found.append((list(memory.known()), near, memory.take_changes(10_000), memory.forgotten))
    assert found[0] == found[1]


@given(st.binary(min_size=0, max_size=64), st.integers(0, TILE_BYTES - 1), soundings)
@settings(max_examples=60)
def test_damaged_tiles_are_refused_or_harmless(noise, place, rows):
    ((key, tile), *_), _ = filled(rows).take_changes(10_000)
    damaged = (tile[:place] + noise + tile[place + len(noise) :])[:TILE_BYTES]
    memory = DepthMemory(CONFIG, 0.05)
    if memory.restore(key, damaged):
        memory.restored()
        assert all(math.isfinite(cell.robust_m(0.05)) for *_, cell in memory.known())
        memory.shoals_near(at(0.0), 30.0, 4.0)
    assert not memory.restore(key, damaged[:-1])


@given(st.floats(-80.0, 80.0), st.floats(-179.9, 179.9), st.sampled_from((0.5, 2.0, 10.0)))
@settings(max_examples=60)
def test_a_cell_is_near_its_place_and_square_anywhere(lat_deg, lon_deg, cell_m):
    geometry = Geometry(cell_m)
    lat, lon = math.radians(lat_deg), math.radians(lon_deg)
    row, column = geometry.cell_of(lat, lon)
    mid_lat, mid_lon = geometry.centre(row, column)
    assert abs(mid_lat - lat) * 6.4e6 <= 0.51 * cell_m * 1.01
    assert abs(mid_lon - lon) * 6.4e6 * math.cos(lat) <= 0.51 * cell_m * 1.02
    assert geometry.cell_of(mid_lat, mid_lon) == (row, column)


@given(st.lists(st.floats(2.0, 9.0), min_size=1, max_size=30), st.lists(st.floats(2.0, 9.0), min_size=1, max_size=30))
def test_joining_is_the_same_as_having_sounded_it_all_at_once(first, second):
    def cell(values):
        mean = sum(values) / len(values)
        return Cell(len(values), min(values), mean, sum((value - mean) ** 2 for value in values), 1)

    joined, whole = cell(first).joined(cell(second)), cell(first + second)
    assert joined.mean_m == pytest.approx(whole.mean_m)
    assert joined.squares == pytest.approx(whole.squares, abs=1e-9)
    assert joined.least_m == whole.least_m


@given(
    st.lists(st.tuples(st.floats(0.0, 40.0), st.floats(-6.0, 6.0), st.floats(1.0, 9.0)), min_size=1, max_size=25),
    st.floats(1.0, 9.0),
    st.floats(0.0, 2.5),
)
@settings(max_examples=50)
def test_own_soundings_never_make_a_chart_deeper(rows, charted_m, speed_mps):
    """With a memory the look-ahead stops wherever it stops without one, and never knows of more water."""
    config = DepthGuardConfig()
    chart = build([Sounding(*offset(*HERE, north, 0.0), charted_m) for north in range(4, 40, 4)], 2.0, 4.0)
    state = at(0.0, sog_mps=speed_mps, cog_rad=0.0, psi_rad=0.0)
    looks = []
    for memory in (None, filled(rows)):
        ahead = DepthAhead(config, memory, HullGeometry(beam_m=1.1))
        ahead.map = chart
        looks.append(
            ahead.look(0, state, 6.0, DepthInput(config.input, HullGeometry()), None, lambda speed: 2.3 * speed)
        )
    without, with_it = looks
    assert with_it.stop >= without.stop
    if without.map_least_m is not None:
        assert with_it.map_least_m <= without.map_least_m


def test_what_the_store_would_not_take_is_handed_on_again():
    memory, store = filled([(0.0, 0.0, 5.0)]), MemoryStore()
    answers = []
    keeper = DepthKeeper(memory, CONFIG, lambda op, answer: answers.append((op, answer)))
    keeper.save(0)
    keeper.save(10_000_000)
    assert len(answers) == 1, "one at a time"
    answers[0][1](Reply(Result.FAILED, "no space on the disk"))
    keeper.save(20_000_000)
    assert answers[1][0] == answers[0][0]
    answers[1][1](ACCEPTED)
    keeper.save(30_000_000)
    assert len(answers) == 2, "nothing new"
    store.submit(answers[1][0])
    store.completions()
    later = DepthKeeper(again := DepthMemory(CONFIG, 0.05), CONFIG, lambda op, answer: None)
    assert later.restore({**store.snapshot().depth, "2000/1/1": "AAAA", "500/1/1": "AAAA", "x": ""}) == [
        "Depth memory: 1 tiles of earlier voyages",
        "Depth memory: 2 tiles are damaged and left out",
        "Depth memory: 1 tiles of another cell size are not used (depth.memory.cell_m)",
    ]
    assert list(again.known()) == list(memory.known())


def test_at_the_end_of_a_run_all_of_it_is_handed_on_after_a_disk_in_trouble():
    """Of a hundred tiles that could not be written 64 were; the rest was lost."""
    memory = filled([(float(north), 0.0, 5.0) for north in range(0, 16_000, 20)])
    handed = []
    keeper = DepthKeeper(memory, CONFIG, lambda op, answer: handed.append(op))
    keeper.save(0)
    first = len(handed[0].tiles)
    assert first == 64
    keeper.close(1)
    assert sum(len(op.tiles) for op in handed) == len(memory)


def test_that_the_memory_is_full_is_told_once():
    memory, told = filled([(north * 40.0, 0.0, 5.0) for north in range(16)], DepthMemory(SMALL, 0.05)), []
    keeper = DepthKeeper(memory, SMALL, lambda op, answer: answer(ACCEPTED), told.append)
    keeper.save(0)
    assert told == []
    for north in range(16, 20):
        filled([(north * 40.0, 0.0, 5.0)], memory)
        keeper.save(north * 10_000_000)
    assert told == ["Depth memory is full (16 tiles): the oldest go. Raise depth.memory.tiles_max"]


def test_a_real_store_keeps_no_soundings_of_a_simulated_sea():
    """Without --simulated, 'companion run' beside a simulated world had written them into the boat's own store, and told nothing."""
    for world, board, kept in (("real", "TWIN", 0), ("real", "UNO", 1), ("simulated", "TWIN", 1)):
        memory, handed, told = filled([(0.0, 0.0, 5.0)]), [], []
        keeper = DepthKeeper(memory, CONFIG, lambda op, answer, handed=handed: handed.append(op), told.append)
        keeper.restore({}, world)
        for version in (None, Version(1, "1.0", board, 500), Version(1, "1.0", board, 500)):
            keeper.heed_board(version)
        keeper.save(0)
        keeper.close(1)
        assert (len(handed), len(told)) == (kept, 1 - kept)
        assert all("SIMULATED BOARD" in text for text in told)
