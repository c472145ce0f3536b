"""The depth memory piece by piece: what a cell says, what is forgotten first, and what counts as a shoal."""

from __future__ import annotations

import math

import pytest

from companion.core.guard.depth.grid import offset
from companion.core.guard.depth.memory import DepthMemory, DepthMemoryConfig
from companion.core.guard.depth.tiles import TILE_BYTES, Cell, cells, tile_of
from mavlink_bridge.language.messages import EstimatedState

HERE = (0.7188, -0.1519)
TILE_M = 16 * 2.0


def at(north_m, east_m=0.0, t_us=0, **more):
    lat, lon = offset(*HERE, north_m, east_m)
    return EstimatedState(t_us, lat_rad=lat, lon_rad=lon, x_m=north_m, y_m=east_m, **more)


def sounded(memory, *depths_m, north_m=0.0, utc_s=0):
    for depth_m in depths_m:
        memory.note(at(north_m), 0, depth_m, utc_s)
    memory.close_cell()
    return memory


def memory(**config):
    return DepthMemory(DepthMemoryConfig(**config), 0.05)


def test_a_cell_counts_and_knows_the_least_the_mean_and_the_newest():
    found = sounded(memory(), 5.0, 4.0, 6.0, utc_s=7)
    sounded(found, 5.0, utc_s=9)
    sounded(found, 5.0, utc_s=0)
    ((_, _, cell),) = found.known()
    assert (cell.soundings, cell.least_m, cell.last_s) == (5, 4.0, 9)
    assert cell.mean_m == pytest.approx(5.0)
    assert cell.squares == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("depths_m", "robust_m"),
    [
        ([5.0], 5.0),
        ([5.0] * 10, 5.0),
        ([4.96, 5.04] * 10, 5.0),
        ([4.0, 4.5, 5.0, 5.5, 6.0] * 4, 4.0),
        ([5.0] * 50 + [2.0], 4.2),
    ],
    ids=["one", "equal", "noise", "a slope in it", "one false echo"],
)
def test_the_robust_depth_is_the_shallow_side_of_the_bottom_and_not_of_the_noise(depths_m, robust_m):
    ((_, _, cell),) = sounded(memory(), *depths_m).known()
    assert cell.robust_m(0.05) == pytest.approx(robust_m, abs=0.12)


def test_a_long_stay_in_one_place_says_the_same_as_many_short_ones():
    """An hour at anchor with one fish: the spread belongs to all readings, not to the thousand that are counted."""
    depths_m = [5.0 + 0.05 * (-1) ** i for i in range(36_000)]
    depths_m[18_000:18_003] = [3.7] * 3
    ((_, _, once),) = sounded(memory(), *depths_m).known()
    many = memory()
    for begin in range(0, 36_000, 1000):
        sounded(many, *depths_m[begin : begin + 1000])
    ((_, _, often),) = many.known()
    assert once.soundings == often.soundings == 1000
    assert once.robust_m(0.05) > 4.9
    assert often.robust_m(0.05) > 4.5


@pytest.mark.parametrize("beside", [20, 200, 900])
def test_a_pinnacle_that_was_sounded_stays_however_long_the_boat_lies_beside_it_in_its_cell(beside):
    """Three readings at the top, which is what the input chain passes of one; then the drift beside it."""
    noise = [0.05 * (-1) ** i for i in range(beside)]
    for together in (True, False):
        found = sounded(memory(), 3.0, 3.05, 2.95, *([20.0 + each for each in noise] if together else []))
        if not together:
            sounded(found, *[20.0 + each for each in noise])
        assert found.shoals_near(at(0.0), 5.0, 4.0)


def test_old_soundings_weigh_less_in_the_end():
    found = sounded(memory(), *[3.0] * 5000)
    sounded(found, *[9.0] * 5000)
    ((_, _, cell),) = found.known()
    assert cell.soundings == 1000
    assert cell.mean_m == pytest.approx(6.0)
    for _ in range(10):
        sounded(found, *[9.0] * 1000)
    ((_, _, cell),) = found.known()
    assert cell.mean_m > 8.9


def test_a_sounding_belongs_where_the_vessel_was_when_it_was_measured():
    """A reading that was held for confirmation is two seconds old: at 2.5 m/s that is two cells back."""
    found = memory()
    found.note(at(100.0, t_us=2_000_000, vx_mps=2.5, vy_mps=0.0), 0, 5.0, 0)
    found.close_cell()
    ((lat, _, _),) = found.known()
    assert (lat - HERE[0]) * 6.36e6 == pytest.approx(95.0, abs=1.2)


def test_what_has_no_place_or_is_no_number_is_not_kept():
    found = memory()
    found.note(EstimatedState(0), 0, 5.0, 0)
    found.note(at(0.0), 0, math.nan, 0)
    found.close_cell()
    assert list(found.known()) == []


def test_the_tile_sailed_over_longest_ago_is_forgotten_first():
    found = memory(tiles_max=16)
    for i in range(16):
        sounded(found, 5.0, north_m=i * TILE_M)
    found.take_changes(100)
    sounded(found, 5.0, north_m=0.0)
    for i in (16, 17):
        sounded(found, 5.0, north_m=i * TILE_M)
    changed, gone = found.take_changes(100)
    assert len(found) == 16
    norths = [round((lat - HERE[0]) * 6.36e6 / TILE_M) for lat, _, _ in found.known()]
    assert 0 in norths, "it was sailed over again"
    assert 1 not in norths
    assert 2 not in norths
    assert len(gone) == 2
    assert len(changed) == 3
    sounded(found, 5.0, north_m=1.0 * TILE_M)
    oldest = tile_of(found.geometry.cell_of(*offset(*HERE, 3 * TILE_M, 0.0)))
    assert found.take_changes(100)[1] == [oldest]


def stored(*tiles, most=16):
    """A memory that takes back tiles, each (north in tiles, depth in m, date in s)."""
    source = memory(tiles_max=1000)
    for north, depth_m, utc_s in tiles:
        sounded(source, depth_m, north_m=north * TILE_M, utc_s=utc_s)
    found = memory(tiles_max=most)
    for key, tile in source.take_changes(1000)[0]:
        assert found.restore(key, tile)
    found.restored()
    return found


def norths_of(found):
    return [round((lat - HERE[0]) * 6.36e6 / TILE_M) for lat, _, _ in found.known()]


def test_every_tile_of_the_store_is_kept_and_looked_at_however_many_there_are():
    """4404 of 6404 imported tiles had been deleted from the store at the first start, the bar 60 m ahead with them."""
    found = stored(*[(i, 3.0 if i in (2, 37) else 20.0, 0) for i in range(40)])
    assert len(found) == 40
    assert found.take_changes(100) == ([], []), "nothing is deleted"
    assert norths_of(found) == list(range(40))
    for i in (2, 37):
        assert found.shoals_near(at(i * TILE_M - 10.0), 15.0, 4.0)
        assert not found.shoals_near(at(i * TILE_M - 100.0), 15.0, 4.0)
        sounded(found, 3.0, north_m=i * TILE_M)
        ((key, tile),) = found.take_changes(100)[0]
        assert [cell.soundings for _, cell in cells(key, tile)] == [2], "a sounding joins what is known there"
    assert found.forget_near(*offset(*HERE, 5 * TILE_M, 0.0), 10.0) == (1, 20.0)
    assert 5 not in norths_of(found)


def test_imports_leave_voyages_their_room_and_stay_however_long_a_voyage_is():
    dated, undated = [(i, 9.0, 1000 - i) for i in range(10)], [(i, 3.0 + i, 0) for i in range(10, 20)]
    found = stored(*dated, *undated, most=16)
    for i in range(18):
        sounded(found, 9.0, north_m=(50 + i) * TILE_M, utc_s=2000 + i)
        assert len(found) == min(21 + i, 26), "16 of voyages, 10 imported"
        assert found.forgotten == max(0, i - 5)
        if i == 15:
            assert [i for i in range(20) if i not in norths_of(found)] == [*range(10)]
    assert norths_of(found) == [*range(10, 20), *range(52, 68)], "the oldest of the voyage itself goes"


def test_where_imports_leave_a_voyage_no_room_they_go_the_deepest_first(monkeypatch):
    monkeypatch.setattr("companion.core.guard.depth.memory.TILES_MOST", 20)
    found = stored(*[(i, 3.0 + i, 0) for i in range(20)])
    for i in range(18):
        sounded(found, 9.0, north_m=(50 + i) * TILE_M, utc_s=2000 + i)
    assert norths_of(found) == [*range(4), *range(52, 68)], "16 of the voyage"


def test_an_imported_tile_that_is_sailed_over_belongs_to_the_voyage():
    found = stored(*[(i, 3.0, 0) for i in range(4)])
    sounded(found, 3.0, north_m=2 * TILE_M, utc_s=2000)
    for i in range(18):
        sounded(found, 9.0, north_m=(50 + i) * TILE_M, utc_s=3000 + i)
    assert [i for i in norths_of(found) if i < 50] == [0, 1, 3]
    assert len(found) == 20


def test_voyages_that_the_store_holds_too_many_of_stay_until_new_ones_come():
    found = stored(*[(i, 9.0, 1000 + i) for i in range(40)])
    for i in (50, 51):
        sounded(found, 9.0, north_m=i * TILE_M, utc_s=3000)
    assert norths_of(found) == [*range(2, 40), 50, 51]


def test_what_is_sounded_after_the_tile_was_packed_counts_at_once():
    found = stored(*[(i, 9.0, 0) for i in range(40)])
    assert not found.shoals_near(at(0.0), 20.0, 4.0)
    sounded(found, 3.0, north_m=4.0)
    assert found.shoals_near(at(0.0), 20.0, 4.0)


def test_changes_are_taken_in_portions_and_put_back():
    found = memory()
    for i in range(5):
        sounded(found, 5.0, north_m=i * TILE_M)
    first, _ = found.take_changes(3)
    rest, _ = found.take_changes(100)
    assert (len(first), len(rest)) == (3, 2)
    assert found.take_changes(100) == ([], [])
    found.put_back([key for key, _ in first], [(1, 1)])
    again, gone = found.take_changes(100)
    assert again == first
    assert gone == [(1, 1)]


def test_only_proven_shallow_cells_are_shoals():
    """One sounding of 3.95 m may be noise over 4.05 m; thirteen of them are a bottom."""
    for depths_m, shoal in (
        ([3.95], False),
        ([3.85], True),
        ([3.95] * 13, True),
        ([4.0] * 13, False),
        ([3.85] + [4.3] * 9, False),
    ):
        assert sounded(memory(), *depths_m).shoals_near(at(0.0), 5.0, 4.0) == shoal, depths_m


def test_a_shoal_that_was_dredged_is_none_in_the_end():
    found = sounded(memory(), *[3.0] * 10)
    assert found.shoals_near(at(0.0), 5.0, 4.0)
    assert found.shoal_at(at(0.0).lat_rad, at(0.0).lon_rad) == pytest.approx(3.0)
    for _ in range(60):
        sounded(found, *[9.0] * 900)
    assert not found.shoals_near(at(0.0), 5.0, 4.0)


def test_a_new_limit_is_judged_anew_and_without_a_place_there_is_nothing():
    found = sounded(memory(), *[4.5] * 10)
    assert not found.shoals_near(at(0.0), 5.0, 4.0)
    assert found.shoals_near(at(0.0), 5.0, 5.0)
    assert not found.shoals_near(at(0.0), 5.0, 4.0)
    assert not found.shoals_near(EstimatedState(0), 5.0, 5.0)


def test_the_open_cell_does_not_count_until_it_is_left():
    found = memory()
    for _ in range(10):
        found.note(at(0.0), 0, 2.0, 0)
    assert not found.shoals_near(at(0.0), 5.0, 4.0)
    found.note(at(3.0), 0, 2.0, 0)
    assert found.shoals_near(at(0.0), 5.0, 4.0)


def passes(*tops_m, gap_s=60, utc_s=1_000_000):
    """Passes over one cell, each nine soundings of 9 m and one of a top; then five thousand of 9 m."""
    found = memory()
    for number, top_m in enumerate(tops_m):
        for depth_m in (*[9.0] * 9, top_m):
            found.note(at(3.0), 0, depth_m, utc_s + number * gap_s if utc_s else 0)
        found.close_cell()
    for _ in range(5):
        for _ in range(1000):
            found.note(at(3.0), 0, 9.0, utc_s + 1000 if utc_s else 0)
        found.close_cell()
    return found


@pytest.mark.parametrize(
    ("tops_m", "more", "stays"),
    [
        ((3.0, 3.1), {}, True),
        ((3.0, 9.0, 3.1), {}, True),
        ((3.1, 3.0, 5.0), {}, True),
        ((3.0,), {}, False),
        ((3.0, 9.0), {}, False),
        ((5.0, 5.0, 3.0), {}, False),
        ((3.0, 3.1), {"gap_s": 59}, False),
        ((3.0, 3.1), {"utc_s": 0}, False),
    ],
    ids=["twice", "with one beside", "then less", "once", "then not", "another top", "one pass", "no clock"],
)
def test_what_was_sounded_on_two_passes_is_never_averaged_away(tops_m, more, stays):
    found = passes(*tops_m, **more)
    again = memory()
    for key, tile in found.take_changes(100)[0]:
        assert again.restore(key, tile)
    again.restored()
    for known in (found, again):
        assert known.shoals_near(at(0.0), 5.0, 4.0) == stays
    assert found.forget_near(at(3.0).lat_rad, at(3.0).lon_rad, 2.0)[0]
    assert not found.shoals_near(at(0.0), 5.0, 4.0)


def test_noise_over_a_level_bottom_is_no_top_however_often_it_is_passed():
    found = memory()
    for number in range(50):
        for depth_m in (4.1, 4.15, 4.2):
            found.note(at(3.0), 0, depth_m, 1_000_000 + 60 * number)
        found.close_cell()
    assert not found.shoals_near(at(0.0), 5.0, 4.12)


def test_a_tile_with_impossible_numbers_is_refused():
    (key, tile), *_ = sounded(memory(), 5.0).take_changes(1)[0]
    found = memory()
    place = next(i for i in range(0, TILE_BYTES, 16) if tile[i])
    for at_byte, noise in (
        (4, b"\x00\x00\xc0\x7f"),
        (8, b"\x00\x00\x80\x7f"),
        (8, b"\x00\x00\x80\xbf"),
        (0, b"\xff\xff"),
    ):
        damaged = tile[: place + at_byte] + noise + tile[place + at_byte + len(noise) :]
        assert not found.restore(key, damaged)
    assert found.restore(key, tile)
    assert Cell(1, 5.0, 5.0, 0.0, 0) == next(found.known())[2]
