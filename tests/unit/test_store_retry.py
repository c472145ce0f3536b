"""A disk that could not be written is tried again: what was acknowledged outlives the process, whatever the disk did meanwhile."""

from __future__ import annotations

import sqlite3
import time

import pytest

from companion.io.keeping.content import SaveParam, SaveStamp, SaveValue
from companion.io.keeping.mark import WorldKind
from companion.io.keeping.store import RETRY_S, Store


class Clock:
    """Seconds that pass when a test says so."""

    def __init__(self):
        self.now_s = 0.0

    def __call__(self):
        return self.now_s


def wait(store, wanted):
    """The completions up to the first that is ``wanted``; only the writer's thread is waited for."""
    found = []
    deadline_s = time.monotonic() + 60.0
    while not any(map(wanted, found)):
        assert time.monotonic() < deadline_s, found
        found += store.completions()
        time.sleep(0.0005)
    return found


def ask(store, op):
    ticket = store.submit(op)
    return next(done for done in wait(store, lambda done: done.ticket == ticket) if done.ticket == ticket)


def well(done):
    return done.ticket == 0 and done.ok and not done.text


@pytest.fixture
def blocked(tmp_path):
    """A place where no folder can be made yet: a file lies there."""
    (tmp_path / "state").write_text("in the way")
    return tmp_path / "state"


def reopened(path):
    store = Store(path)
    store.close()
    return store.snapshot()


def test_a_store_that_cannot_be_written_at_the_start_refuses_says_so_and_comes_back(blocked):
    clock = Clock()
    store = Store(blocked / "companion.db", clock_s=clock)
    (news,) = store.completions()
    assert (news.ticket, news.ok) == (0, False)
    assert news.text in store.warnings[0]
    refused = ask(store, SaveParam("DEPTH_MIN", 2.0))
    assert (refused.ok, refused.text) == (False, news.text)
    assert not ask(store, SaveStamp("own", 7)).ok
    blocked.unlink()
    clock.now_s = RETRY_S + 0.1
    wait(store, well)
    assert ask(store, SaveParam("CRUISE_SPEED", 1.0)) == (3, True, "")
    store.close()
    content = reopened(blocked / "companion.db")
    assert content.params == {"CRUISE_SPEED": 1.0}, "what was refused is not there"
    assert content.stamps == {"own": 7}, "what the vessel keeps by itself waited"


def test_a_change_tries_the_disk_at_once(blocked):
    clock = Clock()
    store = Store(blocked / "companion.db", clock_s=clock)
    blocked.unlink()
    clock.now_s = 1.0
    assert ask(store, SaveParam("DEPTH_MIN", 2.0)).ok
    store.close()
    assert reopened(blocked / "companion.db").params == {"DEPTH_MIN": 2.0}


def test_an_owner_who_accepts_memory_gets_marked_acknowledgements_that_reach_the_disk_later(blocked):
    clock = Clock()
    store = Store(blocked / "companion.db", memory_ok=True, clock_s=clock)
    done = ask(store, SaveParam("DEPTH_MIN", 2.0))
    assert done.ok
    assert done.text.startswith("kept in memory only: ")
    assert ask(store, SaveParam("DEPTH_MIN", 3.0)).ok
    blocked.unlink()
    clock.now_s = RETRY_S + 0.1
    wait(store, well)
    store.close()
    assert reopened(blocked / "companion.db").params == {"DEPTH_MIN": 3.0}


def test_a_disk_that_comes_back_with_another_plan_is_told_and_its_newer_stamps_stay(tmp_path):
    path = tmp_path / "card" / "companion.db"
    first = Store(path)
    for op in (SaveParam("DEPTH_MIN", 1.25), SaveStamp("own", 1_000), SaveStamp("1/1/0", 5), SaveStamp("clean", 1)):
        first.submit(op)
    first.close()
    path.parent.rename(tmp_path / "drawer")
    (tmp_path / "card").write_text("no card")
    clock = Clock()
    store = Store(path, clock_s=clock)
    for op in (SaveStamp("own", 900), SaveStamp("1/1/0", 6), SaveStamp("clean", 0)):
        ask(store, op)
    (tmp_path / "card").unlink()
    (tmp_path / "drawer").rename(tmp_path / "card")
    clock.now_s = RETRY_S + 0.1
    done = wait(store, lambda done: "restart" in done.text)
    assert "1 parameters and plans that are not in force" in done[-1].text
    assert ask(store, SaveParam("CRUISE_SPEED", 1.0)).ok
    store.close()
    content = reopened(path)
    assert content.params == {"DEPTH_MIN": 1.25, "CRUISE_SPEED": 1.0}
    assert content.stamps == {"own": 1_000, "1/1/0": 6, "clean": 0}


def test_a_card_that_is_pulled_under_way_and_comes_back_empty_gets_what_is_in_force(tmp_path, monkeypatch):
    path = tmp_path / "companion.db"
    clock = Clock()
    store = Store(path, clock_s=clock)
    assert ask(store, SaveParam("DEPTH_MIN", 2.0)).ok
    for name in tmp_path.iterdir():
        name.unlink()

    with monkeypatch.context() as context:

        def gone(*arguments):
            error = sqlite3.OperationalError("disk I/O error")
            error.sqlite_errorcode = sqlite3.SQLITE_IOERR
            raise error

        context.setattr("companion.io.keeping.store.in_one_transaction", gone)
        assert ask(store, SaveParam("DEPTH_MIN", 3.0)) == (2, False, "disk I/O error")
    clock.now_s = RETRY_S + 0.1
    wait(store, well)
    store.close()
    assert reopened(path).params == {"DEPTH_MIN": 2.0}


def test_a_full_disk_is_written_again_when_there_is_room(tmp_path, monkeypatch):
    store = Store(tmp_path / "companion.db")

    def full(*arguments):
        error = sqlite3.OperationalError("database or disk is full")
        error.sqlite_errorcode = sqlite3.SQLITE_FULL
        raise error

    with monkeypatch.context() as context:
        context.setattr("companion.io.keeping.store.in_one_transaction", full)
        assert ask(store, SaveParam("A", 1.0)).text == "no space on the disk"
        ask(store, SaveValue("radio-airtime", "[]"))
    assert ask(store, SaveParam("A", 2.0)).ok
    store.close()
    content = reopened(tmp_path / "companion.db")
    assert content.params == {"A": 2.0}
    assert content.values == {"radio-airtime": "[]"}


def test_another_worlds_file_that_turns_up_while_the_vessel_runs_is_left_alone(blocked):
    clock = Clock()
    store = Store(blocked / "companion.db", clock_s=clock)
    store.completions()
    blocked.unlink()
    other = Store(blocked / "companion.db", world=WorldKind.SIMULATED)
    other.close()
    before = (blocked / "companion.db").read_bytes()
    clock.now_s = 1.0
    refused = ask(store, SaveParam("DEPTH_MIN", 2.0))
    store.close()
    assert not refused.ok
    assert "simulated vessel" in refused.text
    assert (blocked / "companion.db").read_bytes() == before


def deleted(path):
    path.unlink()


def replaced_by_a_folder(path):
    path.unlink()
    path.mkdir()


def replaced_by_a_copy(path):
    copy = path.with_name("copy.db")
    with sqlite3.connect(path) as source, sqlite3.connect(copy) as target:
        source.backup(target)
    copy.replace(path)


def without_its_journal(path):
    path.with_name(f"{path.name}-wal").unlink()


def all_deleted(path):
    for each in path.parent.glob("companion.db*"):
        each.unlink()


@pytest.mark.parametrize("happens", [deleted, all_deleted, replaced_by_a_copy, without_its_journal])
def test_what_is_acknowledged_outlives_a_file_that_is_deleted_or_replaced_under_way(tmp_path, happens):
    clock = Clock()
    path = tmp_path / "companion.db"
    store = Store(path, clock_s=clock)
    assert ask(store, SaveParam("DEPTH_MIN", 2.0)).ok
    clock.now_s = 10.0
    happens(path)
    ticket = store.submit(SaveParam("CRUISE_SPEED", 1.0))
    found = wait(store, lambda done: done.ticket == ticket)
    assert any(done.ticket == ticket and done.ok for done in found)
    assert any("was deleted or replaced" in done.text for done in found), "and it is told"
    store.close()
    assert reopened(path).params == {"DEPTH_MIN": 2.0, "CRUISE_SPEED": 1.0}


def test_nothing_is_acknowledged_while_a_folder_has_the_files_name(tmp_path):
    clock = Clock()
    path = tmp_path / "companion.db"
    store = Store(path, clock_s=clock)
    assert ask(store, SaveParam("DEPTH_MIN", 2.0)).ok
    clock.now_s = 10.0
    replaced_by_a_folder(path)
    store.submit(SaveParam("CRUISE_SPEED", 1.0))
    refused, news = sorted(wait(store, lambda done: not done.ticket), key=lambda done: -done.ticket)
    assert (refused.ok, news.ok) == (False, False)
    assert refused.text == "its file was deleted or replaced"
    assert news.text
    path.rmdir()
    clock.now_s = 10.0 + RETRY_S + 0.1
    wait(store, well)
    assert ask(store, SaveParam("CRUISE_SPEED", 1.5)).ok
    store.close()
    assert reopened(path).params == {"DEPTH_MIN": 2.0, "CRUISE_SPEED": 1.5}


def test_a_file_that_goes_twice_within_a_second_is_not_acknowledged(tmp_path):
    clock = Clock()
    path = tmp_path / "companion.db"
    store = Store(path, clock_s=clock)
    clock.now_s = 10.0
    deleted(path)
    assert ask(store, SaveParam("DEPTH_MIN", 2.0)).ok
    deleted(path)
    assert not ask(store, SaveParam("CRUISE_SPEED", 1.0)).ok
    clock.now_s = 11.0
    assert ask(store, SaveParam("CRUISE_SPEED", 1.0)).ok
    store.close()
    assert reopened(path).params == {"DEPTH_MIN": 2.0, "CRUISE_SPEED": 1.0}
