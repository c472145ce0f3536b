"""The commands around the store and the keys: round trips, and every mistake with its mend."""

from __future__ import annotations

import contextlib
import io
import json
import os
import sqlite3
import stat

import pytest

from companion.cli import main
from companion.io.keeping.content import SaveCounter, SaveParam, SavePlan, to_json
from companion.io.keeping.keys import KeyFileError, from_passphrase, read_key, write_key
from companion.io.keeping.store import Store
from mavlink_bridge.language.requests import PlanItem, PlanKind

PLAN = SavePlan(PlanKind.MISSION, (PlanItem(16, 6, 0.0, 0.1, 0.0, float("nan"), 411822000, -87063000, 0.0),))


@pytest.fixture
def store(tmp_path):
    path = tmp_path / "companion.db"
    made = Store(path)
    for op in (PLAN, SaveParam("DEPTH_MIN", 4.5), SaveCounter("boots", 3)):
        made.submit(op)
    made.close()
    return path


def content(path):
    made = Store(path)
    found = to_json(made.snapshot())
    del found["meta"]  # each its own
    made.close()
    return repr(found)


def test_an_export_restores_everything(store, tmp_path, capsys):
    assert main(["store", "export", str(store), str(tmp_path / "saved.json")]) == 0
    assert main(["store", "import", str(tmp_path / "new.db"), str(tmp_path / "saved.json")]) == 0
    assert content(tmp_path / "new.db") == content(store)
    assert main(["store", "show", str(store)]) == 0
    shown = capsys.readouterr().out
    assert "DEPTH_MIN = 4.5" in shown
    assert "mission    1 items" in shown


def test_replace_forgets_the_rest_and_without_it_things_add_up(store, tmp_path):
    other = tmp_path / "other.db"
    made = Store(other)
    made.submit(SaveParam("X", 1.0))
    made.close()
    main(["store", "export", str(other), str(tmp_path / "x.json")])
    main(["store", "import", str(store), str(tmp_path / "x.json")])
    assert "DEPTH_MIN" in content(store)
    assert "'X'" in content(store)
    main(["store", "import", str(store), str(tmp_path / "x.json"), "--replace"])
    assert content(store) == content(other)


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"format": "something else"}', '{"format": "usv-companion store 1", "param": {"A": "much"}}'],
)
def test_what_is_no_export_changes_nothing(store, tmp_path, text, capsys):
    before = content(store)
    (tmp_path / "bad.json").write_text(text)
    assert main(["store", "import", str(store), str(tmp_path / "bad.json"), "--replace"]) == 2
    assert "bad.json" in capsys.readouterr().err
    assert content(store) == before


def test_a_missing_or_foreign_store_is_named(store, tmp_path, capsys):
    export = tmp_path / "good.json"
    assert main(["store", "export", str(store), str(export)]) == 0
    assert main(["store", "show", str(tmp_path / "none.db")]) == 2
    (tmp_path / "text.db").write_text("hello, this is text and no database, whatever its name says")
    for words in (["export"], ["show"], ["import"]):
        files = [str(tmp_path / "text.db"), *([str(export)] if words == ["import"] else [])]
        assert main(["store", *words, *files]) == 2
        told = capsys.readouterr().err
        assert "text.db" in told
        assert "is no store of this program" in told
    other = tmp_path / "other.db"
    with contextlib.closing(sqlite3.connect(other)) as made:
        made.execute("CREATE TABLE stamps (country TEXT)")
        made.commit()
    before = other.read_bytes()
    assert main(["store", "show", str(other)]) == 2
    assert main(["store", "import", str(other), str(export)]) == 2
    assert capsys.readouterr().err.count("is no store of this program (a database with stamps)") == 2
    assert other.read_bytes() == before


def test_a_damaged_store_is_not_taken_for_another_programs(store, capsys):
    data = bytearray(store.read_bytes())
    data[data.index(b"CREATE TABLE") + 30] ^= 0x80
    store.write_bytes(data)
    assert main(["store", "show", str(store)]) == 2
    assert "is damaged (malformed database schema" in capsys.readouterr().err


def test_an_export_to_standard_output_is_json(store, capsys):
    assert main(["store", "export", str(store)]) == 0
    assert json.loads(capsys.readouterr().out)["param"] == {"DEPTH_MIN": 4.5}


def test_a_made_key_is_private_and_differs_each_time(tmp_path, capsys):
    for name in ("a", "b"):
        assert main(["keys", "make", str(tmp_path / name)]) == 0
        assert stat.S_IMODE((tmp_path / name).stat().st_mode) == 0o600
        assert len(read_key(tmp_path / name)) == 32
    assert read_key(tmp_path / "a") != read_key(tmp_path / "b")
    assert main(["keys", "check", str(tmp_path / "a"), str(tmp_path / "b")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].split()[-1] != lines[-2].split()[-1]
    assert main(["keys", "show", str(tmp_path / "a")]) == 0
    assert bytes.fromhex(capsys.readouterr().out.strip()) == read_key(tmp_path / "a")


def test_a_key_is_not_overwritten_by_accident(tmp_path):
    assert main(["keys", "make", str(tmp_path / "a")]) == 0
    key = read_key(tmp_path / "a")
    assert main(["keys", "make", str(tmp_path / "a")]) == 2
    assert read_key(tmp_path / "a") == key
    assert main(["keys", "make", str(tmp_path / "a"), "--replace"]) == 0
    assert read_key(tmp_path / "a") != key


def test_a_key_makes_no_folder_of_a_slip_in_its_path(tmp_path, capsys):
    assert main(["keys", "make", str(tmp_path / "ect" / "page.key"), "--page"]) == 2
    assert capsys.readouterr().err.endswith(f"no such folder; make it first: mkdir -p {tmp_path}/ect\n")
    assert not (tmp_path / "ect").exists()


def test_a_passphrase_gives_the_ground_stations_key(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("correct horse battery\n"))
    assert main(["keys", "make", str(tmp_path / "a"), "--passphrase"]) == 0
    assert read_key(tmp_path / "a") == from_passphrase("correct horse battery")
    monkeypatch.setattr("sys.stdin", io.StringIO("short\n"))
    assert main(["keys", "make", str(tmp_path / "b"), "--passphrase"]) == 2
    monkeypatch.setattr("sys.stdin", io.StringIO("correct horse battery\n"))
    assert main(["keys", "make", str(tmp_path / "c"), "--passphrase", "--radio"]) == 0
    # reckoned by OpenSSL 3: kdf SCRYPT (RFC 7914), n 32768, r 8, p 1
    assert read_key(tmp_path / "c").hex() == "595085676ff3810756bbb79e989b44b71211dfba9c6c080f1fa63daa8a2c299e"
    assert not (tmp_path / "b").exists()


def test_row_50_a_bad_key_file_names_its_mend(tmp_path):
    path = tmp_path / "key"
    with pytest.raises(KeyFileError, match="companion keys make"):
        read_key(path)
    path.write_bytes(bytes(31))
    with pytest.raises(KeyFileError, match="exactly 32"):
        read_key(path)
    path.write_bytes(bytes(33))
    with pytest.raises(KeyFileError, match="more than 32"):
        read_key(path)
    path.write_bytes(bytes(range(32)))
    path.chmod(0o640)
    with pytest.raises(KeyFileError, match="chmod 600"):
        read_key(path)
    path.chmod(0o600)
    assert read_key(path) == bytes(range(32))
    with pytest.raises(KeyFileError):
        write_key(tmp_path / "short", b"x")


def test_a_new_key_has_its_name_on_the_disk_before_anybody_is_told(tmp_path, monkeypatch):
    """A power cut after it must not leave one side of a link with the old key and the other with the new."""
    done, real = [], (os.replace, os.fsync)
    monkeypatch.setattr(os, "replace", lambda *names: (done.append("rename"), real[0](*names)))
    kind = {True: "folder", False: "file"}
    monkeypatch.setattr(os, "fsync", lambda fd: (done.append(kind[stat.S_ISDIR(os.fstat(fd).st_mode)]), real[1](fd)))
    write_key(tmp_path / "boat.key", bytes(range(32)))
    assert done == ["file", "rename", "folder"]


def test_row_50_zeros_are_no_key(tmp_path):
    path = tmp_path / "key"
    with pytest.raises(KeyFileError, match="zeros"):
        write_key(path, bytes(32))
    assert not path.exists()
    path.write_bytes(bytes(32))
    path.chmod(0o600)
    with pytest.raises(KeyFileError, match="companion keys make"):
        read_key(path)
