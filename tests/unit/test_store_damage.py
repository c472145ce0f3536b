"""A flipped bit anywhere in the store's file costs at most the row it falls into, and is told; never the start."""

from __future__ import annotations

import os
import random
import sqlite3
import time
from pathlib import Path

import pytest

from companion.commands.store import read_store
from companion.io.keeping.content import (
    FENCE_LOST,
    SaveCounter,
    SaveParam,
    SavePlan,
    SaveStamp,
    SaveValue,
    StoreContent,
    to_json,
)
from companion.io.keeping.store import Store
from companion.settings.schema import ConfigError
from mavlink_bridge.language.requests import PlanItem, PlanKind

FLIPS = 150
ITEMS = tuple(PlanItem(16, 3, 0.0, 1.0, 0.0, 0.0, 410000000 + i, -80000000, 0.0, True) for i in range(20))
SAVED = [
    *(SavePlan(kind, items) for kind in PlanKind for items in (ITEMS[:3], ITEMS)),
    *(SaveParam(f"DEPTH_{number}", value) for number in range(20) for value in (4.0, 5.0)),
    SaveStamp("1/1/0", 5),
    SaveCounter("boots", 5),
    SaveValue("home", "hello"),
    SaveValue("home", "hallo"),
]


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The bytes of a store that holds two generations of most things."""
    path = tmp_path_factory.mktemp("sound") / "store.db"
    store = Store(path)
    for op in SAVED:
        store.submit(op)
    store.close()
    return path.read_bytes()


def opened(folder: Path, data: bytes, *, is_taken: bool = True) -> tuple[StoreContent, tuple[str, ...]]:
    """What a store makes of a file that holds ``data``; it must take a change as well, or refuse it (``is_taken``)."""
    for old in folder.glob("store.db*"):
        old.unlink()
    (folder / "store.db").write_bytes(data)
    store = Store(folder / "store.db")
    ticket = store.submit(SaveCounter("boots", 6))
    deadline_s = time.monotonic() + 60.0
    while not (done := [item for item in store.completions() if item.ticket]) and time.monotonic() < deadline_s:
        time.sleep(0.0005)
    store.close()
    assert [(item.ticket, item.ok) for item in done] == [(ticket, is_taken)]
    return store.snapshot(), store.warnings


def flipped(data: bytes, at: int, mask: int) -> bytes:
    return data[:at] + bytes([data[at] ^ mask]) + data[at + 1 :]


def test_row_58_no_flipped_bit_stops_the_start_or_goes_untold(tmp_path: Path, sound: bytes) -> None:
    rng = random.Random(58)
    whole = opened(tmp_path, sound)[0]
    used = [at for at, byte in enumerate(sound) if byte]
    lost = 0
    for at in rng.sample(used, FLIPS):
        content, warnings = opened(tmp_path, flipped(sound, at, 1 << rng.randrange(8)))
        assert all(value in (4.0, 5.0) for value in content.params.values())
        assert all(items in (ITEMS[:3], ITEMS) for items in content.plans.values())
        lost += len(content.params) + len(content.plans) < 12
        if to_json(content) != to_json(whole):
            assert warnings, f"byte {at}: something else, and nobody is told"
    assert lost <= 1, "only the root page's own head, 12 bytes, can hide much"


def test_row_58_a_text_that_is_no_utf_8_any_more_falls_back_to_its_previous_generation(
    tmp_path: Path, sound: bytes
) -> None:
    content, warnings = opened(tmp_path, flipped(sound, sound.index(b'"hallo"') + 3, 0x80))
    assert content.values == {"home": "hello"}
    assert len(content.params) == 20
    assert warnings == ("Store: value home is damaged; its previous state is used",)
    assert not list(tmp_path.glob("*.damaged-*"))


def test_an_older_state_that_is_damaged_is_not_called_a_loss(tmp_path: Path, sound: bytes) -> None:
    content, warnings = opened(tmp_path, flipped(sound, sound.index(b'"hello"') + 3, 0x01))
    assert content.values == {"home": "hallo"}
    assert warnings == ("Store: value home had an older state that is damaged; the newest is sound",)


def test_row_58_a_name_that_is_no_text_any_more_costs_only_its_row(tmp_path: Path, sound: bytes) -> None:
    connection = sqlite3.connect(":memory:", isolation_level=None)
    connection.deserialize(sound[:18] + b"\1\1" + sound[20:])  # a database in memory has no journal
    connection.execute("UPDATE entry SET key = CAST(key AS BLOB) WHERE key = 'DEPTH_7' AND generation = 2")
    connection.execute("UPDATE entry SET key = CAST(x'ff5c0a' AS TEXT) WHERE key = 'DEPTH_8' AND generation = 2")
    content, warnings = opened(tmp_path, connection.serialize())
    assert {name: value for name, value in content.params.items() if value != 5.0} == {"DEPTH_7": 4.0, "DEPTH_8": 4.0}
    assert len(warnings) == 2
    for text in warnings:
        assert text.encode("ascii").decode().isprintable(), "texts go to people and into recordings"


@pytest.mark.parametrize(
    ("at", "mask"),
    [(60, 0x80), (63, 0x01), (18, 0x04), (16, 0x10), (None, 0x80), (None, 0x08)],
    ids=["version negative", "version 0", "write version", "page size", "schema no text", "schema no SQL"],
)
def test_row_58_a_damaged_first_page_costs_nothing_but_is_told(
    tmp_path: Path, sound: bytes, at: int | None, mask: int
) -> None:
    where = sound.index(b"CREATE TABLE") + 30 if at is None else at
    content, warnings = opened(tmp_path, flipped(sound, where, mask))
    assert to_json(content) == to_json(opened(tmp_path, sound)[0])
    assert any("damaged" in text for text in warnings)


def test_a_number_of_a_generation_that_cannot_go_on_does_not_stop_saving(tmp_path: Path, sound: bytes) -> None:
    connection = sqlite3.connect(":memory:", isolation_level=None)
    connection.deserialize(sound[:18] + b"\1\1" + sound[20:])
    connection.execute(f"INSERT INTO entry VALUES ('counter', 'boots', {2**63 - 1}, '5', 0)")
    connection.execute("INSERT INTO entry VALUES ('counter', 'boots', 'x', '5', 0)")
    opened(tmp_path, connection.serialize())
    again = Store(tmp_path / "store.db")
    again.close()
    assert (again.snapshot().counters, again.warnings) == ({"boots": 6}, ())


DAMAGED = 36  # the header's count of free pages
DAMAGED_NAME = ".damaged-"
WHOLE = {f"DEPTH_{number}": 5.0 for number in range(20)}


def test_rows_58_and_56_what_was_rescued_is_used_though_the_disk_takes_no_new_file(
    tmp_path: Path, sound: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, damaged = tmp_path / "store.db", flipped(sound, DAMAGED, 0x07)
    path.write_bytes(damaged)

    def full(*arguments: object) -> None:
        raise sqlite3.OperationalError("database or disk is full")

    with monkeypatch.context() as context:
        context.setattr("companion.io.keeping.file.write_entries", full)
        content, warnings = opened(tmp_path, damaged, is_taken=False)
    assert content.params == WHOLE
    assert content.stamps == {"1/1/0": 5}
    assert ["no space on the disk" in text and "entries rescued" in text for text in warnings] == [True]
    assert path.read_bytes() == damaged
    assert {name.name for name in tmp_path.iterdir()} <= {"store.db", "store.db-wal", "store.db-shm"}
    again = Store(path)
    again.close()
    assert again.snapshot().params == WHOLE, "there is room now, and nothing was lost meanwhile"


@pytest.mark.parametrize("cut", range(2))
def test_rows_55_and_58_a_power_cut_while_a_damaged_file_is_replaced_loses_nothing(
    tmp_path: Path, sound: bytes, monkeypatch: pytest.MonkeyPatch, cut: int
) -> None:
    path, real, done = tmp_path / "store.db", os.replace, iter(range(9))
    path.write_bytes(flipped(sound, DAMAGED, 0x07))
    (tmp_path / "store.db-wal").write_bytes(b"of the damaged file")

    def replace(*names: str) -> None:
        if next(done) == cut:
            raise KeyboardInterrupt
        real(*names)

    with monkeypatch.context() as context:
        context.setattr(os, "replace", replace)
        with pytest.raises(KeyboardInterrupt):
            Store(path)
    again = Store(path)
    again.close()
    assert again.snapshot().params == WHOLE
    assert sum(DAMAGED_NAME in name.name for name in tmp_path.iterdir()) >= 1


def test_the_command_says_what_it_cannot_read(tmp_path: Path, sound: bytes) -> None:
    path = tmp_path / "store.db"
    path.write_bytes(flipped(sound, sound.index(b"CREATE TABLE") + 30, 0x80))
    with pytest.raises(ConfigError, match="malformed database schema"):
        read_store(path)


def test_a_fence_that_was_lost_is_known_as_lost_at_every_start_until_one_is_stored(tmp_path: Path) -> None:
    """Also when an older one was found, when a bit of its name flipped, and when the whole file was cut off."""
    path = tmp_path / "store.db"
    store = Store(path)
    for number in (1, 2):
        store.submit(SavePlan(PlanKind.FENCE, ITEMS[number : number + 1]))
    store.close()
    sound = path.read_bytes()
    assert FENCE_LOST not in opened(tmp_path, sound)[0].records
    older = flipped(sound, sound.index(b"410000002"), 1)
    nameless = sound.replace(b"planFENCE", b"planFENCG")
    for data, what in ((older, "previous state"), (nameless, "may be lost"), (sound[:200], "may be lost")):
        path.write_bytes(data)
        for _ in range(2):
            content = opened(tmp_path, path.read_bytes())[0]
            assert what in content.records[FENCE_LOST].data
        store = Store(path)
        store.submit(SavePlan(PlanKind.FENCE, ()))
        store.close()
        assert FENCE_LOST not in opened(tmp_path, path.read_bytes())[0].records
