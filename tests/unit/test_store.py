"""The store keeps what it was given, and a damaged, foreign, full or read-only file never stops the vessel."""

from __future__ import annotations

import contextlib
import math
import os
import sqlite3
import time
from dataclasses import replace

import pytest

from companion.io.keeping.content import (
    Completion,
    ForgetParams,
    ForgetRecord,
    ForgetValue,
    Record,
    SaveCounter,
    SaveDepth,
    SaveLedger,
    SaveParam,
    SavePlan,
    SaveRecord,
    SaveStamp,
    SaveValue,
    StoreContent,
    StoredRow,
    Together,
    from_json,
    pack_tile,
    to_json,
    unpack_tile,
)
from companion.io.keeping.store import MIGRATIONS, Store, migrate, write_entries
from mavlink_bridge.language.requests import PlanItem, PlanKind

ITEMS = (
    PlanItem(16, 6, 0.0, 2.0, 0.1, math.nan, 411822000, -87063000, 0.0),
    PlanItem(18, 6, 1.0, 0.0, -15.0, 1.0, 411823000, -87064000, 3.5, 0),
)
OPS = (
    SavePlan(PlanKind.MISSION, ITEMS),
    SavePlan(PlanKind.RALLY, ITEMS[:1]),
    SaveParam("DEPTH_MIN", 0.1 + 0.2),
    SaveParam("GONE", 1.0),
    ForgetParams(("GONE",)),
    SaveLedger("lora", ((1_800_000_000_000_000, 660_000), (1_800_000_001_000_000, 260_000))),
    SaveStamp("1/1/0", 2**47),
    SaveCounter("boots", 7),
    SaveValue("home", "41.18,-8.70"),
    SaveDepth((("2000/1/-2", b"one" * 9), ("2000/1/-3", b"two"))),
    SaveDepth((("2000/1/-2", b"three" * 9),), ("2000/1/-3",)),
    SaveValue("old", "x"),
    ForgetValue("old"),
    SaveRecord("mute-board/serial:/dev/ttyACM0", 1, {"utc_us": 5}),
    SaveRecord("far-plan", 1, {"plan_id": 7}),
    SaveRecord("gone", 3, [1, None]),
    ForgetRecord("gone"),
)
EXPECTED = StoreContent(
    {PlanKind.MISSION: ITEMS, PlanKind.RALLY: ITEMS[:1]},
    {"DEPTH_MIN": 0.1 + 0.2},
    {"lora": ((1_800_000_000_000_000, 660_000), (1_800_000_001_000_000, 260_000))},
    {"1/1/0": 2**47},
    {"boots": 7},
    {"home": "41.18,-8.70"},
    {"2000/1/-2": pack_tile(b"three" * 9)},
    {"mute-board/serial:/dev/ttyACM0": Record(1, {"utc_us": 5}), "far-plan": Record(1, {"plan_id": 7})},
)


def test_a_packed_tile_comes_back_and_anything_else_is_refused():
    assert unpack_tile(pack_tile(bytes(4096)), 4096) == bytes(4096)
    assert len(unpack_tile(pack_tile(bytes(4_000_000)), 4096)) == 4096, "a bomb is cut"
    for text in ("", "====", "abc", "AAAA", pack_tile(b"x" * 99)[:-8], "é"):
        with contextlib.suppress(ValueError):
            assert len(unpack_tile(text, 4096)) < 4096


def finish(store: Store, count: int) -> list[Completion]:
    done: list[Completion] = []
    deadline = time.monotonic() + 60.0
    while len(done) < count and time.monotonic() < deadline:
        done += [item for item in store.completions() if item.ticket]
        time.sleep(0.001)
    return done


def modes(folder):
    return {path.name: path.stat().st_mode & 0o777 for path in folder.iterdir()}


@pytest.mark.parametrize("mask", [0o022, 0o000, 0o077])
def test_a_store_is_its_owners_and_his_groups(tmp_path, mask):
    """Places, plans and time stamps stood open to every account of the computer."""
    path = tmp_path / "state" / "companion.db"
    before = os.umask(mask)
    try:
        store = Store(path)
        store.submit(SaveParam("DEPTH_MIN", 1.0))
        assert modes(path.parent) == dict.fromkeys(
            ("companion.db", "companion.db-wal", "companion.db-shm"), 0o640 & ~mask
        )
        store.close()
    finally:
        os.umask(before)
    assert path.parent.stat().st_mode & 0o777 == 0o750 & ~mask


def test_a_store_that_an_earlier_version_left_open_is_closed_at_the_next_start(tmp_path):
    path = tmp_path / "companion.db"
    store = Store(path)
    store.submit(SaveParam("DEPTH_MIN", 1.0))
    store.close()
    path.chmod(0o644)
    again = Store(path)
    assert set(modes(tmp_path).values()) == {0o640}
    assert again.snapshot().params == {"DEPTH_MIN": 1.0}
    again.close()


def fill(path, ops=OPS):
    store = Store(path)
    tickets = [store.submit(op) for op in ops]
    done = finish(store, len(tickets))
    store.close()
    assert [item.ticket for item in done] == tickets
    return done


def same(one: StoreContent, other: StoreContent) -> bool:
    """Whether two hold the same, whosever they are."""
    return repr(to_json(replace(one, meta={}))) == repr(to_json(replace(other, meta={})))


def content(path) -> StoreContent:
    store = Store(path)
    found = store.snapshot()
    assert store.warnings == ()
    store.close()
    return found


def test_everything_comes_back_exactly(tmp_path):
    done = fill(tmp_path / "store.db")
    assert all(item.ok and not item.text for item in done)
    assert same(content(tmp_path / "store.db"), EXPECTED)


def test_content_survives_json():
    assert same(from_json(to_json(EXPECTED)), EXPECTED)


def test_together_is_all_or_nothing_and_forget_all_forgets_all(tmp_path):
    path = tmp_path / "store.db"
    fill(path, (Together((SaveParam("A", 1.0), SaveParam("B", 2.0))), Together((ForgetParams(), SaveParam("C", 3.0)))))
    assert content(path).params == {"C": 3.0}


def test_submit_returns_at_once_while_the_disk_hangs(tmp_path):
    import threading

    from companion.io.writer import Writer

    writer = Writer(max_jobs=8)
    gate = threading.Event()
    store = Store(tmp_path / "store.db", writer)
    writer.post(gate.wait)
    tickets = [store.submit(SaveCounter("n", n)) for n in range(40)]
    refused = store.completions()
    assert store.pending == len(tickets) - len(refused)
    assert all(not item.ok for item in refused)
    assert len(refused) >= 30
    gate.set()
    rest = finish(store, len(tickets) - len(refused))
    assert all(item.ok for item in rest)
    writer.close()
    store.close()


def test_row_57_the_end_does_not_wait_for_a_disk_that_hangs(tmp_path, monkeypatch):
    import threading

    from companion.io.keeping import store as module
    from companion.io.writer import Writer

    gate, real = threading.Event(), module.in_one_transaction

    def hang(*arguments):
        gate.wait(30)
        real(*arguments)

    monkeypatch.setattr(module, "in_one_transaction", hang)
    writer = Writer(max_jobs=2)
    store = Store(tmp_path / "store.db", writer)
    for number in range(9):
        store.submit(SaveCounter("n", number))
        time.sleep(0.01)
    ended = threading.Thread(target=store.close, daemon=True)
    ended.start()
    ended.join(3 * module.CLOSE_WAIT_S)
    waits = ended.is_alive()
    gate.set()
    writer.close()
    assert not waits
    assert content(tmp_path / "store.db").counters.keys() == {"n"}, (
        "what the disk had taken is whole when it comes back"
    )


@pytest.mark.parametrize(
    "data",
    [b"this is not a database at all" * 100, bytes(range(32)), b"0" + bytes(range(9))],
    ids=["long", "key", "short"],
)
def test_a_file_that_never_was_a_database_is_left_where_it_is(tmp_path, data):
    """A key that the store was named after was moved away, and called damaged."""
    path = tmp_path / "store.db"
    path.write_bytes(data)
    store = Store(path)
    assert same(store.snapshot(), StoreContent())
    assert "holds something else than a store and is left alone" in store.warnings[0]
    store.submit(SaveParam("DEPTH_MIN", 4.0))
    assert not finish(store, 1)[0].ok
    store.close()
    assert path.read_bytes() == data
    assert [each.name for each in tmp_path.iterdir()] == ["store.db"]


@pytest.mark.parametrize(
    "data", [bytes(8192), b"\xff" * 8192, b"SQLite format 3" + bytes(300)], ids=["zeros", "ones", "cut"]
)
def test_a_store_that_a_power_cut_has_blanked_or_cut_is_moved_aside(tmp_path, data):
    path = tmp_path / "store.db"
    path.write_bytes(data)
    store = Store(path)
    store.submit(SaveCounter("boots", 1))
    assert finish(store, 1)[0].ok
    store.close()
    assert (tmp_path / "store.db.damaged-1").read_bytes() == data
    assert content(path).counters == {"boots": 1}


def test_a_file_of_a_newer_version_is_left_alone(tmp_path):
    path = tmp_path / "store.db"
    fill(path)
    with sqlite3.connect(path, isolation_level=None) as connection:
        connection.execute("PRAGMA user_version=99")
        write_entries(connection, [StoredRow("meta", "schema", '"99"')])
    connection.close()
    before = path.read_bytes()
    store = Store(path)
    assert "newer version" in store.warnings[0]
    store.submit(SaveCounter("boots", 1))
    done = finish(store, 1)
    assert not done[0].ok
    assert "newer version" in done[0].text
    store.close()
    assert path.read_bytes() == before


def test_an_older_schema_is_migrated_and_keeps_its_content(tmp_path):
    path = tmp_path / "store.db"
    fill(path)
    connection = sqlite3.connect(path, isolation_level=None)
    migrate(connection, (*MIGRATIONS, "ALTER TABLE entry ADD COLUMN note TEXT DEFAULT 'old'"))
    assert connection.execute("PRAGMA user_version").fetchone() == (len(MIGRATIONS) + 1,)
    notes = connection.execute("SELECT DISTINCT note FROM entry").fetchall()
    connection.close()
    assert notes == [("old",)]


def test_row_58_a_damaged_row_falls_back_to_its_previous_generation(tmp_path):
    path = tmp_path / "store.db"
    fill(path, (SaveParam("A", 1.0), SaveParam("A", 2.0), SaveParam("B", 5.0)))
    connection = sqlite3.connect(path)
    connection.execute("UPDATE entry SET body = '99.0' WHERE section = 'param' AND body IN ('2.0', '5.0')")
    connection.commit()
    connection.close()
    store = Store(path)
    assert store.snapshot().params == {"A": 1.0}
    assert len(store.warnings) == 2
    assert "previous state" in store.warnings[0]
    store.close()


@pytest.mark.parametrize("step", [1, 97])
def test_no_flipped_byte_stops_the_start_or_is_believed(tmp_path, step):
    """Fault row 58: whatever a byte becomes, the store opens, and no value is other than one that was stored."""
    path = tmp_path / "store.db"
    fill(path, (SaveParam("A", 1.25), SaveParam("A", 2.5), SavePlan(PlanKind.MISSION, ITEMS)))
    whole = path.read_bytes()
    positions = range(0, 200) if step == 1 else range(200, len(whole), step)
    for at in positions:
        for old in tmp_path.glob("trial*"):
            old.unlink()
        trial = tmp_path / "trial.db"
        trial.write_bytes(whole[:at] + bytes([whole[at] ^ 0x55]) + whole[at + 1 :])
        store = Store(trial)
        found = store.snapshot()
        assert found.params.get("A") in (None, 1.25, 2.5)
        assert PlanKind.MISSION not in found.plans or repr(found.plans[PlanKind.MISSION]) == repr(ITEMS)
        store.submit(SaveCounter("after", 1))
        assert finish(store, 1)[0].ok
        store.close()


def test_a_folder_that_cannot_be_written_leaves_it_in_memory(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    store = Store(blocked / "store.db")
    assert len(store.warnings) == 1
    store.submit(SaveCounter("boots", 1))
    done = finish(store, 1)
    assert not done[0].ok
    assert done[0].text in store.warnings[0]
    store.close()


def test_what_was_submitted_just_before_the_end_is_kept(tmp_path):
    from companion.io.writer import Writer

    writer = Writer()
    store = Store(tmp_path / "store.db", writer)
    for number in range(30):
        store.submit(SaveCounter("n", number))
    store.close()
    assert writer.close()
    assert content(tmp_path / "store.db").counters == {"n": 29}
