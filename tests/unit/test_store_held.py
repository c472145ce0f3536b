"""One process at a time sails by a store: a second one is refused, and told whom to stop; a lock ends with its process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import config
from companion.cli import main
from companion.io.keeping import Store
from companion.io.keeping.content import SaveParam
from companion.io.keeping.hold import HeldError, hold

HOLDER = """
import sys, time
from pathlib import Path
from companion.io.keeping.hold import hold
with hold(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""
BOAT = str(config.path("replay-nmea.toml"))


@pytest.fixture
def holder(tmp_path):
    """Another process that has the store."""
    process = subprocess.Popen([sys.executable, "-c", HOLDER, str(tmp_path / "boat.db")], stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == b"held\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


def run(tmp_path: Path) -> int:
    words = [
        "--set",
        f"store={tmp_path}/boat.db",
        "--set",
        "record.enabled=false",
        "--set",
        f"record.directory={tmp_path}/runs",
    ]
    return main(["run", BOAT, "--duration", "0.1", *words])


def test_a_second_vessel_on_the_store_of_a_running_one_is_refused_and_told_whom_to_stop(tmp_path, holder, capsys):
    """It started, was the same vessel to every station, and acknowledged plans into the other's store."""
    assert run(tmp_path) == 2
    said = capsys.readouterr().err
    assert f"store = '{tmp_path}/boat.db': process {holder.pid} has it since 20" in said
    assert said.rstrip().endswith(f"stop that one first: kill {holder.pid}")
    assert not (tmp_path / "runs").exists()
    assert not (tmp_path / "boat.db").exists()


def test_the_lock_ends_with_its_process_however_that_ends(tmp_path, holder):
    os.kill(holder.pid, signal.SIGKILL)
    holder.wait()
    assert run(tmp_path) == 0
    assert run(tmp_path) == 0, "and with a run that has ended"


def test_another_name_of_the_same_store_is_the_same_store(tmp_path, holder):
    (tmp_path / "link.db").symlink_to(tmp_path / "boat.db")
    with pytest.raises(HeldError, match=str(holder.pid)), hold(tmp_path / "link.db"):
        pass
    with hold(tmp_path / "other.db"):
        pass


def test_a_gateway_has_its_store_for_itself_too(tmp_path, holder, capsys):
    (tmp_path / "radio.key").write_bytes(bytes(range(32)))
    (tmp_path / "radio.key").chmod(0o600)
    words = ["--set", f"store={tmp_path}/boat.db", "--set", f"key_file={tmp_path}/radio.key"]
    assert main(["gateway", str(config.path("gateway.toml")), "--duration", "0.1", *words]) == 2
    assert f"process {holder.pid} has it" in capsys.readouterr().err


def test_who_looks_at_a_store_or_checks_a_file_needs_no_lock(tmp_path, holder, capsys):
    store = Store(tmp_path / "boat.db")
    store.submit(SaveParam("DEPTH_MIN", 4.5))
    store.close()
    assert main(["store", "show", str(tmp_path / "boat.db")]) == 0
    assert "DEPTH_MIN" in capsys.readouterr().out
    assert main(["check", BOAT, "--set", f"store={tmp_path}/boat.db"]) == 0


@pytest.mark.parametrize("told", [b"", b"none", b"99999999999999999999 2026", b"\xff\xfe"])
def test_a_lock_that_does_not_say_whose_it_is_is_kept_all_the_same(tmp_path, holder, told):
    (tmp_path / "boat.db.lock").write_bytes(told)
    with pytest.raises(HeldError, match="another process has it"), hold(tmp_path / "boat.db"):
        pass


def test_a_place_that_takes_no_lock_stops_no_boat(tmp_path):
    (tmp_path / "file").write_text("in the way")
    entered = False
    with hold(tmp_path / "file" / "boat.db"):
        entered = True
    assert entered
    assert [each.name for each in tmp_path.iterdir()] == ["file"]
