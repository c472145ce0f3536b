"""Worlds do not mix: whose a store is stands in it, and what is another world's, unmarked or emptied is told and not used."""

from __future__ import annotations

import sqlite3

import pytest

from companion.io.keeping.content import SaveParam, SavePlan
from companion.io.keeping.mark import ASIDE, WorldKind, departure_refusal
from companion.io.keeping.store import MIGRATIONS, Store
from mavlink_bridge.language.requests import PlanItem, PlanKind
from tests.replay.first_release import unpack

ITEMS = (PlanItem(16, 6, 0.0, 2.0, 0.1, 1.0, 411822000, -87063000, 0.0),)


def saved(path, world):
    """A store of one world with a parameter and a plan; its content."""
    store = Store(path, world=world)
    store.submit(SaveParam("DEPTH_MIN", 0.5))
    store.submit(SavePlan(PlanKind.MISSION, ITEMS))
    store.close()
    return reopened(path, world)[0]


def reopened(path, world=WorldKind.REAL):
    store = Store(path, world=world)
    store.close()
    return store.snapshot(), store.warnings


@pytest.mark.parametrize("world", WorldKind)
def test_a_store_knows_its_world_and_a_vessel_that_no_other_store_has(tmp_path, world):
    one, other = saved(tmp_path / "a.db", world), saved(tmp_path / "b.db", world)
    assert one.world == other.world == world.value
    assert len(one.vessel) == 32
    assert one.vessel != other.vessel
    assert reopened(tmp_path / "a.db", world)[0].vessel == one.vessel


def test_a_simulations_store_in_a_boats_place_is_set_aside_unharmed_and_bars_the_departure(tmp_path):
    path = tmp_path / "companion.db"
    saved(path, WorldKind.SIMULATED)
    before = path.read_bytes()
    for _ in range(3):  # a restart does not make it good
        content, warnings = reopened(path)
        assert content.world == "real"
        assert content.params == {}
        assert content.plans == {}
        assert "companion.db.simulated-1" in departure_refusal(content)
        assert "companion store adopt" in departure_refusal(content)
    assert (tmp_path / "companion.db.simulated-1").read_bytes() == before
    assert warnings == ()


def test_a_boats_store_is_never_opened_for_writing_by_a_simulation(tmp_path):
    path = tmp_path / "companion.db"
    for made in (lambda: saved(path, WorldKind.REAL), lambda: unpack("home/companion.db", tmp_path)):
        made()
        before = {item.name: item.read_bytes() for item in tmp_path.iterdir()}
        store = Store(path, world=WorldKind.SIMULATED)
        store.submit(SaveParam("DEPTH_MIN", 9.0))
        store.close()
        assert store.snapshot().params == {}
        assert "left alone" in store.warnings[0]
        assert {item.name: item.read_bytes() for item in tmp_path.iterdir()} == before


def test_of_a_store_of_the_first_release_parameters_count_and_the_rest_waits(tmp_path):
    path = unpack("home/companion.db", tmp_path)
    content, warnings = reopened(path)
    assert content.params == {"CRUISE_SPEED": 1.25, "DEPTH_MIN": 1.75, "FS_GCS_TIMEOUT": 45.0}
    assert content.plans == content.depth == {}
    assert {kind.name: len(items) for kind, items in content.old_plans.items()} == {
        "FENCE": 4,
        "MISSION": 3,
        "RALLY": 2,
    }
    assert len(content.old_depth) == 3
    (text,) = warnings
    assert "3 plans and 3 tiles of soundings unused until 'companion store adopt'" in text
    assert content.world == "real"
    assert departure_refusal(content) == ""
    again, warnings = reopened(path)
    assert again == content
    assert warnings == ()


def test_what_is_loaded_after_the_upgrade_is_the_boats_own(tmp_path):
    path = unpack("home/companion.db", tmp_path)
    store = Store(path)
    store.submit(SavePlan(PlanKind.MISSION, ITEMS))
    store.close()
    content, _ = reopened(path)
    assert content.plans == {PlanKind.MISSION: ITEMS}
    assert set(content.old_plans) == set(PlanKind)


@pytest.mark.parametrize("size", [0, 1, 100, 511])
def test_an_emptied_or_cut_off_store_is_told(tmp_path, size):
    path = tmp_path / "companion.db"
    saved(path, WorldKind.REAL)
    whole = path.read_bytes()
    path.write_bytes(whole[:size])
    content, warnings = reopened(path)
    assert content.params == {}
    assert f"({size} bytes)" in warnings[0]
    assert "lost" in warnings[0]
    assert (tmp_path / "companion.db.damaged-1").read_bytes() == whole[:size]
    assert reopened(path)[1] == ()


def test_a_store_without_one_row_was_emptied(tmp_path):
    path = tmp_path / "companion.db"
    saved(path, WorldKind.REAL)
    with sqlite3.connect(path) as connection:
        connection.execute("DELETE FROM entry")
    connection.close()
    assert "emptied" in reopened(path)[1][0]


def test_a_version_of_the_header_alone_is_a_flipped_bit(tmp_path):
    path = tmp_path / "companion.db"
    saved(path, WorldKind.REAL)
    data = bytearray(path.read_bytes())
    data[63] = len(MIGRATIONS) ^ 1
    path.write_bytes(data)
    content, warnings = reopened(path)
    assert content.params == {"DEPTH_MIN": 0.5}
    assert "damaged" in warnings[0]


@pytest.mark.parametrize("which", ["world", "vessel", "schema"])
def test_a_lost_mark_is_made_again_and_costs_no_parameter(tmp_path, which):
    path = tmp_path / "companion.db"
    before = saved(path, WorldKind.REAL)
    with sqlite3.connect(path) as connection:
        connection.execute("DELETE FROM entry WHERE key = ?", (which,))
    connection.close()
    content, warnings = reopened(path)
    assert content.world == "real"
    assert (content.vessel == before.vessel) == (which != "vessel")
    assert content.params == {"DEPTH_MIN": 0.5}
    assert bool(warnings) == (which == "world"), "a plan that may be anybody's waits"
    assert set(content.plans) == (set() if which == "world" else {PlanKind.MISSION})


def test_a_foreign_store_on_a_disk_that_cannot_be_written_is_not_used_either(tmp_path, monkeypatch):
    path = tmp_path / "companion.db"
    saved(path, WorldKind.SIMULATED)
    before = path.read_bytes()

    def fails(*arguments):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr("companion.io.keeping.open.replace", fails)
    store = Store(path)
    store.close()
    assert store.snapshot().params == {}
    assert store.snapshot().records[ASIDE].data == "companion.db"
    assert "Read-only file system" in store.warnings[0]
    assert path.read_bytes() == before
